//! The thesis's YAML: `relations` or `graph`, and `properties`.
//!
//! ```yaml
//! relations:
//!   turn: { angle: { in: [base, radius], fct: "atan(base / radius)", constraint: "radius > 1" } }
//! graph:                       # or: from each node to those that it feeds
//!   base: [turn]
//!   turn: [angle]
//! properties:
//!   type: { base: 0, angle: 0, turn: 1 }     # 0 a variable, 1 a relation
//!   provided: { base: True }                 # or [base]
//!   provision: { base: ["/base"] }           # by name
//!   constant: { gain: 2.5 }
//!   need: { angle: ["/angle"] }
//!   accuracy: { base: 0.9 }                  # any number of a variable or relation
//! provision_properties: { "/base": { accuracy: 0.9, pubrate: 10 } }
//! ```

mod graph;

use shsa_core::knowledge::Text;
use std::collections::{BTreeMap, BTreeSet};

use super::notes::Notes;
use super::sketch::{Direction, Sketch, Sketched};
use shsa_model::tree::{Node, Value};

/// Whether a tree has the thesis's form: `properties` beside its structure, or relations by outputs.
pub(in super::super) fn is_thesis(root: &Node) -> bool {
    let Value::Map(entries) = &root.value else { return false };
    let has = |key: &str| entries.iter().any(|(name, _)| name.text == key);
    !has("shsa")
        && !has("variables")
        && (has("graph") || has("relations"))
        && (has("properties") || has("utils"))
}

/// Reads the tree; unknown parts are reported.
pub(super) fn sketch(notes: &mut Notes, root: &Node) -> Sketch {
    let mut reader = Reader { notes, sketch: Sketch::default(), kinds: BTreeMap::new() };
    let entries = reader.entries(root, "a mapping with `relations` and `properties`");
    let of = |key: &str| entries.iter().find(|(name, _)| name.text == key).map(|(_, node)| node);
    if let Some(properties) = of("properties") {
        reader.kinds(properties);
    }
    match (of("relations"), of("graph")) {
        (Some(relations), _) => reader.relations(relations),
        (None, Some(graph)) => reader.graph(graph),
        (None, None) => {
            reader.wrong(root, "there are neither `relations` nor a `graph`", "write one of them")
        }
    }
    for (name, node) in entries {
        match name.text.as_str() {
            "relations" => {}
            "graph" if of("relations").is_none() => {}
            "properties" => reader.properties(node),
            "provision_properties" => {}
            "utils" => {
                let help =
                    "relations that call functions of these files are structure only: write the formulas out";
                reader.notes.warn(name, "other files of Python are not read", help);
            }
            other => reader.notes.warn(name, format!("`{other}` is not taken over"), ""),
        }
    }
    if let Some(properties) = of("provision_properties") {
        reader.provision_properties(properties);
    }
    reader.sketch
}

struct Reader<'n> {
    notes: &'n mut Notes,
    sketch: Sketch,
    /// By node of a graph, whether it is a relation.
    kinds: BTreeMap<String, bool>,
}

type Entries<'a> = &'a [(Text, Node)];

impl Reader<'_> {
    fn wrong(&mut self, node: &Node, message: &str, help: &str) {
        self.notes.error(node.place, message, help);
    }

    fn entries<'a>(&mut self, node: &'a Node, what: &str) -> Entries<'a> {
        match &node.value {
            Value::Map(entries) => entries,
            Value::Null => &[],
            _ => {
                self.wrong(
                    node,
                    &format!("expected {what}"),
                    "see the form in the documentation of `shsa model convert`",
                );
                &[]
            }
        }
    }

    fn text(&mut self, node: &Node, what: &str) -> Option<Text> {
        if let Value::Scalar(text) = &node.value {
            return Some(text.clone());
        }
        if !matches!(node.value, Value::Null) {
            self.wrong(node, &format!("expected {what}"), "write one value");
        }
        None
    }

    /// One name or a list of them.
    fn names(&mut self, node: &Node, what: &str) -> Vec<Text> {
        match &node.value {
            Value::List(items) => items.iter().filter_map(|item| self.text(item, what)).collect(),
            _ => self.text(node, what).into_iter().collect(),
        }
    }

    fn relations(&mut self, node: &Node) {
        for (name, node) in self.entries(node, "relations by their names") {
            let outputs = self.entries(node, "outputs, each with `in` and `fct`");
            let directions: Vec<Direction> =
                outputs.iter().filter_map(|(output, node)| self.direction(output, node)).collect();
            if outputs.is_empty() {
                self.notes.warn(name, format!("relation `{}` has no output: it is left out", name.text), "");
            } else {
                self.sketch.relations.push(Sketched { name: name.clone(), directions, code: None });
            }
        }
    }

    fn direction(&mut self, output: &Text, node: &Node) -> Option<Direction> {
        if !matches!(node.value, Value::Map(_) | Value::Null) {
            let help = "write it like `angle: { in: [base, radius], fct: \"atan(base / radius)\" }`";
            self.wrong(node, &format!("expected what `{}` is computed from", output.text), help);
            return None;
        }
        let mut direction =
            Direction { output: output.clone(), inputs: Vec::new(), code: None, constraint: None };
        for (key, node) in self.entries(node, "`in` and `fct`") {
            match key.text.as_str() {
                "in" => direction.inputs = self.names(node, "the names of the inputs"),
                "fct" | "fun" | "function" => direction.code = self.text(node, "a formula"),
                "constraint" => direction.constraint = self.text(node, "a condition"),
                other => self.notes.warn(key, format!("`{other}` of a relation is not taken over"), ""),
            }
        }
        Some(direction)
    }

    fn properties(&mut self, node: &Node) {
        for (key, node) in self.entries(node, "properties by their names") {
            match key.text.as_str() {
                "type" => {}
                "provided" => self.provided(node),
                "provision" | "itoms" => self.provision(node),
                "constant" => self.constants(node),
                "need" => self.needs(node),
                "fct" => self.formulas(node),
                _ => self.numbers(key, node),
            }
        }
    }

    /// `[a, b]`, or `{ a: True, b: False }`; a signal of the same name carries each variable.
    fn provided(&mut self, node: &Node) {
        if let Value::List(_) = node.value {
            for name in self.names(node, "the name of a variable") {
                self.own_signal(&name);
            }
            return;
        }
        for (name, node) in self.entries(node, "variables with `True` or `False`") {
            match self.truth(node) {
                Some(true) => self.own_signal(name),
                Some(false) => self.sketch.variables.push(name.clone()),
                None => {
                    self.wrong(node, "expected `True` or `False`", "say whether the variable is provided")
                }
            }
        }
    }

    fn own_signal(&mut self, variable: &Text) {
        let name = Text { text: format!("/{}", variable.text), place: variable.place };
        self.sketch.signals.push((variable.clone(), name));
    }

    fn truth(&self, node: &Node) -> Option<bool> {
        let Value::Scalar(text) = &node.value else { return None };
        match text.text.as_str() {
            "True" | "true" | "TRUE" | "yes" | "1" => Some(true),
            "False" | "false" | "FALSE" | "no" | "0" => Some(false),
            _ => None,
        }
    }

    /// Names of services by variable; a number is the value of a constant.
    fn provision(&mut self, node: &Node) {
        for (variable, node) in self.entries(node, "variables with the names of what provides them") {
            if let Some(provided) = self.truth(node).filter(|_| !is_number(node)) {
                if provided {
                    self.own_signal(variable);
                }
                continue;
            }
            self.sketch.variables.push(variable.clone());
            let names = self.names(node, "the names of what provides it");
            match names.as_slice() {
                [value] if value.text.parse::<f64>().is_ok() => {
                    self.sketch.constants.push((variable.clone(), value.clone()));
                }
                _ => self.sketch.signals.extend(names.into_iter().map(|name| (variable.clone(), name))),
            }
        }
    }

    /// Numbers; a name is that of a constant signal.
    fn constants(&mut self, node: &Node) {
        for (variable, node) in self.entries(node, "names with their values") {
            for value in self.names(node, "a number") {
                if value.text.parse::<f64>().is_ok_and(f64::is_finite) {
                    self.sketch.constants.push((variable.clone(), value));
                } else {
                    let message =
                        format!("`{}` is no number: `{}` becomes a signal", value.text, variable.text);
                    self.notes.warn(&value, message, "");
                    self.sketch.signals.push((variable.clone(), value));
                }
            }
        }
    }

    fn needs(&mut self, node: &Node) {
        for (variable, node) in self.entries(node, "variables with the names under which they are needed") {
            match self.truth(node) {
                Some(true) => self.sketch.needs.push((variable.clone(), None)),
                Some(false) => {}
                None => {
                    let names = self.names(node, "a name or `True`").into_iter();
                    self.sketch.needs.extend(names.map(|name| (variable.clone(), Some(name))));
                }
            }
        }
    }

    /// Formulas of relations with one output.
    fn formulas(&mut self, node: &Node) {
        let relations = self.sketch.relations.iter().enumerate();
        let places: BTreeMap<String, usize> =
            relations.map(|(at, relation)| (relation.name.text.clone(), at)).collect();
        for (name, node) in self.entries(node, "relations with their formulas") {
            let code = self.text(node, "a formula");
            match places.get(&name.text).and_then(|&at| self.sketch.relations.get_mut(at)) {
                Some(relation) => relation.code = code,
                None => {
                    let message = format!("there is no relation `{}`: its formula is left out", name.text);
                    self.notes.warn(name, message, "");
                }
            }
        }
    }

    /// Any other property: numbers are converted, texts are not.
    fn numbers(&mut self, key: &Text, node: &Node) {
        let mut left = 0_usize;
        for (name, node) in self.entries(node, "variables or relations with their values") {
            match &node.value {
                Value::Scalar(value) if value.text.parse::<f64>().is_ok_and(f64::is_finite) => {
                    self.sketch.properties.push((name.clone(), key.clone(), value.clone()));
                }
                Value::Null => {}
                _ => left += 1,
            }
        }
        if left > 0 {
            let values = if left == 1 { "value is" } else { "values are" };
            let message = format!("{left} `{}` {values} no number and left out", key.text);
            self.notes.warn(key, message, "a property of a model is a number");
        }
    }

    /// The properties of signals: a rate, and numbers.
    fn provision_properties(&mut self, node: &Node) {
        let signals: BTreeSet<String> =
            self.sketch.signals.iter().map(|(_, name)| name.text.clone()).collect();
        let names = self.sketch.needs.iter().filter_map(|(_, name)| name.as_ref());
        let needed: BTreeSet<String> = names.map(|name| name.text.clone()).collect();
        for (signal, node) in self.entries(node, "names with their properties") {
            for (key, node) in self.entries(node, "properties by their names") {
                match (key.text.as_str(), &node.value) {
                    ("need", _) if needed.contains(&signal.text) => {}
                    ("pubrate", Value::Scalar(rate)) if signals.contains(&signal.text) => {
                        self.sketch.rates.push((signal.clone(), rate.clone()));
                    }
                    (_, Value::Scalar(value)) if is_number(node) => {
                        self.sketch.signal_properties.push((signal.clone(), key.clone(), value.clone()));
                    }
                    _ => {
                        let message = format!("`{}` of `{}` is left out", key.text, signal.text);
                        self.notes.warn(
                            key,
                            message,
                            "only numbers of what carries a variable are taken over",
                        );
                    }
                }
            }
        }
    }
}

fn is_number(node: &Node) -> bool {
    matches!(&node.value, Value::Scalar(text) if text.text.parse::<f64>().is_ok_and(f64::is_finite))
}
