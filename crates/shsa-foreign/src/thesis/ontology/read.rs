//! Ontologies as drafts of models.

use super::super::names::{Names, Taken};
use super::super::notes::Notes;
use super::graph::{Graph, Node};
use shsa_core::knowledge::{
    BodyDraft, Bounds, Draft, Place, RelationDraft, SignalDraft, Text, VariableDraft,
};
use shsa_message::source;
use std::collections::{BTreeMap, BTreeSet};

/// The draft of an ontology; problems are reported. Time: linear in the text, but for the order of the names.
pub(in super::super) fn draft(notes: &mut Notes, text: &str) -> Draft {
    let graph = Graph::read(notes, text);
    let mut reader = Reader { graph: &graph, notes, names: Names::default(), ours: BTreeMap::new() };
    let draft = reader.draft();
    let is_empty = draft.variables.is_empty() && draft.relations.is_empty();
    if is_empty && notes.found.iter().all(|found| found.severity != shsa_core::knowledge::Severity::Error) {
        let help = "a sensor looks like `<wheel> a sosa:Sensor ; sosa:observes <speed> .`";
        notes.error(
            Text::default().place,
            "no sensor, property or procedure of SOSA and SSN is in this text",
            help,
        );
    }
    draft
}

struct Reader<'g, 'n> {
    graph: &'g Graph<'g>,
    notes: &'n mut Notes,
    names: Names,
    /// Our names of variables and constants, by IRI.
    ours: BTreeMap<&'g str, Text>,
}

impl<'g> Reader<'g, '_> {
    fn draft(&mut self) -> Draft {
        let properties = self.properties();
        let mut draft = Draft::default();
        for &iri in &properties {
            let name = self.add(iri);
            let node = self.graph.nodes.get(iri);
            let text = |text: &String| Text { text: text.clone(), place: name.place };
            let unit = node.and_then(|node| node.unit.as_ref()).filter(|unit| *unit != "1");
            match node.and_then(|node| node.value.as_ref()) {
                Some(value) => {
                    let unit = unit.map(|unit| format!(" {unit}")).unwrap_or_default();
                    draft.constants.push((name.clone(), Bounds::One(text(&format!("{value}{unit}")))));
                }
                None => {
                    let shape = node.and_then(|node| node.shape.as_ref()).map(text);
                    let unit = unit.map(text);
                    draft.variables.push(VariableDraft { unit, shape, name, ..VariableDraft::default() });
                }
            }
        }
        draft.signals = self.signals();
        draft.relations = self.relations();
        draft
    }

    /// What is a variable or a constant.
    fn properties(&self) -> BTreeSet<&'g str> {
        let nodes = &self.graph.nodes;
        let is_property =
            |node: &Node| node.classes.contains("ObservableProperty") || node.classes.contains("Property");
        let own = nodes.iter().filter(|(_, node)| is_property(node)).map(|(iri, _)| iri);
        let named =
            nodes.values().flat_map(|node| node.observes.iter().chain(&node.inputs).chain(&node.outputs));
        own.chain(named).map(String::as_str).collect()
    }

    /// Our name of a property, at its place.
    fn add(&mut self, iri: &'g str) -> Text {
        let found = self.graph.name(iri);
        let is_taken = self.names.find(&found.text).is_some();
        // Two with one label.
        let key =
            Text { text: if is_taken { iri.to_owned() } else { found.text.clone() }, place: found.place };
        let ours = Text { text: self.names.add(&key), place: found.place };
        if ours.text != found.text {
            self.notes.warn(&found, format!("`{}` becomes `{}`", found.text, ours.text), "");
        }
        self.ours.insert(iri, ours.clone());
        ours
    }

    fn our(&self, iri: &str) -> Option<Text> {
        self.ours.get(iri).cloned()
    }

    fn signals(&self) -> Vec<SignalDraft> {
        let mut hosts: BTreeMap<&str, Vec<(Text, Option<Text>)>> = BTreeMap::new();
        for (platform, node) in self.graph.nodes.iter().filter(|(_, node)| node.hosts.len() > 1) {
            for hosted in &node.hosts {
                hosts.entry(hosted).or_default().push((self.graph.name(platform), None));
            }
        }
        let (mut taken, mut signals) = (Taken::default(), Vec::new());
        for (iri, node) in &self.graph.nodes {
            for observed in &node.observes {
                let found = self.graph.name(iri);
                let name = match (node.observes.len(), self.our(observed)) {
                    (2.., Some(variable)) => format!("{}/{}", found.text, variable.text),
                    _ => found.text,
                };
                let name = taken.unique(&name);
                signals.push(SignalDraft {
                    source_parts: source::parts(&name, None),
                    name: Text { text: name, place: found.place },
                    variable: self.our(observed),
                    shares: hosts.get(iri.as_str()).cloned().unwrap_or_default(),
                    ..SignalDraft::default()
                });
            }
        }
        signals
    }

    /// Procedures of one label, equation and set of properties are the directions of one relation.
    fn relations(&mut self) -> Vec<RelationDraft> {
        let (mut relations, mut places) = (Vec::new(), BTreeMap::new());
        let mut taken = Taken::default();
        for (iri, node) in self.graph.nodes.iter().filter(|(_, node)| !node.outputs.is_empty()) {
            let name = self.graph.name(iri);
            let all: BTreeSet<&String> = node.inputs.iter().chain(&node.outputs).collect();
            let at = *places.entry((name.text.clone(), &node.equation, all)).or_insert(relations.len());
            if at == relations.len() {
                let own = Text { text: taken.unique(&name.text), place: name.place };
                relations.push(RelationDraft::new(own, body(node, name.place)));
            }
            let Some(relation) = relations.get_mut(at) else { continue };
            let ours =
                |iris: &BTreeSet<String>| iris.iter().filter_map(|iri| self.our(iri)).collect::<Vec<_>>();
            match &mut relation.body {
                BodyDraft::Equation(_) => {
                    relation.directions.get_or_insert_default().extend(ours(&node.outputs))
                }
                BodyDraft::Structure { outputs, inputs } => {
                    outputs.extend(ours(&node.outputs));
                    let new = ours(&node.inputs).into_iter().filter(|input| !inputs.contains(input));
                    let new = new.collect::<Vec<_>>();
                    inputs.extend(new);
                }
                // An ontology has none.
                BodyDraft::Specification(_) => {}
            }
        }
        relations
    }
}

/// The equation of a procedure, or a structure without members yet.
fn body(node: &Node, place: Place) -> BodyDraft {
    match &node.equation {
        Some(equation) => BodyDraft::Equation(Text { text: equation.clone(), place }),
        None => BodyDraft::Structure { outputs: Vec::new(), inputs: Vec::new() },
    }
}
