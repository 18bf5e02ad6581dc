//! The judge's view of the evidence: the residuals with their ways, and the state of each signal that bears on its trust.

use crate::interval::Interval;
use crate::knowledge::SignalId;
use crate::monitor::{Frozen, Monitor, Residual, WatchedWay, WayIndex};

/// All that the judge reads of the monitor.
pub trait EvidenceView {
    /// All residuals.
    fn pairs(&self) -> &[Residual];

    /// The residuals that rest on a signal, in their order.
    fn pairs_of(&self, signal: SignalId) -> impl Iterator<Item = &Residual>;

    /// The residuals with a recent disagreement, in their order: all that are undecided or in conflict, or may become so without
    /// another disagreement.
    fn restless(&self) -> impl Iterator<Item = &Residual>;

    /// A way that is compared.
    fn way(&self, index: WayIndex) -> Option<&WatchedWay>;

    /// Since when a signal has repeated its value.
    fn frozen(&self, signal: SignalId) -> Frozen;

    /// The current value of a signal, SI, when it is a number.
    fn latest_value(&self, signal: SignalId) -> Option<Interval>;

    /// Whether a signal gives values, and no detector finds a fault in its readings.
    fn is_sound(&self, signal: SignalId) -> bool;

    /// Whether the value of a signal can be reached from its last sound reading before a detector found a fault.
    fn has_returned(&self, signal: SignalId) -> bool;

    /// Whether the readings of a signal have started anew with their last jump.
    fn has_started_anew(&self, signal: SignalId) -> bool;

    /// Whether the current value of a signal is the one at which it may rest.
    fn is_at_rest(&self, signal: SignalId) -> bool;

    /// Whether a signal counts: only how it changes says something of other variables.
    fn counts(&self, signal: SignalId) -> bool;
}

impl EvidenceView for Monitor {
    fn pairs(&self) -> &[Residual] {
        self.residuals()
    }

    fn pairs_of(&self, signal: SignalId) -> impl Iterator<Item = &Residual> {
        self.pairs_of(signal)
    }

    fn restless(&self) -> impl Iterator<Item = &Residual> {
        self.restless()
    }

    fn way(&self, index: WayIndex) -> Option<&WatchedWay> {
        self.way(index)
    }

    fn frozen(&self, signal: SignalId) -> Frozen {
        self.frozen(signal)
    }

    fn latest_value(&self, signal: SignalId) -> Option<Interval> {
        self.ports()[signal].newest().map(|sample| sample.value)
    }

    fn is_sound(&self, signal: SignalId) -> bool {
        let watch = self.timeouts();
        let is_present = watch.absence(signal).is_none() && watch.has_given_value(signal);
        is_present && self.detectors().fault(signal).is_none()
    }

    fn has_returned(&self, signal: SignalId) -> bool {
        self.ports()[signal].has_returned()
    }

    fn has_started_anew(&self, signal: SignalId) -> bool {
        self.ports()[signal].has_started_anew()
    }

    fn is_at_rest(&self, signal: SignalId) -> bool {
        self.ports()[signal].is_at_rest()
    }

    fn counts(&self, signal: SignalId) -> bool {
        self.ports()[signal].is_counter()
    }
}
