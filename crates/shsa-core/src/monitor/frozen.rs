//! How long a signal has repeated its value, and how long it usually does.

use crate::interval::Interval;
use crate::numbers::{IN_A_ROW, LATELY, MISSED_PERIODS};
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

impl Frozen {
    /// Takes in a reading.
    pub fn record(&mut self, value: Interval, time: Time) {
        match self.value {
            Some(before) if before == value => self.readings = self.readings.saturating_add(1),
            Some(_) => {
                let lasted = time - self.since;
                let change = Span((lasted - self.usual).0 / i64::from(LATELY));
                self.usual = if self.usual == Span::ZERO { lasted } else { self.usual + change };
                (self.since, self.readings) = (time, 1);
            }
            None => (self.since, self.readings) = (time, 1),
        }
        self.value = Some(value);
    }

    /// Whether the signal has stood still since before `moment`, and for longer than usual by `now`.
    #[must_use]
    pub fn is_still_since(&self, moment: Time, now: Time) -> bool {
        self.readings >= IN_A_ROW
            && self.since <= moment
            && now - self.since > self.usual.times(MISSED_PERIODS)
    }

    /// Whether the value has ever changed.
    #[must_use]
    pub fn has_moved(&self) -> bool {
        self.usual > Span::ZERO
    }

    /// Since when the value has been the same.
    #[must_use]
    pub fn since(&self) -> Time {
        self.since
    }
}
