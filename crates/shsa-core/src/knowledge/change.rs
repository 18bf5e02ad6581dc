//! A model that is changed while it is in use: every change is checked like a file, and is made whole or not at all.
//!
//! A [`Model`] keeps the draft that its knowledge base was built from. Edits go into a copy of the draft, which is
//! built again; only without errors does the new knowledge base take the place of the old one, with a higher version. What
//! needs no check against other elements goes straight in: availability and properties.

use super::draft::{
    Bounds, Diagnostic, Draft, NeedDraft, PropertyDrafts, RelationDraft, Severity, SignalDraft, Text,
    UtilityDraft, VariableDraft,
};
use super::{Element, Id, KnowledgeBase, SignalId, build};
use crate::unit::nearest;
use alloc::collections::BTreeMap;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;

/// A kind of elements that are found by their names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Section {
    /// Physical quantities.
    Variables,
    /// Names with a value.
    Constants,
    /// Formulas with parameters.
    Functions,
    /// How variables determine each other.
    Relations,
    /// What carries variables.
    Signals,
    /// What must stay available, by the names of the variables: all needs of one; or, to be removed, by the name under which
    /// one is published.
    Needs,
}

impl Section {
    /// What one element of it is called.
    #[must_use]
    pub fn singular(self) -> &'static str {
        match self {
            Section::Variables => "variable",
            Section::Constants => "constant",
            Section::Functions => "function",
            Section::Relations => "relation",
            Section::Signals => "signal",
            Section::Needs => "need",
        }
    }
}

/// One change of a model.
#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "edits come a few at a time, and are soon gone")]
pub enum Edit {
    /// Adds a variable, or replaces the one of its name.
    Variable(VariableDraft),
    /// Adds a constant, or replaces the one of its name.
    Constant(Text, Bounds),
    /// Adds a function (its head and its formula), or replaces the one of its name.
    Function(Text, Text),
    /// Adds a relation, or replaces the one of its name.
    Relation(RelationDraft),
    /// Adds a signal, or replaces the one of its name.
    Signal(SignalDraft),
    /// Adds a need, or replaces all of its variable.
    Need(NeedDraft),
    /// Adds needs, all of one variable, or replaces all that it has.
    Needs(Vec<NeedDraft>),
    /// Rates substitutions otherwise; as usual when `None`.
    Utility(Option<UtilityDraft>),
    /// Removes the element of this name; an error when there is none.
    Remove(Section, Text),
    /// Sets one property of a variable, relation or signal, or takes it away.
    Property {
        /// Where the element is.
        section: Section,
        /// Its name.
        element: Text,
        /// Of the property.
        name: Text,
        /// A number; none takes the property away.
        value: Option<Text>,
    },
    /// Allows or forbids the use of a signal.
    Available(Text, bool),
}

/// A model in use: the draft is what it says, the knowledge base what was built from it.
#[derive(Clone, Debug, Default)]
pub struct Model {
    draft: Draft,
    knowledge: KnowledgeBase,
}

impl Model {
    /// Builds a model, and gives its warnings.
    ///
    /// # Errors
    /// Everything that is wrong, warnings included.
    pub fn new(draft: Draft) -> Result<(Model, Vec<Diagnostic>), Vec<Diagnostic>> {
        let (knowledge, found) = checked(&draft)?;
        Ok((Model { draft, knowledge }, found))
    }

    /// What it says.
    #[must_use]
    pub fn draft(&self) -> &Draft {
        &self.draft
    }

    /// What was built from it.
    #[must_use]
    pub fn knowledge(&self) -> &KnowledgeBase {
        &self.knowledge
    }

    /// Makes all of these changes, in their order, and gives the warnings about the model as it is then.
    ///
    /// Signals that stay stay as available as they were. Time: that of [`build()`] on the whole draft.
    ///
    /// # Errors
    /// Everything that is wrong with the edits, or with the model as it were then; nothing has changed then.
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

    /// Takes another model over, and gives its warnings; signals of the same name stay as available as they were.
    ///
    /// # Errors
    /// Everything that is wrong with it; nothing has changed then.
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

    /// Allows or forbids the use of a signal; the version changes when this does. Time: O(1).
    pub fn set_available(&mut self, signal: SignalId, available: bool) {
        self.knowledge.set_available(signal, available);
    }

    /// Sets a property, or takes it away; the version changes when this does. Time: logarithmic in the element's properties.
    ///
    /// # Errors
    /// What is wrong with the number, in words; nothing has changed then.
    pub fn set_property(&mut self, element: Element, name: &str, value: Option<f64>) -> Result<(), String> {
        self.knowledge.set_property(element, name, value)?;
        // A knowledge base without errors has left nothing out: its elements stand where they stand in the draft.
        let Some(properties) = properties_at(&mut self.draft, element) else { return Ok(()) };
        let text = |text: String| Text { text, ..Text::default() };
        put_property(properties, &text(name.to_string()), value.map(|value| text(format!("{value}"))));
        Ok(())
    }
}

impl Draft {
    /// Makes these changes, in their order, without looking at what they mean; what is replaced keeps its place. Gives an
    /// error for each name that there is not. Availability is no matter of drafts.
    ///
    /// Time: O(n log n) in the sections that are changed.
    pub fn apply(&mut self, edits: &[Edit]) -> Vec<Diagnostic> {
        let mut changes = Changes::default();
        edits.iter().for_each(|edit| changes.sort(edit));
        let mut problems = Vec::new();
        let mut work = Work { problems: &mut problems };
        let no_properties: fn(&mut (Text, Bounds)) -> Option<&mut PropertyDrafts> = |_| None;
        work.section(
            Section::Variables,
            &mut self.variables,
            changes.variables,
            |it| &it.name.text,
            |it| Some(&mut it.properties),
        );
        work.section(
            Section::Constants,
            &mut self.constants,
            changes.constants,
            |it| &it.0.text,
            no_properties,
        );
        work.section(
            Section::Functions,
            &mut self.functions,
            changes.functions,
            |it| function_name(&it.0.text),
            |_| None,
        );
        work.section(
            Section::Relations,
            &mut self.relations,
            changes.relations,
            |it| &it.name.text,
            |it| Some(&mut it.properties),
        );
        work.section(
            Section::Signals,
            &mut self.signals,
            changes.signals,
            |it| &it.name.text,
            |it| Some(&mut it.properties),
        );
        work.needs(&mut self.needs, changes.needs);
        if let Some(utility) = changes.utility {
            self.utility = utility.cloned();
        }
        problems
    }
}

/// What happens to one element.
enum Change<'e, T> {
    Put(T),
    Remove,
    Property(&'e Text, Option<&'e Text>),
}

/// The changes of one section, each with the name that it is about.
type Named<'e, T> = Vec<(&'e Text, Change<'e, T>)>;

/// Edits by section: what happens in one has no influence on another.
#[derive(Default)]
struct Changes<'e> {
    variables: Named<'e, VariableDraft>,
    constants: Named<'e, (Text, Bounds)>,
    functions: Named<'e, (Text, Text)>,
    relations: Named<'e, RelationDraft>,
    signals: Named<'e, SignalDraft>,
    needs: Named<'e, Vec<NeedDraft>>,
    utility: Option<Option<&'e UtilityDraft>>,
}

impl<'e> Changes<'e> {
    fn sort(&mut self, edit: &'e Edit) {
        match edit {
            Edit::Variable(draft) => self.variables.push((&draft.name, Change::Put(draft.clone()))),
            Edit::Constant(name, bounds) => {
                self.constants.push((name, Change::Put((name.clone(), bounds.clone()))));
            }
            Edit::Function(head, body) => {
                self.functions.push((head, Change::Put((head.clone(), body.clone()))));
            }
            Edit::Relation(draft) => self.relations.push((&draft.name, Change::Put(draft.clone()))),
            Edit::Signal(draft) => self.signals.push((&draft.name, Change::Put(draft.clone()))),
            Edit::Need(draft) => self.needs.push((&draft.variable, Change::Put(Vec::from([draft.clone()])))),
            Edit::Needs(drafts) => {
                let first = drafts.first().map(|draft| (&draft.variable, Change::Put(drafts.clone())));
                self.needs.extend(first);
            }
            Edit::Utility(utility) => self.utility = Some(utility.as_ref()),
            Edit::Remove(section, name) => self.remove(*section, name),
            Edit::Property { section, element, name, value } => {
                self.property(*section, element, name, value.as_ref());
            }
            Edit::Available(..) => {}
        }
    }

    fn remove(&mut self, section: Section, name: &'e Text) {
        match section {
            Section::Variables => self.variables.push((name, Change::Remove)),
            Section::Constants => self.constants.push((name, Change::Remove)),
            Section::Functions => self.functions.push((name, Change::Remove)),
            Section::Relations => self.relations.push((name, Change::Remove)),
            Section::Signals => self.signals.push((name, Change::Remove)),
            Section::Needs => self.needs.push((name, Change::Remove)),
        }
    }

    fn property(&mut self, section: Section, element: &'e Text, name: &'e Text, value: Option<&'e Text>) {
        match section {
            Section::Variables => self.variables.push((element, Change::Property(name, value))),
            Section::Constants => self.constants.push((element, Change::Property(name, value))),
            Section::Functions => self.functions.push((element, Change::Property(name, value))),
            Section::Relations => self.relations.push((element, Change::Property(name, value))),
            Section::Signals => self.signals.push((element, Change::Property(name, value))),
            Section::Needs => self.needs.push((element, Change::Property(name, value))),
        }
    }
}

struct Work<'p> {
    problems: &'p mut Vec<Diagnostic>,
}

impl Work<'_> {
    fn section<T>(
        &mut self,
        section: Section,
        list: &mut Vec<T>,
        changes: Named<'_, T>,
        name: impl Fn(&T) -> &str,
        properties: impl Fn(&mut T) -> Option<&mut PropertyDrafts>,
    ) {
        if changes.is_empty() {
            return;
        }
        let mut places: BTreeMap<String, usize> = BTreeMap::new();
        for (at, element) in list.iter().enumerate() {
            places.entry(name(element).to_string()).or_insert(at);
        }
        let mut slots: Vec<Option<T>> = core::mem::take(list).into_iter().map(Some).collect();
        for (about, change) in changes {
            let key = if section == Section::Functions { function_name(&about.text) } else { &about.text };
            let Some(&place) = places.get(key) else {
                match change {
                    Change::Put(element) => {
                        places.insert(key.to_string(), slots.len());
                        slots.push(Some(element));
                    }
                    _ => self.unknown(section, about, places.keys().map(String::as_str)),
                }
                continue;
            };
            let Some(slot) = slots.get_mut(place) else { continue };
            match change {
                Change::Put(element) => *slot = Some(element),
                Change::Remove => {
                    *slot = None;
                    places.remove(key);
                }
                Change::Property(name, value) => match slot.as_mut().and_then(&properties) {
                    Some(known) => self.property(known, name, value),
                    None => self.error(name, format!("a {} has no properties", section.singular()), None),
                },
            }
        }
        *list = slots.into_iter().flatten().collect();
    }

    /// A variable's needs are one element: they are given together, and replaced together.
    fn needs(&mut self, list: &mut Vec<NeedDraft>, changes: Named<'_, Vec<NeedDraft>>) {
        for (about, change) in changes {
            let is_of = |need: &NeedDraft| need.variable.text == about.text;
            let is_named =
                |need: &NeedDraft| need.signal.as_ref().is_some_and(|name| name.text == about.text);
            match change {
                Change::Put(needs) => {
                    let at = list.iter().position(is_of).unwrap_or(list.len());
                    list.retain(|need| !is_of(need));
                    list.splice(at..at, needs);
                }
                Change::Remove if list.iter().any(is_of) => list.retain(|need| !is_of(need)),
                Change::Remove if list.iter().any(is_named) => list.retain(|need| !is_named(need)),
                Change::Property(name, _) if list.iter().any(is_of) => {
                    self.error(name, "a need has no properties".to_string(), None);
                }
                _ => {
                    let names = list.iter().map(|need| need.variable.text.as_str());
                    let near = nearest(&about.text, names).map(|near| format!("did you mean `{near}`?"));
                    self.error(about, format!("there is no need `{}` to change", about.text), near);
                }
            }
        }
    }

    fn property(&mut self, known: &mut PropertyDrafts, name: &Text, value: Option<&Text>) {
        let is_known = known.iter().any(|(known, _)| known.text == name.text);
        if value.is_none() && !is_known {
            let help = nearest(&name.text, known.iter().map(|(known, _)| known.text.as_str()));
            let help = help.map(|near| format!("did you mean `{near}`?"));
            return self.error(name, format!("there is no property `{}` to remove", name.text), help);
        }
        put_property(known, name, value.cloned());
    }

    fn unknown<'a>(&mut self, section: Section, name: &Text, known: impl Iterator<Item = &'a str>) {
        let near = nearest(&name.text, known).map(|near| format!("did you mean `{near}`?"));
        self.error(name, format!("there is no {} `{}` to change", section.singular(), name.text), near);
    }

    fn error(&mut self, at: &Text, message: String, help: Option<String>) {
        self.problems.push(error(at, message, help));
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
