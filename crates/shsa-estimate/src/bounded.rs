//! Measurements with errors within bounds, beside any filter: such an error need not average out.
//!
//! A sensor may be off by its whole bound, always and in the same direction. A filter that takes this for noise becomes certain of
//! what is wrong. So the filter computes as it does, and beside it two matrices follow what its gains make of the bounds. With `A = I -
//! k h'`, an error of the estimate becomes `A F b + k e` with a measurement:
//!
//! * `reach` is an ellipsoid that holds all `b` that errors within the bounds can lead to. The sum of an ellipsoid and a segment is
//!   enclosed by the ellipsoid of least trace, each state in its own standard deviations (F. Schweppe 1968, doi:10.1109/TAC.1968.1098790;
//!   C. Durieu, E. Walter, B. Polyak 2001, doi:10.1023/A:1011978200643). For one state that is exact: `|a| b + |k| r`. Absolute values of
//!   each element would grow without end where a speed is estimated, too: there `|A| |F|` has an eigenvalue above 1.
//! * `counted` is the part of the filter's covariance that stands for these errors. The rest is that of noise.
//!
//! What the filter did is seen from its mean: a robust filter counts a measurement for less, so its gain is scaled until it moves the mean
//! as far as the filter did. What is left of a move, by curvature, counts as a bound in a filter that is its mean and covariance; in
//! one of particles, the covariance tells it.
//!
//! O(n^3) for a prediction, O(m n^2) for an update of m measurements.

use crate::kernel::{add_scaled, are_finite, dot};
use crate::matrix::{Matrix, at, column, column_mut, multiply, propagate, work};
use crate::method::{
    Bias, Errors, Gaussian, Innovation, Measurement, Method, Updated, restore, save, uniform,
};
use crate::system::{System, wrapped};

/// A move of the mean by less than this share of a standard deviation is not looked at: rounding.
const ROUNDING: f64 = 1e-9;

/// A measurement as it counts: the residual, and the bound.
#[derive(Clone, Copy, Debug, Default)]
struct Taken {
    apart: f64,
    bound: f64,
    /// The part of its variance that stands for the bound.
    counted: f64,
}

/// A filter with what bounds of errors make of its estimate.
pub struct Bounded<S> {
    method: Box<dyn Method>,
    system: S,
    bias: Bias,
    /// The mean and the covariance before a step of the filter.
    mean: Vec<f64>,
    spread: Matrix,
    /// The expected mean, or its change.
    next: Vec<f64>,
    jacobian: Matrix,
    nothing: Matrix,
    work: Matrix,
    product: Vec<f64>,
    /// Gain and gradient of measurement i as column i.
    gains: Matrix,
    gradients: Matrix,
    taken: Vec<Taken>,
    /// For each state one over its variance, which makes all states alike.
    weights: Vec<f64>,
}

impl<S: System> Bounded<S> {
    /// The filter of a system, whose initial error is noise.
    #[must_use]
    pub fn new(method: Box<dyn Method>, system: S) -> Bounded<S> {
        let (n, m) = (system.states(), system.sensors());
        let square = Matrix::zeros(n, n);
        Bounded {
            bias: Bias { reach: square.clone(), counted: square.clone() },
            mean: vec![0.0; n],
            spread: square.clone(),
            next: vec![0.0; n],
            jacobian: square.clone(),
            nothing: square,
            work: work(n),
            product: vec![0.0; n],
            gains: Matrix::zeros(n, m),
            gradients: Matrix::zeros(n, m),
            taken: Vec::with_capacity(m),
            weights: vec![0.0; n],
            method,
            system,
        }
    }

    /// Keeps the estimate before a step of the filter.
    fn remember(&mut self) {
        self.mean.copy_from_slice(self.method.mean());
        self.spread.copy_from(self.method.spread());
    }

    /// The gains of a linear filter for measurements of a moment, one after the other, from the kept estimate.
    fn linear(&mut self, measurements: &[Measurement], controls: &[f64]) {
        self.taken.clear();
        self.next.fill(0.0);
        for measurement in measurements.iter().take(self.gains.ncols()) {
            let Measurement { sensor, value, variance, bound } = *measurement;
            let place = self.taken.len();
            let gradient = column_mut(&mut self.gradients, place);
            let expected = self.system.gradient(sensor, &self.mean, controls, gradient);
            let apart = wrapped(value - expected, self.system.turn(sensor));
            let noise =
                variance.unwrap_or_else(|| self.system.covariance(sensor, sensor, &self.mean, controls));
            let gain = column_mut(&mut self.gains, place);
            multiply(&self.spread, gradient, gain);
            let all = dot(gradient, gain) + noise;
            if !(are_finite(gradient) && apart.is_finite() && all > 0.0 && all.is_finite()) {
                continue;
            }
            for (j, own) in gain.iter().enumerate() {
                add_scaled(column_mut(&mut self.spread, j), -own / all, gain);
            }
            gain.iter_mut().for_each(|gain| *gain /= all);
            let counted = uniform(bound).min(noise);
            let rest = apart - dot(gradient, &self.next);
            add_scaled(&mut self.next, rest, gain);
            self.taken.push(Taken { apart, bound, counted });
        }
    }

    /// By how much the gains are to be multiplied so that they move the mean as the filter did; never beyond the measured values.
    fn followed(&self) -> f64 {
        let (mut both, mut square) = (0.0, 0.0);
        let moves = self.method.mean().iter().zip(&self.mean).zip(self.next.iter().zip(&self.weights));
        for ((after, before), (step, weight)) in moves {
            both += weight * step * (after - before);
            square += weight * step * step;
        }
        let most = (0..self.taken.len()).fold(f64::INFINITY, |most, place| {
            most.min(
                1.0 / dot(column(&self.gains, place), column(&self.gradients, place)).max(f64::MIN_POSITIVE),
            )
        });
        if square > ROUNDING * ROUNDING { (both / square).clamp(0.0, most) } else { 1.0 }
    }

    /// Carries the bounds through the measurements. `next` becomes the move of the mean.
    fn take_in(&mut self) {
        let share = self.followed();
        self.next.fill(0.0);
        for (place, Taken { apart, bound, counted }) in self.taken.iter().copied().enumerate() {
            let (gain, gradient) = (column_mut(&mut self.gains, place), column(&self.gradients, place));
            gain.iter_mut().for_each(|gain| *gain *= share);
            let rest = apart - dot(gradient, &self.next);
            add_scaled(&mut self.next, rest, gain);
            let Bias { reach, counted: covariance } = &mut self.bias;
            absorb(reach, gain, gradient, 0.0, &mut self.product);
            absorb(covariance, gain, gradient, counted, &mut self.product);
            extend(reach, gain, bound, &self.weights);
        }
    }

    /// Counts what is left of a move of the mean as a bound, in a filter that is its mean and covariance; `next` is the expected mean.
    fn leave(&mut self) {
        if !self.method.is_gaussian() {
            return;
        }
        self.next.iter_mut().zip(self.method.mean()).for_each(|(next, mean)| *next = mean - *next);
        let size: f64 = self.next.iter().zip(&self.weights).map(|(rest, weight)| weight * rest * rest).sum();
        if size > ROUNDING * ROUNDING {
            extend(&mut self.bias.reach, &self.next, 1.0, &self.weights);
        }
    }

    fn weigh(&mut self) {
        for (place, weight) in self.weights.iter_mut().enumerate() {
            let inverse = 1.0 / at(self.method.spread(), place, place);
            *weight = if inverse.is_finite() { inverse.max(0.0) } else { 0.0 };
        }
    }
}

/// `p <- (I - k h') p (I - k h')' + added k k'`. O(n^2).
fn absorb(p: &mut Matrix, gain: &[f64], gradient: &[f64], added: f64, product: &mut [f64]) {
    multiply(p, gradient, product);
    let all = dot(gradient, product) + added;
    for (j, (own_gain, own)) in gain.iter().zip(product.iter()).enumerate() {
        let to = column_mut(p, j);
        add_scaled(to, -own_gain, product);
        add_scaled(to, all * own_gain - own, gain);
    }
}

/// The ellipsoid of least weighted trace that holds the sum of an ellipsoid and a segment, `size` times a vector to both sides. O(n^2).
fn extend(reach: &mut Matrix, vector: &[f64], size: f64, weights: &[f64]) {
    let square: f64 = vector.iter().zip(weights).map(|(own, weight)| weight * own * own).sum();
    let own: f64 = weights.iter().enumerate().map(|(place, weight)| weight * at(reach, place, place)).sum();
    let (segment, own) = (size * square.sqrt(), own.max(0.0).sqrt());
    if segment <= 0.0 {
        return;
    }
    let (kept, added) = if own > 0.0 { (1.0 + segment / own, 1.0 + own / segment) } else { (1.0, 1.0) };
    *reach *= kept;
    for (j, factor) in vector.iter().enumerate() {
        add_scaled(column_mut(reach, j), added * size * size * factor, vector);
    }
}

impl<S: System> Method for Bounded<S> {
    fn gaussian(&self) -> &Gaussian {
        self.method.gaussian()
    }

    fn gaussian_mut(&mut self) -> &mut Gaussian {
        self.method.gaussian_mut()
    }

    fn bias(&self) -> Option<&Bias> {
        Some(&self.bias)
    }

    fn predict(&mut self, dt: f64, controls: &[f64]) -> bool {
        self.mean.copy_from_slice(self.method.mean());
        if !self.method.predict(dt, controls) {
            return false;
        }
        self.system.linearised(&self.mean, controls, dt, &mut self.next, &mut self.jacobian);
        if are_finite(self.jacobian.as_slice()) {
            let Bias { reach, counted } = &mut self.bias;
            propagate(&self.jacobian, reach, &self.nothing, &mut self.work);
            propagate(&self.jacobian, counted, &self.nothing, &mut self.work);
            self.weigh();
            self.leave();
        }
        true
    }

    fn innovation(&mut self, measurement: &Measurement, controls: &[f64]) -> Option<Innovation> {
        let plain = self.method.innovation(measurement, controls)?;
        let gradient = column_mut(&mut self.gradients, 0);
        self.system.gradient(measurement.sensor, self.method.mean(), controls, gradient);
        let (expected, random) = self.bias.along(gradient, plain.uncertainty());
        let errors = Errors { expected, measured: measurement.bound, random };
        Some(Innovation { errors: are_finite(gradient).then_some(errors), ..plain })
    }

    fn update(&mut self, measurements: &[Measurement], controls: &[f64]) -> Updated {
        self.remember();
        let updated = self.method.update(measurements, controls);
        if updated.used > 0 {
            self.linear(measurements, controls);
            self.weigh();
            self.take_in();
            self.next.iter_mut().zip(&self.mean).for_each(|(next, mean)| *next += mean);
            self.leave();
        }
        updated
    }

    fn widen(&mut self, factor: f64) {
        self.method.widen(factor);
    }

    fn is_gaussian(&self) -> bool {
        self.method.is_gaussian()
    }

    fn memory_len(&self) -> usize {
        self.method.memory_len() + 2 * self.spread.len()
    }

    fn save(&self, memory: &mut [f64]) {
        let own = self.method.memory_len();
        let Some((to_method, rest)) = memory.split_at_mut_checked(own) else { return };
        self.method.save(to_method);
        save(rest, &[self.bias.reach.as_slice(), self.bias.counted.as_slice()]);
    }

    fn restore(&mut self, memory: &[f64]) {
        let own = self.method.memory_len();
        let Some((of_method, rest)) = memory.split_at_checked(own) else { return };
        self.method.restore(of_method);
        restore(rest, &mut [self.bias.reach.as_mut_slice(), self.bias.counted.as_mut_slice()]);
    }
}
