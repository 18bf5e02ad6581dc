//! The unscented Kalman filter: 2n + 1 points represent the distribution, and go through the formulas unchanged.
//!
//! With `L = alpha^2 (n + kappa) - n` the points are the mean, and the mean plus and minus the columns of the lower factor of
//! `(n + L) P`; the weights are `L / (n + L)` for the mean (for covariances `+ 1 - alpha^2 + beta`) and `1 / (2 (n + L))` for the
//! others. The points are drawn again after adding the process noise. Zero pivots give columns of zeros. The mean of an angle is
//! the first point's value plus the weighted differences to it, each within half a turn. Where a sensor's formula is linear,
//! differences are not wrapped, as points further apart than half a turn would be confused.
//!
//! With `alpha` = 1, the default, no weight is large; the widespread 0.001 gives weights of a million that cost six digits, and
//! has reversed motions.
//!
//! O(n^3) and 2n + 1 evaluations for a prediction; O(m n^2 + m^3) and m (2n + 1) evaluations for an update.
//!
//! S. Julier, J. Uhlmann 2004 (doi:10.1109/JPROC.2003.823141); E. Wan, R. van der Merwe 2000 (doi:10.1109/ASSPCC.2000.882463).

use crate::Error;
use crate::kernel::add_scaled;
use crate::matrix::{Factors, Matrix, at, check_covariance, column, column_mut, heal, put, symmetrise, work};
use crate::method::{Gaussian, Innovation, Measurement, Method, Tally, Updated};
use crate::system::{System, wrapped};

/// A deviation from the slope by less than this share counts as linear.
const LINEAR: f64 = 1e-9;

/// The spread of the points, and their weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Points {
    /// The spread; above 0.
    pub alpha: f64,
    /// Knowledge of the distribution: 2 for a normal one.
    pub beta: f64,
    /// Added to n; above -n.
    pub kappa: f64,
}

impl Default for Points {
    fn default() -> Points {
        Points { alpha: 1.0, beta: 2.0, kappa: 0.0 }
    }
}

/// The weights of the points of n numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Weights {
    /// The squared distance of a point, in columns of the factor.
    scale: f64,
    mean: f64,
    covariance: f64,
    other: f64,
}

impl Points {
    fn weights(self, n: usize) -> Result<Weights, Error> {
        let n = n as f64;
        let scale = self.alpha * self.alpha * (n + self.kappa);
        if !(scale > 0.0 && scale.is_finite() && self.beta.is_finite()) {
            return Err(Error::Range {
                what: "alpha^2 (n + kappa) of the sigma points",
                value: scale,
                range: "finite and above 0",
            });
        }
        let mean = (scale - n) / scale;
        let covariance = mean + 1.0 - self.alpha * self.alpha + self.beta;
        Ok(Weights { scale, mean, covariance, other: 0.5 / scale })
    }
}

/// An unscented Kalman filter.
#[derive(Clone, Debug)]
pub struct Unscented<S> {
    system: S,
    weights: Weights,
    estimate: Gaussian,
    factors: Factors,
    work: Matrix,
    /// One point a column.
    points: Matrix,
    moved: Matrix,
    next: Vec<f64>,
    noise: Matrix,
    /// The measurement at each point minus the mean: one measurement a column.
    expectations: Matrix,
    /// Covariance of state and measurement i as column i.
    cross: Matrix,
    s: Matrix,
    s_factors: Factors,
    apart: Vec<f64>,
    sensors: Vec<usize>,
}

impl<S: System> Unscented<S> {
    /// Starts from a mean and its covariance.
    ///
    /// # Errors
    /// A size other than the system's, a covariance that is not positive semidefinite, or undefined points.
    pub fn new(system: S, mean: &[f64], spread: &Matrix, points: Points) -> Result<Unscented<S>, Error> {
        let (n, m) = (system.states(), system.sensors());
        let estimate = Gaussian::new(mean, spread, n)?;
        Ok(Unscented {
            weights: points.weights(n)?,
            system,
            estimate,
            factors: Factors::new(n),
            work: work(n),
            points: Matrix::zeros(n, 2 * n + 1),
            moved: Matrix::zeros(n, 2 * n + 1),
            next: vec![0.0; n],
            noise: Matrix::zeros(n, n),
            expectations: Matrix::zeros(2 * n + 1, m),
            cross: Matrix::zeros(n, m),
            s: Matrix::zeros(m, m),
            s_factors: Factors::new(m),
            apart: vec![0.0; m],
            sensors: vec![0; m],
        })
    }

    /// Draws the points of the present estimate.
    fn draw(&mut self) {
        let n = self.estimate.mean.len();
        self.factors.factor(&self.estimate.spread, n);
        column_mut(&mut self.points, 0).copy_from_slice(&self.estimate.mean);
        for (place, pivot) in self.factors.d.iter().enumerate().take(n) {
            let far = (self.weights.scale * pivot).sqrt();
            for (point, sign) in [(1 + place, 1.0), (1 + n + place, -1.0)] {
                let to = column_mut(&mut self.points, point);
                to.copy_from_slice(&self.estimate.mean);
                let factor = column(&self.factors.l, place).get(place..).unwrap_or(&[]);
                add_scaled(to.get_mut(place..).unwrap_or(&mut []), sign * far, factor);
            }
        }
    }

    /// Computes a measurement at all points, minus their mean, into column `place`. Returns the residual and the noise; `None`
    /// where a point has no value.
    fn expect(&mut self, place: usize, measurement: &Measurement, controls: &[f64]) -> Option<(f64, f64)> {
        let turn = self.system.turn(measurement.sensor);
        let column = column_mut(&mut self.expectations, place);
        for (point, expectations) in self.points.column_iter().zip(column.iter_mut()) {
            *expectations = self.system.expected(measurement.sensor, point.as_slice(), controls);
        }
        let first = *column.first()?;
        column.iter_mut().for_each(|expectations| *expectations -= first);
        let is_far =
            turn.is_some_and(|turn| column.iter().any(|expectations| expectations.abs() > 0.5 * turn));
        let round = turn.filter(|_| !is_far || !self.is_linear(place, measurement.sensor, controls));
        let column = column_mut(&mut self.expectations, place);
        let mut sum = 0.0;
        for expectations in column.iter_mut() {
            *expectations = wrapped(*expectations, round);
            sum += self.weights.other * *expectations;
        }
        column.iter_mut().for_each(|expectations| *expectations = wrapped(*expectations - sum, round));
        let own =
            self.system.covariance(measurement.sensor, measurement.sensor, &self.estimate.mean, controls);
        let variance = measurement.variance.unwrap_or(own);
        let apart = wrapped(measurement.value - (first + sum), turn);
        (apart.is_finite() && variance >= 0.0 && variance.is_finite()).then_some((apart, variance))
    }

    /// Whether the differences of a sensor's values at all points to the first, in column `place`, are those of its slope.
    fn is_linear(&mut self, place: usize, sensor: usize, controls: &[f64]) -> bool {
        self.system.gradient(sensor, &self.estimate.mean, controls, &mut self.next);
        let expectations = column(&self.expectations, place);
        self.points.column_iter().zip(expectations).all(|(point, expectations)| {
            let steps = point.as_slice().iter().zip(&self.estimate.mean).map(|(point, mean)| point - mean);
            let sloped: f64 = steps.zip(&self.next).map(|(step, slope)| step * slope).sum();
            (expectations - sloped).abs() <= LINEAR * expectations.abs().max(1.0)
        })
    }

    /// The weighted sum of products of two measurements at all points.
    fn shared(&self, one: usize, other: usize) -> f64 {
        let mut weight = self.weights.covariance;
        let mut sum = 0.0;
        for (one, other) in column(&self.expectations, one).iter().zip(column(&self.expectations, other)) {
            sum += weight * one * other;
            weight = self.weights.other;
        }
        sum
    }

    /// Computes all measurements at the points; returns how many have an expectation.
    fn expect_all(&mut self, measurements: &[Measurement], controls: &[f64]) -> usize {
        let mut count = 0;
        for measurement in measurements.iter().take(self.sensors.len()) {
            let Some((apart, variance)) = self.expect(count, measurement, controls) else { continue };
            if let (Some(own), Some(sensor)) = (self.apart.get_mut(count), self.sensors.get_mut(count)) {
                (*own, *sensor) = (apart, measurement.sensor);
            }
            let own = variance + self.shared(count, count);
            put(&mut self.s, count, count, own);
            for other in 0..count {
                let sensor = self.sensors.get(other).copied().unwrap_or(0);
                let noise = self.system.covariance(measurement.sensor, sensor, &self.estimate.mean, controls);
                let shared = noise + self.shared(count, other);
                put(&mut self.s, count, other, shared);
            }
            let cross = column_mut(&mut self.cross, count);
            cross.fill(0.0);
            let mut weight = self.weights.covariance;
            for (point, expectations) in self.points.column_iter().zip(column(&self.expectations, count)) {
                for ((cross, point), mean) in cross.iter_mut().zip(point.as_slice()).zip(&self.estimate.mean)
                {
                    *cross += weight * (point - mean) * expectations;
                }
                weight = self.weights.other;
            }
            count += 1;
        }
        count
    }
}

impl<S: System> Method for Unscented<S> {
    fn gaussian(&self) -> &Gaussian {
        &self.estimate
    }

    fn gaussian_mut(&mut self) -> &mut Gaussian {
        &mut self.estimate
    }

    fn predict(&mut self, dt: f64, controls: &[f64]) -> bool {
        self.draw();
        self.system.noise(&self.estimate.mean, controls, dt, &mut self.noise);
        for (place, point) in self.points.column_iter().enumerate() {
            self.system.transition(point.as_slice(), controls, dt, column_mut(&mut self.moved, place));
        }
        let mut all = self.moved.iter().chain(self.noise.iter());
        if !all.all(|number| number.is_finite()) {
            return false;
        }
        // Relative to the first point: large weights of both signs then cancel only small numbers.
        self.next.fill(0.0);
        for place in 1..self.moved.ncols() {
            let pairs = column(&self.moved, place).iter().zip(column(&self.moved, 0));
            for (next, (moved, first)) in self.next.iter_mut().zip(pairs) {
                *next += self.weights.other * (moved - first);
            }
        }
        self.next.iter_mut().zip(column(&self.moved, 0)).for_each(|(next, first)| *next += first);
        self.estimate.spread.copy_from(&self.noise);
        let mut weight = self.weights.covariance;
        for place in 0..self.moved.ncols() {
            let moved = column_mut(&mut self.moved, place);
            moved.iter_mut().zip(&self.next).for_each(|(moved, next)| *moved -= next);
            let moved = column(&self.moved, place);
            for (j, factor) in moved.iter().enumerate() {
                add_scaled(column_mut(&mut self.estimate.spread, j), weight * factor, moved);
            }
            weight = self.weights.other;
        }
        self.estimate.mean.copy_from_slice(&self.next);
        symmetrise(&mut self.estimate.spread);
        true
    }

    fn innovation(&mut self, measurement: &Measurement, controls: &[f64]) -> Option<Innovation> {
        self.draw();
        (self.expect_all(&[*measurement], controls) == 1).then_some(())?;
        let (value, variance) = (*self.apart.first()?, *self.s.get((0, 0))?);
        let noise = variance - self.shared(0, 0);
        (variance > 0.0).then_some(Innovation { value, variance, noise, errors: None })
    }

    fn update(&mut self, measurements: &[Measurement], controls: &[f64]) -> Updated {
        if measurements.is_empty() {
            return Updated::NOTHING;
        }
        self.draw();
        let count = self.expect_all(measurements, controls);
        self.s_factors.factor(&self.s, count);
        let n = self.estimate.mean.len();
        let mut tally = Tally::NOTHING;
        // Makes the innovations independent, one after the other: `S = L D L'`, `C <- C L'^-1`.
        for j in 0..count {
            for k in 0..j {
                let factor = -at(&self.s_factors.l, j, k);
                let known = self.apart.get(k).copied().unwrap_or(0.0);
                if let Some(apart) = self.apart.get_mut(j) {
                    *apart += factor * known;
                }
                let (left, right) = self.cross.as_mut_slice().split_at_mut(j * n);
                if let (Some(from), Some(to)) = (left.get(k * n..(k + 1) * n), right.get_mut(..n)) {
                    add_scaled(to, factor, from);
                }
            }
            let (apart, variance) = (self.apart.get(j).copied(), self.s_factors.d.get(j).copied());
            let (Some(apart), Some(variance)) = (apart, variance) else { continue };
            if variance.is_nan() || variance <= 0.0 {
                continue;
            }
            let cross = column(&self.cross, j);
            add_scaled(&mut self.estimate.mean, apart / variance, cross);
            for (place, factor) in cross.iter().enumerate() {
                add_scaled(column_mut(&mut self.estimate.spread, place), -factor / variance, cross);
            }
            tally.count(apart, variance);
        }
        symmetrise(&mut self.estimate.spread);
        tally.updated(heal(&mut self.estimate.spread, &mut self.factors, &mut self.work))
    }
}

/// The mean and covariance of `y = f(x)` and the covariance of x and y, through the points of x.
///
/// # Errors
/// A covariance of a wrong size or not positive semidefinite, or undefined points. Time: n^3 and 2n + 1 evaluations.
pub fn transform(
    mean: &[f64],
    spread: &Matrix,
    points: Points,
    outputs: usize,
    mut function: impl FnMut(&[f64], &mut [f64]),
) -> Result<(Vec<f64>, Matrix, Matrix), Error> {
    let n = mean.len();
    check_covariance("the covariance", spread, n)?;
    let weights = points.weights(n)?;
    let mut factors = Factors::new(n);
    factors.factor(spread, n);
    let mut moves = vec![vec![0.0; n]];
    for place in 0..n {
        let far = (weights.scale * factors.d.get(place).copied().unwrap_or(0.0)).sqrt();
        let column = column(&factors.l, place);
        let below = |sign: f64| {
            (0..n).zip(column).map(|(i, it)| if i < place { 0.0 } else { sign * far * it }).collect()
        };
        moves.extend([below(1.0), below(-1.0)]);
    }
    let expectations = moves.iter().map(|step| {
        let x: Vec<f64> = mean.iter().zip(step).map(|(mean, step)| mean + step).collect();
        let mut y = vec![0.0; outputs];
        function(&x, &mut y);
        y
    });
    let expectations: Vec<Vec<f64>> = expectations.collect();
    let of_mean = |place: usize| if place == 0 { weights.mean } else { weights.other };
    let of_spread = |place: usize| if place == 0 { weights.covariance } else { weights.other };
    let mut y = vec![0.0; outputs];
    expectations.iter().enumerate().for_each(|(place, it)| add_scaled(&mut y, of_mean(place), it));
    let (mut own, mut cross) = (Matrix::zeros(outputs, outputs), Matrix::zeros(n, outputs));
    for (place, (step, expectations)) in moves.iter().zip(&expectations).enumerate() {
        for (j, (expected_j, y_j)) in expectations.iter().zip(&y).enumerate() {
            let factor = of_spread(place) * (expected_j - y_j);
            for (i, (expected_i, y_i)) in expectations.iter().zip(&y).enumerate() {
                let sum = at(&own, i, j) + factor * (expected_i - y_i);
                put(&mut own, i, j, sum);
            }
            add_scaled(column_mut(&mut cross, j), factor, step);
        }
    }
    Ok((y, own, cross))
}

#[cfg(test)]
mod tests;
