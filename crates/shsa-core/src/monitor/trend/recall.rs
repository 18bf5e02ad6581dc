//! What many comparisons have shown, taken out as numbers and put back: it took long to come together.

use super::{Tendency, Trend};
use crate::time::Time;

/// What many comparisons of two ways have shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrendRecord {
    /// How much the two usually differ, SI; `None` while that is not known.
    pub usual: Option<f64>,
    /// How far a drift above and below that has come towards an alarm, in 0..1.
    pub sums: [f64; 2],
    /// Weighted means of the difference, SI, and in shares of the tolerance of its square, of the same in the last second,
    /// of half the square of its changes, and of the slope with itself and with the difference.
    pub means: [f64; 6],
    /// How much the means rest on, in 0..1.
    pub weight: f64,
    /// What has come together.
    pub tendency: Tendency,
}

impl Trend {
    /// What is to be remembered; `None` before there is anything.
    #[must_use]
    pub fn to_record(&self) -> Option<TrendRecord> {
        (self.weight > 0.0).then_some(TrendRecord {
            usual: self.usual,
            sums: self.sums,
            means: [
                self.mean,
                self.square,
                self.recent,
                self.scatter,
                self.slope_slope,
                self.slope_difference,
            ],
            weight: self.weight,
            tendency: self.alarm,
        })
    }

    /// Goes on from what was remembered; numbers that cannot be are left out.
    pub fn recall(&mut self, record: &TrendRecord, now: Time) {
        let [mean, square, recent, scatter, slope_slope, slope_difference] = record.means;
        let numbers = record.means.iter().chain(&record.sums).chain(&record.usual).chain([&record.weight]);
        if !numbers.into_iter().all(|number| number.is_finite()) {
            return;
        }
        let not_below_zero = |number: f64| number.max(0.0);
        *self = Trend {
            usual: record.usual,
            settled: record.usual.map(|_| now),
            sums: record.sums.map(|sum| sum.clamp(0.0, 1.0)),
            mean,
            square: not_below_zero(square),
            recent: not_below_zero(recent),
            scatter: not_below_zero(scatter),
            slope_slope: not_below_zero(slope_slope),
            slope_difference,
            weight: record.weight.clamp(0.0, 1.0),
            alarm: record.tendency,
            raised: now,
            ..Trend::empty(self.options, self.noise)
        };
    }
}
