//! How long a signal has said the same, and how long it usually does.

use crate::interval::Interval;
use crate::time::{Span, Time};

/// The last change of a signal's values.
#[derive(Clone, Copy, Debug, Default)]
pub struct Frozen {
    value: Option<Interval>,
    since: Time,
    readings: u32,
    /// The mean time between two changes.
    usual: Span,
}

/// Fewer readings of the same value are no standstill, and neither is
const FEWEST: u32 = 4;
/// less than so many times the usual time between two changes.
const LONGER: i64 = 3;
/// The mean goes over about so many changes.
const MEMORY: i64 = 8;

impl Frozen {
    /// Takes a reading in.
    pub fn record(&mut self, value: Interval, time: Time) {
        match self.value {
            Some(before) if before == value => self.readings = self.readings.saturating_add(1),
            Some(_) => {
                let lasted = time - self.since;
                let change = Span((lasted - self.usual).0 / MEMORY);
                self.usual = if self.usual == Span::ZERO { lasted } else { self.usual + change };
                (self.since, self.readings) = (time, 1);
            }
            None => (self.since, self.readings) = (time, 1),
        }
        self.value = Some(value);
    }

    /// Whether it has stood still since before `moment`, and for longer than usual by `now`.
    #[must_use]
    pub fn is_still_since(&self, moment: Time, now: Time) -> bool {
        self.readings >= FEWEST && self.since <= moment && now - self.since > self.usual.times(LONGER)
    }

    /// Whether it has ever changed.
    #[must_use]
    pub fn has_moved(&self) -> bool {
        self.usual > Span::ZERO
    }

    /// Since when it says the same.
    #[must_use]
    pub fn since(&self) -> Time {
        self.since
    }
}
