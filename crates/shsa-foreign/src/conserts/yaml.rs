//! The YAML of conserts-rs: one certificate per file.

use super::raw::{Promise, Raw};
use super::statement;
use shsa_core::interval::Interval;
use shsa_core::knowledge::Text;
use shsa_core::statement::{Content, Inclusion, Property};
use shsa_model::reader::{Fields, Reader};
use shsa_model::tree::{self, Node, Value};
use std::collections::BTreeSet;

const ROOT: [&str; 7] = [
    "guarantees",
    "demands",
    "evidence",
    "gates",
    "tree_propagations",
    "provided_services",
    "required_services",
];

/// Reads one certificate; the second part holds the places where the scalars differ from the text of the file.
pub(super) fn read(reader: &mut Reader, text: &str, name: &str) -> (Vec<Raw>, BTreeSet<u32>) {
    let tree = tree::read(text);
    reader.problems.extend(tree.problems);
    let Some(root) = tree.root else { return (Vec::new(), tree.rewritten) };
    let fields = reader.fields(&root, "a certificate", &ROOT, "guarantees: []");
    for key in ROOT {
        if fields.get(key).is_none() {
            reader.wrong(
                &root,
                &format!("`{key}` is missing"),
                &format!("an empty list is written `{key}: []`"),
            );
        }
    }
    let mut raw = Raw { name: name.to_owned(), ..Raw::default() };
    for node in items(reader, &fields, "guarantees") {
        raw.guarantees.extend(promise(reader, node));
    }
    for node in items(reader, &fields, "demands") {
        raw.demands.extend(promise(reader, node));
    }
    for node in items(reader, &fields, "evidence") {
        raw.evidence.extend(evidence(reader, node));
    }
    for node in items(reader, &fields, "gates") {
        raw.gates.extend(gate(reader, node));
    }
    for node in items(reader, &fields, "tree_propagations") {
        let fields = reader.fields(node, "an arrow", &["from", "to"], "{ from: Cool, to: SpeedGood }");
        let ends = [word(reader, node, &fields, "from"), word(reader, node, &fields, "to")];
        if let [Some(from), Some(to)] = ends {
            raw.arrows.push((from, to));
        }
    }
    for node in items(reader, &fields, "provided_services") {
        raw.provided.extend(service(reader, node, "guarantees"));
    }
    for node in items(reader, &fields, "required_services") {
        raw.required.extend(service(reader, node, "demands"));
    }
    (vec![raw], tree.rewritten)
}

fn items<'n>(reader: &mut Reader, fields: &Fields<'n>, key: &str) -> &'n [Node] {
    match fields.get(key).map(|node| (node, &node.value)) {
        Some((_, Value::List(items))) => items,
        Some((node, _)) => {
            reader.wrong(
                node,
                &format!("`{key}` is a list"),
                &format!("an empty one is written `{key}: []`"),
            );
            &[]
        }
        None => &[],
    }
}

fn word(reader: &mut Reader, node: &Node, fields: &Fields<'_>, key: &str) -> Option<Text> {
    match fields.get(key) {
        Some(value) => reader.text(value, "a word", key),
        None => {
            reader.wrong(node, &format!("`{key}` is missing"), &format!("write `{key}:`"));
            None
        }
    }
}

fn promise(reader: &mut Reader, node: &Node) -> Option<Promise> {
    let fields = reader.fields(
        node,
        "a statement",
        &["id", "description", "dimensions"],
        "{ id: A, dimensions: [..] }",
    );
    let id = word(reader, node, &fields, "id")?;
    let dimensions = items(reader, &fields, "dimensions");
    if dimensions.is_empty() {
        reader.wrong(node, &format!("`{}` states nothing", id.text), "give it at least one of `dimensions`");
    }
    let properties = dimensions.iter().filter_map(|node| property(reader, node)).collect();
    Some(Promise { name: id.text.clone(), id, level: None, properties })
}

fn evidence(reader: &mut Reader, node: &Node) -> Option<(Text, String, Option<Interval>)> {
    let fields =
        reader.fields(node, "evidence", &["id", "description", "dimension"], "{ id: A, dimension: .. }");
    let id = word(reader, node, &fields, "id")?;
    let Some(dimension) = fields.get("dimension") else {
        reader.wrong(node, "`dimension` is missing", "dimension: { Binary: { type: Cool } }");
        return None;
    };
    let within = match property(reader, dimension)?.content {
        Content::Numeric { ranges, .. } => {
            if ranges.len() != 1 {
                reader.wrong(dimension, "evidence is measured in one range", "write one of `covered`");
            }
            ranges.first().copied()
        }
        Content::Binary | Content::Categorical { .. } => None,
    };
    let name = id.text.clone();
    Some((id, name, within))
}

fn gate(reader: &mut Reader, node: &Node) -> Option<(Text, bool)> {
    let fields = reader.fields(node, "a gate", &["id", "function"], "{ id: Gate0, function: And }");
    let id = word(reader, node, &fields, "id")?;
    let function = word(reader, node, &fields, "function")?;
    match function.text.as_str() {
        "And" => Some((id, true)),
        "Or" => Some((id, false)),
        other => {
            reader.note(function.place, &format!("`{other}` is no function of a gate"), "`And` or `Or`");
            None
        }
    }
}

fn service(reader: &mut Reader, node: &Node, key: &str) -> Option<(String, Vec<Text>)> {
    let fields =
        reader.fields(node, "a service", &["id", "functional_service_type", key], "{ id: Wheel, .. }");
    word(reader, node, &fields, "id")?;
    let of = word(reader, node, &fields, "functional_service_type")?;
    let names =
        items(reader, &fields, key).iter().filter_map(|node| reader.text(node, "a name", key)).collect();
    Some((of.text, names))
}

fn property(reader: &mut Reader, node: &Node) -> Option<Property> {
    let example = "Binary: { type: Cool }";
    let fields = reader.fields(node, "a dimension", &["Binary", "Categorical", "Numeric"], example);
    if let Some(node) = fields.get("Binary") {
        let fields = reader.fields(node, "a binary dimension", &["type"], example);
        let name = word(reader, node, &fields, "type")?.text;
        return Some(Property { name, mode: None, content: Content::Binary });
    }
    if let Some(node) = fields.get("Categorical") {
        let fields = reader.fields(node, "a categorical dimension", &["type", "covered", "subset"], example);
        let name = word(reader, node, &fields, "type")?.text;
        let inclusion = inclusion(reader, node, &fields)?;
        let covered = covered(reader, node, &fields)?;
        let covered =
            covered.iter().filter_map(|node| reader.text(node, "a case", "SIL 2")).map(|it| it.text);
        return Some(Property {
            name,
            mode: None,
            content: Content::Categorical { covered: covered.collect(), inclusion },
        });
    }
    let Some(node) = fields.get("Numeric") else {
        reader.wrong(node, "a dimension is `Binary`, `Categorical` or `Numeric`", example);
        return None;
    };
    let fields = reader.fields(node, "a numeric dimension", &["type", "covered", "subset", "uom"], example);
    let name = word(reader, node, &fields, "type")?.text;
    let inclusion = inclusion(reader, node, &fields)?;
    let uom = word(reader, node, &fields, "uom")?;
    let Some(unit) = statement::unit(&uom.text) else {
        reader.note(uom.place, &format!("no unit `{}`", uom.text), "such as m, km/h, ms");
        return None;
    };
    let covered = covered(reader, node, &fields)?;
    let ranges: Vec<Interval> = covered.iter().filter_map(|node| range(reader, node, &unit)).collect();
    let dimension = unit.dimension;
    (ranges.len() == covered.len()).then_some(Property {
        name,
        mode: None,
        content: Content::Numeric { ranges, dimension, inclusion },
    })
}

fn covered<'n>(reader: &mut Reader, node: &Node, fields: &Fields<'n>) -> Option<&'n [Node]> {
    let covered = items(reader, fields, "covered");
    if covered.is_empty() {
        reader.wrong(
            fields.get("covered").unwrap_or(node),
            "nothing is covered",
            "write at least one range or case",
        );
        return None;
    }
    Some(covered)
}

fn inclusion(reader: &mut Reader, node: &Node, fields: &Fields<'_>) -> Option<Inclusion> {
    let subset = word(reader, node, fields, "subset")?;
    match subset.text.as_str() {
        "Guarantee" => Some(Inclusion::GuaranteeInDemand),
        "Demand" => Some(Inclusion::DemandInGuarantee),
        other => {
            reader.note(
                subset.place,
                &format!("`{other}` is no side"),
                "`Guarantee` or `Demand`: which lies within which",
            );
            None
        }
    }
}

fn range(reader: &mut Reader, node: &Node, unit: &shsa_core::unit::Unit) -> Option<Interval> {
    let example = "Inclusive: { start: 0.0, end: 2.0 }";
    let fields = reader.fields(node, "a range", &["Inclusive", "Exclusive"], example);
    let (inner, excluded) = match (fields.get("Inclusive"), fields.get("Exclusive")) {
        (Some(inner), None) => (inner, false),
        (None, Some(inner)) => (inner, true),
        _ => {
            reader.wrong(node, "a range is `Inclusive` or `Exclusive`", example);
            return None;
        }
    };
    let fields = reader.fields(inner, "two bounds", &["start", "end"], example);
    let (start, end) = (word(reader, inner, &fields, "start")?, word(reader, inner, &fields, "end")?);
    let number =
        |text: &Text| text.text.trim_start_matches('.').parse::<f64>().ok().filter(|number| !number.is_nan());
    let bounds =
        number(&start).zip(number(&end)).map(|(lo, hi)| statement::range(unit, [lo, hi], [excluded; 2]));
    if bounds.is_none_or(Interval::is_empty) {
        reader.wrong(inner, "this range holds no number", example);
    }
    bounds.filter(|range| !range.is_empty())
}
