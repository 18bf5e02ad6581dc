//! Temporal specifications of a model file: each becomes the variable of its verdict, and a relation that computes the verdict.

use shsa_core::knowledge::{
    BodyDraft, Draft, RelationDraft, Requirement, SpecificationDraft, Text, VariableDraft,
};
use std::collections::BTreeSet;

use super::keys::SPECIFICATION;
use super::known::Known;
use super::reader::Reader;
use super::tree::{Node, Value};
use super::write::{Tree, keys, properties, text};

/// An example of a section's entry.
pub(super) const EXAMPLE: &str =
    "valve_answers: { when: valve > 50 %, eventually: flow > 1 l/s, within: 2 s }";

/// The drafts that a specification becomes.
pub(super) struct Drafts {
    pub(super) variable: VariableDraft,
    pub(super) relation: RelationDraft,
}

/// Reads a specification; one that requires nothing is reported.
pub(super) fn read(reader: &mut Reader, (name, node): &(Text, Node)) -> Option<Drafts> {
    if let Value::Scalar(condition) = &node.value {
        return Some(drafts(name, None, Requirement::Always(condition.clone(), None), Vec::new()));
    }
    let mut keys = Known::of(reader, node, &SPECIFICATION, "a condition or a specification's keys", EXAMPLE);
    let when = keys.text("when");
    let (always, eventually) = (keys.text("always"), keys.text("eventually"));
    let (span, within) = (keys.text("for"), keys.text("within"));
    let properties = keys.numbers("properties");
    let (message, help) = match (always, eventually, span, within) {
        (Some(always), None, span, None) => {
            return Some(drafts(name, when, Requirement::Always(always, span), properties));
        }
        (None, Some(eventually), None, Some(within)) => {
            return Some(drafts(name, when, Requirement::Eventually(eventually, within), properties));
        }
        (None, Some(_), _, None) => {
            ("does not say within which time", "write `within`, such as `within: 2 s`")
        }
        (Some(_), Some(_), ..) => ("requires two things", "make two specifications of it"),
        (Some(_), None, _, Some(_)) => ("has `within` without `eventually`", "`always` goes with `for`"),
        (None, Some(_), Some(_), _) => ("has `for` without `always`", "`eventually` goes with `within`"),
        (None, None, ..) => ("requires nothing", "give it a condition under `always` or `eventually`"),
    };
    reader.note(name.place, &format!("specification `{}` {message}", name.text), help);
    None
}

fn drafts(name: &Text, when: Option<Text>, what: Requirement, properties: Vec<(Text, Text)>) -> Drafts {
    let bound = |value: &str| Text { text: value.to_owned(), place: name.place };
    let range = Some((bound("0"), bound("1")));
    let variable = VariableDraft { name: name.clone(), range, ..VariableDraft::default() };
    let body = BodyDraft::Specification(Box::new(SpecificationDraft { when, what }));
    Drafts { variable, relation: RelationDraft { properties, ..RelationDraft::new(name.clone(), body) } }
}

/// The names of a draft's specifications, which are those of the variables of their verdicts.
pub(super) fn names(draft: &Draft) -> BTreeSet<&str> {
    let specifications = draft.relations.iter().filter(|relation| of(relation).is_some());
    specifications.map(|relation| relation.name.text.as_str()).collect()
}

/// The specification of a relation that computes a verdict.
pub(super) fn of(relation: &RelationDraft) -> Option<&SpecificationDraft> {
    match &relation.body {
        BodyDraft::Specification(specification) => Some(specification),
        BodyDraft::Equation(_) | BodyDraft::Structure { .. } => None,
    }
}

/// A specification as it is written.
pub(super) fn written(relation: &RelationDraft, specification: &SpecificationDraft) -> Tree {
    let (always, span, eventually, within) = match &specification.what {
        Requirement::Always(always, span) => (Some(always), span.as_ref(), None, None),
        Requirement::Eventually(eventually, within) => (None, None, Some(eventually), Some(within)),
    };
    keys([
        ("when", specification.when.as_ref().map(text)),
        ("always", always.map(text)),
        ("for", span.map(text)),
        ("eventually", eventually.map(text)),
        ("within", within.map(text)),
        ("properties", properties(&relation.properties)),
    ])
}
