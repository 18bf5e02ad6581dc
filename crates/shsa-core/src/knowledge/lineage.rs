//! What of a knowledge base lives on in the one that takes its place: elements are matched by their names.

use super::{Id, IdVec, KnowledgeBase, NeedId, RelationId, SignalId, VariableId};
use alloc::collections::BTreeMap;
use alloc::vec::Vec;

/// Where the elements of an old knowledge base stand in a new one.
#[derive(Clone, Debug)]
pub struct Lineage {
    variables: IdVec<VariableId, Option<VariableId>>,
    relations: IdVec<RelationId, Option<RelationId>>,
    namesakes: IdVec<SignalId, Option<SignalId>>,
    sources: IdVec<SignalId, Option<SignalId>>,
    signals: IdVec<SignalId, Option<SignalId>>,
    needs: IdVec<NeedId, Option<NeedId>>,
}

impl Lineage {
    /// Matches two knowledge bases. Time: O(n log n) in their elements.
    #[must_use]
    pub fn new(old: &KnowledgeBase, new: &KnowledgeBase) -> Lineage {
        let variables = matched(old.variables(), new.variables(), |variable| &variable.name);
        let relations = matched(old.relations(), new.relations(), |relation| &relation.name);
        let namesakes = matched(old.signals(), new.signals(), |signal| &signal.name);
        let same_source =
            |one: SignalId, other: &SignalId| old.signals()[one].source == new.signals()[*other].source;
        let sources = IdVec::filled(old.signals().len(), |id| {
            namesakes[id].filter(|namesake| same_source(id, namesake))
        });
        let mut lineage =
            Lineage { variables, relations, namesakes, sources, signals: IdVec::new(), needs: IdVec::new() };
        lineage.signals = IdVec::filled(old.signals().len(), |id| {
            lineage.sources[id].filter(|&namesake| lineage.reads_alike((old, id), (new, namesake)))
        });
        lineage.needs = lineage.matched_needs(old, new);
        lineage
    }

    /// The variable of the same name.
    #[must_use]
    pub fn variable(&self, old: VariableId) -> Option<VariableId> {
        self.variables.find(old).copied().flatten()
    }

    /// The relation of the same name; it may say something else now.
    #[must_use]
    pub fn relation(&self, old: RelationId) -> Option<RelationId> {
        self.relations.find(old).copied().flatten()
    }

    /// The signal of the same name; it may come from elsewhere now.
    #[must_use]
    pub fn namesake(&self, old: SignalId) -> Option<SignalId> {
        self.namesakes.find(old).copied().flatten()
    }

    /// The signal of the same name from the same source; its values may mean something else now.
    #[must_use]
    pub fn source(&self, old: SignalId) -> Option<SignalId> {
        self.sources.find(old).copied().flatten()
    }

    /// The signal whose observations still mean what they meant: of the same name, source, variable, unit, errors,
    /// delay and possible values. Its rate, timeout, other limits and properties may differ.
    #[must_use]
    pub fn signal(&self, old: SignalId) -> Option<SignalId> {
        self.signals.find(old).copied().flatten()
    }

    /// The need of the same variable, which still has its dimension and shape; the limits may differ.
    #[must_use]
    pub fn need(&self, old: NeedId) -> Option<NeedId> {
        self.needs.find(old).copied().flatten()
    }

    fn reads_alike(&self, old: (&KnowledgeBase, SignalId), new: (&KnowledgeBase, SignalId)) -> bool {
        let ((old, id), (new, namesake)) = (old, new);
        let (one, other) = (&old.signals()[id], &new.signals()[namesake]);
        let (before, after) = (&old.variables()[one.variable], &new.variables()[other.variable]);
        self.variable(one.variable) == Some(other.variable)
            && (before.shape, before.range) == (after.shape, after.range)
            && one.unit == other.unit
            && one.value_error == other.value_error
            && one.time_error == other.time_error
            && one.delay == other.delay
            && one.limits.range == other.limits.range
    }

    /// A variable has one need in a file; of several, those with the same name of publication are the same.
    fn matched_needs(&self, old: &KnowledgeBase, new: &KnowledgeBase) -> IdVec<NeedId, Option<NeedId>> {
        let mut open: BTreeMap<VariableId, Vec<NeedId>> = BTreeMap::new();
        let mut counts: BTreeMap<VariableId, usize> = BTreeMap::new();
        for (id, need) in new.needs().enumerate() {
            open.entry(need.variable).or_default().push(id);
        }
        for need in old.needs() {
            *counts.entry(need.variable).or_default() += 1;
        }
        IdVec::filled(old.needs().len(), |id: NeedId| {
            let need = &old.needs()[id];
            let variable = self.variable(need.variable)?;
            let (before, after) = (&old.variables()[need.variable], &new.variables()[variable]);
            let dimension = |unit: &crate::unit::Unit| unit.dimension;
            if before.shape != after.shape
                || before.unit.as_ref().map(dimension) != after.unit.as_ref().map(dimension)
            {
                return None;
            }
            let candidates = open.get_mut(&variable)?;
            let same_name = |candidate: &NeedId| new.needs()[*candidate].signal == need.signal;
            let is_only = candidates.len() == 1 && counts.get(&need.variable) == Some(&1);
            let at = candidates.iter().position(same_name).or(is_only.then_some(0))?;
            Some(candidates.swap_remove(at))
        })
    }
}

/// For each old element the new one of the same name.
fn matched<I: Id, T>(old: &IdVec<I, T>, new: &IdVec<I, T>, name: impl Fn(&T) -> &str) -> IdVec<I, Option<I>> {
    let names: BTreeMap<&str, I> = new.enumerate().map(|(id, element)| (name(element), id)).collect();
    let mut found = IdVec::new();
    for element in old {
        found.push(names.get(name(element)).copied());
    }
    found
}
