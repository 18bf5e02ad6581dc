//! Saves and restores the state of the trend detectors, which many comparisons have built up.

use super::{Tendency, Trend};
use crate::time::Time;

/// The state of the trend of two ways.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrendRecord {
    /// The usual difference, SI; `None` while that is not known.
    pub usual: Option<f64>,
    /// How near a drift above and below the usual difference is to an alarm, in 0..1.
    pub sums: [f64; 2],
    /// Weighted means of the difference, SI, and in shares of the tolerance of its square, of the same in the last second,
    /// of half the square of its changes, and of the slope with itself and with the difference.
    pub means: [f64; 6],
    /// The weight of the means, in 0..1.
    pub weight: f64,
    /// The trend.
    pub tendency: Tendency,
}

impl Trend {
    /// The state to remember; `None` before the first comparison.
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

    /// Goes on from a remembered state; a state with impossible numbers is ignored.
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
