//! What the monitor watches of each variable, what it leaves out, and what that costs in telling faults apart.

use super::comparisons::Watched;
use super::faults::Faults;
use crate::knowledge::{IdVec, KnowledgeBase, SignalId, SignalSet, VariableId};
use alloc::vec::Vec;

/// The ways of knowing a variable that are watched.
#[derive(Clone, Debug, PartialEq)]
pub struct Watch {
    /// The variable.
    pub variable: VariableId,
    /// How many of its ways of knowing are watched; none when comparing two of them costs too much.
    pub ways: usize,
    /// How many there are; at least so many unless it is [`exact`](Watch::exact).
    pub possible: usize,
    /// Whether `possible` counts all.
    pub exact: bool,
    /// Operations a second of computing and comparing them, by the declared rates.
    pub cost: f64,
    /// What would be told if all ways that were looked at were watched, and no other variable tells.
    pub hidden: Vec<Hidden>,
}

/// What the choice of ways leaves untold about a signal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Hidden {
    /// The signal whose fault it is about.
    pub signal: SignalId,
    /// Whether its fault does not show.
    pub undetected: bool,
    /// The signals that it is taken for and would be told from.
    pub taken_for: SignalSet,
}

/// In file order. Complexity: that of [`Witnesses::reach`](crate::residual_selection::Witnesses::reach) for each variable of which
/// not all ways are watched.
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

/// What more ways would tell, as far as the comparisons of all variables together do not; what does not show comes first.
fn hidden(knowledge: &KnowledgeBase, faults: &Faults, reach: Vec<(SignalId, SignalSet)>) -> Vec<Hidden> {
    let untold = |(signal, within_reach): (SignalId, SignalSet)| {
        let within_reach = knowledge.with_same(within_reach);
        let undetected = !faults.is_detectable(signal);
        let suspects = faults.suspects(signal).iter();
        let taken_for: SignalSet = suspects.filter(|suspect| !within_reach.contains(*suspect)).collect();
        (undetected || !taken_for.is_empty()).then_some(Hidden { signal, undetected, taken_for })
    };
    let mut hidden: Vec<Hidden> = reach.into_iter().filter_map(untold).collect();
    hidden.sort_by_key(|hidden| (!hidden.undetected, hidden.signal));
    hidden
}
