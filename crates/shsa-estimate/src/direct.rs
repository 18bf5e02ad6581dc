//! Fusion without a model: several inputs measure one quantity directly.
//!
//! The quantity is a single state that walks at random: its variance grows at a declared rate. So a value of some age is off by
//! its own noise and by the walk since then, which all older values share: a mean with weights `w`, noise variances `r` and ages
//! `a` has the variance `sum(w_i^2 r_i) + growth * sum(w_i w_j min(a_i, a_j))`.

mod recent;

use crate::Error;
use crate::average::{Certain, MovingAverage, Window, by_confidence};
use crate::interval_fusion::{Regions, brooks_iyengar, marzullo, schmid};
use crate::matrix::{Matrix, at, put};
use crate::method::{Bias, Errors, Gaussian, Innovation, Measurement, Method, Tally, Updated};
use recent::{Part, Recent, errors, walked};
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
    /// Marzullo's interval of the values of a moment, each with a number of standard deviations to both sides. Where no value is
    /// in enough intervals, the quantity is unknown: its variance is infinite.
    Marzullo(Faulty),
    /// Schmid's interval, of the same values.
    Schmid(Faulty),
    /// The estimate of Brooks and Iyengar.
    BrooksIyengar(Faulty),
}

impl Rule {
    /// The rule for a number of inputs: of a single one no fault can be tolerated.
    pub(crate) fn among(mut self, inputs: usize) -> Rule {
        if let Rule::Marzullo(faulty) | Rule::Schmid(faulty) | Rule::BrooksIyengar(faulty) = &mut self {
            faulty.count = faulty.count.min(inputs.saturating_sub(1));
        }
        self
    }
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
    /// The estimate, of one number, and how far it may be off by errors within bounds.
    estimate: Gaussian,
    bias: Bias,
    intervals: Vec<Interval>,
    /// The values of this moment, with the variance of each that includes the walk during its age.
    pairs: Vec<(Option<f64>, f64)>,
    /// Their bounds.
    bounds: Vec<f64>,
    /// Their ages in seconds, and with their weights, the youngest first.
    ages: Vec<f64>,
    weighted: Vec<Part>,
    regions: Regions,
    recent: Recent,
}

/// The numbers of the memory before those of the window.
const HEAD: usize = 5;

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
        let window = window_capacity(&rule);
        Ok(Direct {
            rule,
            variances: variances.to_vec(),
            growth,
            estimate: Gaussian { mean: vec![mean], spread: Matrix::from_element(1, 1, variance) },
            bias: Bias { reach: Matrix::zeros(1, 1), counted: Matrix::zeros(1, 1) },
            intervals: Vec::with_capacity(n),
            pairs: Vec::with_capacity(n),
            bounds: Vec::with_capacity(n),
            ages: Vec::with_capacity(n),
            weighted: Vec::with_capacity(n),
            regions: Regions::new(n),
            recent: Recent::new(window),
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

    /// Sets how far the value may be off within bounds, and the part of its variance that stands for that.
    fn set_errors(&mut self, bound: f64, counted: f64) {
        put(&mut self.bias.reach, 0, 0, bound * bound);
        put(&mut self.bias.counted, 0, 0, counted);
    }

    fn variance(&self, measurement: &Measurement) -> Option<f64> {
        let own = measurement.variance.or_else(|| self.variances.get(measurement.sensor).copied());
        own.filter(|variance| *variance > 0.0 && variance.is_finite() && measurement.value.is_finite())
    }

    /// The value of a moment and its variance; `None` where it is unknown.
    fn combined(&mut self) -> Option<(f64, f64)> {
        match &self.rule {
            Rule::Average(_) | Rule::Median(_) => self.windowed(),
            Rule::Confidence => self.by_confidence(),
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

    fn by_confidence(&mut self) -> Option<(f64, f64)> {
        let alike = by_confidence(&self.pairs, Certain::Refused).ok()?;
        let weights = self.pairs.iter().map(|(_, variance)| alike.variance / variance);
        self.weighted.clear();
        self.weighted.extend(self.ages.iter().copied().zip(weights.clone()));
        self.weighted.sort_unstable_by(|one, other| one.0.total_cmp(&other.0));
        // The variances of the pairs have the walk of each alone, not what they share.
        let alone: f64 = self.weighted.iter().map(|(age, weight)| weight * weight * age).sum();
        let shared = walked(self.weighted.iter().copied()) - alone;
        let weights = self.pairs.iter().map(|(_, variance)| alike.variance / variance);
        let (bound, counted) = errors(self.bounds.iter().copied().zip(weights));
        self.set_errors(bound, counted);
        Some((alike.value, alike.variance + self.growth * shared.max(0.0)))
    }

    /// Takes the values one by one into the window.
    fn windowed(&mut self) -> Option<(f64, f64)> {
        let (capacity, mut mean) = (window_capacity(&self.rule), None);
        for ((value, variance), bound) in self.pairs.iter().zip(&self.bounds) {
            let value = (*value)?;
            self.recent.push(*variance, *bound, capacity);
            match &mut self.rule {
                Rule::Average(average) => mean = Some(average.push(value)),
                Rule::Median(window) => window.push(value),
                _ => {}
            }
        }
        match &mut self.rule {
            Rule::Average(average) => {
                let variance = self.recent.variance(average.shares(), self.growth);
                let (bound, counted) = self.recent.errors(average.shares());
                self.set_errors(bound, counted);
                Some((mean?, variance))
            }
            Rule::Median(window) => {
                let count = window.values().len();
                let weights = std::iter::repeat_n(1.0 / count as f64, count);
                // Of n uniform numbers the median has this many times the variance of their mean, of normal ones less: up to pi / 2.
                // Of one or two it is their mean.
                let times = if count < 3 { 1.0 } else { 3.0 * count as f64 / (count as f64 + 2.0) };
                let variance = times * self.recent.variance(weights.clone(), self.growth);
                let (bound, (_, counted)) = (self.recent.bound_of_median(), self.recent.errors(weights));
                let median = window.median()?;
                self.set_errors(bound, times * counted);
                Some((median, variance))
            }
            _ => None,
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

    /// Updates with the measurements of a moment, and others of these ages in seconds; one without an age is of this moment.
    pub(crate) fn update_aged(&mut self, measurements: &[Measurement], ages: &[f64]) -> Updated {
        self.pairs.clear();
        self.bounds.clear();
        self.ages.clear();
        let (before, own) = self.known();
        let own = own.min(f64::MAX / 2.0);
        let mut tally = Tally::NOTHING;
        for (place, measurement) in measurements.iter().enumerate().take(self.variances.len()) {
            let Some(variance) = self.variance(measurement) else { continue };
            let age = ages.get(place).copied().unwrap_or(0.0);
            self.pairs.push((Some(measurement.value), variance + self.growth * age));
            self.bounds.push(measurement.bound);
            self.ages.push(age);
            tally.count(measurement.value - before, variance + own);
        }
        let updated = tally.updated(false);
        if self.pairs.is_empty() {
            return updated;
        }
        match self.combined() {
            Some((value, variance)) => {
                self.set(value, variance);
                updated
            }
            // No value is in enough intervals: more inputs are faulty than declared, or too few speak.
            None => {
                self.set(before, f64::INFINITY);
                Updated { used: 0, ..updated }
            }
        }
    }
}

fn window_capacity(rule: &Rule) -> usize {
    match rule {
        Rule::Average(average) => average.window().capacity(),
        Rule::Median(window) => window.capacity(),
        _ => 0,
    }
}

impl Method for Direct {
    fn gaussian(&self) -> &Gaussian {
        &self.estimate
    }

    fn gaussian_mut(&mut self) -> &mut Gaussian {
        &mut self.estimate
    }

    fn bias(&self) -> Option<&Bias> {
        Some(&self.bias)
    }

    fn predict(&mut self, dt: f64, _: &[f64]) -> bool {
        let (mean, variance) = self.known();
        self.set(mean, variance + self.growth * dt.max(0.0));
        self.recent.ages.iter_mut().for_each(|age| *age += dt.max(0.0));
        true
    }

    fn innovation(&mut self, measurement: &Measurement, _: &[f64]) -> Option<Innovation> {
        let (mean, own) = self.known();
        // Where the quantity is unknown, every measurement fits.
        let noise = self.variance(measurement)?;
        let (expected, random) = self.bias.along(&[1.0], own.min(f64::MAX));
        let errors = Some(Errors { expected, measured: measurement.bound, random });
        let variance = (noise + own).min(f64::MAX);
        Some(Innovation { value: measurement.value - mean, variance, noise, errors })
    }

    fn update(&mut self, measurements: &[Measurement], _: &[f64]) -> Updated {
        self.update_aged(measurements, &[])
    }

    fn memory_len(&self) -> usize {
        HEAD + 4 * window_capacity(&self.rule)
    }

    fn save(&self, memory: &mut [f64]) {
        let values = match &self.rule {
            Rule::Average(average) => average.window().values(),
            Rule::Median(window) => window.values(),
            _ => &[],
        };
        let (mean, variance) = self.known();
        let Bias { reach, counted } = &self.bias;
        let head: [f64; HEAD] = [mean, variance, at(reach, 0, 0), at(counted, 0, 0), values.len() as f64];
        let Recent { ages, variances, bounds, .. } = &self.recent;
        crate::method::save(memory, &[&head, values, ages, variances, bounds]);
    }

    fn restore(&mut self, memory: &[f64]) {
        let [mean, variance, reach, counted, count, kept @ ..] = memory else { return };
        self.set(*mean, *variance);
        put(&mut self.bias.reach, 0, 0, *reach);
        put(&mut self.bias.counted, 0, 0, *counted);
        let (count, Recent { ages, variances, bounds, .. }) = (*count as usize, &mut self.recent);
        let window = match &mut self.rule {
            Rule::Average(average) => average.window_mut(),
            Rule::Median(window) => window,
            _ => return,
        };
        window.clear();
        kept.iter().take(count).for_each(|value| window.push(*value));
        for (part, to) in [ages, variances, bounds].into_iter().enumerate() {
            to.clear();
            to.extend(kept.iter().skip((part + 1) * count).take(count));
        }
    }
}

#[cfg(test)]
mod tests;
