//! Maps the elements of a knowledge base to those of its successor, by name.

use super::{Id, IdVec, KnowledgeBase, NeedId, RelationId, SignalId, VariableId};
use alloc::collections::BTreeMap;
use alloc::vec::Vec;

/// The places of the elements of an old knowledge base in a new one.
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
        lineage.signals = IdVec::filled(old.signals().len(), |id| lineage.unchanged(old, new, id));
        lineage.needs = lineage.matched_needs(old, new);
        lineage
    }

    /// The variable of the same name.
    #[must_use]
    pub fn variable(&self, old: VariableId) -> Option<VariableId> {
        self.variables.find(old).copied().flatten()
    }

    /// The relation of the same name; its content may differ.
    #[must_use]
    pub fn relation(&self, old: RelationId) -> Option<RelationId> {
        self.relations.find(old).copied().flatten()
    }

    /// The signal of the same name; its source may differ.
    #[must_use]
    pub fn namesake(&self, old: SignalId) -> Option<SignalId> {
        self.namesakes.find(old).copied().flatten()
    }

    /// The signal of the same name and source; the meaning of its values may differ.
    #[must_use]
    pub fn source(&self, old: SignalId) -> Option<SignalId> {
        self.sources.find(old).copied().flatten()
    }

    /// The signal whose observations have the same meaning as before: of the same name, source, variable, unit, scaling,
    /// errors, delay and possible values, standing as long. Its rate, timeout, other limits and properties may differ.
    #[must_use]
    pub fn signal(&self, old: SignalId) -> Option<SignalId> {
        self.signals.find(old).copied().flatten()
    }

    /// The need of the same variable with the same dimension and shape; the limits may differ.
    #[must_use]
    pub fn need(&self, old: NeedId) -> Option<NeedId> {
        self.needs.find(old).copied().flatten()
    }

    /// Whether every remaining variable, relation and signal keeps its id.
    #[must_use]
    pub fn keeps_ids(&self) -> bool {
        keep(&self.variables) && keep(&self.relations) && keep(&self.namesakes)
    }

    /// The signal of the same name and source, if its observations still mean what they meant.
    fn unchanged(&self, old: &KnowledgeBase, new: &KnowledgeBase, id: SignalId) -> Option<SignalId> {
        let namesake = self.sources[id]?;
        let (one, other) = (&old.signals()[id], &new.signals()[namesake]);
        let (before, after) = (&old.variables()[one.variable], &new.variables()[other.variable]);
        let is_unchanged = self.variable(one.variable) == Some(other.variable)
            && (before.shape, before.range, before.wraps) == (after.shape, after.range, after.wraps)
            && one.unit == other.unit
            && one.scaling == other.scaling
            && one.value_error == other.value_error
            && (one.noise, one.change_error) == (other.noise, other.change_error)
            && one.time_error == other.time_error
            && one.mean_over == other.mean_over
            && one.delay == other.delay
            && (one.holds, one.dead_band) == (other.holds, other.dead_band)
            && (one.limits.range, one.limits.saturation) == (other.limits.range, other.limits.saturation);
        is_unchanged.then_some(namesake)
    }

    /// Matches the needs of a variable; of several, those with the same name of publication.
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

fn keep<I: Id>(matches: &IdVec<I, Option<I>>) -> bool {
    matches.enumerate().all(|(id, new)| new.is_none_or(|new| new == id))
}

/// At most this many elements are skipped to bring two lists back into step.
const AHEAD: usize = 8;

/// For each old element, the new element of the same name.
///
/// Most elements of a changed model keep their order, so both lists are compared side by side, from both ends; only elements in
/// between are looked up by name. Time: O(n), and O(k log k) for k in between.
fn matched<I: Id, T>(old: &IdVec<I, T>, new: &IdVec<I, T>, name: impl Fn(&T) -> &str) -> IdVec<I, Option<I>> {
    let old_name = |at: usize| old.find(I::from_index(at)).map(&name);
    let new_name = |at: usize| new.find(I::from_index(at)).map(&name);
    let same = |at: usize, new_at: usize| old_name(at).is_some() && old_name(at) == new_name(new_at);
    let mut found = IdVec::filled(old.len(), |_| None);
    let (mut lost, mut gained) = (Vec::new(), Vec::new());
    let (mut at, mut new_at) = (0, 0);
    let ahead = |(at, new_at)| {
        let steps = (0..=AHEAD).flat_map(|ahead| [(ahead, 0), (0, ahead), (ahead, ahead)]);
        steps.into_iter().find(|(passed, new_passed)| same(at + passed, new_at + new_passed))
    };
    while let Some((passed, new_passed)) = ahead((at, new_at)) {
        lost.extend(at..at + passed);
        gained.extend(new_at..new_at + new_passed);
        found[I::from_index(at + passed)] = Some(I::from_index(new_at + new_passed));
        (at, new_at) = (at + passed + 1, new_at + new_passed + 1);
    }
    let (mut end, mut new_end) = (old.len(), new.len());
    while at < end && new_at < new_end && same(end - 1, new_end - 1) {
        (end, new_end) = (end - 1, new_end - 1);
        found[I::from_index(end)] = Some(I::from_index(new_end));
    }
    lost.extend(at..end);
    gained.extend(new_at..new_end);
    let names: BTreeMap<_, _> = gained.into_iter().map(|at| (new_name(at), I::from_index(at))).collect();
    for at in lost {
        found[I::from_index(at)] = names.get(&old_name(at)).copied();
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::string::{String, ToString};
    use proptest::prelude::*;

    fn list(names: &[u32]) -> IdVec<VariableId, String> {
        let mut list = IdVec::new();
        names.iter().for_each(|name| _ = list.push(name.to_string()));
        list
    }

    fn check(old: &[u32], new: &[u32]) {
        let place = |name: &u32| new.iter().position(|other| other == name);
        let expected: Vec<Option<usize>> = old.iter().map(place).collect();
        let found = matched(&list(old), &list(new), String::as_str);
        let found: Vec<Option<usize>> = found.iter().map(|id| id.map(Id::index)).collect();
        assert_eq!(found, expected, "{old:?} {new:?}");
    }

    proptest! {
        #[test]
        fn names_are_matched_wherever_they_stand(
            all in Just((0..60).collect::<Vec<u32>>()).prop_shuffle(),
            cuts in prop::collection::vec((0..60_usize, 0..60_usize, 0..12_usize), 0..5),
            old in 0..60_usize,
        ) {
            let old = all.get(..old).unwrap_or_default();
            let mut new = old.to_vec();
            for (cut, (at, to, length)) in (100..).step_by(100).zip(cuts) {
                let at = at.min(new.len());
                let moved: Vec<u32> = new.drain(at..(at + length).min(new.len())).collect();
                let to = to.min(new.len());
                match length % 3 {
                    0 => {}
                    1 => new.splice(to..to, moved).for_each(drop),
                    _ => new.splice(to..to, cut..cut + length as u32).for_each(drop),
                }
            }
            check(old, &new);
        }
    }
}
