//! The one trait of all methods: predict, look at a measurement, take measurements in, keep and restore.

use crate::matrix::Matrix;

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

/// A method of estimation. Nothing is allocated once it is made; without measurements nothing is corrected.
///
/// Measurements are given in the declared order of their sensors, none twice; of more than there are sensors the rest is left
/// out.
pub trait Method: Send {
    /// The present estimate, n numbers.
    fn mean(&self) -> &[f64];

    /// Its covariance, n by n, symmetric and positive semidefinite.
    fn spread(&self) -> &Matrix;

    /// Goes on by a time in seconds. False: the model has no value there, and nothing is changed.
    fn predict(&mut self, dt: f64, controls: &[f64]) -> bool;

    /// A measurement beside what is expected of it now; `None` where the model has no value. Changes nothing.
    fn innovation(&mut self, measurement: &Measurement, controls: &[f64]) -> Option<Innovation>;

    /// Takes all measurements of a moment in, together.
    fn update(&mut self, measurements: &[Measurement], controls: &[f64]) -> Updated;

    /// Multiplies its covariance: what it believed was too sure.
    fn widen(&mut self, factor: f64);

    /// How many numbers hold all that changes.
    fn memory_len(&self) -> usize;

    /// Puts all that changes into a slice of that length.
    fn save(&self, memory: &mut [f64]);

    /// Goes back to what was saved.
    fn restore(&mut self, memory: &[f64]);
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
