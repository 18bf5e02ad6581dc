//! The comparisons that the monitor makes, and whose faults each of them shows.

use super::basis::Basis;
use super::budget::Budget;
use crate::engine::{Witnesses, witnesses};
use crate::knowledge::{IdVec, KnowledgeBase, Shape, SignalId, SignalSet, VariableId};
use crate::monitor::{compared, rests_on};
use crate::plan::Graph;
use crate::substitution::{Step, Way};
use alloc::vec::Vec;

/// The ways of knowing one variable that are compared.
#[derive(Clone, Debug, Default)]
pub(super) struct Watched {
    pub(super) ways: Vec<Way>,
    /// Whether there are no others.
    pub(super) complete: bool,
    /// Whether the budget was spent before they were looked for.
    pub(super) skipped: bool,
}

impl Watched {
    /// The ways of a variable that the monitor would watch.
    pub(super) fn of(
        knowledge: &KnowledgeBase,
        graph: &Graph,
        basis: &Basis,
        variable: VariableId,
        budget: &mut Budget,
    ) -> Watched {
        if knowledge.variables()[variable].shape == Shape::Vector {
            return Watched { complete: true, ..Watched::default() };
        }
        if budget.is_spent() {
            return Watched { skipped: true, ..Watched::default() };
        }
        let Witnesses { mut ways, complete, expanded } = witnesses(knowledge, graph, variable);
        budget.spend(1 + expanded);
        ways.retain(|way| basis.admits(knowledge, way));
        Watched { ways, complete, skipped: false }
    }
}

/// Two ways of one variable that are compared, as places in [`Comparisons::ways`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Comparison {
    /// One of them.
    pub one: usize,
    /// The other.
    pub other: usize,
}

/// All comparisons of a knowledge base.
#[derive(Clone, Debug, Default)]
pub struct Comparisons {
    ways: Vec<Way>,
    rests_on: Vec<SignalSet>,
    pairs: Vec<Comparison>,
}

impl Comparisons {
    /// Pairs these ways as the monitor does. Complexity: O(p log p) for p pairs of ways of one variable.
    pub(super) fn new(knowledge: &KnowledgeBase, ways: Vec<Way>) -> Comparisons {
        let rests_on: Vec<SignalSet> = ways.iter().map(|way| rests_on(knowledge, way)).collect();
        let borrowed: Vec<(&Way, &SignalSet)> = ways.iter().zip(&rests_on).collect();
        let pairs = compared(&borrowed).into_iter().map(|(one, other)| Comparison { one, other }).collect();
        Comparisons { ways, rests_on, pairs }
    }

    /// The ways that are watched, by variable, best utility first.
    #[must_use]
    pub fn ways(&self) -> &[Way] {
        &self.ways
    }

    /// All comparisons, in the order of the ways.
    #[must_use]
    pub fn pairs(&self) -> &[Comparison] {
        &self.pairs
    }

    /// The signals that a comparison speaks about: when its ways disagree, at least one of these is faulty.
    #[must_use]
    pub fn signals(&self, comparison: Comparison) -> SignalSet {
        let mut signals = self.rests_on(comparison.one).cloned().unwrap_or_default();
        if let Some(other) = self.rests_on(comparison.other) {
            signals.extend(other);
        }
        signals
    }

    /// The signals whose faults a comparison shows: those that its two ways do not depend on in the same manner.
    ///
    /// A signal that only one way rests on shows. One that both read shows if it reaches their outputs over different
    /// relations; else it moves both alike (`s + a` and `s + b` say nothing about `s`). One that a signal of the other
    /// way is derived from is in both of them, and does not show.
    #[must_use]
    pub fn shows(&self, knowledge: &KnowledgeBase, comparison: Comparison) -> SignalSet {
        let (Some(one), Some(other)) = (self.ways.get(comparison.one), self.ways.get(comparison.other))
        else {
            return SignalSet::new();
        };
        let (Some(under), Some(beside)) = (self.rests_on(comparison.one), self.rests_on(comparison.other))
        else {
            return SignalSet::new();
        };
        let is_read = |signal: SignalId| {
            one.inputs().any(|input| input == signal) && other.inputs().any(|input| input == signal)
        };
        let shows = |&signal: &SignalId| {
            under.contains(signal) != beside.contains(signal)
                || (is_read(signal) && cone(knowledge, one, signal) != cone(knowledge, other, signal))
        };
        self.signals(comparison).iter().filter(shows).collect()
    }

    fn rests_on(&self, way: usize) -> Option<&SignalSet> {
        self.rests_on.get(way)
    }
}

/// The steps of a way through which a signal reaches its output, ascending.
fn cone(knowledge: &KnowledgeBase, way: &Way, signal: SignalId) -> Vec<Step> {
    let mut reached = Vec::from([knowledge.signals()[signal].variable]);
    let mut steps = Vec::new();
    for &step in &way.substitution.steps {
        if knowledge.relations()[step.relation].needs(step.output).any(|input| reached.contains(&input)) {
            reached.push(step.output);
            steps.push(step);
        }
    }
    steps.sort_unstable();
    steps
}

/// All ways of these variables, in order.
pub(super) fn gathered(watched: &IdVec<VariableId, Watched>, among: &[VariableId]) -> Vec<Way> {
    among.iter().filter_map(|&variable| watched.find(variable)).flat_map(|w| w.ways.clone()).collect()
}
