//! What a comparison is worth: whether an agreement could have been a conflict, whom a conflict is about, and over which time.

use super::EvidenceView;
use crate::interval::Interval;
use crate::knowledge::{SignalId, SignalSet};
use crate::monitor::{Residual, WatchedWay};
use crate::numbers::EVEN;
use crate::time::Span;

/// Whether an agreement could well have been a conflict. That a value is possible says nothing, that a specification holds nothing of
/// the size of what it reads, and
/// two values that are half as wide as the variable's range together would agree by chance as often as [`EVEN`] says.
pub(super) fn has_power(evidence: &impl EvidenceView, agreement: &Residual) -> bool {
    let (Some(one), Some(other)) = (evidence.way(agreement.way), evidence.way(agreement.other)) else {
        return false;
    };
    let width = |way: &WatchedWay| way.latest_value().map_or(0.0, Interval::width);
    let is_narrow = |range: f64| width(one) + width(other) < EVEN * range;
    !one.is_verdict()
        && !other.is_range()
        && one.range_width().is_none_or(is_narrow)
        && !is_of_a_bound(evidence, agreement)
}

/// Whether one of two ways says at present that the value is beyond what it can show, which agrees with nearly any error.
pub(super) fn is_of_a_bound(evidence: &impl EvidenceView, pair: &Residual) -> bool {
    [pair.way, pair.other].into_iter().filter_map(|index| evidence.way(index)).any(WatchedWay::is_a_bound)
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
