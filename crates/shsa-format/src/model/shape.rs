//! The shape of a model file: which keys there are and what they hold.

use shsa_core::knowledge::{
    BodyDraft, Bounds, Draft, NeedDraft, RelationDraft, Severity, SignalDraft, Source, Text, UtilityDraft,
    VariableDraft,
};

use super::json::{Entry, Json};
use super::problem;
use super::reader::{Fields, Keys, Reader};
use super::tree::{Node, Value};

/// The version of the model's shape that is read here.
const VERSION: &str = "1";

const MODEL: [&str; 8] =
    ["shsa", "variables", "constants", "functions", "relations", "signals", "needs", "utility"];
const VARIABLE: [&str; 6] = ["unit", "shape", "range", "max_rate", "wraps", "properties"];
const RELATION: [&str; 8] = ["equation", "for", "when", "error", "output", "outputs", "inputs", "properties"];
const SIGNAL: [&str; 19] = [
    "variable",
    "source",
    "unit",
    "scale",
    "offset",
    "rate",
    "value_error",
    "noise",
    "time_error",
    "delay",
    "mean_over",
    "timeout",
    "range",
    "max_rate",
    "max_delay",
    "frozen_after",
    "derived_from",
    "shares",
    "properties",
];
const NEED: [&str; 11] = [
    "signal",
    "max_age",
    "max_width",
    "integrity",
    "min_rate",
    "when_unsure",
    "hold",
    "probation",
    "blend",
    "hysteresis",
    "isolation",
];

const NEED_EXAMPLE: &str = "dmin: { max_age: 300 ms }";

const UTILITY: [&str; 5] = ["aggregate", "relation", "signal", "way", "defaults"];

/// A model whose pieces are read from its tree, or from the text where the tree has none.
pub(crate) struct Model<'r, 'n, 'j> {
    reader: &'r mut Reader,
    fields: Fields<'n>,
    json: Option<&'r mut Json<'j>>,
}

/// All that a tree says, at once.
pub(crate) fn draft(reader: &mut Reader, root: &Node) -> Draft {
    Draft::of(&mut Model::new(reader, root, None))
}

impl<'r, 'n, 'j> Model<'r, 'n, 'j> {
    /// Of a tree; `json` is the text that holds what is unread. Problems of the shape go to the reader.
    pub(crate) fn new(reader: &'r mut Reader, root: &'n Node, json: Option<&'r mut Json<'j>>) -> Self {
        let fields = reader.fields(root, "a model: a mapping", &MODEL, "shsa: 1");
        version(reader, root, &fields);
        Model { reader, fields, json }
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

impl Source for Model<'_, '_, '_> {
    fn variables(&mut self, take: &mut dyn FnMut(&VariableDraft)) {
        self.section("variables", "speed: { unit: m/s }", &mut |reader, entry| {
            take(&variable(reader, entry))
        });
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

    fn signals(&mut self, take: &mut dyn FnMut(&SignalDraft)) {
        let example = "/scan: { variable: distances }";
        self.section("signals", example, &mut |reader, entry| take(&signal(reader, entry)));
    }

    fn needs(&mut self, take: &mut dyn FnMut(&NeedDraft)) {
        self.section("needs", NEED_EXAMPLE, &mut |reader, (variable, node)| match &node.value {
            Value::List(several) if !several.is_empty() => {
                several.iter().for_each(|node| take(&need(reader, variable, node)));
            }
            _ => take(&need(reader, variable, node)),
        });
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
    let fields = reader.fields(node, "a variable's keys", &VARIABLE, "speed: { unit: m/s, range: [-3, 3] }");
    let mut keys = Keys { reader, fields };
    VariableDraft {
        name: name.clone(),
        unit: keys.text("unit", "a unit", "m/s"),
        shape: keys.text("shape", "`scalar` or `vector`", "vector"),
        max_rate: keys.text("max_rate", "a rate of change", "12 m/s^2"),
        wraps: keys.text("wraps", "a turn", "360 deg"),
        range: keys
            .fields
            .get("range")
            .and_then(|node| keys.reader.pair(node, "the lowest and the highest value", "range: [-3, 3]")),
        properties: keys.reader.properties(keys.fields.get("properties")),
    }
}

fn relation(reader: &mut Reader, (name, node): &(Text, Node)) -> Option<RelationDraft> {
    let example = "nearest: dmin = min(distances)";
    if let Value::Scalar(equation) = &node.value {
        let body = BodyDraft::Equation(equation.clone());
        let properties = Vec::new();
        let name = name.clone();
        return Some(RelationDraft {
            name,
            body,
            directions: None,
            condition: None,
            error: None,
            properties,
        });
    }
    let fields = reader.fields(node, "an equation or a relation's keys", &RELATION, example);
    if matches!(node.value, Value::List(_)) {
        return None;
    }
    let mut keys = Keys { reader, fields };
    let body = body(&mut keys, name)?;
    let error = keys.fields.get("error");
    Some(RelationDraft {
        name: name.clone(),
        body,
        directions: keys.names("for", "the variables to solve for"),
        condition: keys.text("when", "a condition", "abs(speed) > 0.2"),
        error: error.and_then(|node| keys.reader.bounds(node, "an error or its bounds", "error: 0.1")),
        properties: keys.reader.properties(keys.fields.get("properties")),
    })
}

fn body(keys: &mut Keys, name: &Text) -> Option<BodyDraft> {
    let equation = keys.text("equation", "an equation", "dmin = min(distances)");
    let outputs = match (keys.names("outputs", "the outputs"), keys.names("output", "the output")) {
        (Some(all), Some(one)) => [all, one].concat(),
        (all, one) => all.or(one).unwrap_or_default(),
    };
    let inputs = keys.names("inputs", "the inputs");
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
    let fields =
        reader.fields(node, "a signal's keys", &SIGNAL, "/scan: { variable: distances, rate: 10 Hz }");
    let mut keys = Keys { reader, fields };
    let value_error = keys.fields.get("value_error");
    let time_error = keys.fields.get("time_error");
    SignalDraft {
        name: name.clone(),
        variable: keys.text("variable", "a variable", "speed"),
        source: keys.text("source", "a place", "scan#ranges"),
        unit: keys.text("unit", "a unit", "m"),
        scale: keys.text("scale", "a number", "0.01"),
        offset: keys.text("offset", "a number or a quantity", "-40 degC"),
        rate: keys.text("rate", "a frequency", "10 Hz"),
        value_error: value_error.and_then(|node| {
            keys.reader.bounds(node, "an error or its lowest and highest value", "value_error: [-0.1, 0.2]")
        }),
        time_error: time_error.and_then(|node| {
            keys.reader.bounds(node, "a time or the lowest and the highest", "time_error: [-100 ms, 0 ms]")
        }),
        noise: keys.text("noise", "a standard deviation", "0.1"),
        delay: keys.span("delay"),
        mean_over: keys.span("mean_over"),
        timeout: keys.span("timeout"),
        range: keys
            .fields
            .get("range")
            .and_then(|node| keys.reader.pair(node, "the lowest and the highest reading", "range: [0, 5 V]")),
        max_rate: keys.text("max_rate", "a rate of change", "12 m/s^2"),
        max_delay: keys.span("max_delay"),
        frozen_after: keys.span("frozen_after"),
        derived_from: keys.names("derived_from", "names of signals").unwrap_or_default(),
        shares: keys.fields.get("shares").map(|node| shares(keys.reader, node)).unwrap_or_default(),
        properties: keys.reader.properties(keys.fields.get("properties")),
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
    let fields = reader.fields(node, "the name of a utility, or its formulas", &UTILITY, example);
    if !matches!(node.value, Value::Map(_)) {
        return None;
    }
    let mut keys = Keys { reader, fields };
    Some(UtilityDraft::Own {
        at: Text { text: String::new(), place: node.place },
        aggregate: keys.text("aggregate", "`product`, `sum` or `minimum`", "product"),
        relation: keys.text("relation", "a formula over properties of a relation", "1 / cost"),
        signal: keys.text("signal", "a formula over properties of a signal", "accuracy"),
        way: keys.text("way", "a formula over how a way of knowing ran", "agreement * availability"),
        defaults: keys.reader.properties(keys.fields.get("defaults")),
    })
}

fn need(reader: &mut Reader, variable: &Text, node: &Node) -> NeedDraft {
    let fields = reader.fields(node, "a need's keys, or a list of needs", &NEED, NEED_EXAMPLE);
    let mut keys = Keys { reader, fields };
    NeedDraft {
        variable: variable.clone(),
        signal: keys.text("signal", "a name", "/healed/dmin"),
        max_age: keys.span("max_age"),
        max_width: keys.text("max_width", "a width", "0.5 m"),
        integrity: keys.text("integrity", "a level from A to D", "B"),
        min_rate: keys.text("min_rate", "a frequency", "5 Hz"),
        when_unsure: keys.text("when_unsure", "`hull`, `last` or `withhold`", "hull"),
        hold: keys.span("hold"),
        probation: keys.span("probation"),
        blend: keys.span("blend"),
        hysteresis: keys.text("hysteresis", "a share", "5 %"),
        isolation: keys.text("isolation", "`engine` or `process`", "process"),
    }
}
