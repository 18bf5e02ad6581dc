//! Selects the ways of knowing each variable that are compared, from the model, before the first value comes.
//!
//! Of the ways of one variable, those that isolate most faults are watched ([`witnesses`]); further ways compute a measured
//! number where that isolates more ([`isolate`]); all within the budget ([`afford`]). A comparison has a [`FaultSignature`]; all
//! comparisons together have [`Findings`].

mod fault_signature;
mod findings;
mod cost;
mod greedy;
mod candidates;
mod witnesses;
mod measured;
mod isolation;
mod budget;

pub use budget::{WatchBudget, afford};
pub use fault_signature::FaultSignature;
pub use findings::{Findings, Isolability};
pub use isolation::isolate;
pub use witnesses::{Witnesses, witnesses};

use crate::computation::Computation;
use crate::knowledge::{KnowledgeBase, Shape, VariableId};
use crate::monitor::may_leave_range;
use crate::plan::Graph;
use crate::substitution::Way;
use alloc::vec::Vec;

/// Whether a way can be evaluated for comparisons: it has formulas, and does not go on from its own last value.
#[must_use]
pub fn can_be_watched(knowledge: &KnowledgeBase, way: &Way) -> bool {
    !way.substitution.continues_itself(knowledge) && Computation::can_run(knowledge, way)
}

/// All ways of knowing every variable that can be known in two ways or more, or in one that may leave the variable's range, with
/// those that [isolate](isolate()) more, within a budget: what the engine's monitor compares.
#[must_use]
pub fn to_watch(knowledge: &KnowledgeBase, graph: &Graph, budget: WatchBudget) -> Vec<Way> {
    let runs = |way: &Way| can_be_watched(knowledge, way);
    let is_number = |variable: &VariableId| knowledge.variables()[*variable].shape == Shape::Scalar;
    let variables = knowledge.variables().ids().filter(is_number);
    let mut all: Vec<(VariableId, Witnesses)> = variables
        .map(|variable| (variable, witnesses(knowledge, graph, variable, budget.ways, runs)))
        .collect();
    let mut by_variable = all.iter_mut().map(|(variable, witnesses)| (*variable, witnesses)).collect();
    isolate(knowledge, graph, &mut by_variable, budget.ways, runs);
    afford(knowledge, all.iter_mut().map(|(_, witnesses)| witnesses), budget.cost);
    let is_compared = |ways: &[Way]| match ways {
        [way] => may_leave_range(knowledge, way),
        _ => true,
    };
    all.into_iter().map(|(_, witnesses)| witnesses.ways).filter(|ways| is_compared(ways)).flatten().collect()
}
