//! Fusion without a model: several inputs measure one quantity directly.
//!
//! The quantity is a single state; between measurements it stays constant, and its variance grows at a declared rate.

use crate::Error;
use crate::average::{Certain, MovingAverage, Window, by_confidence};
use crate::interval_fusion::{Regions, brooks_iyengar, marzullo, schmid};
use crate::matrix::{Matrix, at, put};
use crate::method::{Gaussian, Innovation, Measurement, Method, Tally, Updated};
use shsa_core::interval::Interval;

/// How the values of several inputs are combined.
#[derive(Clone, Debug)]
pub enum Rule {
    /// The weighted average of the last values, whichever input they came from.
    Average(MovingAverage),
    /// The median of the last values.
    Median(Window),
    /// The average of the values of a moment by their variances.
    Confidence,
    /// Marzullo's interval of the values of a moment, each with a number of standard deviations to both sides.
    Marzullo(Faulty),
    /// Schmid's interval, of the same values.
    Schmid(Faulty),
    /// The estimate of Brooks and Iyengar.
    BrooksIyengar(Faulty),
}

/// The parameters of interval fusion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Faulty {
    /// The largest number of faulty inputs.
    pub count: usize,
    /// The half-width of an input's interval, in standard deviations.
    pub deviations: f64,
}

/// A quantity measured by several inputs.
#[derive(Clone, Debug)]
pub struct Direct {
    rule: Rule,
    /// The variance of each input whose measurement brings none.
    variances: Vec<f64>,
    /// The growth of the variance in a second.
    growth: f64,
    /// The estimate, of one number.
    estimate: Gaussian,
    intervals: Vec<Interval>,
    pairs: Vec<(Option<f64>, f64)>,
    regions: Regions,
}

impl Direct {
    /// Starts from a value and its variance.
    ///
    /// # Errors
    /// A variance that is not above zero, growth below zero, no input, or a recursive average.
    pub fn new(
        rule: Rule,
        variances: &[f64],
        growth: f64,
        (mean, variance): (f64, f64),
    ) -> Result<Direct, Error> {
        if variances.is_empty() {
            return Err(Error::Nothing);
        }
        for value in variances.iter().copied() {
            if !(value > 0.0 && value.is_finite()) {
                return Err(Error::Range {
                    what: "the variance of an input",
                    value,
                    range: "finite and above 0",
                });
            }
        }
        for (what, value) in [("the growth of the variance", growth), ("the initial variance", variance)] {
            if value.is_nan() || value < 0.0 {
                return Err(Error::Range { what, value, range: "0 or more" });
            }
        }
        if let Rule::Average(average) = &rule
            && average.is_recursive()
        {
            return Err(Error::Formula {
                what: "a moving average".to_owned(),
                reason: "is recursive: what it remembers never ends, and late values could not be taken in"
                    .to_owned(),
            });
        }
        let n = variances.len();
        Ok(Direct {
            rule,
            variances: variances.to_vec(),
            growth,
            estimate: Gaussian { mean: vec![mean], spread: Matrix::from_element(1, 1, variance) },
            intervals: Vec::with_capacity(n),
            pairs: Vec::with_capacity(n),
            regions: Regions::new(n),
        })
    }

    /// The value and its variance.
    fn known(&self) -> (f64, f64) {
        let Gaussian { mean, spread } = &self.estimate;
        (mean.first().copied().unwrap_or(f64::NAN), at(spread, 0, 0))
    }

    fn set(&mut self, value: f64, variance: f64) {
        let Gaussian { mean, spread } = &mut self.estimate;
        mean.fill(value);
        put(spread, 0, 0, variance);
    }

    fn variance(&self, measurement: &Measurement) -> Option<f64> {
        let own = measurement.variance.or_else(|| self.variances.get(measurement.sensor).copied());
        own.filter(|variance| *variance > 0.0 && variance.is_finite() && measurement.value.is_finite())
    }

    /// The value of a moment and its variance.
    fn combined(&mut self) -> Option<(f64, f64)> {
        let alike = by_confidence(&self.pairs, Certain::Refused).ok()?;
        match &mut self.rule {
            Rule::Confidence => Some((alike.value, alike.variance)),
            Rule::Average(average) => {
                let value = average.push(alike.value);
                let weights: f64 = average.shares().map(|share| share * share).sum();
                Some((value, alike.variance * weights))
            }
            Rule::Median(window) => {
                window.push(alike.value);
                // The median of n normal numbers has pi / 2 times the variance of their mean; a single number has its own.
                let count = window.values().len() as f64;
                let share = if count < 2.0 { 1.0 } else { (std::f64::consts::FRAC_PI_2 / count).min(1.0) };
                Some((window.median()?, alike.variance * share))
            }
            Rule::Marzullo(faulty) | Rule::Schmid(faulty) | Rule::BrooksIyengar(faulty) => {
                let Faulty { count, deviations } = *faulty;
                self.intervals.clear();
                self.intervals.extend(self.pairs.iter().filter_map(|(value, variance)| {
                    let (value, reach) = ((*value)?, deviations * variance.sqrt());
                    Some(Interval::new(value - reach, value + reach))
                }));
                let (value, about) = self.fused(count)?;
                let reach = (about.hi() - value).max(value - about.lo());
                Some((value, (reach / deviations).powi(2)))
            }
        }
    }

    fn fused(&mut self, faulty: usize) -> Option<(f64, Interval)> {
        match self.rule {
            Rule::Marzullo(_) => marzullo(&self.intervals, faulty).map(|it| (it.midpoint(), it)),
            Rule::Schmid(_) => schmid(&self.intervals, faulty).map(|it| (it.midpoint(), it)),
            _ => {
                brooks_iyengar(&self.intervals, faulty, &mut self.regions);
                self.regions.estimate().zip(self.regions.hull())
            }
        }
    }

    fn window(&mut self) -> Option<&mut Window> {
        match &mut self.rule {
            Rule::Average(average) => Some(average.window_mut()),
            Rule::Median(window) => Some(window),
            _ => None,
        }
    }

    fn window_capacity(&self) -> usize {
        match &self.rule {
            Rule::Average(average) => average.window().capacity(),
            Rule::Median(window) => window.capacity(),
            _ => 0,
        }
    }
}

impl Method for Direct {
    fn gaussian(&self) -> &Gaussian {
        &self.estimate
    }

    fn gaussian_mut(&mut self) -> &mut Gaussian {
        &mut self.estimate
    }

    fn predict(&mut self, dt: f64, _: &[f64]) -> bool {
        let (mean, variance) = self.known();
        self.set(mean, variance + self.growth * dt.max(0.0));
        true
    }

    fn innovation(&mut self, measurement: &Measurement, _: &[f64]) -> Option<Innovation> {
        let (mean, own) = self.known();
        let variance = self.variance(measurement)? + own;
        variance.is_finite().then_some(Innovation { value: measurement.value - mean, variance })
    }

    fn update(&mut self, measurements: &[Measurement], _: &[f64]) -> Updated {
        self.pairs.clear();
        let (before, own) = self.known();
        let mut tally = Tally::NOTHING;
        for measurement in measurements.iter().take(self.variances.len()) {
            let Some(variance) = self.variance(measurement) else { continue };
            self.pairs.push((Some(measurement.value), variance));
            tally.count(measurement.value - before, variance + own);
        }
        let updated = tally.updated(false);
        match self.combined() {
            Some((value, variance)) => {
                self.set(value, variance);
                updated
            }
            // No value is in enough intervals: more inputs are faulty than declared.
            None => Updated { used: 0, ..updated },
        }
    }

    fn memory_len(&self) -> usize {
        3 + self.window_capacity()
    }

    fn save(&self, memory: &mut [f64]) {
        let values = match &self.rule {
            Rule::Average(average) => average.window().values(),
            Rule::Median(window) => window.values(),
            _ => &[],
        };
        let (mean, variance) = self.known();
        let head = [mean, variance, values.len() as f64];
        crate::method::save(memory, &[&head, values]);
    }

    fn restore(&mut self, memory: &[f64]) {
        let [mean, variance, count, values @ ..] = memory else { return };
        self.set(*mean, *variance);
        if let Some(window) = self.window() {
            window.clear();
            values.iter().take(*count as usize).for_each(|value| window.push(*value));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measured(values: &[f64]) -> Vec<Measurement> {
        let all = values.iter().enumerate();
        all.map(|(sensor, value)| Measurement { sensor, value: *value, variance: None }).collect()
    }

    #[track_caller]
    fn check(rule: Rule, values: &[f64], expected: f64) {
        let mut direct = Direct::new(rule, &[1.0; 4], 0.5, (0.0, 9.0)).unwrap();
        direct.update(&measured(values), &[]);
        assert!((direct.mean()[0] - expected).abs() < 1e-12, "{}", direct.mean()[0]);
    }

    #[test]
    fn a_liar_is_outvoted() {
        let faulty = Faulty { count: 1, deviations: 2.0 };
        check(Rule::Confidence, &[1.0, 2.0, 3.0], 2.0);
        check(Rule::Marzullo(faulty), &[1.0, 2.0, 3.0, 90.0], 2.0);
        check(Rule::Schmid(faulty), &[1.0, 2.0, 3.0, 90.0], 2.5);
        check(Rule::BrooksIyengar(faulty), &[1.0, 2.0, 3.0, 90.0], 2.0);
        // Two inputs are faulty: no value is in three of four intervals, and the estimate stays.
        check(Rule::Marzullo(faulty), &[1.0, 2.0, 50.0, 90.0], 0.0);
    }

    #[test]
    fn without_input_the_variance_grows() {
        let mut direct = Direct::new(Rule::Confidence, &[1.0], 0.5, (0.0, 9.0)).unwrap();
        direct.update(&measured(&[3.0]), &[]);
        assert!(direct.predict(2.0, &[]));
        assert_eq!((direct.mean()[0], direct.spread()[(0, 0)]), (3.0, 2.0));
    }

    #[test]
    fn a_window_goes_back_with_the_rest() {
        let mut direct = Direct::new(Rule::Median(Window::new(3)), &[1.0], 0.0, (0.0, 1.0)).unwrap();
        direct.update(&measured(&[1.0]), &[]);
        let mut memory = vec![0.0; direct.memory_len()];
        direct.save(&mut memory);
        let mut go_on = || {
            [5.0, 9.0].map(|value| {
                direct.update(&measured(&[value]), &[]);
                direct.mean()[0]
            })
        };
        assert_eq!(go_on(), [3.0, 5.0]);
        direct.restore(&memory);
        assert_eq!(direct.mean()[0], 1.0);
        direct.update(&measured(&[5.0]), &[]);
        assert_eq!(direct.mean()[0], 3.0);
    }
}
