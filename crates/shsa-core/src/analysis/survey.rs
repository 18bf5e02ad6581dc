//! What a knowledge base can do as it is: its comparisons, its faults, its losses.

use super::Limited;
use super::basis::Basis;
use super::budget::Budget;
use super::comparisons::{Comparisons, Watched, gathered};
use super::faults::Faults;
use super::losses::{Losses, Target, Tolerance};
use crate::knowledge::{IdVec, KnowledgeBase, NeedId, SignalId, VariableId};
use crate::plan::Graph;
use alloc::vec::Vec;

/// Everything about the model as it is.
#[derive(Clone, Debug)]
pub(super) struct Survey {
    pub(super) watched: IdVec<VariableId, Watched>,
    pub(super) comparisons: Comparisons,
    pub(super) faults: Faults,
    /// Of the variables that a signal carries.
    pub(super) variables: IdVec<VariableId, Option<Tolerance>>,
    pub(super) needs: IdVec<NeedId, Tolerance>,
}

impl Survey {
    /// Needs come first, then the comparisons, then the variables: a budget that ends leaves the rest unclear.
    pub(super) fn new(
        knowledge: &KnowledgeBase,
        graph: &Graph,
        basis: &Basis,
        budget: &mut Budget,
    ) -> Survey {
        let mut losses = Losses::new(knowledge, graph, basis);
        let needs = IdVec::filled(knowledge.needs().len(), |need| {
            losses.tolerance(Target::of_need(knowledge, need), budget)
        });
        let watched = IdVec::filled(knowledge.variables().len(), |variable| {
            Watched::of(knowledge, graph, basis, variable, budget)
        });
        let all: Vec<VariableId> = knowledge.variables().ids().collect();
        let comparisons = Comparisons::new(knowledge, gathered(&watched, &all));
        let faults = Faults::new(knowledge, &comparisons);
        let variables = IdVec::filled(knowledge.variables().len(), |variable| {
            let carried = !knowledge.carriers(variable).is_empty();
            carried.then(|| losses.tolerance(Target::of_variable(variable), budget))
        });
        Survey { watched, comparisons, faults, variables, needs }
    }

    /// Whether the variable of a signal can be known without it.
    pub(super) fn is_substitutable(&self, knowledge: &KnowledgeBase, signal: SignalId) -> bool {
        let tolerance = self.variables[knowledge.signals()[signal].variable].as_ref();
        tolerance.is_some_and(|tolerance| tolerance.known && !tolerance.single_points.contains(signal))
    }

    /// What was not looked at to the end.
    pub(super) fn limited(&self) -> Vec<Limited> {
        let skipped = self.watched.iter().filter(|watched| watched.skipped).count();
        let unwatched = self.watched.iter().filter(|watched| !watched.complete && !watched.skipped).count();
        let inexact = |tolerance: &&Tolerance| !tolerance.exact;
        let needs = self.needs.iter().filter(inexact).count();
        let variables = self.variables.iter().flatten().filter(inexact).count();
        let told = [
            (unwatched > 0).then_some(Limited::Ways { variables: unwatched }),
            (skipped > 0).then_some(Limited::Skipped { variables: skipped }),
            (needs > 0).then_some(Limited::Needs { needs }),
            (variables > 0).then_some(Limited::Variables { variables }),
        ];
        told.into_iter().flatten().collect()
    }
}
