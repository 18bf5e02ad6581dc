//! Plans for every failure, prepared in advance: the substitute is known before the failure.
//!
//! A search from a variable reads only what it can reach without passing a provided variable. So the loss of a signal changes the
//! plan only where the search reads the signal's variable, and a set of lost signals is reduced to those signals: two failures of
//! which one does not concern the variable count as one. A search may read a lost signal that the best plan does not use, and
//! even an unused signal can change the utility of relations that could use it. So every entry has a search of its own, and
//! equals a new search.
//!
//! A table lists for each variable which elements its searches have read. When a number or the availability of a signal changes
//! there, the plans of this variable are made again, and no others. After a change of structure, the plans of variables are
//! carried over where nothing that was read has changed.

mod derivation;
mod reach;
mod prepare;
mod job;
mod carry;

pub use prepare::Preparation;

use super::best_first::BestFirst;
use super::graph::{Graph, Options};
use super::{Plan, Requirements};
use crate::knowledge::{Element, Id, IdVec, KnowledgeBase, Lineage, SignalId, VariableId};
use alloc::borrow::Cow;
use alloc::collections::BTreeSet;
use alloc::vec::Vec;
use carry::Succession;
use derivation::Derivations;
use job::{Inputs, Workshop};
use prepare::{Prepared, without};

/// The best plans of some variables after each loss; of no variables by default.
#[derive(Clone, Debug, Default)]
pub struct Contingency {
    preparation: Preparation,
    /// The options, without elements that fall short of the requirements on their own.
    options: Options,
    version: u64,
    /// Whether the utility allows searches.
    monotone: bool,
    prepared: Vec<Prepared>,
    /// The place of the plans of each variable.
    slots: IdVec<VariableId, Option<u32>>,
    /// The variables whose plans depend on a variable: `(read, prepared)`.
    readers: BTreeSet<(VariableId, VariableId)>,
    derivations: Derivations,
    workshop: Workshop,
    searches: u64,
}

impl Contingency {
    /// Makes the plans of `variables`, in this order; each counts once. Variables for which [`Preparation::work`] is not enough
    /// are left out, and so are losses for which [`Preparation::work_each`] is not.
    ///
    /// Complexity: one search for each variable and each signal (with [`Preparation::pairs`]: each pair) that it
    /// depends on.
    #[must_use]
    pub fn new(
        knowledge: &KnowledgeBase,
        graph: &Graph,
        variables: impl IntoIterator<Item = VariableId>,
        preparation: Preparation,
    ) -> Contingency {
        let mut table = Contingency::empty(knowledge, graph, preparation);
        table.fill(knowledge, graph, variables, |_| None);
        table
    }

    /// The table of `variables` after a change of structure, from the table of the knowledge base before, whose graph was
    /// `before`. It equals that of [`Contingency::new`], but makes only the plans that the change may affect (with requirements,
    /// all); [`Contingency::searches`] continues.
    ///
    /// Complexity: O(model), O(table) when ids have changed, and that of [`Contingency::new`] for the new plans.
    #[must_use]
    pub fn carried_over(
        self,
        before: &Graph,
        lineage: &Lineage,
        knowledge: &KnowledgeBase,
        graph: &Graph,
        variables: impl IntoIterator<Item = VariableId>,
    ) -> Contingency {
        // Requirements read more than the graph, which is all that is compared.
        let is_asked = self.preparation.requirements != Requirements::default();
        let is_current = self.version == before.version() && !is_asked;
        let mut table = Contingency::empty(knowledge, graph, self.preparation.succeeded(lineage));
        table.searches = self.searches;
        let succession = Succession::new((before, &self.derivations), (graph, &table.derivations), lineage);
        let mut carried: Vec<Option<Prepared>> =
            self.prepared.into_iter().map(|old| succession.carried(old).filter(|_| is_current)).collect();
        let mut slots = IdVec::filled(graph.variables(), |_| None);
        for (variable, slot) in self.slots.enumerate() {
            lineage.variable(variable).into_iter().for_each(|namesake| slots[namesake] = *slot);
        }
        table
            .fill(knowledge, graph, variables, |variable| carried.get_mut(slots[variable]? as usize)?.take());
        table
    }

    fn empty(knowledge: &KnowledgeBase, graph: &Graph, preparation: Preparation) -> Contingency {
        Contingency {
            options: preparation.requirements.narrowed(knowledge, &preparation.options),
            preparation,
            version: graph.version(),
            monotone: graph.is_monotone(),
            prepared: Vec::new(),
            slots: IdVec::filled(graph.variables(), |_| None),
            readers: BTreeSet::new(),
            derivations: Derivations::new(knowledge),
            workshop: Workshop::default(),
            searches: 0,
        }
    }

    /// Takes the known plans of each variable where their work is allowed, and makes the others.
    fn fill(
        &mut self,
        knowledge: &KnowledgeBase,
        graph: &Graph,
        variables: impl IntoIterator<Item = VariableId>,
        mut known: impl FnMut(VariableId) -> Option<Prepared>,
    ) {
        let mut left = self.preparation.work;
        for variable in variables {
            if left == 0 {
                break;
            }
            if self.slots.find(variable) != Some(&None) {
                continue;
            }
            let most = left.min(self.preparation.work_each);
            let (prepared, work) = match known(variable).filter(|known| known.work <= most) {
                Some(known) => {
                    let work = known.work;
                    (Some(known), work)
                }
                None => self.make(knowledge, graph, variable, left),
            };
            left = left.saturating_sub(work);
            if let Some(prepared) = prepared {
                self.slots[variable] = Some(self.prepared.len() as u32);
                self.prepared.push(prepared);
            }
        }
        let slots = self.slots.enumerate();
        let known =
            slots.filter_map(|(variable, slot)| Some((variable, self.prepared.get((*slot)? as usize)?)));
        self.readers = known
            .flat_map(|(variable, known)| known.reads.iter().map(move |&read| (read, variable)))
            .collect();
    }

    /// The version of the knowledge base of the table.
    #[must_use]
    pub fn version(&self) -> u64 {
        self.version
    }

    /// The preparation that the table was made for.
    #[must_use]
    pub fn preparation(&self) -> &Preparation {
        &self.preparation
    }

    /// The variables of the table, ascending.
    pub fn variables(&self) -> impl Iterator<Item = VariableId> + '_ {
        self.slots.enumerate().filter(|(_, slot)| slot.is_some()).map(|(variable, _)| variable)
    }

    fn prepared(&self, variable: VariableId) -> Option<&Prepared> {
        self.prepared.get((*self.slots.find(variable)?)? as usize)
    }

    /// The number of searches since the beginning.
    #[must_use]
    pub fn searches(&self) -> u64 {
        self.searches
    }

    /// Whether the table has all requested losses of a variable; other losses need a search.
    #[must_use]
    pub fn is_complete(&self, variable: VariableId) -> bool {
        self.prepared(variable).is_some_and(|prepared| prepared.complete)
    }

    /// These signals and all signals derived from them, which are lost with them, ascending.
    #[must_use]
    pub fn with_derived(&self, lost: &[SignalId]) -> Vec<SignalId> {
        self.derivations.with_derived(lost)
    }

    /// The signals whose loss, with all that are derived from them, can change the plan of a variable, ascending.
    #[must_use]
    pub fn events(&self, variable: VariableId) -> &[SignalId] {
        self.prepared(variable).map_or(&[], |prepared| &prepared.events)
    }

    /// The signals that matter after a loss and do not with nothing lost, ascending.
    #[must_use]
    pub fn then_matter(&self, variable: VariableId, lost: &[SignalId]) -> &[SignalId] {
        let entry = self.prepared(variable).and_then(|prepared| prepared.project(lost));
        entry.filter(|entry| !entry.lost.is_empty()).map_or(&[], |entry| &entry.matters)
    }

    /// Of some lost signals, in any order, those that can change the plan of `variable`, ascending; `None` when the table has no
    /// such loss. Complexity: O(lost times log of the table).
    #[must_use]
    pub fn loss(&self, variable: VariableId, lost: &[SignalId]) -> Option<&[SignalId]> {
        self.prepared(variable)?.project(lost).map(|entry| entry.lost.as_slice())
    }

    /// The plan of a variable without some lost signals, in any order; `None` when the table does not have it.
    ///
    /// The plan is that of [`best`](super::best) with the lost signals forbidden. Complexity: O(lost times log of the table).
    #[must_use]
    pub fn plan(&self, variable: VariableId, lost: &[SignalId]) -> Option<&Plan> {
        let prepared = self.prepared(variable)?;
        prepared.plan(prepared.project(lost)?)
    }

    /// The plan of the table; a search where the table has none, or is of another version than the graph.
    #[must_use]
    pub fn plan_or_search(
        &self,
        knowledge: &KnowledgeBase,
        graph: &Graph,
        variable: VariableId,
        lost: &[SignalId],
    ) -> Cow<'_, Plan> {
        let known = self.plan(variable, lost).filter(|_| self.version == graph.version());
        known.map_or_else(|| Cow::Owned(self.search(knowledge, graph, variable, lost)), Cow::Borrowed)
    }

    fn search(
        &self,
        knowledge: &KnowledgeBase,
        graph: &Graph,
        variable: VariableId,
        lost: &[SignalId],
    ) -> Plan {
        let Preparation { count, limits, options, requirements, .. } = &self.preparation;
        let options = without(options, lost);
        Plan::of(&mut BestFirst::meeting(knowledge, graph, variable, &options, requirements, *limits), *count)
    }

    /// The plans of a variable by the lost signals, with nothing lost first. Signals whose loss changes nothing are not listed.
    pub fn losses(&self, variable: VariableId) -> impl Iterator<Item = (&[SignalId], &Plan)> + '_ {
        let prepared = self.prepared(variable);
        prepared
            .into_iter()
            .flat_map(|p| p.entries.iter().filter_map(|e| Some((e.lost.as_slice(), p.plan(e)?))))
    }

    /// Makes the plans again that the `changed` elements may affect, after [`Graph::update`]; returns their variables, ascending.
    /// After a change of structure see [`Contingency::new`].
    pub fn update(
        &mut self,
        knowledge: &KnowledgeBase,
        graph: &Graph,
        changed: &[Element],
    ) -> Vec<VariableId> {
        let mut affected = BTreeSet::new();
        for &element in changed {
            match element {
                Element::Variable(variable) => affected.extend(self.readers_of(variable)),
                Element::Signal(signal) => {
                    let carried = graph.carried(signal);
                    affected.extend(carried.into_iter().flat_map(|variable| self.readers_of(variable)));
                }
                Element::Relation(relation) => {
                    let outputs = knowledge.relations().find(relation).into_iter().flat_map(|r| &r.outputs);
                    affected.extend(outputs.flat_map(|&output| self.readers_of(output)));
                }
            }
        }
        let options = self.preparation.requirements.narrowed(knowledge, &self.preparation.options);
        if self.monotone != graph.is_monotone() || self.options != options {
            self.options = options;
            affected.extend(self.variables());
        }
        for &variable in &affected {
            self.renew(knowledge, graph, variable);
        }
        self.monotone = graph.is_monotone();
        self.version = graph.version();
        affected.into_iter().collect()
    }

    fn readers_of(&self, variable: VariableId) -> impl Iterator<Item = VariableId> + '_ {
        let all = |of: VariableId| (of, VariableId::from_index(0))..=(of, VariableId::from_index(usize::MAX));
        self.readers.range(all(variable)).map(|&(_, prepared)| prepared)
    }

    /// The plans of one variable, and the work they took.
    fn make(
        &mut self,
        knowledge: &KnowledgeBase,
        graph: &Graph,
        variable: VariableId,
        work: u64,
    ) -> (Option<Prepared>, u64) {
        let Contingency { derivations, preparation, options, workshop, .. } = self;
        let inputs = Inputs { knowledge, graph, derivations, preparation, options };
        let made = workshop.prepare(inputs, variable, work);
        self.searches += made.0.as_ref().map_or(0, |made| made.plans.len() as u64);
        made
    }

    /// Makes the plans of a variable of the table again.
    fn renew(&mut self, knowledge: &KnowledgeBase, graph: &Graph, variable: VariableId) {
        let (new, _) = self.make(knowledge, graph, variable, u64::MAX);
        let slot = self.slots.find(variable).copied().flatten();
        let Some(old) = slot.and_then(|slot| self.prepared.get_mut(slot as usize)) else { return };
        match new {
            Some(new) => {
                difference(&old.reads, &new.reads)
                    .for_each(|read| _ = self.readers.remove(&(read, variable)));
                difference(&new.reads, &old.reads).for_each(|read| _ = self.readers.insert((read, variable)));
                *old = new;
            }
            // The read variables are kept: when they change back, the work may be enough again.
            None => *old = Prepared { reads: core::mem::take(&mut old.reads), ..Prepared::default() },
        }
    }
}

/// The elements of one ascending list that are not in another.
fn difference(of: &[VariableId], without: &[VariableId]) -> impl Iterator<Item = VariableId> {
    of.iter().copied().filter(|item| without.binary_search(item).is_err())
}
