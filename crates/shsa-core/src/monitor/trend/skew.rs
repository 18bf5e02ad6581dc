//! The third detector: one way says what the other one says, but earlier or later.
//!
//! Such differences go with the slope of the values, so a regression of the one on the other tells how late the way is.

use super::{HALF, HYSTERESIS, MEMORY, TrendOptions, approach};
use crate::time::Span;

/// A root mean square difference of so many deviations may be a shift in time, when that explains it.
pub(super) const SHIFTED: f64 = 3.0;
/// The share of the differences' squares that a shift in time must explain.
const EXPLAINED: f64 = 0.8;

/// A single difference adds at most this share of the limit, even where it is one of the fewest that means rest on.
const SINGLE: f64 = 0.25;

/// How the differences of two ways go with the slope of the values: means, weighted exponentially.
#[derive(Clone, Copy, Debug)]
pub(super) struct Skew {
    /// The mean square difference that must be explained by a shift in time to be one.
    limit: f64,
    /// Below this it comes near to nothing.
    calm: f64,
    /// No difference counts as more: a wild value is no shift in time.
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
            largest: libm::sqrt(SINGLE * limit * MEMORY * f64::from(options.least.max(1))),
            square: 0.0,
            slope_slope: 0.0,
            slope_difference: 0.0,
            was_shifted: false,
        }
    }

    /// Takes in a difference with the slope of the other way's values.
    // A part of what is done for every comparison: by a hint alone it would be called.
    #[inline(always)]
    pub(super) fn record(&mut self, difference: f64, slope: f64, gain: f64) {
        let difference = difference.clamp(-self.largest, self.largest);
        approach(&mut self.square, difference * difference, gain);
        approach(&mut self.slope_slope, slope * slope, gain);
        approach(&mut self.slope_difference, slope * difference, gain);
    }

    /// The mean square difference as a multiple of its limit, where a shift in time explains it; `held` of the share that it
    /// must explain is enough.
    pub(super) fn nearness(&self, held: f64) -> f64 {
        self.shifted(held) / self.limit
    }

    fn shifted(&self, held: f64) -> f64 {
        if self.explained() > EXPLAINED * held { self.square } else { 0.0 }
    }

    fn explained(&self) -> f64 {
        let squares = self.slope_slope * self.square;
        if squares > 0.0 { self.slope_difference * self.slope_difference / squares } else { 0.0 }
    }

    /// Whether it is far from an alarm.
    #[inline(always)]
    pub(super) fn stays_calm(&self) -> bool {
        self.square <= self.calm
    }

    /// Single comparisons begin to disagree; whether there is an alarm, and whether the means rest on enough.
    pub(super) fn note(&mut self, is_alarm: bool, rests_on_enough: bool) {
        self.was_shifted = is_alarm || (rests_on_enough && self.shifted(HYSTERESIS) > HALF * self.limit);
    }

    /// Whether it is why single comparisons disagree.
    pub(super) fn was_shifted(&self) -> bool {
        self.was_shifted
    }

    /// How much later than the other the first way tells what happens; `None` where no shift in time explains the
    /// differences.
    pub(super) fn late(&self) -> Option<Span> {
        let is_explained = self.slope_slope > 0.0 && self.explained() > EXPLAINED * HYSTERESIS;
        is_explained.then(|| Span::from_seconds(-self.slope_difference / self.slope_slope))
    }
}
