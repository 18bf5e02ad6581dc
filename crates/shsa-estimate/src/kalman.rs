//! The Kalman filter and the extended Kalman filter: one algorithm over a [`System`], linear or linearised.
//!
//! Prediction: `x <- f(x, u, dt)`, `P <- F P F' + Q` with `F` the derivatives of `f` at the old state. Update, with the
//! derivatives `H` of the sensors at the predicted state (one linearisation, no iteration): the factors of the noise, `R = L D
//! L'`, make the measurements independent, and they are processed one by one: `k = P h / (h' P h + d)`, `x <- x + k e`, and
//! Joseph's form `P <- (I - k h') P (I - k h')' + d k k'`, which stays positive where `P - k h' P` does not. The result is that
//! of all measurements at once.
//!
//! O(n^3) for a prediction (less where `F` has zeros), O(m n^2 + m^3) for an update of m measurements.
//!
//! R. E. Kalman 1960 (doi:10.1115/1.3662552); R. Bucy, P. Joseph 1968; the extended filter: A. Jazwinski, "Stochastic Processes and
//! Filtering Theory", 1970 (doi:10.1016/s0076-5392(09)x6024-9); sequential updates: G. Bierman 1977
//! (doi:10.1016/s0076-5392(08)x6064-3).
//!
//! # Outliers
//! A [`Loss`] makes the update robust: the weight of a measurement falls with its residual, by iteration. Huber's: Z. Durovic, B.
//! Kovacevic 1999 (doi:10.1109/9.769393); Student's t: G. Agamennoni and others 2012 (doi:10.1109/TSP.2012.2208106).

use crate::Error;
use crate::kernel::{self, Absorb, Absorbed, add_scaled, are_finite, dot};
use crate::matrix::{Factors, Matrix, at, column, column_mut, heal, propagate, put, variance_along, work};
use crate::method::{Gaussian, Innovation, Measurement, Method, Tally, Updated};
use crate::system::{System, wrapped};

/// The loss function of residuals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Loss {
    /// Quadratic, for normal noise.
    Square,
    /// Huber's: quadratic up to this many standard deviations, linear beyond (1.345 loses 5 % on normal noise).
    Huber(f64),
    /// Student's t, with this many degrees of freedom: the weight of a far outlier vanishes.
    Student(f64),
}

impl Loss {
    /// The weight of a residual in standard deviations.
    fn weight(self, residual: f64) -> f64 {
        match self {
            Loss::Square => 1.0,
            Loss::Huber(limit) if residual.abs() > limit => limit / residual.abs(),
            Loss::Huber(_) => 1.0,
            Loss::Student(degrees) => (degrees + 1.0) / (degrees + residual * residual),
        }
    }
}

/// Iterations of a robust update: each makes the error of the weights several times smaller.
const ITERATIONS: usize = 12;

/// Below a tenth of this share, changes of the weights do not matter.
const SETTLED: f64 = 1e-6;

/// An independent measurement: its residual against the prediction, and its noise.
#[derive(Clone, Copy, Debug, Default)]
struct Scalar {
    apart: f64,
    variance: f64,
    weight: f64,
}

/// A Kalman filter; over nonlinear formulas it is the extended one.
#[derive(Clone, Debug)]
pub struct Kalman<S> {
    system: S,
    loss: Loss,
    estimate: Gaussian,
    next: Vec<f64>,
    jacobian: Matrix,
    work: Matrix,
    noise: Matrix,
    /// The gradient of measurement i as column i.
    h: Matrix,
    r: Matrix,
    independent: Factors,
    scalars: Vec<Scalar>,
    /// The sensor of each measurement.
    sensors: Vec<usize>,
    step: Vec<f64>,
    scratch: Vec<f64>,
    check: Factors,
    /// The covariance before the update.
    before: Matrix,
}

impl<S: System> Kalman<S> {
    /// Starts from a mean and its covariance.
    ///
    /// # Errors
    /// A size other than the system's, a covariance that is not positive semidefinite, or a loss with a parameter not above 0.
    pub fn new(system: S, mean: &[f64], spread: &Matrix, loss: Loss) -> Result<Kalman<S>, Error> {
        let (n, m) = (system.states(), system.sensors());
        let estimate = Gaussian::new(mean, spread, n)?;
        if let Loss::Huber(value) | Loss::Student(value) = loss
            && (value.is_nan() || value <= 0.0)
        {
            return Err(Error::Range { what: "the number of the loss", value, range: "above 0" });
        }
        Ok(Kalman {
            system,
            loss,
            estimate,
            next: vec![0.0; n],
            jacobian: Matrix::zeros(n, n),
            work: work(n),
            noise: Matrix::zeros(n, n),
            h: Matrix::zeros(n, m),
            r: Matrix::zeros(m, m),
            independent: Factors::new(m),
            scalars: vec![Scalar::default(); m],
            sensors: vec![0; m],
            step: vec![0.0; n],
            scratch: vec![0.0; kernel::SCRATCH * n],
            check: Factors::new(n),
            before: spread.clone(),
        })
    }

    /// The variance of a measurement: its own, or the model's.
    fn variance(&mut self, measurement: &Measurement, controls: &[f64]) -> f64 {
        let Measurement { sensor, variance, .. } = *measurement;
        variance.unwrap_or_else(|| self.system.covariance(sensor, sensor, &self.estimate.mean, controls))
    }

    /// Fills gradients, residuals and noise of the measurements that have an expectation; returns their number.
    fn linearise(&mut self, measurements: &[Measurement], controls: &[f64]) -> usize {
        let mut count = 0;
        for measurement in measurements.iter().take(self.scalars.len()) {
            let gradient = column_mut(&mut self.h, count);
            let expected = self.system.gradient(measurement.sensor, &self.estimate.mean, controls, gradient);
            let is_smooth = are_finite(gradient);
            let apart = wrapped(measurement.value - expected, self.system.turn(measurement.sensor));
            let variance = self.variance(measurement, controls);
            if !(is_smooth && apart.is_finite() && variance >= 0.0 && variance.is_finite()) {
                continue;
            }
            let place = self.scalars.get_mut(count).zip(self.sensors.get_mut(count));
            if let Some((scalar, sensor)) = place {
                (*scalar, *sensor) = (Scalar { apart, variance, weight: 1.0 }, measurement.sensor);
                count += 1;
            }
        }
        count
    }

    /// Makes the noise of the first measurements independent: `y <- L^-1 y`, `H <- L^-1 H`, variances `D`.
    fn separate(&mut self, count: usize, controls: &[f64]) {
        if self.system.is_independent() {
            return;
        }
        for (j, scalar) in self.scalars.iter().enumerate().take(count) {
            put(&mut self.r, j, j, scalar.variance);
            for i in j + 1..count {
                let (one, other) = (self.sensors.get(j), self.sensors.get(i));
                let (Some(one), Some(other)) = (one, other) else { continue };
                let shared = self.system.covariance(*one, *other, &self.estimate.mean, controls);
                put(&mut self.r, i, j, shared);
            }
        }
        self.independent.factor(&self.r, count);
        for j in 0..count {
            for k in 0..j {
                let factor = -at(&self.independent.l, j, k);
                let known = self.scalars.get(k).map_or(0.0, |scalar| scalar.apart);
                if let Some(scalar) = self.scalars.get_mut(j) {
                    scalar.apart += factor * known;
                }
                let n = self.step.len();
                let (left, right) = self.h.as_mut_slice().split_at_mut(j * n);
                let (from, to) = (left.get(k * n..(k + 1) * n), right.get_mut(..n));
                if let (Some(from), Some(to)) = (from, to) {
                    add_scaled(to, factor, from);
                }
            }
            let pivot = self.independent.d.get(j).copied().unwrap_or(0.0);
            if let Some(scalar) = self.scalars.get_mut(j) {
                scalar.variance = pivot;
            }
        }
    }

    /// Processes the first measurements one by one, into `step` and the covariance.
    fn take_in(&mut self, count: usize) -> Tally {
        let (mut tally, n) = (Tally::NOTHING, self.step.len());
        self.step.fill(0.0);
        for (place, scalar) in self.scalars.iter().enumerate().take(count) {
            let (p, h) = (self.estimate.spread.as_mut_slice(), column(&self.h, place));
            let (noise, apart) = (scalar.variance / scalar.weight, scalar.apart);
            let absorb = Absorb { p, h, noise, apart, step: &mut self.step };
            if let Some(Absorbed { apart, variance }) = kernel::run(absorb, n, &mut self.scratch) {
                // Weights move the estimate. What is told of the innovations is by the declared noise.
                tally.count(apart, variance - noise + scalar.variance);
            }
        }
        tally
    }

    /// Processes the first measurements with weights that fit the remaining residuals.
    fn take_in_robustly(&mut self, count: usize) -> Tally {
        self.before.copy_from(&self.estimate.spread);
        let mut tally = Tally::NOTHING;
        for iteration in 0..ITERATIONS {
            let mut change = 0.0_f64;
            for place in 0..count {
                let residual = self.residual(place, iteration == 0);
                let weight = self.loss.weight(residual).max(f64::MIN_POSITIVE);
                if let Some(scalar) = self.scalars.get_mut(place) {
                    change = change.max((scalar.weight - weight).abs() / weight);
                    scalar.weight = weight;
                }
            }
            if iteration > 0 && change < SETTLED {
                break;
            }
            self.estimate.spread.copy_from(&self.before);
            tally = self.take_in(count);
        }
        tally
    }

    /// A residual in standard deviations: first against the prediction, then against the estimate.
    fn residual(&self, place: usize, is_first: bool) -> f64 {
        let Some(scalar) = self.scalars.get(place) else { return 0.0 };
        let h = column(&self.h, place);
        let (apart, variance) = if is_first {
            (scalar.apart, scalar.variance + variance_along(&self.before, h))
        } else {
            (scalar.apart - dot(h, &self.step), scalar.variance)
        };
        if variance > 0.0 { apart / variance.sqrt() } else { 0.0 }
    }
}

impl<S: System> Method for Kalman<S> {
    fn gaussian(&self) -> &Gaussian {
        &self.estimate
    }

    fn gaussian_mut(&mut self) -> &mut Gaussian {
        &mut self.estimate
    }

    fn predict(&mut self, dt: f64, controls: &[f64]) -> bool {
        let Gaussian { mean, spread } = &mut self.estimate;
        self.system.linearised(mean, controls, dt, &mut self.next, &mut self.jacobian);
        self.system.noise(mean, controls, dt, &mut self.noise);
        let all = [&self.next, self.jacobian.as_slice(), self.noise.as_slice()];
        if !all.into_iter().all(are_finite) {
            return false;
        }
        propagate(&self.jacobian, spread, &self.noise, &mut self.work);
        mean.copy_from_slice(&self.next);
        true
    }

    fn innovation(&mut self, measurement: &Measurement, controls: &[f64]) -> Option<Innovation> {
        (self.linearise(&[*measurement], controls) == 1).then_some(())?;
        let (h, scalar) = (column(&self.h, 0), self.scalars.first()?);
        let variance = variance_along(&self.estimate.spread, h) + scalar.variance;
        (variance > 0.0).then_some(Innovation {
            value: scalar.apart,
            variance,
            noise: scalar.variance,
            errors: None,
        })
    }

    fn update(&mut self, measurements: &[Measurement], controls: &[f64]) -> Updated {
        let count = self.linearise(measurements, controls);
        self.separate(count, controls);
        let tally = match self.loss {
            Loss::Square => self.take_in(count),
            Loss::Huber(_) | Loss::Student(_) => self.take_in_robustly(count),
        };
        let Gaussian { mean, spread } = &mut self.estimate;
        mean.iter_mut().zip(&self.step).for_each(|(mean, step)| *mean += step);
        tally.updated(count > 0 && heal(spread, &mut self.check, &mut self.work))
    }
}

#[cfg(test)]
mod tests;
