//! What a comparison is worth: whether an agreement could have been a conflict, whom a conflict is about, and over which time.

use super::EvidenceView;
use crate::diagnosis::candidates::ONE_SIDED;
use crate::knowledge::{SignalId, SignalSet};
use crate::monitor::{Residual, WatchedWay};
use crate::time::Span;

/// Whether an agreement could have been a conflict: a value that is off by as much as the conflicts about this variable show, or one
/// anywhere in the variable's range, would agree less often than [`ONE_SIDED`] says.
pub(super) fn has_power(evidence: &impl EvidenceView, agreement: &Residual, conflicts: &[&Residual]) -> bool {
    let (Some(one), Some(other)) = (evidence.way(agreement.way), evidence.way(agreement.other)) else {
        return false;
    };
    if one.is_verdict() {
        return false;
    }
    let (Some(value), Some(beside)) = (one.latest_value(), other.latest_value()) else { return true };
    let beside = one.in_turn(beside, value);
    let (above, below) = (beside.hi() - value.lo(), value.hi() - beside.lo());
    let is_of_it =
        |pair: &&&Residual| evidence.way(pair.way).is_some_and(|way| way.variable() == one.variable());
    let gap =
        |pair: &&Residual| pair.disagreement.map(|it| (it.value.midpoint() - it.other.midpoint()).abs());
    // The side to which a fault has moved the value is not always known: what would show on either side has power.
    match conflicts.iter().filter(is_of_it).filter_map(gap).reduce(f64::max) {
        Some(size) => size > above.min(below),
        None => one.range_width().is_none_or(|range| value.width() + beside.width() < ONE_SIDED * range),
    }
}

/// The signals on which both ways rest and that neither of them reads.
pub(super) fn common_ancestors(one: &WatchedWay, other: &WatchedWay) -> SignalSet {
    let is_read = |signal: &SignalId| one.reads.contains(*signal) || other.reads.contains(*signal);
    one.rests_on.iter().filter(|signal| other.rests_on.contains(*signal) && !is_read(signal)).collect()
}

/// How far back the values lie that a pair compares now.
pub(super) fn reach(evidence: &impl EvidenceView, pair: &Residual) -> Span {
    let window = |index| evidence.way(index).map_or(Span::ZERO, |way| way.computation.timing().window);
    pair.window.reach() + window(pair.way).max(window(pair.other))
}

/// How long a pair shows a step of a signal. A difference quotient shows it for the length of its window.
pub(super) fn shows_a_step(evidence: &impl EvidenceView, pair: &Residual) -> Span {
    let rate = |index| evidence.way(index).filter(|way| way.computation.is_rate());
    let window = |index| rate(index).map_or(Span::ZERO, |way| way.computation.timing().window);
    match window(pair.way).max(window(pair.other)) {
        Span::ZERO => Span::MAX,
        window => window,
    }
}
