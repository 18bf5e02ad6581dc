//! Amendments to a monitor's past: evidence that no longer counts, and state from before the start.

use super::{Absence, Monitor, TrendRecord, WayIndex};
use crate::interval::Interval;
use crate::knowledge::{SignalId, VariableId};
use crate::time::Time;
use alloc::collections::BTreeMap;

impl Monitor {
    /// Forgets the comparisons of some pairs, given by their places; later ones count. O(all pairs).
    pub fn forget_pairs(&mut self, places: &[usize]) {
        for &place in places {
            if let Some(pair) = self.pairs.get_mut(place) {
                pair.window.forget();
                pair.trend.begin_anew();
                pair.disagreement = None;
                pair.moved = (0.0, 0.0);
            }
        }
        self.index.renew(&self.pairs);
    }

    /// Restores the trends of pairs, and [how far they have moved](super::Residual::moved), by the two ways of each pair. O(n log n) in
    /// pairs.
    pub fn recall_trends(
        &mut self,
        records: &BTreeMap<(WayIndex, WayIndex), (TrendRecord, [f64; 2])>,
        now: Time,
    ) {
        for pair in &mut self.pairs {
            if let Some((record, moved)) = records.get(&(pair.way, pair.other)) {
                pair.trend.recall(record, now);
                pair.recall_moved(*moved);
            }
        }
        self.index.renew(&self.pairs);
    }

    /// Sets the present value of a constant that is learned. O(ways).
    pub fn set_constant(&mut self, variable: VariableId, value: Interval) {
        for way in &mut self.ways {
            way.computation.set_constant(variable, value);
            if way.constant.is_some() {
                way.constant = way.computation.constant();
            }
        }
    }

    /// Forgets the detector state of a signal; to be called between two moments.
    pub fn forget_readings(&mut self, signal: SignalId) {
        self.detectors.forget(signal);
        self.ports[signal].set_gate(false);
        self.ports[signal].come_home();
    }

    /// Accepts that a signal, trusted again, is where it is, however far comparisons of its changes say that it has moved.
    pub fn trust_level(&mut self, signal: SignalId) {
        for &at in self.index.of_signal(signal) {
            self.pairs.get_mut(at as usize).into_iter().for_each(|pair| pair.moved = (0.0, 0.0));
        }
    }

    /// A signal has begun anew: what is computed from it forgets what it has seen. O(ways).
    pub(super) fn begin_anew(&mut self, signal: SignalId) {
        for way in &mut self.ways {
            if way.computation.begin_anew(signal) {
                way.outputs.clear();
                way.measured = None;
            }
        }
    }

    /// Accepts the present level of a signal's readings as sound.
    pub fn trust_readings(&mut self, signal: SignalId) {
        self.ports[signal].come_home();
    }

    /// Sets a signal absent from before the start: the signal stays absent until its first value, and this absence is not
    /// reported.
    pub fn expect_absent(&mut self, signal: SignalId, absence: Absence) {
        self.timeouts.expect_absent(signal, absence);
    }
}
