//! The statements of a text in Turtle, by subject.

use super::super::notes::Notes;
use super::{OWN, RDFS, SCHEMAS, SOSA, SSN};
use oxrdf::vocab::rdf;
use oxrdf::{NamedOrBlankNode, Term};
use oxttl::TurtleParser;
use shsa_core::knowledge::{Place, Text};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// The most errors of the notation that are reported.
const MOST_ERRORS: usize = 20;
/// The most predicates in the report of what is not read.
const MOST_NAMED: usize = 5;

/// What is said of one subject.
#[derive(Default)]
pub(super) struct Node {
    /// The classes of SOSA and SSN, without their vocabulary.
    pub(super) classes: BTreeSet<String>,
    pub(super) label: Option<String>,
    pub(super) unit: Option<String>,
    pub(super) value: Option<String>,
    pub(super) equation: Option<String>,
    pub(super) shape: Option<String>,
    // Sets, as both directions of a statement may be there: `observes` and `isObservedBy`.
    pub(super) observes: BTreeSet<String>,
    pub(super) hosts: BTreeSet<String>,
    pub(super) inputs: BTreeSet<String>,
    pub(super) outputs: BTreeSet<String>,
}

/// All subjects and objects, by their IRIs.
pub(super) struct Graph<'t> {
    pub(super) nodes: BTreeMap<String, Node>,
    /// How often each predicate occurs that is not read.
    passed: BTreeMap<String, usize>,
    /// Where each word of the text stands first.
    words: HashMap<&'t str, usize>,
}

impl<'t> Graph<'t> {
    /// Reads a text. Errors of the notation are reported with their place, and the rest is read. Time: linear in the text, but for
    /// the order of the names.
    pub(super) fn read(notes: &mut Notes, text: &'t str) -> Graph<'t> {
        let mut graph = Graph { nodes: BTreeMap::new(), passed: BTreeMap::new(), words: words(text) };
        let mut errors = 0;
        for triple in TurtleParser::new().for_slice(text) {
            match triple {
                Ok(triple) => graph.take(&triple.subject, triple.predicate.as_str(), triple.object),
                Err(error) => {
                    let at = usize::try_from(error.location().start.offset).unwrap_or(usize::MAX);
                    notes.error(place(at, at), error.message(), "Turtle: https://www.w3.org/TR/turtle/");
                    errors += 1;
                    if errors == MOST_ERRORS {
                        break;
                    }
                }
            }
        }
        graph.report_passed(notes);
        graph
    }

    fn take(&mut self, subject: &NamedOrBlankNode, predicate: &str, object: Term) {
        let subject = key(subject);
        let (object, is_node) = match object {
            Term::NamedNode(node) => (node.into_string(), true),
            Term::BlankNode(node) => (node.to_string(), true),
            Term::Literal(literal) => (literal.value().to_owned(), false),
        };
        let word = |vocabulary: &str| predicate.strip_prefix(vocabulary).unwrap_or_default();
        let of_schema = SCHEMAS.into_iter().find_map(|it| predicate.strip_prefix(it)).unwrap_or_default();
        let node = self.nodes.entry(subject.clone()).or_default();
        match (word(SOSA), word(SSN), is_node) {
            _ if predicate == rdf::TYPE.as_str() => {
                let class = object.strip_prefix(SOSA).or_else(|| object.strip_prefix(SSN));
                node.classes.extend(class.map(str::to_owned));
            }
            ("observes", _, true) => node.observes.extend([object]),
            ("isObservedBy", _, true) => self.node(object).observes.extend([subject]),
            ("hosts", _, true) => node.hosts.extend([object]),
            ("isHostedBy", _, true) => self.node(object).hosts.extend([subject]),
            (_, "hasInput", true) => node.inputs.extend([object]),
            (_, "hasOutput", true) => node.outputs.extend([object]),
            (.., false) if word(RDFS) == "label" => node.label = Some(object),
            (.., false) if of_schema == "unitText" => node.unit = Some(object),
            (.., false) if of_schema == "value" => node.value = Some(object),
            (.., false) if word(OWN) == "equation" => node.equation = Some(object),
            (.., false) if word(OWN) == "shape" => node.shape = Some(object),
            _ => *self.passed.entry(predicate.to_owned()).or_default() += 1,
        }
    }

    fn node(&mut self, iri: String) -> &mut Node {
        self.nodes.entry(iri).or_default()
    }

    /// The label of an element, or the end of its IRI where it has none, at the first place of that end in the text.
    pub(super) fn name(&self, iri: &str) -> Text {
        let end = iri.rsplit(['/', '#', ':']).find(|part| !part.is_empty()).unwrap_or(iri);
        let from = self.words.get(end).copied().unwrap_or(0);
        let label = self.nodes.get(iri).and_then(|node| node.label.clone());
        Text { text: label.unwrap_or_else(|| end.to_owned()), place: place(from, from + end.len()) }
    }

    /// One warning about all statements that are not read.
    fn report_passed(&self, notes: &mut Notes) {
        let count: usize = self.passed.values().sum();
        if count == 0 {
            return;
        }
        let mut names: Vec<&str> = self.passed.keys().map(String::as_str).take(MOST_NAMED).collect();
        if self.passed.len() > MOST_NAMED {
            names.push("..");
        }
        let statements = format!("{count} statement{}", if count == 1 { "" } else { "s" });
        let message = format!("not taken over: {statements} with {}", names.join(", "));
        let help = "what is read is in `shsa model convert --help`";
        notes.warn(&Text::default(), message, help);
    }
}

fn key(subject: &NamedOrBlankNode) -> String {
    match subject {
        NamedOrBlankNode::NamedNode(node) => node.as_str().to_owned(),
        NamedOrBlankNode::BlankNode(node) => node.to_string(),
    }
}

/// Where each word of a text stands first.
fn words(text: &str) -> HashMap<&str, usize> {
    let mut words = HashMap::new();
    let is_between = |c: char| c.is_whitespace() || "<>\"'/#:;,()[]".contains(c);
    for word in text.split(is_between).filter(|word| !word.is_empty()) {
        let at = word.as_ptr().addr() - text.as_ptr().addr();
        words.entry(word).or_insert(at);
    }
    words
}

fn place(from: usize, to: usize) -> Place {
    let offset = |at: usize| u32::try_from(at).unwrap_or(u32::MAX);
    Place { from: offset(from), to: offset(to) }
}
