//! Kinematic models of a quantity that changes smoothly, and their fit to recorded values.
//!
//! A quantity, its rate and its acceleration, up to the order; the last of them is a random walk. With the diffusion `q` of that
//! walk, in its unit squared per second, `Q_ij = q dt^(a+b+1) / ((a+b+1) a! b!)` where `a` and `b` are the orders left below i
//! and j.
//!
//! Y. Bar-Shalom and others, "Estimation with Applications to Tracking and Navigation", 2001, 6.2 (doi:10.1002/0471221279).

use crate::Error;
use crate::kalman::{Kalman, Loss};
use crate::matrix::{Matrix, put};
use crate::method::{Measurement, Method};
use crate::system::System;
use shsa_core::time::Time;
use std::ops::RangeInclusive;

/// The highest order.
pub const ORDER_MAX: usize = 3;

/// A model of a quantity that changes smoothly and is measured directly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kinematic {
    order: usize,
    diffusion: f64,
    variance: f64,
}

impl Kinematic {
    /// A model of an order: 1 is a random walk of the quantity, 2 of its rate, 3 of its acceleration. The diffusion is that of
    /// the walk, in its unit squared per second; the variance is that of a measurement.
    ///
    /// # Errors
    /// Another order; numbers that are not finite or below 0.
    pub fn new(order: usize, diffusion: f64, variance: f64) -> Result<Kinematic, Error> {
        if !(1..=ORDER_MAX).contains(&order) {
            let value = order as f64;
            return Err(Error::Range { what: "the order of a kinematic model", value, range: "1, 2 or 3" });
        }
        for (what, value) in [("the diffusion", diffusion), ("the variance of a measurement", variance)] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(Error::Range { what, value, range: "finite and 0 or more" });
            }
        }
        Ok(Kinematic { order, diffusion, variance })
    }

    /// The model, of one of these orders, with the largest likelihood of recorded values in the order of time. `None` for fewer
    /// than eight values, or values that never change.
    ///
    /// The search varies only the ratio of diffusion and variance: the best scale of both follows from the innovations. Time:
    /// some 40 runs of a filter over the values for each order.
    #[must_use]
    pub fn fit(orders: RangeInclusive<usize>, values: &[(Time, f64)]) -> Option<Kinematic> {
        let fitted = orders.filter_map(|order| Kinematic::fit_order(order, values));
        let (_, best) = fitted.max_by(|(one, _), (other, _)| one.total_cmp(other))?;
        Some(best)
    }

    /// The best model of an order, and its likelihood.
    fn fit_order(order: usize, values: &[(Time, f64)]) -> Option<(f64, Kinematic)> {
        let (first, last) = (values.first()?, values.last()?);
        let step = (last.0 - first.0).seconds() / (values.len() - 1) as f64;
        if values.len() < 8 || step <= 0.0 {
            return None;
        }
        // With a ratio of 1, a step of mean length adds about the variance of a measurement.
        let unit = step.powi(1 - 2 * order as i32);
        let of = |exponent: f64| concentrated(order, unit * 10.0_f64.powf(exponent), values);
        let likelihood = |exponent: f64| of(exponent).map_or(f64::NEG_INFINITY, |(likelihood, _)| likelihood);
        let grid = (-10..=10).map(f64::from);
        let best = grid.max_by(|one, other| likelihood(*one).total_cmp(&likelihood(*other)))?;
        let exponent = greatest(likelihood, best);
        let (likelihood, scale) = of(exponent).filter(|(_, scale)| *scale > 0.0)?;
        Some((likelihood, Kinematic::new(order, scale * unit * 10.0_f64.powf(exponent), scale).ok()?))
    }

    /// The order.
    #[must_use]
    pub fn order(&self) -> usize {
        self.order
    }

    /// The variance of a measurement.
    #[must_use]
    pub fn variance(&self) -> f64 {
        self.variance
    }

    /// The diffusion of the random walk, in its unit squared per second.
    #[must_use]
    pub fn diffusion(&self) -> f64 {
        self.diffusion
    }

    /// A filter of the model in an unknown state: a value within `reach` of a mean, and rates up to `reach` a second.
    ///
    /// # Errors
    /// A reach that is not finite.
    pub fn filter(self, mean: f64, reach: f64) -> Result<Kalman<Kinematic>, Error> {
        let (mut start, p) = ([0.0; ORDER_MAX], Matrix::identity(self.order, self.order) * (reach * reach));
        start[0] = mean;
        Kalman::new(self, start.get(..self.order).unwrap_or(&[]), &p, Loss::Square)
    }
}

/// The logarithm of the likelihood with the best scale (without constants), and this scale: the variance of a measurement.
fn concentrated(order: usize, ratio: f64, values: &[(Time, f64)]) -> Option<(f64, f64)> {
    let (first_at, first) = *values.first()?;
    let mut filter = Kinematic::new(order, ratio, 1.0).ok()?.filter(first, 1e6).ok()?;
    let (mut square, mut logarithm, mut count, mut before) = (0.0, 0.0, 0.0, first_at);
    for (place, (at, value)) in values.iter().enumerate() {
        let elapsed = (*at - before).seconds();
        if elapsed > 0.0 && !filter.predict(elapsed, &[]) {
            return None;
        }
        before = *at;
        let measurement = Measurement { sensor: 0, value: *value, variance: None, bound: 0.0 };
        let innovation = filter.innovation(&measurement, &[])?;
        filter.update(&[measurement], &[]);
        // The first measurements only determine the initial state.
        if place >= ORDER_MAX {
            square += innovation.normalized_square();
            logarithm += libm::log(innovation.variance);
            count += 1.0;
        }
    }
    let scale = square / count;
    Some((-0.5 * (count * libm::log(scale) + logarithm), scale))
        .filter(|(likelihood, _)| likelihood.is_finite())
}

/// The maximum of a function within 1 of a place, by golden-section search, to a thousandth.
fn greatest(function: impl Fn(f64) -> f64, about: f64) -> f64 {
    const SECTION: f64 = 0.618_033_988_749_895;
    let (mut low, mut high) = (about - 1.0, about + 1.0);
    while high - low > 1e-3 {
        let (one, other) = (high - SECTION * (high - low), low + SECTION * (high - low));
        if function(one) < function(other) { low = one } else { high = other }
    }
    0.5 * (low + high)
}

impl System for Kinematic {
    fn states(&self) -> usize {
        self.order
    }

    fn sensors(&self) -> usize {
        1
    }

    fn transition(&mut self, from: &[f64], _: &[f64], dt: f64, to: &mut [f64]) {
        for (place, to) in to.iter_mut().enumerate() {
            // Horner's form of the Taylor series.
            let rates = from.iter().enumerate().skip(place).rev();
            *to = rates.fold(0.0, |sum, (own, rate)| rate + sum * dt / (own - place + 1) as f64);
        }
    }

    fn linearised(&mut self, from: &[f64], controls: &[f64], dt: f64, to: &mut [f64], jacobian: &mut Matrix) {
        self.transition(from, controls, dt, to);
        jacobian.fill_with_identity();
        for row in 0..self.order {
            let mut slope = 1.0;
            for column in row + 1..self.order {
                slope *= dt / (column - row) as f64;
                put(jacobian, row, column, slope);
            }
        }
    }

    fn noise(&mut self, _: &[f64], _: &[f64], dt: f64, noise: &mut Matrix) {
        let factorial = |number: usize| (1..=number).product::<usize>() as f64;
        for row in 0..self.order {
            for column in 0..self.order {
                let (a, b) = (self.order - 1 - row, self.order - 1 - column);
                let divisor = (a + b + 1) as f64 * factorial(a) * factorial(b);
                put(noise, row, column, self.diffusion * dt.powi((a + b + 1) as i32) / divisor);
            }
        }
    }

    fn expected(&mut self, _: usize, state: &[f64], _: &[f64]) -> f64 {
        state.first().copied().unwrap_or(f64::NAN)
    }

    fn gradient(&mut self, sensor: usize, state: &[f64], controls: &[f64], gradient: &mut [f64]) -> f64 {
        gradient.fill(0.0);
        gradient.iter_mut().take(1).for_each(|slope| *slope = 1.0);
        self.expected(sensor, state, controls)
    }

    fn covariance(&mut self, one: usize, other: usize, _: &[f64], _: &[f64]) -> f64 {
        if one == other { self.variance } else { 0.0 }
    }

    fn is_independent(&self) -> bool {
        true
    }

    fn turn(&self, _: usize) -> Option<f64> {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn matrices_of_the_third_order() {
        let mut system = Kinematic::new(3, 2.0, 1.0).unwrap();
        let (mut to, mut jacobian, mut noise) = ([0.0; 3], Matrix::zeros(3, 3), Matrix::zeros(3, 3));
        system.linearised(&[1.0, 2.0, 4.0], &[], 0.5, &mut to, &mut jacobian);
        assert_eq!(to, [2.5, 4.0, 4.0]);
        assert_eq!(jacobian, Matrix::from_row_slice(3, 3, &[1.0, 0.5, 0.125, 0.0, 1.0, 0.5, 0.0, 0.0, 1.0]));
        system.noise(&[], &[], 1.0, &mut noise);
        let wanted = [0.1, 0.25, 1.0 / 3.0, 0.25, 2.0 / 3.0, 1.0, 1.0 / 3.0, 1.0, 2.0];
        assert!((noise - Matrix::from_row_slice(3, 3, &wanted)).amax() < 1e-15);
    }

    #[test]
    fn a_fit_finds_what_a_walk_was_made_with() {
        for (order, diffusion, variance) in [(1, 0.5, 0.01), (1, 0.01, 0.5), (2, 0.2, 0.04)] {
            let (mut random, mut state) = (Random::new(7), [0.0; 2]);
            let values: Vec<(Time, f64)> = (0..4000_i64)
                .map(|place| {
                    let walk = (diffusion * 0.1_f64).sqrt() * random.normal();
                    state[0] += if order == 1 { walk } else { 0.1 * state[1] + 0.05 * walk };
                    state[1] += walk;
                    (Time(place * 100_000_000), state[0] + f64::sqrt(variance) * random.normal())
                })
                .collect();
            let fitted = Kinematic::fit(order..=order, &values).unwrap();
            assert!((fitted.diffusion() / diffusion).ln().abs() < 0.25, "{order}: {fitted:?}");
            assert!((fitted.variance() / variance).ln().abs() < 0.15, "{order}: {fitted:?}");
        }
    }

    #[test]
    fn what_never_changes_cannot_be_fitted() {
        let values: Vec<(Time, f64)> = (0..50).map(|place| (Time(place * 1_000_000), 3.0)).collect();
        assert_eq!(Kinematic::fit(1..=3, &values), None);
        assert_eq!(Kinematic::fit(2..=2, &values[..5]), None);
        assert!(Kinematic::new(4, 1.0, 1.0).is_err() && Kinematic::new(1, -1.0, 1.0).is_err());
    }
}
