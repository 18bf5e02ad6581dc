//! Elements of a translated knowledge base that the core refuses are left out and reported, so that the rest can be used.

use shsa_core::knowledge::{BodyDraft, Draft, Place, Severity, Text, build};
use std::collections::BTreeSet;

use super::formulas::{Candidates, STRUCTURE};
use super::notes::Notes;

/// The element of an error of the core.
#[derive(Clone, Copy)]
enum Mark {
    Relation(usize),
    RelationProperty(usize, usize),
    VariableProperty(usize, usize),
    SignalProperty(usize, usize),
    Rate(usize),
    Need(usize),
}

/// Tries the formulas until the core accepts them; an element that it never accepts is left out.
///
/// Time: a few times that of the construction of the knowledge base.
pub(super) fn settle(draft: &mut Draft, mut candidates: Vec<Candidates>, notes: &mut Notes) {
    let gone = Gone::default();
    let mut settler = Settler { draft, candidates: &mut candidates, notes, gone };
    settler.first_formulas();
    // each round takes away at least one reason of every error; there are at most that many
    for _ in 0..6 {
        let (marked, marks) = marked(settler.draft);
        let errors = build(&marked).1.into_iter().filter(|found| found.severity == Severity::Error);
        let mut found: Vec<(Mark, String)> = errors
            .filter_map(|error| Some((*marks.get(error.place.from as usize)?, error.message)))
            .collect();
        if found.is_empty() {
            return;
        }
        // the last of a list first, so that places stay what they are while elements are removed
        found.reverse();
        found.sort_by_key(|(mark, _)| std::cmp::Reverse(mark.order()));
        found.dedup_by_key(|(mark, _)| mark.order());
        for (mark, message) in found {
            settler.leave_out(mark, &message);
        }
        settler.sweep();
    }
}

impl Mark {
    fn order(self) -> (u8, usize, usize) {
        match self {
            Mark::Relation(at) => (0, at, usize::MAX),
            Mark::RelationProperty(at, property) => (0, at, property),
            Mark::VariableProperty(at, property) => (1, at, property),
            Mark::SignalProperty(at, property) => (2, at, property),
            Mark::Rate(at) => (3, at, 0),
            Mark::Need(at) => (4, at, 0),
        }
    }
}

/// A copy whose places identify the elements.
fn marked(draft: &Draft) -> (Draft, Vec<Mark>) {
    let mut marks = Vec::new();
    let mut marked = draft.clone();
    let mut put = |mark: Mark, texts: &mut dyn Iterator<Item = &mut Text>| {
        let at = u32::try_from(marks.len()).unwrap_or(u32::MAX);
        marks.push(mark);
        texts.for_each(|text| text.place = Place { from: at, to: at });
    };
    for (at, relation) in marked.relations.iter_mut().enumerate() {
        let body: Vec<&mut Text> = match &mut relation.body {
            BodyDraft::Equation(text) => vec![text],
            BodyDraft::Structure { outputs, inputs } => outputs.iter_mut().chain(inputs).collect(),
            BodyDraft::Specification(specification) => specification.texts_mut().collect(),
        };
        let wanted = relation.directions.iter_mut().flatten();
        let texts = body.into_iter().chain(wanted).chain(&mut relation.condition);
        put(Mark::Relation(at), &mut texts.chain(std::iter::once(&mut relation.name)));
        for (property, (_, value)) in relation.properties.iter_mut().enumerate() {
            put(Mark::RelationProperty(at, property), &mut std::iter::once(value));
        }
    }
    for (at, variable) in marked.variables.iter_mut().enumerate() {
        for (property, (_, value)) in variable.properties.iter_mut().enumerate() {
            put(Mark::VariableProperty(at, property), &mut std::iter::once(value));
        }
    }
    for (at, signal) in marked.signals.iter_mut().enumerate() {
        for (property, (_, value)) in signal.properties.iter_mut().enumerate() {
            put(Mark::SignalProperty(at, property), &mut std::iter::once(value));
        }
        put(Mark::Rate(at), &mut signal.rate.iter_mut());
    }
    for (at, need) in marked.needs.iter_mut().enumerate() {
        put(Mark::Need(at), &mut std::iter::once(&mut need.variable).chain(&mut need.signal));
    }
    let nobody = Place { from: u32::MAX, to: u32::MAX };
    let names = marked.variables.iter_mut().map(|variable| &mut variable.name);
    let constants = marked.constants.iter_mut().map(|(name, _)| name);
    let signals = marked.signals.iter_mut().map(|signal| &mut signal.name);
    names.chain(constants).chain(signals).for_each(|text| text.place = nobody);
    (marked, marks)
}

struct Settler<'s> {
    draft: &'s mut Draft,
    /// The candidates in the order of the relations of the draft.
    candidates: &'s mut Vec<Candidates>,
    notes: &'s mut Notes,
    gone: Gone,
}

/// The elements to remove after all marks of a round.
#[derive(Default)]
struct Gone {
    relations: BTreeSet<usize>,
    needs: BTreeSet<usize>,
}

impl Settler<'_> {
    fn first_formulas(&mut self) {
        for at in 0..self.draft.relations.len() {
            self.next_formula(at);
        }
    }

    /// Installs the next formula of a relation; returns whether there was one.
    fn next_formula(&mut self, at: usize) -> bool {
        let (Some(relation), Some(candidates)) =
            (self.draft.relations.get_mut(at), self.candidates.get_mut(at))
        else {
            return false;
        };
        if candidates.equations.is_empty() {
            return false;
        }
        let candidate = candidates.equations.remove(0);
        if let BodyDraft::Structure { outputs, inputs } = &relation.body {
            candidates.structure = Some((outputs.clone(), inputs.clone()));
            relation.directions = Some(outputs.clone());
        }
        relation.body = BodyDraft::Equation(candidate.equation);
        relation.condition = candidate.condition;
        true
    }

    fn leave_out(&mut self, mark: Mark, message: &str) {
        match mark {
            Mark::Relation(at) => self.relation(at, message),
            Mark::RelationProperty(at, property) => {
                let list = self.draft.relations.get_mut(at).map(|relation| &mut relation.properties);
                without(self.notes, list, property, message);
            }
            Mark::VariableProperty(at, property) => {
                let list = self.draft.variables.get_mut(at).map(|variable| &mut variable.properties);
                without(self.notes, list, property, message);
            }
            Mark::SignalProperty(at, property) => {
                let list = self.draft.signals.get_mut(at).map(|signal| &mut signal.properties);
                without(self.notes, list, property, message);
            }
            Mark::Rate(at) => {
                if let Some(rate) = self.draft.signals.get_mut(at).and_then(|signal| signal.rate.take()) {
                    self.notes.warn(&rate, format!("this rate is left out: {message}"), "");
                }
            }
            Mark::Need(at) => self.need(at, message),
        }
    }

    /// A relation loses its formula; a relation without one is left out.
    fn relation(&mut self, at: usize, message: &str) {
        if self.next_formula(at) {
            return;
        }
        let (Some(relation), Some(candidates)) =
            (self.draft.relations.get_mut(at), self.candidates.get_mut(at))
        else {
            return;
        };
        match (candidates.structure.take(), candidates.code.take()) {
            (Some((outputs, inputs)), Some(code)) => {
                relation.body = BodyDraft::Structure { outputs, inputs };
                (relation.directions, relation.condition) = (None, None);
                self.notes.warn(&code, format!("this cannot be taken over: {message}"), STRUCTURE);
            }
            _ => {
                self.notes.warn(&relation.name, format!("this relation is left out: {message}"), "");
                self.gone.relations.insert(at);
            }
        }
    }

    fn sweep(&mut self) {
        let gone = std::mem::take(&mut self.gone);
        keep(&mut self.draft.relations, &gone.relations);
        keep(self.candidates, &gone.relations);
        keep(&mut self.draft.needs, &gone.needs);
    }

    /// A need loses the name under which it is published; a need without one is left out.
    fn need(&mut self, at: usize, message: &str) {
        let Some(need) = self.draft.needs.get_mut(at) else { return };
        let (what, text) = match need.signal.take() {
            Some(signal) => ("this name", signal),
            None => {
                self.gone.needs.insert(at);
                ("this need", need.variable.clone())
            }
        };
        self.notes.warn(&text, format!("{what} is left out: {message}"), "");
    }
}

fn keep<T>(items: &mut Vec<T>, gone: &BTreeSet<usize>) {
    let mut at = 0..;
    items.retain(|_| at.next().is_none_or(|at| !gone.contains(&at)));
}

fn without(notes: &mut Notes, list: Option<&mut Vec<(Text, Text)>>, at: usize, message: &str) {
    if let Some(list) = list.filter(|list| at < list.len()) {
        let (_, value) = list.remove(at);
        notes.warn(&value, format!("this is left out: {message}"), "");
    }
}
