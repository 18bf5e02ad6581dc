//! The watched ways of knowing one variable: of many, those that isolate most faults.

use super::candidates::{MOST_SEARCHED, candidates};
use super::cost::{Cost, added_cost};
use super::fault_signature::FaultSignature;
use super::greedy::{self, chosen};
use crate::knowledge::{KnowledgeBase, Shape, SignalId, SignalSet, VariableId};
use crate::plan::{self, Graph, Limits, Options, StopReason};
use crate::substitution::{Substitution, Way};
use alloc::collections::BTreeSet;
use alloc::vec::Vec;

/// Expansions after which a search for the next best substitution ends; counted, so that runs repeat.
const LIMITS: Limits = Limits { expansions: 20_000, states: 20_000 };

/// The watched ways of a variable.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Witnesses {
    /// Best utility first, then in file order; last the ways that compute a measured number.
    pub ways: Vec<Way>,
    /// The number of all ways; a lower bound unless [`exact`](Witnesses::exact).
    pub possible: usize,
    /// Whether `possible` is exact, as no limit has ended the search.
    pub exact: bool,
    /// The number of decisions of the search, and of comparisons examined for the choice.
    pub expanded: u64,
    /// All considered ways, where these are more than `ways`.
    candidates: Vec<Way>,
}

impl Witnesses {
    /// Whether all ways are watched.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.exact && self.ways.len() >= self.possible
    }

    /// The findings by comparisons of all considered ways, where not all are watched: each detectable signal, with the signals
    /// that its fault would not be isolable from.
    ///
    /// Complexity: O(w^2 s) for w ways (at most 256) and s signals.
    #[must_use]
    pub fn reach(&self, knowledge: &KnowledgeBase) -> Vec<(SignalId, SignalSet)> {
        greedy::suspects(&FaultSignature::of_all(knowledge, &self.candidates))
    }

    /// Operations a second for watching these ways, counted as in [`WatchBudget::cost`](super::WatchBudget::cost).
    #[must_use]
    pub fn cost(&self, knowledge: &KnowledgeBase) -> f64 {
        let costs: Vec<Cost> = self.ways.iter().map(|way| Cost::of(knowledge, way)).collect();
        (0..costs.len()).map(|count| added_cost(&costs, 0..=count)).sum()
    }

    /// Adds a way.
    pub(super) fn add(&mut self, way: Way) {
        if !self.candidates.is_empty() {
            self.candidates.push(way.clone());
        }
        self.ways.push(way);
        self.possible = self.possible.saturating_add(1);
    }

    /// Keeps only the ways at these places; fewer than two are compared with nothing.
    pub(super) fn keep(&mut self, kept: &BTreeSet<usize>) {
        if kept.len() == self.ways.len() {
            return;
        }
        if self.candidates.is_empty() {
            self.candidates.clone_from(&self.ways);
        }
        let mut at = 0;
        self.ways.retain(|_| {
            at += 1;
            kept.contains(&(at - 1))
        });
    }
}

/// The ways of knowing a variable with information of their own: at most `most`, those that isolate most faults.
///
/// `admits` tells whether a way counts; it is asked once for ways that differ in their signals only. A provided number is read,
/// not computed, as it is compared itself ([`isolate`](super::isolate) adds the rest). A provided vector is computed, as vectors
/// are compared only through numbers that follow from them. Of ways that read the same measurement, one counts.
///
/// Complexity: a search for 256 substitutions, and, where there are more than `most` ways, O(w k s^2 / 64) for w of them (at
/// most 256), k = `most`, over s signals.
#[must_use]
pub fn witnesses(
    knowledge: &KnowledgeBase,
    graph: &Graph,
    variable: VariableId,
    most: usize,
    admits: impl Fn(&Way) -> bool,
) -> Witnesses {
    let is_vector = |variable: VariableId| knowledge.variables()[variable].shape == Shape::Vector;
    // The search substitutes all provided variables or none, and all takes much longer in a large model.
    let substitute_provided = graph.computed_vectors().iter().any(|&vector| knowledge.is_provided(vector));
    let options = Options { substitute_provided, ..Options::default() };
    let found = plan::best(graph, variable, &options, MOST_SEARCHED, LIMITS);
    let compared_itself = |substitution: &Substitution| {
        let mut behind =
            substitution.steps.iter().map(|step| step.output).filter(|&output| output != variable);
        behind.any(|output| knowledge.is_provided(output) && !is_vector(output))
    };
    let counts = |substitution: &&Substitution| {
        let any = || Way::choices(knowledge, substitution, |_| true, 1);
        !compared_itself(substitution) && any().first().is_some_and(&admits)
    };
    let substitutions: Vec<&Substitution> =
        found.substitutions.iter().map(|(substitution, _)| substitution).filter(counts).collect();
    let (candidates, possible) = candidates(knowledge, &substitutions);
    let exact = found.stop == StopReason::Complete;
    let mut witnesses =
        Witnesses { ways: candidates, possible, exact, expanded: found.expanded, candidates: Vec::new() };
    if witnesses.ways.len() > most {
        witnesses.expanded += (witnesses.ways.len().min(MOST_SEARCHED) * most) as u64;
        let kept = isolated_pairs(knowledge, &witnesses.ways, most);
        witnesses.keep(&kept);
    } else if witnesses.ways.len() < possible {
        witnesses.candidates.clone_from(&witnesses.ways);
    }
    witnesses
}

/// The places of the watched ways: all signals of the variable, and the computed ways that isolate most faults beside the first
/// of these.
fn isolated_pairs(knowledge: &KnowledgeBase, ways: &[Way], most: usize) -> BTreeSet<usize> {
    let is_direct = |at: &usize| ways.get(*at).is_some_and(|way| way.direct().is_some());
    let (direct, computed): (Vec<usize>, Vec<usize>) = (0..ways.len()).partition(is_direct);
    let mut looked_at: Vec<usize> = direct.iter().copied().take(most).chain(computed).collect();
    looked_at.sort_unstable();
    let some: Vec<Way> = looked_at.iter().filter_map(|&at| ways.get(at).cloned()).collect();
    let chosen = chosen(&FaultSignature::of_all(knowledge, &some), most);
    let chosen = chosen.iter().filter_map(|choice| looked_at.get(choice.at).copied());
    chosen.chain(direct).collect()
}
