//! The watched ways of each variable, the ways left out, and the faults that are missed because of that.

use super::comparisons::Watched;
use super::faults::Faults;
use crate::knowledge::{IdVec, KnowledgeBase, SignalId, SignalSet, VariableId};
use alloc::vec::Vec;

/// The watched ways of a variable.
#[derive(Clone, Debug, PartialEq)]
pub struct Watch {
    /// The variable.
    pub variable: VariableId,
    /// The number of watched ways; 0 when comparing two of them costs too much.
    pub ways: usize,
    /// The number of possible ways; a lower bound unless [`exact`](Watch::exact).
    pub possible: usize,
    /// Whether `possible` counts all.
    pub exact: bool,
    /// Operations a second for computing and comparing the watched ways, by the declared rates.
    pub cost: f64,
    /// Faults that only the ways left out could detect or isolate.
    pub hidden: Vec<Hidden>,
}

/// A fault of a signal that only the ways left out could detect or isolate.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Hidden {
    /// The faulty signal.
    pub signal: SignalId,
    /// Whether the fault is not detected.
    pub undetected: bool,
    /// The signals that the fault could be isolated from, and is not.
    pub taken_for: SignalSet,
}

/// The variables in file order. Complexity: that of [`Witnesses::reach`](crate::residual_selection::Witnesses::reach) for each
/// variable of which not all ways are watched.
pub(super) fn watched(
    knowledge: &KnowledgeBase,
    watched: &IdVec<VariableId, Watched>,
    faults: &Faults,
) -> Vec<Watch> {
    let watch = |(variable, watched): (VariableId, &Watched)| {
        let witnesses = &watched.witnesses;
        Watch {
            variable,
            ways: if witnesses.ways.len() > 1 { witnesses.ways.len() } else { 0 },
            possible: witnesses.possible,
            exact: witnesses.exact,
            cost: witnesses.cost(knowledge),
            hidden: hidden(knowledge, faults, witnesses.reach(knowledge)),
        }
    };
    let all = watched.enumerate().map(watch);
    all.filter(|watch| watch.possible > 1).collect()
}

/// The faults that more ways would detect or isolate and the comparisons of all variables do not; undetected faults first.
fn hidden(knowledge: &KnowledgeBase, faults: &Faults, reach: Vec<(SignalId, SignalSet)>) -> Vec<Hidden> {
    let hidden_fault = |(signal, within_reach): (SignalId, SignalSet)| {
        let within_reach = knowledge.with_same(within_reach);
        let undetected = !faults.is_detectable(signal);
        let suspects = faults.suspects(signal).iter();
        let taken_for: SignalSet = suspects.filter(|suspect| !within_reach.contains(*suspect)).collect();
        (undetected || !taken_for.is_empty()).then_some(Hidden { signal, undetected, taken_for })
    };
    let mut hidden: Vec<Hidden> = reach.into_iter().filter_map(hidden_fault).collect();
    hidden.sort_by_key(|hidden| (!hidden.undetected, hidden.signal));
    hidden
}
