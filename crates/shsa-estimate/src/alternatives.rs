//! Alternatives to the usual course of a moment: a value may be an outlier, and a state may have stepped since the moment before.
//!
//! A filter takes every value for a usual one, and every change of a state for its usual noise. So a load that is switched on looks
//! like an outlier to it, and an outlier of one sensor like a wrong value of another one. Here a moment that surprises the filter is
//! explained in several ways: as usual, with one of its values as an outlier, with a state that has stepped, or with both. Each way
//! has the weight of its rarity and of the density that it gives to the values. The estimate becomes the mean and the covariance of
//! the mixture, and nothing else remains of the ways. When a step has happened is not known: its covariance is that of process noise
//! since the moment before, so states that integrate the stepping one are uncertain with it. Where it is known that a step comes right
//! after the moment before, they follow from it.
//!
//! This is the generalised pseudo-Bayes method of first order: G. Ackerson, K. Fu 1970 (doi:10.1109/TAC.1970.1099359); Y. Bar-Shalom,
//! X. R. Li, T. Kirubarajan 2001, "Estimation with Applications to Tracking and Navigation" (doi:10.1002/0471221279), section 11.6.
//!
//! A moment without surprise costs one update, any other (1 + outliers) (1 + steps). No allocation after construction.

use crate::continuous::{Continuous, Step};
use crate::method::{Gaussian, Innovation, Measurement, Method, Updated, restore, save};
use crate::mixture::{Part, mix};
use crate::system::System;

/// A sensor whose values may be outliers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outlier {
    /// The place of the sensor.
    pub sensor: usize,
    /// The standard deviation of an outlier, SI.
    pub deviation: f64,
}

/// The share of the values that are outliers.
const OUTLIERS: f64 = 0.001;
/// A step is never more probable than this, however long ago the moment before was. And it is never less probable than an outlier:
/// else a sensor that nothing confirms would be disbelieved for long after a step.
const MOST_PROBABLE: f64 = 0.5;
/// Up to this normalized square of the innovations, all other ways together have less than a hundredth of the weight.
const USUAL: f64 = 4.0;

/// A way to explain a moment, and what it leads to.
#[derive(Clone, Debug)]
struct Way {
    estimate: Gaussian,
    /// The logarithm of its weight.
    weight: f64,
}

/// A filter with alternatives to the usual course of each moment.
pub struct Alternatives {
    filter: Box<dyn Method>,
    /// The model of the filter, for the covariance of a step.
    system: Continuous,
    outliers: Vec<Outlier>,
    steps: Vec<Step>,
    /// The mean time between two steps of a state, in seconds.
    every: f64,
    /// The estimate after the last update, from which a step sets out, and the time since, in seconds.
    from: Vec<f64>,
    elapsed: f64,
    /// The estimate before an update.
    prior: Gaussian,
    /// The ways of a moment; those in use come first.
    ways: Vec<Way>,
    count: usize,
    stack: Vec<Measurement>,
}

impl Alternatives {
    /// Alternatives beside a filter of a system, whose memory is its mean and covariance; a state steps about once in `every` seconds.
    #[must_use]
    pub fn new(
        filter: Box<dyn Method>,
        system: Continuous,
        outliers: Vec<Outlier>,
        steps: Vec<Step>,
        every: f64,
    ) -> Alternatives {
        let prior = filter.gaussian().clone();
        let way = Way { estimate: prior.clone(), weight: 0.0 };
        Alternatives {
            from: prior.mean.clone(),
            elapsed: 0.0,
            ways: vec![way; (1 + outliers.len()) * (1 + steps.len())],
            count: 0,
            stack: Vec::with_capacity(system.sensors()),
            prior,
            filter,
            system,
            outliers,
            steps,
            every,
        }
    }

    /// Notes where the filter has come to as a way of this weight.
    fn note(&mut self, weight: f64) {
        let Some(way) = self.ways.get_mut(self.count) else { return };
        way.weight = if weight.is_nan() { f64::NEG_INFINITY } else { weight };
        set_to(&mut way.estimate, self.filter.gaussian());
        self.count += 1;
    }

    /// Updates the filter as if a state had stepped and a value were an outlier, or one of both.
    fn explain(
        &mut self,
        step: Option<Step>,
        outlier: Option<Outlier>,
        measurements: &[Measurement],
        controls: &[f64],
    ) -> Updated {
        let Gaussian { mean, spread } = self.filter.gaussian_mut();
        mean.copy_from_slice(&self.prior.mean);
        spread.copy_from(&self.prior.spread);
        if let Some(step) = step {
            self.system.add_step(&self.from, controls, self.elapsed, step, spread);
        }
        self.stack.clear();
        for measurement in measurements {
            let mut measurement = *measurement;
            if let Some(Outlier { deviation, .. }) = outlier.filter(|it| it.sensor == measurement.sensor) {
                let known = self.filter.innovation(&measurement, controls).map(|it| it.noise);
                measurement.variance = known.map(|own| own + deviation * deviation).or(measurement.variance);
            }
            self.stack.push(measurement);
        }
        let updated = self.filter.update(&self.stack, controls);
        let rarity = step
            .map_or(0.0, |_| libm::log((self.elapsed / self.every).clamp(OUTLIERS, MOST_PROBABLE)))
            + outlier.map_or(0.0, |_| libm::log(OUTLIERS));
        self.note(rarity + updated.log_likelihood);
        updated
    }

    /// The estimate becomes the mixture of the ways. Returns the logarithm of the sum of their weights.
    fn mix(&mut self) -> f64 {
        let used = self.ways.get(..self.count).unwrap_or(&[]).iter();
        let parts = used.map(|Way { estimate, weight }| Part {
            weight: *weight,
            mean: &estimate.mean,
            spread: estimate.spread.as_slice(),
        });
        mix(self.filter.gaussian_mut(), parts)
    }

    /// The next moment sets out from the present estimate.
    fn set_out(&mut self) {
        self.from.copy_from_slice(self.filter.mean());
        self.elapsed = 0.0;
    }
}

impl Method for Alternatives {
    fn gaussian(&self) -> &Gaussian {
        self.filter.gaussian()
    }

    fn gaussian_mut(&mut self) -> &mut Gaussian {
        self.filter.gaussian_mut()
    }

    fn predict(&mut self, dt: f64, controls: &[f64]) -> bool {
        let is_predicted = self.filter.predict(dt, controls);
        self.elapsed += if is_predicted { dt } else { 0.0 };
        is_predicted
    }

    fn innovation(&mut self, measurement: &Measurement, controls: &[f64]) -> Option<Innovation> {
        self.filter.innovation(measurement, controls)
    }

    fn update(&mut self, measurements: &[Measurement], controls: &[f64]) -> Updated {
        set_to(&mut self.prior, self.filter.gaussian());
        let usual = self.filter.update(measurements, controls);
        if usual.used == 0 {
            return usual;
        }
        let mut best = usual;
        if usual.normalized_square > USUAL {
            self.count = 0;
            self.note(usual.log_likelihood);
            let mut greatest = usual.log_likelihood;
            let steps = if self.elapsed > 0.0 { self.steps.len() } else { 0 };
            for place in 1..(1 + steps) * (1 + self.outliers.len()) {
                let (step, outlier) = (place % (1 + steps), place / (1 + steps));
                let step = step.checked_sub(1).and_then(|at| self.steps.get(at).copied());
                let outlier = outlier.checked_sub(1).and_then(|at| self.outliers.get(at).copied());
                let is_there = |it: Outlier| measurements.iter().any(|other| other.sensor == it.sensor);
                if outlier.is_none_or(is_there) {
                    let updated = self.explain(step, outlier, measurements, controls);
                    let weight = self.ways.get(self.count - 1).map_or(f64::NEG_INFINITY, |way| way.weight);
                    if weight > greatest {
                        (greatest, best) = (weight, updated);
                    }
                }
            }
            best.log_likelihood = self.mix();
        }
        self.set_out();
        best
    }

    fn knows_outliers(&self) -> bool {
        !self.outliers.is_empty()
    }

    fn memory_len(&self) -> usize {
        self.filter.memory_len() + self.from.len() + 1
    }

    fn save(&self, memory: &mut [f64]) {
        let own = self.filter.memory_len();
        let Some((to_filter, rest)) = memory.split_at_mut_checked(own) else { return };
        self.filter.save(to_filter);
        save(rest, &[&self.from, &[self.elapsed]]);
    }

    fn restore(&mut self, memory: &[f64]) {
        let own = self.filter.memory_len();
        let Some((of_filter, rest)) = memory.split_at_checked(own) else { return };
        self.filter.restore(of_filter);
        let mut elapsed = [0.0];
        restore(rest, &mut [&mut self.from, &mut elapsed]);
        [self.elapsed] = elapsed;
    }
}

fn set_to(to: &mut Gaussian, from: &Gaussian) {
    to.mean.copy_from_slice(&from.mean);
    to.spread.copy_from(&from.spread);
}

#[cfg(test)]
mod tests;
