//! The third detector: one way gives the other way's values earlier or later.
//!
//! Such differences are proportional to the slope of the values, so a linear regression gives the shift in time.

use super::{HALF, TREND_MEMORY, TrendOptions, approach};
use crate::numbers::{NEAR, SHIFT_EXPLAINS};
use crate::time::Span;

/// The relation between the differences of two ways and the slope of the values: means, weighted exponentially.
#[derive(Clone, Copy, Debug)]
pub(super) struct Skew {
    /// The mean square difference from which on a shift in time counts, where it explains the differences.
    limit: f64,
    /// The mean square difference below which no alarm is near.
    calm: f64,
    /// The largest difference that counts: a wild value is no shift in time.
    largest: f64,
    /// The mean of the differences' squares.
    pub(super) square: f64,
    /// The means of the other way's slope (1/s) with itself and with the difference.
    pub(super) slope_slope: f64,
    pub(super) slope_difference: f64,
    /// Whether a shift in time explained the differences until single comparisons began to disagree.
    was_shifted: bool,
}

impl Skew {
    pub(super) fn new(options: &TrendOptions) -> Skew {
        let limit = options.skew * options.skew;
        Skew {
            limit,
            calm: HALF * limit,
            largest: libm::sqrt(NEAR * limit * TREND_MEMORY * f64::from(options.least.max(1))),
            square: 0.0,
            slope_slope: 0.0,
            slope_difference: 0.0,
            was_shifted: false,
        }
    }

    /// Takes in a difference and the slope of the other way's values.
    // Part of every comparison: `inline` alone would not inline it.
    #[inline(always)]
    pub(super) fn record(&mut self, difference: f64, slope: f64, gain: f64) {
        let difference = difference.clamp(-self.largest, self.largest);
        approach(&mut self.square, difference * difference, gain);
        approach(&mut self.slope_slope, slope * slope, gain);
        approach(&mut self.slope_difference, slope * difference, gain);
    }

    /// The mean square difference as a multiple of its limit, where a shift in time explains it; `held` scales the share to
    /// explain.
    pub(super) fn nearness(&self, held: f64) -> f64 {
        self.shifted(held) / self.limit
    }

    fn shifted(&self, held: f64) -> f64 {
        if self.explained() > SHIFT_EXPLAINS * held { self.square } else { 0.0 }
    }

    fn explained(&self) -> f64 {
        let squares = self.slope_slope * self.square;
        if squares > 0.0 { self.slope_difference * self.slope_difference / squares } else { 0.0 }
    }

    /// Whether the skew is far from an alarm.
    #[inline(always)]
    pub(super) fn stays_calm(&self) -> bool {
        self.square <= self.calm
    }

    /// Notes that single comparisons begin to disagree; the arguments tell whether the skew is an alarm, and whether the means
    /// have enough weight.
    pub(super) fn note(&mut self, is_alarm: bool, rests_on_enough: bool) {
        self.was_shifted = is_alarm || (rests_on_enough && self.shifted(HALF) > HALF * self.limit);
    }

    /// Whether a shift in time is why single comparisons disagree.
    pub(super) fn was_shifted(&self) -> bool {
        self.was_shifted
    }

    /// How late the first way is beside the other; `None` where no shift in time explains the differences.
    pub(super) fn late(&self) -> Option<Span> {
        let is_explained = self.slope_slope > 0.0 && self.explained() > SHIFT_EXPLAINS * HALF;
        is_explained.then(|| Span::from_seconds(-self.slope_difference / self.slope_slope))
    }
}
