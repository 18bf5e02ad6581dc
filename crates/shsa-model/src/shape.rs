//! The shape of a model file: its keys and their content.

use shsa_core::knowledge::{
    BodyDraft, Bounds, ContractDraft, DemandDraft, Diagnostic, Draft, FusionDraft, GuaranteeDraft,
    KnowledgeBase, NeedDraft, RelationDraft, Severity, SignalDraft, Source, Text, UtilityDraft,
    VariableDraft, build_from,
};
use shsa_message::source;

use super::json::{Entry, Json};
use super::keys::{
    ASKED, CONTRACT, GIVEN, Key, NEED, PLATFORM, RELATION, SECTIONS, SIGNAL, UTILITY, VARIABLE,
};
use super::known::Known;
use super::problem;
use super::reader::{Fields, Reader};
use super::tree::{Node, Value};
use super::{fusion, specification};

/// The version of the model's shape that this reader supports.
const VERSION: &str = "1";

const NEED_EXAMPLE: &str = "dmin: { max_age: 300 ms }";

/// A model whose pieces are read from its tree, or from the text where the tree has none.
pub(crate) struct Model<'r, 'n, 'j> {
    reader: &'r mut Reader,
    fields: Fields<'n>,
    json: Option<&'r mut Json<'j>>,
    specifications: Vec<specification::Drafts>,
}

/// The draft of a tree.
pub fn draft(reader: &mut Reader, root: &Node) -> Draft {
    Draft::of(&mut Model::new(reader, root, None))
}

/// The knowledge base of a tree, with the problems that the checks find; the reader gets those of the shape.
pub fn build(reader: &mut Reader, root: &Node) -> (KnowledgeBase, Vec<Diagnostic>) {
    build_from(&mut Model::new(reader, root, None))
}

impl<'r, 'n, 'j> Model<'r, 'n, 'j> {
    /// The model of a tree; `json` is the text of its unread mappings. The reader gets the problems of the shape.
    pub(crate) fn new(reader: &'r mut Reader, root: &'n Node, json: Option<&'r mut Json<'j>>) -> Self {
        let known = SECTIONS.map(|section| section.name);
        let fields = reader.fields(root, "a model: a mapping", &known, "shsa: 1");
        version(reader, root, &fields);
        let mut model = Model { reader, fields, json, specifications: Vec::new() };
        let mut specifications = Vec::new();
        model.section("specifications", specification::EXAMPLE, &mut |reader, entry| {
            specifications.extend(specification::read(reader, entry));
        });
        model.specifications = specifications;
        model
    }

    /// Reads the entries of a section.
    fn section(&mut self, key: &str, example: &str, take: &mut dyn FnMut(&mut Reader, &(Text, Node))) {
        let Some(node) = self.fields.get(key) else { return };
        match (&node.value, &mut self.json) {
            (Value::Unread, Some(json)) => json.entries(node.place, &mut |entry| take(self.reader, entry)),
            _ => {
                let entries = self.reader.entries(node, "names with their values", example);
                entries.iter().for_each(|entry| take(self.reader, entry));
            }
        }
    }
}

impl Model<'_, '_, '_> {
    /// Reads the relations of the section, without those of specifications.
    fn written_relations(&mut self, take: &mut dyn FnMut(&RelationDraft)) {
        let unread = self.fields.get("relations").filter(|node| matches!(node.value, Value::Unread));
        if let (Some(node), Some(json)) = (unread, &mut self.json) {
            return json.relations(node.place, &mut |entry| {
                let read = match entry {
                    Entry::Usual(relation) => Some(relation),
                    Entry::Other(entry) => relation(self.reader, &entry),
                };
                read.iter().for_each(&mut *take);
            });
        }
        self.section("relations", "nearest: dmin = min(distances)", &mut |reader, entry| {
            if let Some(relation) = relation(reader, entry) {
                take(&relation);
            }
        });
    }
}

impl Source for Model<'_, '_, '_> {
    fn variables(&mut self, take: &mut dyn FnMut(&VariableDraft)) {
        self.section("variables", "speed: { unit: m/s }", &mut |reader, entry| {
            take(&variable(reader, entry))
        });
        self.specifications.iter().for_each(|it| take(&it.variable));
    }

    fn constants(&mut self, take: &mut dyn FnMut(&(Text, Bounds))) {
        self.section("constants", "wheel_base: 2.67 m", &mut |reader, (name, node)| {
            if let Some(bounds) = reader.bounds(node, "a value or the bounds of one", "2.67 m") {
                take(&(name.clone(), bounds));
            }
        });
    }

    fn functions(&mut self, take: &mut dyn FnMut(&(Text, Text))) {
        self.section("functions", "clamp01(x): min(max(x, 0), 1)", &mut |reader, (head, node)| {
            if let Some(body) = reader.text(node, "a formula", "min(max(x, 0), 1)") {
                take(&(head.clone(), body));
            }
        });
    }

    fn relations(&mut self, take: &mut dyn FnMut(&RelationDraft)) {
        self.written_relations(take);
        self.specifications.iter().for_each(|it| take(&it.relation));
    }

    fn signals(&mut self, take: &mut dyn FnMut(&SignalDraft)) {
        let example = "/scan: { variable: distances }";
        self.section("signals", example, &mut |reader, entry| take(&signal(reader, entry)));
    }

    fn fusions(&mut self, take: &mut dyn FnMut(&FusionDraft)) {
        let example = "motion: { method: kalman, states: .., inputs: .., outputs: .. }";
        self.section("fusion", example, &mut |reader, entry| take(&fusion::read(reader, entry)));
    }

    fn needs(&mut self, take: &mut dyn FnMut(&NeedDraft)) {
        self.section("needs", NEED_EXAMPLE, &mut |reader, (variable, node)| match &node.value {
            Value::List(several) if !several.is_empty() => {
                several.iter().for_each(|node| take(&need(reader, variable, node)));
            }
            _ => take(&need(reader, variable, node)),
        });
    }

    fn platform(&mut self) -> Vec<ContractDraft> {
        let mut found = Vec::new();
        let example = "computer: { gives: { time: { time: at least 5 ms } } }";
        self.section("platform", example, &mut |reader, entry| {
            found.push(contract(reader, entry, &PLATFORM))
        });
        found
    }

    fn contracts(&mut self) -> Vec<ContractDraft> {
        let mut found = Vec::new();
        let example = "/scan: { gives: { near: { error: at most 0.1 m, level: SIL 2 } } }";
        self.section("contracts", example, &mut |reader, entry| {
            found.push(contract(reader, entry, &CONTRACT))
        });
        found
    }

    fn utility(&mut self) -> Option<UtilityDraft> {
        let node = self.fields.get("utility")?;
        utility(self.reader, node)
    }
}

fn version(reader: &mut Reader, root: &Node, fields: &Fields) {
    match fields.get("shsa") {
        Some(node) => {
            let known = matches!(&node.value, Value::Scalar(text) if text.text == VERSION);
            if !known {
                reader.wrong(node, "this version of the model's shape is not known", "write `shsa: 1`");
            }
        }
        None if matches!(root.value, Value::Map(_)) => {
            let place = shsa_core::knowledge::Place::default();
            let mut missing = problem(place, "the version of the model's shape is missing", None);
            missing.severity = Severity::Warning;
            missing.help = Some("write `shsa: 1` in the first line".to_owned());
            reader.problems.push(missing);
        }
        None => {}
    }
}

fn variable(reader: &mut Reader, (name, node): &(Text, Node)) -> VariableDraft {
    let example = "speed: { unit: m/s, range: [-3, 3] }";
    let mut keys = Known::of(reader, node, &VARIABLE, "a variable's keys", example);
    VariableDraft {
        name: name.clone(),
        unit: keys.text("unit"),
        shape: keys.text("shape"),
        max_rate: keys.text("max_rate"),
        wraps: keys.text("wraps"),
        range: keys.pair("range"),
        properties: keys.numbers("properties"),
    }
}

fn relation(reader: &mut Reader, (name, node): &(Text, Node)) -> Option<RelationDraft> {
    let example = "nearest: dmin = min(distances)";
    if let Value::Scalar(equation) = &node.value {
        return Some(RelationDraft::new(name.clone(), BodyDraft::Equation(equation.clone())));
    }
    let mut keys = Known::of(reader, node, &RELATION, "an equation or a relation's keys", example);
    if matches!(node.value, Value::List(_)) {
        return None;
    }
    let body = body(&mut keys, name)?;
    Some(RelationDraft {
        name: name.clone(),
        body,
        directions: keys.names("for"),
        condition: keys.text("when"),
        error: keys.bounds("error"),
        learn: keys.names("learn").unwrap_or_default(),
        properties: keys.numbers("properties"),
    })
}

fn body(keys: &mut Known, name: &Text) -> Option<BodyDraft> {
    let equation = keys.text("equation");
    let outputs = match (keys.names("outputs"), keys.names("output")) {
        (Some(all), Some(one)) => [all, one].concat(),
        (all, one) => all.or(one).unwrap_or_default(),
    };
    let inputs = keys.names("inputs");
    let structure = inputs.is_some() || !outputs.is_empty();
    match equation {
        Some(equation) => {
            if structure {
                let message = format!("relation `{}` has an equation and a structure", name.text);
                let help = "keep `equation`, or `outputs` and `inputs`";
                keys.reader.note(name.place, &message, help);
            }
            Some(BodyDraft::Equation(equation))
        }
        None if !outputs.is_empty() => {
            Some(BodyDraft::Structure { outputs, inputs: inputs.unwrap_or_default() })
        }
        None => {
            let message = format!("relation `{}` says nothing", name.text);
            let help = "give it an `equation`, or `outputs` and `inputs` for structure only";
            keys.reader.note(name.place, &message, help);
            None
        }
    }
}

fn signal(reader: &mut Reader, (name, node): &(Text, Node)) -> SignalDraft {
    let example = "/scan: { variable: distances, rate: 10 Hz }";
    let mut keys = Known::of(reader, node, &SIGNAL, "a signal's keys", example);
    let source = keys.text("source");
    SignalDraft {
        name: name.clone(),
        variable: keys.text("variable"),
        source_parts: source::parts(&name.text, source.as_ref().map(|source| source.text.as_str())),
        source,
        unit: keys.text("unit"),
        scale: keys.text("scale"),
        offset: keys.text("offset"),
        rate: keys.text("rate"),
        value_error: keys.bounds("value_error"),
        change_error: keys.text("change_error"),
        time_error: keys.bounds("time_error"),
        noise: keys.text("noise"),
        delay: keys.text("delay"),
        mean_over: keys.text("mean_over"),
        timeout: keys.text("timeout"),
        range: keys.pair("range"),
        saturates: keys.pair("saturates"),
        max_rate: keys.text("max_rate"),
        max_delay: keys.text("max_delay"),
        frozen_after: keys.text("frozen_after"),
        counter: keys.text("counter"),
        rests_at: keys.text("rests_at"),
        rests_for: keys.text("rests_for"),
        hold: keys.text("hold"),
        access: keys.text("access"),
        derived_from: keys.names("derived_from").unwrap_or_default(),
        shares: keys.get("shares").map(|node| shares(keys.reader, node)).unwrap_or_default(),
        properties: keys.numbers("properties"),
    }
}

/// Names of common causes: a list, or a mapping with their priors.
fn shares(reader: &mut Reader, node: &Node) -> Vec<(Text, Option<Text>)> {
    let example = "shares: [imu], or shares: { imu: 0.001 }";
    if !matches!(node.value, Value::Map(_)) {
        let names = reader.names(node, "what it shares with other signals", example);
        return names.into_iter().map(|name| (name, None)).collect();
    }
    let entries = reader.entries(node, "what it shares with other signals", example);
    let prior = |(cause, node): &(Text, Node)| {
        Some((cause.clone(), Some(reader.text(node, "the probability of a fault", example)?)))
    };
    entries.iter().filter_map(prior).collect()
}

fn utility(reader: &mut Reader, node: &Node) -> Option<UtilityDraft> {
    if let Value::Scalar(name) = &node.value {
        return Some(UtilityDraft::Named(name.clone()));
    }
    let example = "utility: { aggregate: product, relation: 1 / cost }";
    let mut keys = Known::of(reader, node, &UTILITY, "the name of a utility, or its formulas", example);
    if !matches!(node.value, Value::Map(_)) {
        return None;
    }
    Some(UtilityDraft::Own {
        at: Text { text: String::new(), place: node.place },
        aggregate: keys.text("aggregate"),
        relation: keys.text("relation"),
        signal: keys.text("signal"),
        way: keys.text("way"),
        defaults: keys.numbers("defaults"),
    })
}

fn need(reader: &mut Reader, variable: &Text, node: &Node) -> NeedDraft {
    let mut keys = Known::of(reader, node, &NEED, "a need's keys, or a list of needs", NEED_EXAMPLE);
    NeedDraft {
        variable: variable.clone(),
        signal: keys.text("signal"),
        max_age: keys.text("max_age"),
        max_width: keys.text("max_width"),
        integrity: keys.text("integrity"),
        min_rate: keys.text("min_rate"),
        when_unsure: keys.text("when_unsure"),
        hold: keys.text("hold"),
        probation: keys.text("probation"),
        blend: keys.text("blend"),
        hysteresis: keys.text("hysteresis"),
        isolation: keys.text("isolation"),
    }
}

fn contract(reader: &mut Reader, (name, node): &(Text, Node), keys: &'static [Key]) -> ContractDraft {
    let example = "/scan: { gives: { near: { error: at most 0.1 m, level: SIL 2 } } }";
    let mut keys = Known::of(reader, node, keys, "what is given, asked and observed", example);
    ContractDraft {
        name: name.clone(),
        runs_on: keys.text("runs_on"),
        policy: if keys.is_known("policy") { keys.text("policy") } else { None },
        gives: keys.entries("gives", given),
        asks: keys.entries("asks", asked),
        evidence: keys.words("evidence"),
    }
}

fn given(reader: &mut Reader, (name, node): &(Text, Node)) -> GuaranteeDraft {
    let (mut keys, properties) =
        Known::beside_words(reader, node, &GIVEN, "a guarantee", "near: { error: at most 0.1 m }");
    GuaranteeDraft {
        name: name.clone(),
        of: keys.text("of"),
        level: keys.text("level"),
        when: keys.text("when"),
        redundant: keys.names("redundant"),
        properties,
    }
}

fn asked(reader: &mut Reader, (name, node): &(Text, Node)) -> DemandDraft {
    let (mut keys, properties) =
        Known::beside_words(reader, node, &ASKED, "a demand", "time: { of: platform, time: at least 2 ms }");
    DemandDraft { name: name.clone(), of: keys.text("of"), level: keys.text("level"), properties }
}
