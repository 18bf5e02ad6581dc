//! The estimate of a history's value after its newest sample.
//!
//! Lines through the last 2, 4 and 8 samples (least squares) compete. Of the change that a line predicts, a share is taken: the share
//! that would have predicted the recent samples best, each from those before it, reduced by its own uncertainty. So where lines have
//! predicted nothing, the latest value stands. The line with the least error predicts the next value, and is as wrong as of late.
//! A. P. Dawid, "Statistical theory: the prequential approach", 1984, doi:10.2307/2981683; W. James, C. Stein, "Estimation with
//! quadratic loss", 1961, for the reduction.

use super::history::History;
use crate::interval::Interval;
use crate::numbers::{BEYOND_NOISE, FEWEST, LATELY};
use crate::time::{Time, Validity};

/// The numbers of samples that lines go through.
const LINES: [usize; 3] = [2, 4, 8];

/// A share is reduced by this multiple of its variance: lines that predict by chance only have no share.
const DOUBT: f64 = 2.0;

impl History {
    /// The number of samples that [`History::ahead`] goes over.
    pub const AHEAD: usize = (LATELY as usize) + 8;

    /// The estimate of the value at a moment after the newest sample, where `max_rate` bounds its change a second (0 where nothing
    /// does): the latest value and a share of the change that the best line predicts, with twice the recent error to either side, and
    /// no further from the newest value than the rate allows. It is no bound. `None` before the newest sample, and with fewer than five
    /// samples. Complexity: O(1), some hundred operations.
    #[must_use]
    pub fn ahead(&self, moment: Validity, max_rate: f64) -> Option<Interval> {
        let newest = self.newest(0).filter(|newest| newest.validity.to < moment.from)?;
        let at = moment.centre();
        let tried = |samples: usize| Some((samples, self.trial(samples)?));
        let least = |one: &(usize, Trial), other: &(usize, Trial)| one.1.least().total_cmp(&other.1.least());
        let (samples, trial) = LINES.into_iter().filter_map(tried).min_by(least)?;
        let spacing = newest.validity.centre() - self.newest(1)?.validity.centre();
        // An error grows with the time for which it is predicted, and was found over one spacing.
        let grown = ((at - newest.validity.centre()).seconds() / spacing.seconds()).max(1.0);
        let reach = 0.5 * newest.value.width() + BEYOND_NOISE * trial.error() * grown;
        let change = trial.share() * (self.predicted(0, samples, at)? - newest.value.midpoint());
        let value = newest.value.midpoint() + if change.is_finite() { change } else { 0.0 };
        let estimate = Interval::new(value - reach, value + reach);
        if max_rate <= 0.0 {
            return (!estimate.is_empty() && estimate.is_bounded()).then_some(estimate);
        }
        let farthest = (moment.to - newest.validity.from).seconds();
        let possible = newest.value.widened(farthest * max_rate);
        let within = estimate.intersection(possible);
        Some(if within.is_empty() || !within.is_bounded() { possible } else { within })
    }

    /// The line through `samples` samples, tried on the recent ones.
    fn trial(&self, samples: usize) -> Option<Trial> {
        let mut trial = Trial::default();
        for back in 0..(LATELY as usize) {
            let Some((target, before)) = self.newest(back).zip(self.newest(back + 1)) else { break };
            let Some(predicted) = self.predicted(back + 1, samples, target.validity.centre()) else { break };
            let before = before.value.midpoint();
            trial.record(target.value.midpoint() - before, predicted - before);
        }
        (trial.count >= (FEWEST as usize)).then_some(trial)
    }

    /// The value at a time by the line through `samples` samples, the newest of which is `back` before the newest of all.
    fn predicted(&self, back: usize, samples: usize, at: Time) -> Option<f64> {
        let origin = self.newest(back)?.validity.centre();
        let (mut times, mut values, mut squares, mut products) = (0.0, 0.0, 0.0, 0.0);
        for place in back..back + samples {
            let sample = self.newest(place)?;
            let (time, value) = ((sample.validity.centre() - origin).seconds(), sample.value.midpoint());
            times += time;
            values += value;
            squares += time * time;
            products += time * value;
        }
        let count = samples as f64;
        let (spread, along) = (count * squares - times * times, count * products - times * values);
        let slope = along / spread;
        let predicted = (values - slope * times) / count + slope * (at - origin).seconds();
        predicted.is_finite().then_some(predicted)
    }
}

/// The changes from sample to sample, and those that a line predicted: the sums of their squares and products.
#[derive(Clone, Copy, Default)]
struct Trial {
    changes: f64,
    predicted: f64,
    products: f64,
    count: usize,
}

impl Trial {
    fn record(&mut self, change: f64, predicted: f64) {
        self.changes += change * change;
        self.predicted += predicted * predicted;
        self.products += change * predicted;
        self.count += 1;
    }

    /// The share of the predicted changes that fits best, from 0 to 1.
    fn fitted(&self) -> f64 {
        if self.predicted > 0.0 { (self.products / self.predicted).clamp(0.0, 1.0) } else { 0.0 }
    }

    /// The sum of the squared errors with this share.
    fn squares(&self, share: f64) -> f64 {
        (self.changes - share * (2.0 * self.products - share * self.predicted)).max(0.0)
    }

    /// The least sum of the squared errors with any share.
    fn least(&self) -> f64 {
        self.squares(self.fitted())
    }

    /// The fitted share, reduced by its uncertainty.
    fn share(&self) -> f64 {
        let fitted = self.fitted();
        let explained = fitted * fitted * self.predicted;
        if explained <= 0.0 {
            return 0.0;
        }
        let variance = self.least() / (self.count as f64 - 1.0);
        fitted * (1.0 - DOUBT * variance / explained).max(0.0)
    }

    /// The root of the mean square error with that share.
    fn error(&self) -> f64 {
        libm::sqrt(self.squares(self.share()) / self.count as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::alignment::Sample;
    use proptest::prelude::*;

    fn history(values: impl IntoIterator<Item = (f64, f64)>) -> History {
        let mut history = History::new(History::AHEAD);
        for (seconds, value) in values {
            let validity = Validity::at(Time::from_seconds(seconds));
            history.push(Sample { validity, value: Interval::new(value - 0.1, value + 0.1) });
        }
        history
    }

    fn ahead(history: &History, seconds: f64, max_rate: f64) -> Option<Interval> {
        history.ahead(Validity::at(Time::from_seconds(seconds)), max_rate)
    }

    #[test]
    fn a_ramp_goes_on_and_what_jumps_about_stays() {
        let ramp = history((0..20).map(|n| (f64::from(n), 2.0 * f64::from(n))));
        let value = ahead(&ramp, 20.0, 0.0).unwrap();
        assert!((value.midpoint() - 40.0).abs() < 1e-9 && value.width() < 0.21, "{value:?}");
        // A random walk by single steps, none of which tells the next.
        let steps = [0.0, 1.0, 1.0, 0.0, 1.0, 0.0, 0.0, -1.0, 0.0, -1.0, -1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0];
        let walk = history(steps.into_iter().enumerate().map(|(n, value)| (n as f64, value)));
        let value = ahead(&walk, 17.0, 0.0).unwrap();
        assert!((value.midpoint() - 1.0).abs() < 0.8 && value.width() > 1.0, "{value:?}");
    }

    #[test]
    fn a_bound_of_the_rate_limits_the_estimate() {
        let ramp = history((0..20).map(|n| (f64::from(n), 2.0 * f64::from(n))));
        // The newest value lies within 0.1 of 38, and moves by no more than 0.5 a second.
        let value = ahead(&ramp, 21.0, 0.5).unwrap();
        assert!(value.lo() > 36.8 && value.hi() < 39.2, "{value:?}");
    }

    #[test]
    fn nothing_is_estimated_from_too_little_or_backwards() {
        let short = |samples: u8| history((0..samples).map(|n| (f64::from(n), f64::from(n))));
        assert_eq!(ahead(&short(4), 4.0, 0.0), None);
        assert!(ahead(&short(5), 5.0, 0.0).is_some());
        let ramp = history((0..20).map(|n| (f64::from(n), 2.0 * f64::from(n))));
        assert_eq!(ahead(&ramp, 18.5, 0.0), None);
    }

    proptest! {
        #[test]
        fn anything_may_come(samples in prop::collection::vec((any::<i64>(), any::<f64>()), 0..20), at in any::<i64>(), max_rate in 0.0..10.0_f64) {
            let mut history = History::new(History::AHEAD);
            for (at, value) in samples {
                history.push(Sample { validity: Validity::at(Time(at)), value: Interval::point(value) });
            }
            let found = history.ahead(Validity::at(Time(at)), max_rate);
            prop_assert!(found.is_none_or(|it| !it.is_empty()), "{found:?}");
        }
    }
}
