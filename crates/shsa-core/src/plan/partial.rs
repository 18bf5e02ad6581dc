//! A partial substitution, decided breadth first: decisions that can be made and taken back.

use super::choices::{Before, Choice, Choices, Chosen, Load};
use super::utility::Weight;
use crate::knowledge::{IdVec, RelationId, VariableId};
use crate::substitution::Substitution;
use alloc::collections::BTreeSet;
use alloc::sync::Arc;
use alloc::vec::Vec;

/// The state to restore when a decision is taken back.
#[derive(Clone, Debug)]
struct Frame {
    choice: Choice,
    before: Before,
    needed: usize,
    links: usize,
}

/// A variable that needs another, in the list of the needed variable.
#[derive(Clone, Copy, Debug)]
struct Link {
    of: VariableId,
    above: VariableId,
    next: Option<u32>,
}

/// The needed variables, in the order in which they were first needed; the first ones of them are decided.
#[derive(Clone, Debug)]
pub(super) struct Partial<'a> {
    choices: Choices<'a>,
    needed: Vec<VariableId>,
    is_needed: IdVec<VariableId, bool>,
    frames: Vec<Frame>,
    chosen: Chosen,
    load: Load,
    links: Vec<Link>,
    above: IdVec<VariableId, Option<u32>>,
    /// The sorted choices of the variables that were open so far.
    sorted: IdVec<VariableId, Option<Arc<[Choice]>>>,
}

impl<'a> Partial<'a> {
    /// The partial substitution before the first decision. Complexity: O(model).
    pub(super) fn new(choices: Choices<'a>) -> Partial<'a> {
        let count = choices.variables();
        let root = choices.root();
        let mut partial = Partial {
            load: Load::new(choices.scale()),
            choices,
            needed: Vec::from([root]),
            is_needed: IdVec::filled(count, |_| false),
            frames: Vec::new(),
            chosen: IdVec::filled(count, |_| None),
            links: Vec::new(),
            above: IdVec::filled(count, |_| None),
            sorted: IdVec::filled(count, |_| None),
        };
        partial.is_needed[root] = true;
        partial
    }

    /// The needed variables that are not decided.
    pub(super) fn open(&self) -> &[VariableId] {
        self.needed.get(self.frames.len()..).unwrap_or_default()
    }

    /// The number of decisions made.
    pub(super) fn decided(&self) -> usize {
        self.frames.len()
    }

    pub(super) fn weight(&self) -> Weight {
        self.load.weight()
    }

    /// The choices of all open variables, lightest first, without choices that close a cycle; `None` when a variable has none.
    /// Also returns how many of them are not shared with other rounds.
    pub(super) fn round(&mut self) -> Option<(Vec<Arc<[Choice]>>, usize)> {
        let mut own = 0;
        let mut round = Vec::with_capacity(self.open().len());
        for at in self.frames.len()..self.needed.len() {
            let variable = *self.needed.get(at)?;
            let all = self.sorted(variable);
            let choices: Vec<_> =
                all.iter().copied().filter(|&choice| !self.closes_cycle(variable, choice)).collect();
            if choices.is_empty() {
                return None;
            }
            let shared = choices.len() == all.len();
            own += if shared { 0 } else { choices.len() };
            round.push(if shared { all } else { choices.into() });
        }
        Some((round, own))
    }

    /// All choices of a variable, lightest first.
    fn sorted(&mut self, variable: VariableId) -> Arc<[Choice]> {
        let sort = || {
            let mut choices: Vec<_> = self.choices.of(variable).collect();
            choices.sort_by_key(|choice| (choice.least, choice.relation));
            choices.into()
        };
        self.sorted[variable].get_or_insert_with(sort).clone()
    }

    fn closes_cycle(&self, variable: VariableId, choice: Choice) -> bool {
        let opened = self.choices.opened(variable, choice.relation);
        let old: Vec<_> = opened.filter(|&input| self.is_needed[input]).collect();
        // A variable that is needed for the first time closes no cycle.
        !old.is_empty() && self.stands_on(variable, &old)
    }

    /// Whether a variable is needed for one of `others`. Complexity: O(variables above it).
    fn stands_on(&self, variable: VariableId, others: &[VariableId]) -> bool {
        let mut seen = BTreeSet::new();
        let mut stack = Vec::from([variable]);
        while let Some(variable) = stack.pop() {
            let mut link = self.above[variable];
            while let Some(&Link { above, next, .. }) = link.and_then(|at| self.links.get(at as usize)) {
                if others.contains(&above) {
                    return true;
                }
                if seen.insert(above) {
                    stack.push(above);
                }
                link = next;
            }
        }
        false
    }

    /// Decides the next variable, unless that would close a cycle.
    pub(super) fn take(&mut self, choice: Choice) -> bool {
        let Some(&variable) = self.open().first() else { return false };
        if self.closes_cycle(variable, choice) {
            return false;
        }
        let (needed, links) = (self.needed.len(), self.links.len());
        self.frames.push(Frame { choice, before: self.load.add(choice), needed, links });
        self.chosen[variable] = choice.relation;
        for input in self.choices.opened(variable, choice.relation) {
            if !core::mem::replace(&mut self.is_needed[input], true) {
                self.needed.push(input);
            }
            let next = self.above[input].replace(self.links.len() as u32);
            self.links.push(Link { of: input, above: variable, next });
        }
        true
    }

    /// Takes back the decisions after the first `decided` ones.
    pub(super) fn back_to(&mut self, decided: usize) {
        while self.frames.len() > decided
            && let Some(frame) = self.frames.pop()
        {
            for link in self.links.drain(frame.links..).rev() {
                self.above[link.of] = link.next;
            }
            for variable in self.needed.drain(frame.needed..) {
                self.is_needed[variable] = false;
            }
            self.load.take_back(frame.choice, frame.before);
            if let Some(&variable) = self.needed.get(self.frames.len()) {
                self.chosen[variable] = None;
            }
        }
    }

    /// The substitution of complete decisions.
    pub(super) fn substitution(&self) -> Substitution {
        self.choices.substitution(&self.chosen)
    }

    /// The relations of the decisions, ascending, each once, where other outputs of theirs could make another substitution;
    /// `None` otherwise.
    pub(super) fn ambiguous_relations(&self) -> Option<Vec<RelationId>> {
        let relations = || self.frames.iter().filter_map(|frame| frame.choice.relation);
        if !relations().any(|relation| self.choices.has_several_outputs(relation)) {
            return None;
        }
        Some(relations().collect::<BTreeSet<_>>().into_iter().collect())
    }

    /// The relation of each decision, in their order; `None` where a variable is provided.
    pub(super) fn relations(&self) -> impl Iterator<Item = Option<RelationId>> {
        self.frames.iter().map(|frame| frame.choice.relation)
    }
}
