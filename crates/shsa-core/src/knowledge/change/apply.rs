//! Applies edits to a draft, section by section.

use super::{Edit, Section, error, function_name, put_property};
use crate::knowledge::draft::{
    Bounds, ContractDraft, Diagnostic, Draft, FusionDraft, NeedDraft, PropertyDrafts, RelationDraft,
    SignalDraft, Text, UtilityDraft, VariableDraft,
};
use crate::unit::nearest;
use alloc::collections::BTreeMap;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;

impl Draft {
    /// Makes these changes, in their order, without checking their meaning; a replaced element keeps its place. Returns an error
    /// for each unknown name. Availability is not part of drafts.
    ///
    /// Time: O(n log n) in the changed sections.
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
        work.section(Section::Fusions, &mut self.fusions, changes.fusions, |it| &it.name.text, |_| None);
        work.needs(&mut self.needs, changes.needs);
        fn name(it: &ContractDraft) -> &str {
            &it.name.text
        }
        work.section(Section::Platform, &mut self.platform, changes.platform, name, |_| None);
        work.section(Section::Contracts, &mut self.contracts, changes.contracts, name, |_| None);
        if let Some(utility) = changes.utility {
            self.utility = utility.cloned();
        }
        problems
    }
}

/// A change of one element.
enum Change<'e, T> {
    Put(T),
    Remove,
    Property(&'e Text, Option<&'e Text>),
}

/// The changes of one section, each with the name of its element.
type Named<'e, T> = Vec<(&'e Text, Change<'e, T>)>;

/// Edits by section: changes in one section do not affect another.
#[derive(Default)]
struct Changes<'e> {
    variables: Named<'e, VariableDraft>,
    constants: Named<'e, (Text, Bounds)>,
    functions: Named<'e, (Text, Text)>,
    relations: Named<'e, RelationDraft>,
    signals: Named<'e, SignalDraft>,
    fusions: Named<'e, FusionDraft>,
    needs: Named<'e, Vec<NeedDraft>>,
    platform: Named<'e, ContractDraft>,
    contracts: Named<'e, ContractDraft>,
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
            Edit::Fusion(draft) => self.fusions.push((&draft.name, Change::Put(draft.clone()))),
            Edit::Need(draft) => self.needs.push((&draft.variable, Change::Put(Vec::from([draft.clone()])))),
            Edit::Needs(drafts) => {
                let first = drafts.first().map(|draft| (&draft.variable, Change::Put(drafts.clone())));
                self.needs.extend(first);
            }
            Edit::Platform(draft) => self.platform.push((&draft.name, Change::Put(draft.clone()))),
            Edit::Contract(draft) => self.contracts.push((&draft.name, Change::Put(draft.clone()))),
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
            Section::Fusions => self.fusions.push((name, Change::Remove)),
            Section::Needs => self.needs.push((name, Change::Remove)),
            Section::Platform => self.platform.push((name, Change::Remove)),
            Section::Contracts => self.contracts.push((name, Change::Remove)),
        }
    }

    fn property(&mut self, section: Section, element: &'e Text, name: &'e Text, value: Option<&'e Text>) {
        match section {
            Section::Variables => self.variables.push((element, Change::Property(name, value))),
            Section::Constants => self.constants.push((element, Change::Property(name, value))),
            Section::Functions => self.functions.push((element, Change::Property(name, value))),
            Section::Relations => self.relations.push((element, Change::Property(name, value))),
            Section::Signals => self.signals.push((element, Change::Property(name, value))),
            Section::Fusions => self.fusions.push((element, Change::Property(name, value))),
            Section::Needs => self.needs.push((element, Change::Property(name, value))),
            Section::Platform => self.platform.push((element, Change::Property(name, value))),
            Section::Contracts => self.contracts.push((element, Change::Property(name, value))),
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

    /// The needs of a variable are one element: they are added and replaced together.
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
