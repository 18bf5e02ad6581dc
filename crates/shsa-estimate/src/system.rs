//! The system model of a filter: the transition of the state, and the measurement of each sensor.

use crate::Error;
use crate::kernel::{add_scaled, dot};
use crate::matrix::{Matrix, at, check_covariance, column, column_mut, multiply};

/// A model of a system: `x' = f(x, u, dt) + w`, `z_i = h_i(x, u) + v_i`, with covariances of `w` and `v`.
///
/// All numbers are in SI units. A missing value is not-a-number; the caller tests for it. Slices have the stated length; no
/// allocation.
pub trait System: Send {
    /// The number of states.
    fn states(&self) -> usize;

    /// The number of sensors.
    fn sensors(&self) -> usize;

    /// The state `dt` seconds later, without noise.
    fn transition(&mut self, from: &[f64], controls: &[f64], dt: f64, to: &mut [f64]);

    /// The transition and its derivatives by the old state: row i of `jacobian` is the gradient of element i.
    fn linearised(&mut self, from: &[f64], controls: &[f64], dt: f64, to: &mut [f64], jacobian: &mut Matrix);

    /// The covariance of the process noise.
    fn noise(&mut self, from: &[f64], controls: &[f64], dt: f64, noise: &mut Matrix);

    /// The expected measurement of a sensor, without noise.
    fn expected(&mut self, sensor: usize, state: &[f64], controls: &[f64]) -> f64;

    /// The expected measurement and its derivatives by the state.
    fn gradient(&mut self, sensor: usize, state: &[f64], controls: &[f64], gradient: &mut [f64]) -> f64;

    /// The covariance of the noise of two sensors; of one with itself the variance.
    fn covariance(&mut self, one: usize, other: usize, state: &[f64], controls: &[f64]) -> f64;

    /// Whether the noise of every sensor is independent of all others', so that [`System::covariance`] of two sensors is 0. With
    /// `false` each pair is asked.
    fn is_independent(&self) -> bool {
        false
    }

    /// The turn after which a sensor's values repeat: a whole turn for an angle.
    fn turn(&self, sensor: usize) -> Option<f64>;
}

/// A system that is evaluated for many states at once; column i of a matrix of states is element i of all of them.
pub trait Ensemble: System {
    /// All states `dt` seconds later, without noise.
    fn transitions(&mut self, from: &Matrix, controls: &[f64], dt: f64, to: &mut Matrix);

    /// The expected measurements of a sensor for all states, without noise.
    fn expectations(&mut self, sensor: usize, states: &Matrix, controls: &[f64], to: &mut [f64]);
}

/// A difference brought between minus and plus half a turn.
#[inline]
#[must_use]
pub fn wrapped(difference: f64, turn: Option<f64>) -> f64 {
    match turn {
        Some(turn) => difference - turn * libm::floor(difference / turn + 0.5),
        None => difference,
    }
}

/// A linear system by its matrices, with a fixed step: `x' = A x + B u + w`, `z = H x + v`.
#[derive(Clone, Debug)]
pub struct Linear {
    a: Matrix,
    b: Matrix,
    /// Row i of `H` as column i.
    h: Matrix,
    q: Matrix,
    r: Matrix,
    is_independent: bool,
}

impl Linear {
    /// `a` and `q` are n by n, `b` is n by the number of controls (0 without), `h` is m by n, `r` is m by m.
    ///
    /// # Errors
    /// A matrix of a wrong size, or noise that is not positive semidefinite.
    pub fn new(a: Matrix, b: Matrix, h: &Matrix, q: Matrix, r: Matrix) -> Result<Linear, Error> {
        let n = a.nrows();
        let size = |what, matrix: &Matrix, wanted: (usize, usize)| {
            let wanted_len = wanted.0 * wanted.1;
            let is_right = matrix.shape() == wanted;
            if is_right { Ok(()) } else { Err(Error::Size { what, found: matrix.len(), wanted: wanted_len }) }
        };
        size("A", &a, (n, n))?;
        size("B", &b, (n, b.ncols()))?;
        size("H", h, (h.nrows(), n))?;
        check_covariance("Q", &q, n)?;
        check_covariance("R", &r, h.nrows())?;
        let is_independent =
            r.iter().enumerate().all(|(place, entry)| place % (r.nrows() + 1) == 0 || *entry == 0.0);
        Ok(Linear { a, b, h: h.transpose(), q, r, is_independent })
    }
}

impl System for Linear {
    fn states(&self) -> usize {
        self.a.nrows()
    }

    fn sensors(&self) -> usize {
        self.h.ncols()
    }

    fn transition(&mut self, from: &[f64], controls: &[f64], _: f64, to: &mut [f64]) {
        multiply(&self.a, from, to);
        for (place, control) in controls.iter().enumerate().take(self.b.ncols()) {
            add_scaled(to, *control, column(&self.b, place));
        }
    }

    fn linearised(&mut self, from: &[f64], controls: &[f64], dt: f64, to: &mut [f64], jacobian: &mut Matrix) {
        self.transition(from, controls, dt, to);
        jacobian.copy_from(&self.a);
    }

    fn noise(&mut self, _: &[f64], _: &[f64], _: f64, noise: &mut Matrix) {
        noise.copy_from(&self.q);
    }

    fn expected(&mut self, sensor: usize, state: &[f64], _: &[f64]) -> f64 {
        dot(column(&self.h, sensor), state)
    }

    fn gradient(&mut self, sensor: usize, state: &[f64], _: &[f64], gradient: &mut [f64]) -> f64 {
        gradient.iter_mut().zip(column(&self.h, sensor)).for_each(|(to, from)| *to = *from);
        dot(gradient, state)
    }

    fn covariance(&mut self, one: usize, other: usize, _: &[f64], _: &[f64]) -> f64 {
        self.r.get((one, other)).copied().unwrap_or(f64::NAN)
    }

    fn is_independent(&self) -> bool {
        self.is_independent
    }

    fn turn(&self, _: usize) -> Option<f64> {
        None
    }
}

impl Ensemble for Linear {
    fn transitions(&mut self, from: &Matrix, controls: &[f64], _: f64, to: &mut Matrix) {
        for i in 0..self.a.nrows() {
            let to = column_mut(to, i);
            to.fill(
                controls.iter().enumerate().map(|(place, control)| at(&self.b, i, place) * control).sum(),
            );
            (0..self.a.ncols()).for_each(|j| add_scaled(to, at(&self.a, i, j), column(from, j)));
        }
    }

    fn expectations(&mut self, sensor: usize, states: &Matrix, _: &[f64], to: &mut [f64]) {
        to.fill(0.0);
        (0..self.h.nrows()).for_each(|j| add_scaled(to, at(&self.h, j, sensor), column(states, j)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    #[test]
    fn differences_of_angles_lie_within_half_a_turn() {
        assert_eq!(wrapped(3.0, None), 3.0);
        assert_eq!(wrapped(PI, Some(TAU)), -PI);
        assert!((wrapped(TAU + 0.25, Some(TAU)) - 0.25).abs() < 1e-15);
        assert!((wrapped(-6.0, Some(TAU)) - (TAU - 6.0)).abs() < 1e-15);
    }
}
