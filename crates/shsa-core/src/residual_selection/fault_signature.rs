//! What two ways of knowing a variable say about signals and relations when they disagree.

use crate::knowledge::{Id, IdVec, KnowledgeBase, RelationId, RelationSet, SignalId, SignalSet, VariableId};
use crate::monitor::{rests_on, sized_by};
use crate::substitution::{Step, Way};
use alloc::vec::Vec;

/// The signals and relations of a way of knowing, and how they reach its output.
#[derive(Clone, Debug, PartialEq)]
pub struct FaultSignature {
    rests_on: SignalSet,
    /// Those that the output is computed from; the others are read by conditions only.
    sized_by: SignalSet,
    relations: RelationSet,
    /// Those that the output is computed by; the others serve conditions only.
    sized_through: RelationSet,
    /// For each signal that the output is computed from, ascending: the steps through which it reaches it, ascending. As
    /// one witness, signals from the same source stand under the first of them.
    paths: Vec<(SignalId, Vec<Step>)>,
    /// The same of each step, from the step itself on, ascending by its relation.
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

    /// Those of some ways.
    pub(super) fn of_all(knowledge: &KnowledgeBase, ways: &[Way]) -> Vec<FaultSignature> {
        ways.iter().map(|way| FaultSignature::of(knowledge, way)).collect()
    }

    /// The signals whose loss takes the way.
    #[must_use]
    pub fn rests_on(&self) -> &SignalSet {
        &self.rests_on
    }

    /// The signals that a comparison speaks about: when its ways disagree, at least one of these is faulty.
    #[must_use]
    pub fn signals(&self, other: &FaultSignature) -> SignalSet {
        let mut signals = self.rests_on.clone();
        signals.extend(&other.rests_on);
        signals
    }

    /// The signals whose faults a comparison shows: those that its two ways do not depend on in the same manner.
    ///
    /// A signal that only one way is computed from shows; what only conditions read does not. One that both read shows if it reaches their outputs over different
    /// relations; else it moves both alike (`s + a` and `s + b` say nothing about `s`). One that a signal of the other
    /// way is derived from is in both of them, and does not show.
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

    /// The relations that a comparison speaks about: when its ways disagree, one of its signals is faulty, or one of these
    /// does not hold.
    #[must_use]
    pub fn relations(&self, other: &FaultSignature) -> RelationSet {
        let mut relations = self.relations.clone();
        relations.extend(&other.relations);
        relations
    }

    /// The relations of which a comparison shows that they do not hold: those that its two ways do not depend on in the same
    /// manner, as with signals.
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

    /// The same with signals under other ids, and without relations.
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

/// What stands under an id in an ascending list.
fn of<I: Ord + Copy>(paths: &[(I, Vec<Step>)], id: I) -> impl Iterator<Item = &[Step]> {
    let from = paths.partition_point(|(earlier, _)| *earlier < id);
    paths.iter().skip(from).take_while(move |(same, _)| *same == id).map(|(_, steps)| steps.as_slice())
}

/// The steps of a way from one on through which a variable reaches its output, with those before it, ascending.
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

/// What is to be compared, with the signals numbered from 0 as far as they take part.
pub(super) fn compacted(fault_signature: &[FaultSignature]) -> (Vec<FaultSignature>, Vec<SignalId>) {
    let mut all = SignalSet::new();
    fault_signature.iter().for_each(|each| all.extend(&each.rests_on));
    let signals: Vec<SignalId> = all.iter().collect();
    let rename = |signal: SignalId| signals.binary_search(&signal).ok().map(Id::from_index);
    (fault_signature.iter().map(|each| each.renamed(rename)).collect(), signals)
}

/// The signals numbered from 0 that some ways rest on, by number.
pub(super) type BySignal<T> = IdVec<SignalId, T>;
