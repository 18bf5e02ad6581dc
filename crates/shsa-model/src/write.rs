//! Drafts as text: YAML for people, JSON for programs; both load to the same draft again.

use shsa_core::knowledge::{
    BodyDraft, Bounds, CAUSE_PRIOR, ContractDraft, DemandDraft, Draft, GuaranteeDraft, NeedDraft,
    PropertyDrafts, RelationDraft, SignalDraft, Text, UtilityDraft, VariableDraft,
};
use std::fmt::Write;

use super::{fusion, specification};

/// The longest line of a mapping in one line.
const MAX_LINE: usize = 110;

/// The draft as YAML, without the comments and the layout of its source. Time: linear in the draft.
#[must_use]
pub fn yaml(draft: &Draft) -> String {
    let mut text = String::new();
    for (key, value) in sections(draft) {
        match value {
            Tree::Map(entries) if !entries.is_empty() => {
                text += &format!("\n{key}:\n");
                entries.iter().for_each(|(name, value)| yaml_entry(&mut text, "  ", name, value));
            }
            value => {
                let _ = writeln!(text, "{key}: {}", flow(&value));
            }
        }
    }
    text
}

/// The draft as JSON, one entry per line; ends with a line feed. Time: linear in the draft.
#[must_use]
pub fn json(draft: &Draft) -> String {
    let mut lines = Vec::new();
    for (key, value) in sections(draft) {
        match value {
            Tree::Map(entries) => {
                let entries: Vec<String> = entries
                    .iter()
                    .map(|(name, value)| format!("    {}: {}", quoted(name), json_value(value)))
                    .collect();
                lines.push(format!("  {}: {{\n{}\n  }}", quoted(key), entries.join(",\n")));
            }
            value => lines.push(format!("  {}: {}", quoted(key), json_value(&value))),
        }
    }
    format!("{{\n{}\n}}\n", lines.join(",\n"))
}

/// The written form of a value.
pub(super) enum Tree {
    /// A word, number or formula.
    Text(String),
    List(Vec<Tree>),
    Map(Vec<(String, Tree)>),
}

pub(super) fn text(text: &Text) -> Tree {
    Tree::Text(text.text.clone())
}

fn list(texts: &[Text]) -> Tree {
    Tree::List(texts.iter().map(text).collect())
}

fn pair((lo, hi): (&Text, &Text)) -> Tree {
    Tree::List(vec![text(lo), text(hi)])
}

fn bounds(bounds: &Bounds) -> Tree {
    match bounds {
        Bounds::One(value) => text(value),
        Bounds::Two(lo, hi) => pair((lo, hi)),
    }
}

fn sections(draft: &Draft) -> Vec<(&'static str, Tree)> {
    fn map<T>(items: &[T], entry: impl Fn(&T) -> (&Text, Tree)) -> Tree {
        Tree::Map(items.iter().map(entry).map(|(name, value)| (name.text.clone(), value)).collect())
    }
    let sections = [
        ("variables", of_variables(draft)),
        ("constants", map(&draft.constants, |(name, value)| (name, bounds(value)))),
        ("functions", map(&draft.functions, |(head, body)| (head, text(body)))),
        ("relations", of_relations(draft)),
        ("specifications", of_specifications(draft)),
        ("signals", map(&draft.signals, |signal| (&signal.name, of_signal(signal)))),
        ("fusion", map(&draft.fusions, |fusion| (&fusion.name, fusion::written(fusion)))),
        ("needs", of_needs(&draft.needs)),
        ("platform", map(&draft.platform, |contract| (&contract.name, of_contract(contract)))),
        ("contracts", map(&draft.contracts, |contract| (&contract.name, of_contract(contract)))),
    ];
    let filled =
        sections.into_iter().filter(|(_, value)| !matches!(value, Tree::Map(entries) if entries.is_empty()));
    let version = ("shsa", Tree::Text("1".to_owned()));
    let utility = draft.utility.as_ref().map(|utility| ("utility", of_utility(utility)));
    std::iter::once(version).chain(filled).chain(utility).collect()
}

/// The keys that have a value.
pub(super) fn keys<const N: usize>(keys: [(&str, Option<Tree>); N]) -> Tree {
    Tree::Map(keys.into_iter().filter_map(|(key, value)| Some((key.to_owned(), value?))).collect())
}

pub(super) fn properties(properties: &PropertyDrafts) -> Option<Tree> {
    let entries = properties.iter().map(|(name, value)| (name.text.clone(), text(value)));
    (!properties.is_empty()).then(|| Tree::Map(entries.collect()))
}

fn of_variables(draft: &Draft) -> Tree {
    let verdicts = specification::names(draft);
    let written = draft.variables.iter().filter(|variable| !verdicts.contains(variable.name.text.as_str()));
    Tree::Map(written.map(|variable| (variable.name.text.clone(), of_variable(variable))).collect())
}

fn of_relations(draft: &Draft) -> Tree {
    let written = draft.relations.iter().filter(|relation| specification::of(relation).is_none());
    Tree::Map(written.map(|relation| (relation.name.text.clone(), of_relation(relation))).collect())
}

fn of_specifications(draft: &Draft) -> Tree {
    let entry = |relation: &RelationDraft| {
        let written = specification::written(relation, specification::of(relation)?);
        Some((relation.name.text.clone(), written))
    };
    Tree::Map(draft.relations.iter().filter_map(entry).collect())
}

fn of_variable(variable: &VariableDraft) -> Tree {
    keys([
        ("unit", variable.unit.as_ref().map(text)),
        ("shape", variable.shape.as_ref().map(text)),
        ("range", variable.range.as_ref().map(|(lo, hi)| pair((lo, hi)))),
        ("max_rate", variable.max_rate.as_ref().map(text)),
        ("wraps", variable.wraps.as_ref().map(text)),
        ("properties", properties(&variable.properties)),
    ])
}

fn of_relation(relation: &RelationDraft) -> Tree {
    let (equation, outputs, inputs) = match &relation.body {
        BodyDraft::Equation(equation) => (Some(text(equation)), None, None),
        BodyDraft::Structure { outputs, inputs } => (None, Some(outputs), Some(list(inputs))),
        BodyDraft::Specification(specification) => return specification::written(relation, specification),
    };
    let (output, outputs) = match outputs.map(Vec::as_slice) {
        Some([output]) => (Some(text(output)), None),
        outputs => (None, outputs.map(list)),
    };
    let written = keys([
        ("equation", equation),
        ("output", output),
        ("outputs", outputs),
        ("inputs", inputs),
        ("for", relation.directions.as_deref().map(list)),
        ("when", relation.condition.as_ref().map(text)),
        ("error", relation.error.as_ref().map(bounds)),
        ("learn", (!relation.learn.is_empty()).then(|| list(&relation.learn))),
        ("properties", properties(&relation.properties)),
    ]);
    match written {
        Tree::Map(mut entries) if entries.len() == 1 && entries.iter().any(|(key, _)| key == "equation") => {
            entries.pop().map_or(Tree::Map(Vec::new()), |(_, equation)| equation)
        }
        written => written,
    }
}

fn of_signal(signal: &SignalDraft) -> Tree {
    keys([
        ("variable", signal.variable.as_ref().map(text)),
        ("source", signal.source.as_ref().map(text)),
        ("unit", signal.unit.as_ref().map(text)),
        ("scale", signal.scale.as_ref().map(text)),
        ("offset", signal.offset.as_ref().map(text)),
        ("rate", signal.rate.as_ref().map(text)),
        ("value_error", signal.value_error.as_ref().map(bounds)),
        ("change_error", signal.change_error.as_ref().map(text)),
        ("noise", signal.noise.as_ref().map(text)),
        ("time_error", signal.time_error.as_ref().map(bounds)),
        ("delay", signal.delay.as_ref().map(text)),
        ("mean_over", signal.mean_over.as_ref().map(text)),
        ("timeout", signal.timeout.as_ref().map(text)),
        ("range", signal.range.as_ref().map(|(lo, hi)| pair((lo, hi)))),
        ("saturates", signal.saturates.as_ref().map(|(lo, hi)| pair((lo, hi)))),
        ("max_rate", signal.max_rate.as_ref().map(text)),
        ("max_delay", signal.max_delay.as_ref().map(text)),
        ("frozen_after", signal.frozen_after.as_ref().map(text)),
        ("counter", signal.counter.as_ref().map(text)),
        ("rests_at", signal.rests_at.as_ref().map(text)),
        ("rests_for", signal.rests_for.as_ref().map(text)),
        ("hold", signal.hold.as_ref().map(text)),
        ("access", signal.access.as_ref().map(text)),
        ("derived_from", (!signal.derived_from.is_empty()).then(|| list(&signal.derived_from))),
        ("shares", shares(&signal.shares)),
        ("properties", properties(&signal.properties)),
    ])
}

/// A list of names, or a mapping when priors are given.
fn shares(causes: &[(Text, Option<Text>)]) -> Option<Tree> {
    let prior = |prior: &Option<Text>| prior.as_ref().map_or(Tree::Text(CAUSE_PRIOR.to_string()), text);
    let tree = match causes.iter().all(|(_, prior)| prior.is_none()) {
        true => Tree::List(causes.iter().map(|(cause, _)| text(cause)).collect()),
        false => Tree::Map(causes.iter().map(|(cause, given)| (cause.text.clone(), prior(given))).collect()),
    };
    (!causes.is_empty()).then_some(tree)
}

/// By variable: a need, or a list of needs.
fn of_needs(needs: &[NeedDraft]) -> Tree {
    let mut entries: Vec<(String, Vec<Tree>)> = Vec::new();
    for need in needs {
        let name = &need.variable.text;
        match entries.iter_mut().find(|(known, _)| known == name) {
            Some((_, several)) => several.push(of_need(need)),
            None => entries.push((name.clone(), vec![of_need(need)])),
        }
    }
    let alone = |mut needs: Vec<Tree>| if needs.len() == 1 { needs.remove(0) } else { Tree::List(needs) };
    Tree::Map(entries.into_iter().map(|(name, needs)| (name, alone(needs))).collect())
}

fn of_need(need: &NeedDraft) -> Tree {
    keys([
        ("signal", need.signal.as_ref().map(text)),
        ("max_age", need.max_age.as_ref().map(text)),
        ("max_width", need.max_width.as_ref().map(text)),
        ("integrity", need.integrity.as_ref().map(text)),
        ("min_rate", need.min_rate.as_ref().map(text)),
        ("when_unsure", need.when_unsure.as_ref().map(text)),
        ("hold", need.hold.as_ref().map(text)),
        ("probation", need.probation.as_ref().map(text)),
        ("blend", need.blend.as_ref().map(text)),
        ("hysteresis", need.hysteresis.as_ref().map(text)),
        ("isolation", need.isolation.as_ref().map(text)),
    ])
}

fn of_contract(contract: &ContractDraft) -> Tree {
    let named = |entries: Vec<(String, Tree)>| (!entries.is_empty()).then_some(Tree::Map(entries));
    keys([
        ("runs_on", contract.runs_on.as_ref().map(text)),
        ("evidence", properties(&contract.evidence)),
        ("asks", named(contract.asks.iter().map(|it| (it.name.text.clone(), of_demand(it))).collect())),
        ("gives", named(contract.gives.iter().map(|it| (it.name.text.clone(), of_guarantee(it))).collect())),
        ("policy", contract.policy.as_ref().map(text)),
    ])
}

fn of_guarantee(given: &GuaranteeDraft) -> Tree {
    let fixed = [
        ("of", given.of.as_ref().map(text)),
        ("level", given.level.as_ref().map(text)),
        ("when", given.when.as_ref().map(text)),
        ("redundant", given.redundant.as_deref().map(list)),
    ];
    with_bounds(&given.properties, keys(fixed))
}

fn of_demand(asked: &DemandDraft) -> Tree {
    let fixed = [("of", asked.of.as_ref().map(text)), ("level", asked.level.as_ref().map(text))];
    with_bounds(&asked.properties, keys(fixed))
}

/// The bounds, then the keys.
fn with_bounds(bounds: &PropertyDrafts, fixed: Tree) -> Tree {
    let Tree::Map(fixed) = fixed else { return fixed };
    Tree::Map(bounds.iter().map(|(name, bound)| (name.text.clone(), text(bound))).chain(fixed).collect())
}

fn of_utility(utility: &UtilityDraft) -> Tree {
    match utility {
        UtilityDraft::Named(name) => text(name),
        UtilityDraft::Own { at: _, aggregate, relation, signal, way, defaults } => keys([
            ("aggregate", aggregate.as_ref().map(text)),
            ("relation", relation.as_ref().map(text)),
            ("signal", signal.as_ref().map(text)),
            ("way", way.as_ref().map(text)),
            ("defaults", properties(defaults)),
        ]),
    }
}

/// A short entry without quotes in one line, else its keys below each other.
fn yaml_entry(text: &mut String, indent: &str, name: &str, value: &Tree) {
    let name = plain_or_quoted(name, true);
    let in_one = match value {
        Tree::Text(value) => plain_or_quoted(value, false),
        value => flow(value),
    };
    match value {
        Tree::Map(entries)
            if indent.len() + name.len() + 2 + in_one.len() > MAX_LINE
                || entries.iter().any(|(_, value)| gains(value)) =>
        {
            let _ = writeln!(text, "{indent}{name}:");
            let deeper = format!("{indent}  ");
            entries.iter().for_each(|(name, value)| yaml_entry(text, &deeper, name, value));
        }
        _ => {
            let _ = writeln!(text, "{indent}{name}: {in_one}");
        }
    }
}

/// Whether a value needs quotes only within brackets.
fn gains(value: &Tree) -> bool {
    matches!(value, Tree::Text(text) if is_plain(text, false) && !is_plain(text, true))
}

/// A value in one line.
fn flow(value: &Tree) -> String {
    match value {
        Tree::Text(text) => plain_or_quoted(text, true),
        Tree::List(items) => format!("[{}]", items.iter().map(flow).collect::<Vec<_>>().join(", ")),
        Tree::Map(entries) if entries.is_empty() => "{}".to_owned(),
        Tree::Map(entries) => {
            let entries = entries
                .iter()
                .map(|(name, value)| format!("{}: {}", plain_or_quoted(name, true), flow(value)));
            format!("{{ {} }}", entries.collect::<Vec<_>>().join(", "))
        }
    }
}

/// A text as it is when YAML can read it, else in double quotes.
pub(super) fn plain_or_quoted(text: &str, inside: bool) -> String {
    if is_plain(text, inside) { text.to_owned() } else { quoted(text) }
}

/// Whether YAML reads a text as it is; `inside` brackets, and in keys, fewer characters are allowed.
fn is_plain(text: &str, inside: bool) -> bool {
    let begins = text.starts_with(|c: char| c.is_ascii_alphanumeric() || "/_.(".contains(c))
        || text.starts_with('-') && text[1..].starts_with(|c: char| c.is_ascii_alphanumeric() || c == '.');
    let is_document = text.starts_with("---") || text.starts_with("...");
    let is_sign = |c: char| " _./+-*^%()=<>~@$;".contains(c) || !inside && "[],".contains(c);
    let signs = text.chars().all(|c| c.is_ascii_alphanumeric() || is_sign(c));
    let is_nothing = matches!(text, "null" | "Null" | "NULL" | "~");
    begins && signs && !is_nothing && !is_document && text.trim() == text
}

/// A text in double quotes, as JSON and YAML both read it.
fn quoted(text: &str) -> String {
    let mut quoted = String::from('"');
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            '\n' => quoted += "\\n",
            '\t' => quoted += "\\t",
            // what no YAML text may hold as it is, line ends of other alphabets among it
            _ if c.is_control()
                || matches!(c, '\u{2028}' | '\u{2029}' | '\u{feff}' | '\u{fffe}' | '\u{ffff}') =>
            {
                let _ = write!(quoted, "\\u{:04x}", u32::from(c));
            }
            _ => quoted.push(c),
        }
    }
    quoted.push('"');
    quoted
}

fn json_value(value: &Tree) -> String {
    match value {
        Tree::Text(text) if is_json_number(text) => text.clone(),
        Tree::Text(text) => quoted(text),
        Tree::List(items) => format!("[{}]", items.iter().map(json_value).collect::<Vec<_>>().join(", ")),
        Tree::Map(entries) => {
            let entries =
                entries.iter().map(|(name, value)| format!("{}: {}", quoted(name), json_value(value)));
            format!("{{{}}}", entries.collect::<Vec<_>>().join(", "))
        }
    }
}

/// Whether a text as it is is a number of JSON.
fn is_json_number(text: &str) -> bool {
    let begins = text.starts_with(|c: char| c.is_ascii_digit() || c == '-');
    begins && serde_json::from_str::<serde_json::Number>(text).is_ok()
}
