//! The second detector: differences change from one comparison to the next by more than the declared errors allow.

use super::{HALF, TREND_MEMORY, TrendOptions, approach, smaller};
use crate::numbers::{BRIEF, MOSTLY, SCATTER_LEAST};

/// The scatter of the differences of two ways, as means over the last seconds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scatter {
    /// The variance that is beyond the declared errors.
    limit: f64,
    /// The variance below which no alarm is near.
    calm: f64,
    /// The mean of half the squares of the differences' changes (von Neumann), which is their variance when they are
    /// independent.
    pub(super) variance: f64,
    /// The mean of the differences' squares.
    pub(super) square: f64,
}

impl Scatter {
    pub(super) fn new(options: &TrendOptions) -> Scatter {
        let limit = options.scatter * options.scatter;
        Scatter { limit, calm: HALF * limit, variance: 0.0, square: 0.0 }
    }

    /// Takes in a difference and the one before; `elapsed` is the time between them in seconds.
    // Part of every comparison: `inline` alone would not inline it.
    #[inline(always)]
    pub(super) fn record(&mut self, difference: f64, before: f64, elapsed: f64) {
        let change = difference - before;
        let gain = smaller(elapsed / BRIEF.seconds(), 1.0 / SCATTER_LEAST) / TREND_MEMORY;
        approach(&mut self.variance, 0.5 * change * change, gain);
        approach(&mut self.square, difference * difference, gain);
    }

    /// The variance as a multiple of its limit.
    pub(super) fn nearness(&self) -> f64 {
        self.variance / self.limit
    }

    /// Whether the scatter is far from an alarm.
    #[inline(always)]
    pub(super) fn stays_calm(&self) -> bool {
        self.variance <= self.calm
    }

    /// Whether differences alternate rather than last.
    pub(super) fn alternates(&self) -> bool {
        self.variance > MOSTLY * self.square
    }
}
