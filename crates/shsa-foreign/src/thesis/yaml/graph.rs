//! Relations as the nodes of a graph, in which an edge goes from a node to the nodes that it feeds.

use super::Reader;
use crate::thesis::sketch::{Direction, Sketched};
use shsa_core::knowledge::Text;
use shsa_model::tree::{Node, Value};
use std::collections::{BTreeMap, BTreeSet};

impl Reader<'_> {
    /// Reads which nodes are relations.
    pub(super) fn kinds(&mut self, properties: &Node) {
        let Value::Map(entries) = &properties.value else { return };
        let Some((_, types)) = entries.iter().find(|(name, _)| name.text == "type") else { return };
        for (name, node) in self.entries(types, "nodes with their types") {
            match self
                .text(node, "0 for a variable, 1 for a relation")
                .as_ref()
                .map(|text| text.text.as_str())
            {
                Some("0" | "V" | "variable") => {
                    self.kinds.insert(name.text.clone(), false);
                }
                Some("1" | "R" | "relation") => {
                    self.kinds.insert(name.text.clone(), true);
                }
                _ => {
                    self.wrong(node, "this is no type of a node", "write 0 for a variable, 1 for a relation")
                }
            }
        }
    }

    /// Reads the edges, each from a node to the nodes that it feeds.
    pub(super) fn graph(&mut self, node: &Node) {
        let mut order: Vec<Text> = Vec::new();
        let mut found: BTreeMap<String, (Vec<Text>, Vec<Text>)> = BTreeMap::new();
        let mut unknown = BTreeSet::new();
        for (from, node) in self.entries(node, "nodes with the nodes that they feed") {
            let targets = self.names(node, "the names of nodes");
            for name in std::iter::once(from).chain(&targets) {
                match self.kinds.get(&name.text) {
                    Some(true) if !found.contains_key(&name.text) => {
                        found.insert(name.text.clone(), Default::default());
                        order.push(name.clone());
                    }
                    Some(true) => {}
                    Some(false) => self.sketch.variables.push(name.clone()),
                    None if unknown.insert(name.text.clone()) => {
                        let help = "write under `properties`, `type`: 0 for a variable, 1 for a relation";
                        self.notes.error(name.place, format!("the type of `{}` is missing", name.text), help);
                    }
                    None => {}
                }
            }
            for target in targets {
                self.edge(from, target, &mut found);
            }
        }
        for name in order {
            let (inputs, outputs) = found.remove(&name.text).unwrap_or_default();
            self.node(name, &inputs, outputs);
        }
    }

    fn edge(&mut self, from: &Text, to: Text, found: &mut BTreeMap<String, (Vec<Text>, Vec<Text>)>) {
        match (self.kinds.get(&from.text), self.kinds.get(&to.text)) {
            (Some(false), Some(true)) => {
                found
                    .entry(to.text.clone())
                    .or_default()
                    .0
                    .push(Text { text: from.text.clone(), place: to.place });
            }
            (Some(true), Some(false)) => found.entry(from.text.clone()).or_default().1.push(to),
            (Some(from_kind), Some(_)) => {
                let kind = if *from_kind { "relations" } else { "variables" };
                let message =
                    format!("this edge joins two {kind}, `{}` and `{}`: it is left out", from.text, to.text);
                self.notes.warn(&to, message, "an edge joins a variable and a relation");
            }
            _ => {}
        }
    }

    /// A relation of a graph.
    fn node(&mut self, name: Text, inputs: &[Text], outputs: Vec<Text>) {
        let directions: Vec<Direction> = outputs
            .into_iter()
            .map(|output| Direction { output, inputs: inputs.to_vec(), code: None, constraint: None })
            .collect();
        if directions.is_empty() {
            self.notes.warn(&name, format!("relation `{}` feeds no variable: it is left out", name.text), "");
        } else {
            self.sketch.relations.push(Sketched { name, directions, code: None });
        }
    }
}
