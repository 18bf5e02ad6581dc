//! Fault signatures: the reactions of a comparison of two ways to faults of signals and relations.

use crate::knowledge::{Id, IdVec, KnowledgeBase, RelationId, RelationSet, SignalId, SignalSet, VariableId};
use crate::monitor::{rests_on, sized_by};
use crate::substitution::{Step, Way};
use alloc::vec::Vec;

/// The signals and relations of a way of knowing, and how they reach its output.
#[derive(Clone, Debug, PartialEq)]
pub struct FaultSignature {
    rests_on: SignalSet,
    /// The signals that the output is computed from; only conditions read the others.
    sized_by: SignalSet,
    relations: RelationSet,
    /// The relations that the output is computed by; the others serve conditions only.
    sized_through: RelationSet,
    /// For each signal that the output is computed from, ascending: the steps between it and the output, ascending. Signals from
    /// the same source are listed under the first of them, as one witness.
    paths: Vec<(SignalId, Vec<Step>)>,
    /// The same for each step, including itself, ascending by its relation.
    through: Vec<(RelationId, Vec<Step>)>,
}

impl FaultSignature {
    /// Complexity: O((inputs + steps) times steps).
    #[must_use]
    pub fn of(knowledge: &KnowledgeBase, way: &Way) -> FaultSignature {
        let sized_by = sized_by(knowledge, way);
        let path = |signal: SignalId| {
            let variable = knowledge.signals()[signal].variable;
            (knowledge.witness(signal), path(knowledge, way, 0, variable, Vec::new()))
        };
        let mut paths: Vec<(SignalId, Vec<Step>)> = way.inputs().map(path).collect();
        paths.retain(|(signal, _)| sized_by.contains(*signal));
        paths.sort_unstable();
        let from = |(at, step): (usize, &Step)| {
            (step.relation, self::path(knowledge, way, at + 1, step.output, Vec::from([*step])))
        };
        let mut through: Vec<(RelationId, Vec<Step>)> =
            way.substitution.steps.iter().enumerate().map(from).collect();
        through.sort_unstable();
        let sink = way.substitution.sink;
        let arrives = |steps: &[Step]| steps.iter().any(|step| step.output == sink);
        let relations = through.iter().map(|(relation, _)| *relation).collect();
        let sized_through = through.iter().filter(|(_, steps)| arrives(steps));
        let sized_through = sized_through.map(|(relation, _)| *relation).collect();
        let rests_on = rests_on(knowledge, way);
        FaultSignature { rests_on, sized_by, relations, sized_through, paths, through }
    }

    /// The signatures of some ways.
    pub(super) fn of_all(knowledge: &KnowledgeBase, ways: &[Way]) -> Vec<FaultSignature> {
        ways.iter().map(|way| FaultSignature::of(knowledge, way)).collect()
    }

    /// The signals whose loss breaks the way.
    #[must_use]
    pub fn rests_on(&self) -> &SignalSet {
        &self.rests_on
    }

    /// The signals of a comparison: when its ways disagree, at least one of these is faulty.
    #[must_use]
    pub fn signals(&self, other: &FaultSignature) -> SignalSet {
        let mut signals = self.rests_on.clone();
        signals.extend(&other.rests_on);
        signals
    }

    /// The signals whose faults a comparison shows: its two ways depend on such a signal differently.
    ///
    /// A comparison shows a signal that only one way is computed from, and not one that only conditions read. It shows a signal
    /// of both ways if that reaches their outputs through different relations; otherwise the signal moves both alike (`s + a` and
    /// `s + b` say nothing about `s`). An origin of a signal of the other way is part of both ways, and is not shown.
    #[must_use]
    pub fn shows(&self, other: &FaultSignature) -> SignalSet {
        let mut shown = self.sized_by.difference(&other.sized_by);
        for (signal, _) in &self.paths {
            let is_read = other.paths.binary_search_by_key(signal, |(other, _)| *other).is_ok();
            if is_read && self.paths_of(*signal).ne(other.paths_of(*signal)) {
                shown.insert(*signal);
            }
        }
        shown
    }

    /// The relations of a comparison: a disagreement means that a signal of it is faulty, or one of these relations does not
    /// hold.
    #[must_use]
    pub fn relations(&self, other: &FaultSignature) -> RelationSet {
        let mut relations = self.relations.clone();
        relations.extend(&other.relations);
        relations
    }

    /// The relations whose violation a comparison shows: those on which its two ways depend differently, as for signals.
    #[must_use]
    pub fn shows_relations(&self, other: &FaultSignature) -> RelationSet {
        let mut shown = self.sized_through.difference(&other.sized_through);
        let both = self.sized_through.iter().filter(|&relation| other.sized_through.contains(relation));
        for relation in both {
            if of(&self.through, relation).ne(of(&other.through, relation)) {
                shown.insert(relation);
            }
        }
        shown
    }

    fn paths_of(&self, signal: SignalId) -> impl Iterator<Item = &[Step]> {
        of(&self.paths, signal)
    }

    /// The signature with other ids of signals, and without relations.
    pub(super) fn renamed(&self, rename: impl Fn(SignalId) -> Option<SignalId>) -> FaultSignature {
        let path = |(signal, steps): &(SignalId, Vec<Step>)| Some((rename(*signal)?, steps.clone()));
        let mut paths: Vec<_> = self.paths.iter().filter_map(path).collect();
        paths.sort_unstable();
        let renamed = |signals: &SignalSet| signals.iter().filter_map(&rename).collect();
        FaultSignature {
            rests_on: renamed(&self.rests_on),
            sized_by: renamed(&self.sized_by),
            relations: RelationSet::new(),
            sized_through: RelationSet::new(),
            paths,
            through: Vec::new(),
        }
    }

    #[cfg(test)]
    pub(super) fn resting_on(signals: impl IntoIterator<Item = SignalId>) -> FaultSignature {
        let rests_on: SignalSet = signals.into_iter().collect();
        FaultSignature {
            sized_by: rests_on.clone(),
            rests_on,
            relations: RelationSet::new(),
            sized_through: RelationSet::new(),
            paths: Vec::new(),
            through: Vec::new(),
        }
    }
}

/// The entries of an id in an ascending list.
fn of<I: Ord + Copy>(paths: &[(I, Vec<Step>)], id: I) -> impl Iterator<Item = &[Step]> {
    let from = paths.partition_point(|(earlier, _)| *earlier < id);
    paths.iter().skip(from).take_while(move |(same, _)| *same == id).map(|(_, steps)| steps.as_slice())
}

/// The steps of a way, from one on, through which a variable reaches its output, in addition to `steps`; ascending.
fn path(
    knowledge: &KnowledgeBase,
    way: &Way,
    from: usize,
    variable: VariableId,
    mut steps: Vec<Step>,
) -> Vec<Step> {
    let mut reached = Vec::from([variable]);
    for &step in way.substitution.steps.iter().skip(from) {
        let relation = &knowledge.relations()[step.relation];
        let is_read = |input: VariableId| reached.contains(&input);
        let reaches = match relation.formula(step.output) {
            Some(formula) => {
                formula.symbols().iter().any(|it| is_read(VariableId::from_index(it.0 as usize)))
            }
            None => relation.needs(step.output).any(is_read),
        };
        if reaches {
            reached.push(step.output);
            steps.push(step);
        }
    }
    steps.sort_unstable();
    steps
}

/// The signatures with their signals numbered from 0, and the signals by number.
pub(super) fn compacted(fault_signature: &[FaultSignature]) -> (Vec<FaultSignature>, Vec<SignalId>) {
    let mut all = SignalSet::new();
    fault_signature.iter().for_each(|each| all.extend(&each.rests_on));
    let signals: Vec<SignalId> = all.iter().collect();
    let rename = |signal: SignalId| signals.binary_search(&signal).ok().map(Id::from_index);
    (fault_signature.iter().map(|each| each.renamed(rename)).collect(), signals)
}

/// Values by the numbers of signals.
pub(super) type BySignal<T> = IdVec<SignalId, T>;
