//! For how long readings have been exactly the same.

use crate::interval::Interval;
use crate::numbers::FEWEST;
use crate::time::{Span, Time};

/// Consecutive readings that are exactly the same.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Standstill {
    pub(super) value: Option<Interval>,
    since: Time,
    readings: u32,
}

impl Standstill {
    /// Takes in a reading; returns since when the readings have been the same.
    #[inline]
    pub(super) fn record(&mut self, is_same: bool, value: Option<Interval>, now: Time) -> Option<Span> {
        if is_same {
            self.readings = self.readings.saturating_add(1);
        } else {
            *self = Standstill { value, since: now, readings: 1 };
        }
        (self.readings >= FEWEST).then(|| now - self.since)
    }
}
