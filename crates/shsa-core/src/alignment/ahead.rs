//! The estimate of a history's value after its newest sample.
//!
//! Several predictors compete: the latest value, and lines through the last 2, 4 and 8 samples (least squares). The model that
//! has predicted the recent samples best, each sample from those before it, predicts the next value. Its recent error is the
//! uncertainty of the prediction. A. P. Dawid, "Statistical theory: the prequential approach", 1984, doi:10.2307/2981683.

use super::history::History;
use crate::interval::Interval;
use crate::time::{Time, Validity};

/// How many recent samples the predictors are tried on, and the fewest that judge them.
const TRIED: usize = 8;
const FEWEST: usize = 3;

/// The samples that each predictor goes on from; one is the latest value.
const PREDICTORS: [usize; 4] = [1, 2, 4, 8];

/// The half-width of an estimate in errors of the past, root of the mean square: of normal errors, 95 % are below.
const DEVIATIONS: f64 = 2.0;

impl History {
    /// The number of samples that [`History::ahead`] goes over.
    pub const AHEAD: usize = TRIED + 8;

    /// The estimate of the value at a moment after the newest sample, where `max_rate` bounds its change a second (0 where
    /// nothing does): what the best of the predictors says, with twice its recent error to either side, and no further from
    /// the newest value than the rate allows. It is no bound. `None` before the newest sample, and with fewer than four
    /// samples. Complexity: O(1), some hundred operations.
    #[must_use]
    pub fn ahead(&self, moment: Validity, max_rate: f64) -> Option<Interval> {
        let newest = self.newest(0).filter(|newest| newest.validity.to < moment.from)?;
        let at = moment.centre();
        let tried = |samples: usize| self.recent_error(samples).map(|error| (samples, error));
        let (samples, error) =
            PREDICTORS.into_iter().filter_map(tried).min_by(|one, other| one.1.total_cmp(&other.1))?;
        let spacing = newest.validity.centre() - self.newest(1)?.validity.centre();
        // An error grows with the time for which it is predicted, and was found over one spacing.
        let grown = ((at - newest.validity.centre()).seconds() / spacing.seconds()).max(1.0);
        let reach = 0.5 * newest.value.width() + DEVIATIONS * error.max(0.0) * grown;
        let value = self.predicted(0, samples, at)?;
        let estimate = Interval::new(value - reach, value + reach);
        if max_rate <= 0.0 {
            return (!estimate.is_empty() && estimate.is_bounded()).then_some(estimate);
        }
        let farthest = (moment.to - newest.validity.from).seconds();
        let possible = newest.value.widened(farthest * max_rate);
        let within = estimate.intersection(possible);
        Some(if within.is_empty() || !within.is_bounded() { possible } else { within })
    }

    /// The root of the mean square error of a predictor over the recent samples.
    fn recent_error(&self, samples: usize) -> Option<f64> {
        let (mut squares, mut count) = (0.0, 0_u32);
        for back in 0..TRIED {
            let Some((target, predicted)) = self.newest(back).and_then(|target| {
                let predicted = self.predicted(back + 1, samples, target.validity.centre())?;
                Some((target.value.midpoint(), predicted))
            }) else {
                break;
            };
            squares += (target - predicted) * (target - predicted);
            count += 1;
        }
        (count as usize >= FEWEST).then(|| libm::sqrt(squares / f64::from(count)))
    }

    /// The value at a time by the line through `samples` samples, the newest of which is `back` before the newest of all; the
    /// value of that one where it is alone.
    fn predicted(&self, back: usize, samples: usize, at: Time) -> Option<f64> {
        let last = self.newest(back)?;
        if samples < 2 {
            return Some(last.value.midpoint());
        }
        let origin = last.validity.centre();
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
        assert_eq!(ahead(&history([(0.0, 1.0), (1.0, 2.0), (2.0, 3.0)]), 3.0, 0.0), None);
        assert!(ahead(&history([(0.0, 1.0), (1.0, 2.0), (2.0, 3.0), (3.0, 4.0)]), 4.0, 0.0).is_some());
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
