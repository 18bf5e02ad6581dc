//! Changes of a model in use: every change is checked like a file, and is made whole or not at all.
//!
//! A [`Model`] keeps the draft that its knowledge base was built from. Edits go into a copy of the draft, which is built again.
//! Only without errors does the new knowledge base replace the old one, with a higher version. Changes of availability and
//! properties need no check against other elements and are made directly.

mod apply;

use super::draft::{
    Bounds, ContractDraft, Diagnostic, Draft, FusionDraft, NeedDraft, PropertyDrafts, RelationDraft,
    Severity, SignalDraft, Text, UtilityDraft, VariableDraft,
};
use super::{Element, Id, KnowledgeBase, SignalId, build};
use crate::unit::nearest;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;

/// A kind of elements that are found by their names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Section {
    /// Physical quantities.
    Variables,
    /// Named values.
    Constants,
    /// Formulas with parameters.
    Functions,
    /// How variables determine each other.
    Relations,
    /// Signals on the bus.
    Signals,
    /// Signals that are computed from others by estimation.
    Fusions,
    /// Variables that must stay available, by name: all needs of a variable; to remove a single need, the name of its
    /// publication.
    Needs,
    /// Platforms that services run on.
    Platform,
    /// Guarantees and demands, by the names of the contracts.
    Contracts,
}

impl Section {
    /// The word for one element of the section.
    #[must_use]
    pub fn singular(self) -> &'static str {
        match self {
            Section::Variables => "variable",
            Section::Constants => "constant",
            Section::Functions => "function",
            Section::Relations => "relation",
            Section::Signals => "signal",
            Section::Fusions => "fusion",
            Section::Needs => "need",
            Section::Platform => "platform",
            Section::Contracts => "contract",
        }
    }
}

/// One change of a model.
#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "edits come a few at a time, and are soon gone")]
pub enum Edit {
    /// Adds a variable, or replaces that of the same name.
    Variable(VariableDraft),
    /// Adds a constant, or replaces that of the same name.
    Constant(Text, Bounds),
    /// Adds a function (its head and its formula), or replaces that of the same name.
    Function(Text, Text),
    /// Adds a relation, or replaces that of the same name.
    Relation(RelationDraft),
    /// Adds a signal, or replaces that of the same name.
    Signal(SignalDraft),
    /// Adds a fusion, or replaces that of the same name.
    Fusion(FusionDraft),
    /// Adds a need, or replaces all needs of its variable.
    Need(NeedDraft),
    /// Adds needs of one variable, or replaces all needs of that variable.
    Needs(Vec<NeedDraft>),
    /// Adds a platform, or replaces that of the same name.
    Platform(ContractDraft),
    /// Adds a contract, or replaces that of the same name.
    Contract(ContractDraft),
    /// Sets how substitutions are rated; `None` restores the default.
    Utility(Option<UtilityDraft>),
    /// Removes the element of this name; an error when there is none.
    Remove(Section, Text),
    /// Sets or removes one property of a variable, relation or signal.
    Property {
        /// The element's section.
        section: Section,
        /// The element's name.
        element: Text,
        /// The property's name.
        name: Text,
        /// The number; `None` removes the property.
        value: Option<Text>,
    },
    /// Allows or forbids the use of a signal.
    Available(Text, bool),
}

/// A model in use: its draft, and the knowledge base built from the draft.
#[derive(Clone, Debug, Default)]
pub struct Model {
    draft: Draft,
    knowledge: KnowledgeBase,
}

impl Model {
    /// Builds a model, and returns its warnings.
    ///
    /// # Errors
    /// All problems, warnings included.
    pub fn new(draft: Draft) -> Result<(Model, Vec<Diagnostic>), Vec<Diagnostic>> {
        let (knowledge, found) = checked(&draft)?;
        Ok((Model { draft, knowledge }, found))
    }

    /// The draft.
    #[must_use]
    pub fn draft(&self) -> &Draft {
        &self.draft
    }

    /// The knowledge base built from the draft.
    #[must_use]
    pub fn knowledge(&self) -> &KnowledgeBase {
        &self.knowledge
    }

    /// Makes these changes, in their order, and returns the warnings about the new model.
    ///
    /// Signals keep their availability. Time: that of [`build()`] on the whole draft.
    ///
    /// # Errors
    /// All problems of the edits, or of the new model; then nothing has changed.
    pub fn edit(&mut self, edits: &[Edit]) -> Result<Vec<Diagnostic>, Vec<Diagnostic>> {
        let mut draft = self.draft.clone();
        let mut problems = draft.apply(edits);
        let (knowledge, found) = build(&draft);
        let mut next = knowledge.available_as(&self.knowledge);
        problems.extend(set_availability(&mut next, edits));
        problems.extend(found);
        if has_errors(&problems) {
            return Err(problems);
        }
        self.take(draft, next);
        Ok(problems)
    }

    /// Replaces the model by another one, and returns its warnings; signals of the same name keep their availability.
    ///
    /// # Errors
    /// All problems of the other model; then nothing has changed.
    pub fn replace(&mut self, draft: Draft) -> Result<Vec<Diagnostic>, Vec<Diagnostic>> {
        let (knowledge, found) = checked(&draft)?;
        let next = knowledge.available_as(&self.knowledge);
        self.take(draft, next);
        Ok(found)
    }

    fn take(&mut self, draft: Draft, next: KnowledgeBase) {
        self.knowledge = next.succeeding(self.knowledge.version());
        self.draft = draft;
    }

    /// Allows or forbids the use of a signal; a change raises the version. Time: O(1).
    pub fn set_available(&mut self, signal: SignalId, available: bool) {
        self.knowledge.set_available(signal, available);
    }

    /// Sets or removes a property; a change raises the version. Time: logarithmic in the element's properties.
    ///
    /// # Errors
    /// The problem of the number, in words; then nothing has changed.
    pub fn set_property(&mut self, element: Element, name: &str, value: Option<f64>) -> Result<(), String> {
        self.knowledge.set_property(element, name, value)?;
        // A knowledge base without errors has left nothing out: its elements have the places of the draft.
        let Some(properties) = properties_at(&mut self.draft, element) else { return Ok(()) };
        let text = |text: String| Text { text, ..Text::default() };
        put_property(properties, &text(name.to_string()), value.map(|value| text(format!("{value}"))));
        Ok(())
    }
}

fn put_property(known: &mut PropertyDrafts, name: &Text, value: Option<Text>) {
    let place = known.iter().position(|(known, _)| known.text == name.text);
    match (place.and_then(|at| known.get_mut(at)), value) {
        (Some(entry), Some(value)) => *entry = (name.clone(), value),
        (Some(_), None) => known.retain(|(known, _)| known.text != name.text),
        (None, Some(value)) => known.push((name.clone(), value)),
        (None, None) => {}
    }
}

fn properties_at(draft: &mut Draft, element: Element) -> Option<&mut PropertyDrafts> {
    match element {
        Element::Variable(id) => draft.variables.get_mut(id.index()).map(|draft| &mut draft.properties),
        Element::Relation(id) => draft.relations.get_mut(id.index()).map(|draft| &mut draft.properties),
        Element::Signal(id) => draft.signals.get_mut(id.index()).map(|draft| &mut draft.properties),
    }
}

/// The name in a function's head.
pub(super) fn function_name(head: &str) -> &str {
    head.split_once('(').map_or(head, |(name, _)| name).trim()
}

fn set_availability(knowledge: &mut KnowledgeBase, edits: &[Edit]) -> Vec<Diagnostic> {
    let mut problems = Vec::new();
    for edit in edits {
        let Edit::Available(name, available) = edit else { continue };
        match knowledge.signal(&name.text) {
            Some(signal) => knowledge.set_available(signal, *available),
            None => {
                let known = knowledge.signals().iter().map(|signal| signal.name.as_str());
                let near = nearest(&name.text, known).map(|near| format!("did you mean `{near}`?"));
                problems.push(error(name, format!("there is no signal `{}`", name.text), near));
            }
        }
    }
    problems
}

fn error(at: &Text, message: String, help: Option<String>) -> Diagnostic {
    Diagnostic { severity: Severity::Error, place: at.place, span: None, message, help }
}

fn checked(draft: &Draft) -> Result<(KnowledgeBase, Vec<Diagnostic>), Vec<Diagnostic>> {
    let (knowledge, found) = build(draft);
    if has_errors(&found) { Err(found) } else { Ok((knowledge, found)) }
}

fn has_errors(found: &[Diagnostic]) -> bool {
    found.iter().any(|found| found.severity == Severity::Error)
}
