//! The trait of all methods: predict, compute an innovation, update, save and restore.

use crate::Error;
use crate::matrix::{Matrix, check_covariance, variance_along};
use std::f64::consts::TAU;

/// A measurement of one sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement {
    /// The sensor, by its place in the declared order.
    pub sensor: usize,
    /// The measured value, SI.
    pub value: f64,
    /// The variance that comes with the value; `None` takes the model's.
    pub variance: Option<f64>,
    /// How far the value may be off by an error that need not average out, 0 or more. Its part of the variance is that of a uniform
    /// error, a third of its square.
    pub bound: f64,
}

/// A measurement compared with its expectation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Innovation {
    /// The measured value minus the expected one; an angle within half a turn.
    pub value: f64,
    /// The variance of the innovation: the sum of those of the expectation and of the measurement.
    pub variance: f64,
    /// The variance of the measurement alone.
    pub noise: f64,
    /// How far it may be off by errors within bounds, where they are kept apart from noise.
    pub errors: Option<Errors>,
}

impl Innovation {
    /// The variance of the expectation.
    #[must_use]
    pub fn uncertainty(&self) -> f64 {
        self.variance - self.noise
    }

    /// The squared value divided by the variance: chi-square distributed with one degree of freedom.
    #[must_use]
    pub fn normalized_square(&self) -> f64 {
        self.value * self.value / self.variance
    }

    /// The same for what errors within bounds do not explain, and for the noise alone: above a limit, the measurement contradicts what is
    /// expected.
    #[must_use]
    pub fn contradiction(&self) -> f64 {
        let Some(Errors { expected, measured, random }) = self.errors else {
            return self.normalized_square();
        };
        let rest = self.value.abs() - expected - measured;
        let random = random + (self.noise - uniform(measured)).max(0.0);
        if rest > 0.0 { rest * rest / random.max(ROUNDING * self.variance) } else { 0.0 }
    }
}

/// The share of a variance that rounding may leave where no noise is declared.
const ROUNDING: f64 = 1e-12;

/// The variance of an error that may be anywhere within a bound.
pub(crate) fn uniform(bound: f64) -> f64 {
    bound * bound / 3.0
}

/// Errors within bounds, which need not average out, beside noise, which does.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Errors {
    /// How far the expectation may be off by them.
    pub expected: f64,
    /// How far the measurement may.
    pub measured: f64,
    /// The variance of the expectation by noise alone.
    pub random: f64,
}

/// How far an estimate may be off by errors within bounds, n by n each.
#[derive(Clone, Debug, PartialEq)]
pub struct Bias {
    /// An ellipsoid that holds it: along `h` it is off by no more than the root of `h' reach h`.
    pub reach: Matrix,
    /// The part of the covariance that stands for these errors; the rest is noise.
    pub counted: Matrix,
}

impl Bias {
    /// How far a number with these derivatives by the states, and with this variance, may be off within bounds, and the variance that is
    /// noise.
    pub(crate) fn along(&self, gradient: &[f64], variance: f64) -> (f64, f64) {
        let reach = variance_along(&self.reach, gradient).max(0.0).sqrt();
        (reach, (variance - variance_along(&self.counted, gradient)).max(0.0))
    }
}

/// The result of an update.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Updated {
    /// The number of measurements used; those without an expectation are left out.
    pub used: usize,
    /// The normalized square of all innovations together: chi-square distributed with `used` degrees of freedom.
    pub normalized_square: f64,
    /// The logarithm of their joint density.
    pub log_likelihood: f64,
    /// Whether the covariance (for particles: the weights) had to be repaired.
    pub healed: bool,
}

impl Updated {
    /// The result without measurements.
    pub const NOTHING: Updated =
        Updated { used: 0, normalized_square: 0.0, log_likelihood: 0.0, healed: false };
}

/// The accumulated independent innovations of a moment. One logarithm is taken for many variances.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tally {
    used: usize,
    square: f64,
    /// The product of the variances whose logarithm has not been taken.
    product: f64,
    logarithm: f64,
}

impl Tally {
    pub(crate) const NOTHING: Tally = Tally { used: 0, square: 0.0, product: 1.0, logarithm: 0.0 };

    /// Takes in an innovation that is independent of those before.
    #[inline]
    pub(crate) fn count(&mut self, apart: f64, variance: f64) {
        self.used += 1;
        self.square += apart * apart / variance;
        let scale = TAU * variance;
        // Neither the product nor its factor comes near the range limits of a float.
        let is_moderate = (1e-100..1e100).contains(&scale) && (1e-200..1e200).contains(&self.product);
        if is_moderate {
            self.product *= scale;
        } else {
            self.logarithm += libm::log(scale) + libm::log(self.product);
            self.product = 1.0;
        }
    }

    pub(crate) fn updated(self, healed: bool) -> Updated {
        if self.used == 0 {
            return Updated { healed, ..Updated::NOTHING };
        }
        let log_likelihood = -0.5 * (self.square + self.logarithm + libm::log(self.product));
        Updated { used: self.used, normalized_square: self.square, log_likelihood, healed }
    }
}

/// A mean of n numbers and its covariance.
#[derive(Clone, Debug, PartialEq)]
pub struct Gaussian {
    /// The mean.
    pub mean: Vec<f64>,
    /// The covariance, n by n, symmetric and positive semidefinite.
    pub spread: Matrix,
}

impl Gaussian {
    /// A mean of `n` numbers with a covariance.
    ///
    /// # Errors
    /// A wrong size, or a covariance that is not positive semidefinite. Time: n^3.
    pub fn new(mean: &[f64], spread: &Matrix, n: usize) -> Result<Gaussian, Error> {
        if mean.len() != n {
            return Err(Error::Size { what: "the initial state", found: mean.len(), wanted: n });
        }
        check_covariance("the initial covariance", spread, n)?;
        Ok(Gaussian { mean: mean.to_vec(), spread: spread.clone() })
    }
}

/// A method of estimation. No allocation after construction; without measurements an update changes nothing.
///
/// Measurements come in the declared order of their sensors, none twice; surplus measurements are ignored.
pub trait Method: Send {
    /// The present estimate.
    fn gaussian(&self) -> &Gaussian;

    /// The present estimate, mutable.
    fn gaussian_mut(&mut self) -> &mut Gaussian;

    /// The mean of the present estimate, n numbers.
    fn mean(&self) -> &[f64] {
        &self.gaussian().mean
    }

    /// The covariance of the present estimate, n by n, symmetric and positive semidefinite.
    fn spread(&self) -> &Matrix {
        &self.gaussian().spread
    }

    /// How far the estimate may be off by errors within bounds; `None` where they are not kept apart from noise.
    fn bias(&self) -> Option<&Bias> {
        None
    }

    /// Predicts over a time in seconds. Returns false where the model has no value: then nothing has changed.
    fn predict(&mut self, dt: f64, controls: &[f64]) -> bool;

    /// A measurement compared with its present expectation; `None` where the model has no value. Changes nothing.
    fn innovation(&mut self, measurement: &Measurement, controls: &[f64]) -> Option<Innovation>;

    /// Updates with all measurements of a moment together.
    fn update(&mut self, measurements: &[Measurement], controls: &[f64]) -> Updated;

    /// Multiplies the covariance, when the estimate was too sure.
    fn widen(&mut self, factor: f64) {
        self.gaussian_mut().spread *= factor;
    }

    /// Whether mean and covariance are the whole state, so that [`Method::gaussian_mut`] sets all of it.
    fn is_gaussian(&self) -> bool {
        let Gaussian { mean, spread } = self.gaussian();
        self.memory_len() == mean.len() + spread.len()
    }

    /// The number of numbers in the state.
    fn memory_len(&self) -> usize {
        let Gaussian { mean, spread } = self.gaussian();
        mean.len() + spread.len()
    }

    /// Copies the state into a slice of that length.
    fn save(&self, memory: &mut [f64]) {
        let Gaussian { mean, spread } = self.gaussian();
        save(memory, &[mean, spread.as_slice()]);
    }

    /// Restores a saved state.
    fn restore(&mut self, memory: &[f64]) {
        let Gaussian { mean, spread } = self.gaussian_mut();
        restore(memory, &mut [mean, spread.as_mut_slice()]);
    }
}

/// Copies slices one behind the other into a memory.
pub(crate) fn save(memory: &mut [f64], parts: &[&[f64]]) {
    let mut rest = memory;
    for part in parts {
        let Some((own, after)) = rest.split_at_mut_checked(part.len()) else { return };
        own.copy_from_slice(part);
        rest = after;
    }
}

/// Copies slices back from a memory.
pub(crate) fn restore(memory: &[f64], parts: &mut [&mut [f64]]) {
    let mut rest = memory;
    for part in parts {
        let Some((own, after)) = rest.split_at_checked(part.len()) else { return };
        part.copy_from_slice(own);
        rest = after;
    }
}
