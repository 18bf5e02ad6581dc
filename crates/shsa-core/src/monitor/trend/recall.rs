//! Takes the state of the trend detectors out as numbers and puts it back: it took many comparisons to gather.

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
        let Trend { drift, scatter, skew, .. } = self;
        (drift.weight > 0.0).then_some(TrendRecord {
            usual: drift.usual,
            sums: drift.sums,
            means: [
                drift.mean,
                skew.square,
                scatter.square,
                scatter.variance,
                skew.slope_slope,
                skew.slope_difference,
            ],
            weight: drift.weight,
            tendency: self.alarm,
        })
    }

    /// Goes on from what was remembered; numbers that cannot be are left out.
    pub fn recall(&mut self, record: &TrendRecord, now: Time) {
        let [mean, square, recent, variance, slope_slope, slope_difference] = record.means;
        let numbers = record.means.iter().chain(&record.sums).chain(&record.usual).chain([&record.weight]);
        if !numbers.into_iter().all(|number| number.is_finite()) {
            return;
        }
        let not_below_zero = |number: f64| number.max(0.0);
        *self = Trend::empty(self.options, self.noise);
        let Trend { drift, scatter, skew, .. } = self;
        drift.usual = record.usual;
        drift.settled = record.usual.map(|_| now);
        drift.sums = record.sums.map(|sum| sum.clamp(0.0, 1.0));
        drift.mean = mean;
        drift.weight = record.weight.clamp(0.0, 1.0);
        scatter.variance = not_below_zero(variance);
        scatter.square = not_below_zero(recent);
        skew.square = not_below_zero(square);
        skew.slope_slope = not_below_zero(slope_slope);
        skew.slope_difference = slope_difference;
        (self.alarm, self.raised) = (record.tendency, now);
    }
}
