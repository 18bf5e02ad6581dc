//! The survey of a knowledge base: its comparisons, its faults, its losses.

use super::Limited;
use super::basis::Basis;
use super::budget::Budget;
use super::comparisons::{Comparisons, Watched, gathered, isolated};
use super::faults::Faults;
use super::losses::{Losses, Target, Tolerance};
use crate::knowledge::{IdVec, KnowledgeBase, NeedId, SignalId, VariableId};
use crate::plan::Graph;
use alloc::vec::Vec;

/// The ways of knowing each variable.
pub(super) struct Ways {
    /// The ways to watch without a cost limit, and without those that isolate faults of measured variables.
    pub(super) wanted: IdVec<VariableId, Watched>,
    /// The ways that are watched.
    pub(super) are: IdVec<VariableId, Watched>,
}

/// The ways that are watched, and their comparisons.
pub(super) fn compared(
    knowledge: &KnowledgeBase,
    graph: &Graph,
    basis: &Basis,
    budget: &mut Budget,
) -> (Ways, Comparisons) {
    let wanted = IdVec::filled(knowledge.variables().len(), |variable| {
        Watched::of(knowledge, graph, basis, variable, budget)
    });
    let mut are = wanted.clone();
    isolated(knowledge, graph, basis, &mut are, budget);
    let comparisons = Comparisons::new(knowledge, gathered(knowledge, basis, &mut are));
    (Ways { wanted, are }, comparisons)
}

/// The survey of the model.
#[derive(Clone, Debug)]
pub(super) struct Survey {
    /// The ways to watch without a cost limit, and without those that isolate faults of measured variables.
    pub(super) wanted: IdVec<VariableId, Watched>,
    /// The ways that are watched.
    pub(super) watched: IdVec<VariableId, Watched>,
    pub(super) comparisons: Comparisons,
    pub(super) faults: Faults,
    /// The tolerance of each variable that a signal carries.
    pub(super) variables: IdVec<VariableId, Option<Tolerance>>,
    pub(super) needs: IdVec<NeedId, Tolerance>,
}

impl Survey {
    /// Needs, comparisons and variables get a third of the steps each; the results are marked inexact where a third is not
    /// enough.
    pub(super) fn new(knowledge: &KnowledgeBase, graph: &Graph, basis: &Basis, steps: u64) -> Survey {
        let third = || Budget::new(steps.div_ceil(3));
        let (mut for_needs, mut for_ways, mut for_variables) = (third(), third(), third());
        let mut losses = Losses::new(knowledge, graph, basis);
        let needs = IdVec::filled(knowledge.needs().len(), |need| {
            losses.tolerance(&Target::of_need(knowledge, need), &mut for_needs)
        });
        let (Ways { wanted, are: watched }, comparisons) = compared(knowledge, graph, basis, &mut for_ways);
        let faults = Faults::new(knowledge, &comparisons);
        let variables = IdVec::filled(knowledge.variables().len(), |variable| {
            let carried = !knowledge.carriers(variable).is_empty();
            carried.then(|| losses.tolerance(&Target::of_variable(variable), &mut for_variables))
        });
        Survey { wanted, watched, comparisons, faults, variables, needs }
    }

    /// Whether the variable of a signal can be known without the signal.
    pub(super) fn is_substitutable(&self, knowledge: &KnowledgeBase, signal: SignalId) -> bool {
        let tolerance = self.variables[knowledge.signals()[signal].variable].as_ref();
        tolerance.is_some_and(|tolerance| tolerance.known && !tolerance.single_points.contains(signal))
    }

    /// The limits that were reached.
    pub(super) fn limited(&self) -> Vec<Limited> {
        let skipped = self.watched.iter().filter(|watched| watched.skipped).count();
        let leaves_out = |watched: &&Watched| !watched.skipped && !watched.witnesses.is_complete();
        let unwatched = self.watched.iter().filter(leaves_out).count();
        let inexact = |tolerance: &&Tolerance| !tolerance.exact;
        let needs = self.needs.iter().filter(inexact).count();
        let variables = self.variables.iter().flatten().filter(inexact).count();
        let counts = [
            (unwatched > 0).then_some(Limited::Ways { variables: unwatched }),
            (skipped > 0).then_some(Limited::Skipped { variables: skipped }),
            (needs > 0).then_some(Limited::Needs { needs }),
            (variables > 0).then_some(Limited::Variables { variables }),
        ];
        counts.into_iter().flatten().collect()
    }
}
