//! What the judge hears: the comparisons with their ways, and of each signal what bears on its trust.

use crate::interval::Interval;
use crate::knowledge::SignalId;
use crate::monitor::{Frozen, Monitor, Residual, WatchedWay, WayIndex};

/// All that the judge reads of what watches the signals.
pub trait Testimony {
    /// All pairs of ways that are compared.
    fn pairs(&self) -> &[Residual];

    /// Those that rest on a signal, in their order.
    fn pairs_of(&self, signal: SignalId) -> impl Iterator<Item = &Residual>;

    /// Those in which something has disagreed of late, in their order: all that are undecided or in conflict, or may become
    /// so without another disagreement.
    fn restless(&self) -> impl Iterator<Item = &Residual>;

    /// A way that is compared.
    fn way(&self, index: WayIndex) -> Option<&WatchedWay>;

    /// Since when a signal says the same.
    fn frozen(&self, signal: SignalId) -> Frozen;

    /// What a signal says now, SI, when it is a number.
    fn said(&self, signal: SignalId) -> Option<Interval>;

    /// Whether a signal says something, and nothing is wrong with its readings in themselves.
    fn is_sound(&self, signal: SignalId) -> bool;

    /// Whether a signal says what it could say, from what it said before its readings showed a fault.
    fn is_home(&self, signal: SignalId) -> bool;
}

impl Testimony for Monitor {
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

    fn said(&self, signal: SignalId) -> Option<Interval> {
        self.ports()[signal].newest().map(|sample| sample.value)
    }

    fn is_sound(&self, signal: SignalId) -> bool {
        let watch = self.timeouts();
        let is_heard = watch.absence(signal).is_none() && watch.has_spoken(signal);
        is_heard && self.detectors().fault(signal).is_none()
    }

    fn is_home(&self, signal: SignalId) -> bool {
        self.ports()[signal].is_home()
    }
}
