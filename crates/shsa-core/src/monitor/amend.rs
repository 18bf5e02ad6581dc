//! What a monitor is told about its past: that evidence no longer counts, or what there was before the start.

use super::{Absence, Monitor, TrendRecord, WayIndex};
use crate::knowledge::SignalId;
use crate::time::Time;
use alloc::collections::BTreeMap;

impl Monitor {
    /// Forgets the comparisons of some pairs, given by their places; what comes later counts. O(all pairs).
    pub fn forget_pairs(&mut self, places: &[usize]) {
        for &place in places {
            if let Some(pair) = self.pairs.get_mut(place) {
                pair.window.forget();
                pair.trend.begin_anew();
                pair.disagreement = None;
            }
        }
        self.index.renew(&self.pairs);
    }

    /// Goes on with what many comparisons had shown before the start, by the two ways of each pair. O(n log n) in pairs.
    pub fn recall_trends(&mut self, records: &BTreeMap<(WayIndex, WayIndex), TrendRecord>, now: Time) {
        for pair in &mut self.pairs {
            if let Some(record) = records.get(&(pair.way, pair.other)) {
                pair.trend.recall(record, now);
            }
        }
        self.index.renew(&self.pairs);
    }

    /// Forgets what the readings of a signal have shown by themselves; between two moments.
    pub fn forget_readings(&mut self, signal: SignalId) {
        self.detectors.forget(signal);
        self.ports[signal].set_gate(false);
        self.ports[signal].come_home();
    }

    /// The readings of a signal are trusted again where they are.
    pub fn trust_readings(&mut self, signal: SignalId) {
        self.ports[signal].come_home();
    }

    /// A signal was absent before the start: it counts as that until it speaks, and its absence is no news.
    pub fn expect_absent(&mut self, signal: SignalId, absence: Absence) {
        self.timeouts.expect_absent(signal, absence);
    }
}
