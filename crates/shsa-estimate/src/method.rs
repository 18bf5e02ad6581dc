//! The one trait of all methods: predict, look at a measurement, take measurements in, keep and restore.

use crate::Error;
use crate::matrix::{Matrix, check_covariance};
use std::f64::consts::TAU;

/// What one sensor has measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement {
    /// The sensor, by its place in the declared order.
    pub sensor: usize,
    /// What it says, in SI units.
    pub value: f64,
    /// The variance that came with the value; `None` takes that of the model.
    pub variance: Option<f64>,
}

/// A measurement beside what was expected of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Innovation {
    /// What was measured, less what was expected; an angle within half a turn.
    pub value: f64,
    /// Its variance: that of the expectation and that of the measurement.
    pub variance: f64,
}

impl Innovation {
    /// Its square in units of its variance: chi-square distributed with one degree of freedom.
    #[must_use]
    pub fn normalized_square(&self) -> f64 {
        self.value * self.value / self.variance
    }
}

/// What measurements have done.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Updated {
    /// The measurements used; those without an expectation are not.
    pub used: usize,
    /// The normalized square of all innovations together: chi-square distributed with `used` degrees of freedom.
    pub normalized_square: f64,
    /// The logarithm of their joint density.
    pub log_likelihood: f64,
    /// Whether the covariance (of particles: the weights) had to be healed.
    pub healed: bool,
}

impl Updated {
    /// Of no measurement.
    pub const NOTHING: Updated =
        Updated { used: 0, normalized_square: 0.0, log_likelihood: 0.0, healed: false };
}

/// The innovations of a moment, made independent, and what they come to. One logarithm is taken for many of them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tally {
    used: usize,
    square: f64,
    /// Of the variances whose logarithm has not been taken.
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
        // Neither the product nor a factor of it comes near to the end of what a float can be.
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

/// A mean of n numbers with its covariance.
#[derive(Clone, Debug, PartialEq)]
pub struct Gaussian {
    /// The mean.
    pub mean: Vec<f64>,
    /// Its covariance, n by n, symmetric and positive semidefinite.
    pub spread: Matrix,
}

impl Gaussian {
    /// A mean of `n` numbers with a covariance.
    ///
    /// # Errors
    /// Another size, a covariance that is not positive semidefinite. Time: n^3.
    pub fn new(mean: &[f64], spread: &Matrix, n: usize) -> Result<Gaussian, Error> {
        if mean.len() != n {
            return Err(Error::Size { what: "the initial state", found: mean.len(), wanted: n });
        }
        check_covariance("the initial covariance", spread, n)?;
        Ok(Gaussian { mean: mean.to_vec(), spread: spread.clone() })
    }
}

/// A method of estimation. Nothing is allocated once it is made; without measurements nothing is corrected.
///
/// Measurements are given in the declared order of their sensors, none twice; of more than there are sensors the rest is left
/// out.
pub trait Method: Send {
    /// The present estimate.
    fn gaussian(&self) -> &Gaussian;

    /// The same, to set it by hand.
    fn gaussian_mut(&mut self) -> &mut Gaussian;

    /// The mean of the present estimate, n numbers.
    fn mean(&self) -> &[f64] {
        &self.gaussian().mean
    }

    /// Its covariance, n by n, symmetric and positive semidefinite.
    fn spread(&self) -> &Matrix {
        &self.gaussian().spread
    }

    /// Goes on by a time in seconds. False: the model has no value there, and nothing is changed.
    fn predict(&mut self, dt: f64, controls: &[f64]) -> bool;

    /// A measurement beside what is expected of it now; `None` where the model has no value. Changes nothing.
    fn innovation(&mut self, measurement: &Measurement, controls: &[f64]) -> Option<Innovation>;

    /// Takes all measurements of a moment in, together.
    fn update(&mut self, measurements: &[Measurement], controls: &[f64]) -> Updated;

    /// Multiplies its covariance: what it believed was too sure.
    fn widen(&mut self, factor: f64) {
        self.gaussian_mut().spread *= factor;
    }

    /// Whether mean and covariance are all that it knows, so that [`Method::gaussian_mut`] sets it whole.
    fn is_gaussian(&self) -> bool {
        let Gaussian { mean, spread } = self.gaussian();
        self.memory_len() == mean.len() + spread.len()
    }

    /// How many numbers hold all that changes.
    fn memory_len(&self) -> usize {
        let Gaussian { mean, spread } = self.gaussian();
        mean.len() + spread.len()
    }

    /// Puts all that changes into a slice of that length.
    fn save(&self, memory: &mut [f64]) {
        let Gaussian { mean, spread } = self.gaussian();
        save(memory, &[mean, spread.as_slice()]);
    }

    /// Goes back to what was saved.
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

/// Copies them back.
pub(crate) fn restore(memory: &[f64], parts: &mut [&mut [f64]]) {
    let mut rest = memory;
    for part in parts {
        let Some((own, after)) = rest.split_at_checked(part.len()) else { return };
        part.copy_from_slice(own);
        rest = after;
    }
}
