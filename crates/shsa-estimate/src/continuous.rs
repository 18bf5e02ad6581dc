//! Process noise declared per second: its covariance after any time, propagated by the transition.
//!
//! For white noise with the densities `d_k` in the states, `Q(dt)` is the integral from 0 to `dt` of `sum(d_k phi_k(s)
//! phi_k(s)')`, where `phi_k` is a column of the transition's derivatives after `s`. Three Gauss-Legendre points are exact where
//! these are polynomials up to the second degree (position, speed and acceleration). Then two short steps equal a long one, so a
//! filter may be evaluated at any rate. C. Van Loan 1978 (doi:10.1109/TAC.1978.1101743) has the closed form of linear systems.

use crate::Error;
use crate::formulas::{Draft, Formulas};
use crate::kernel::are_finite;
use crate::matrix::{Matrix, at, column, put};
use crate::system::{Ensemble, System};

/// The Gauss-Legendre points and weights of an integral from 0 to 1.
const POINTS: [(f64, f64); 3] =
    [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

/// A system by formulas whose noise is given by standard deviations: of each state in a second, and of each sensor.
#[derive(Clone, Debug)]
pub struct Continuous {
    formulas: Formulas,
    deviations: Matrix,
    to: Vec<f64>,
    /// The derivatives at the points, and those of the whole time.
    slopes: [Slopes; 4],
}

/// The derivatives of the transition over a time. Those of a linear transition are kept for as long as the time is the same: then they
/// are those of every state.
#[derive(Clone, Debug)]
struct Slopes {
    /// Not-a-number: unknown.
    dt: f64,
    jacobian: Matrix,
}

impl Slopes {
    fn over(
        &mut self,
        formulas: &mut Formulas,
        from: &[f64],
        controls: &[f64],
        dt: f64,
        to: &mut [f64],
    ) -> &Matrix {
        if self.dt != dt {
            formulas.linearised(from, controls, dt, to, &mut self.jacobian);
            let is_kept = formulas.is_linear() && are_finite(self.jacobian.as_slice());
            self.dt = if is_kept { dt } else { f64::NAN };
        }
        &self.jacobian
    }
}

impl Continuous {
    /// As [`Formulas::new`]; the draft's formulas of noise are standard deviations, and those off the diagonal are not used.
    ///
    /// # Errors
    /// The errors of [`Formulas::new`].
    pub fn new(draft: Draft) -> Result<Continuous, Error> {
        let formulas = Formulas::new(draft)?;
        let n = formulas.states();
        let slopes = Slopes { dt: f64::NAN, jacobian: Matrix::zeros(n, n) };
        let slopes = [(); 4].map(|()| slopes.clone());
        Ok(Continuous { formulas, deviations: Matrix::zeros(n, n), to: vec![0.0; n], slopes })
    }
}

impl System for Continuous {
    fn states(&self) -> usize {
        self.formulas.states()
    }

    fn sensors(&self) -> usize {
        self.formulas.sensors()
    }

    fn transition(&mut self, from: &[f64], controls: &[f64], dt: f64, to: &mut [f64]) {
        self.formulas.transition(from, controls, dt, to);
    }

    fn linearised(&mut self, from: &[f64], controls: &[f64], dt: f64, to: &mut [f64], jacobian: &mut Matrix) {
        let [.., slopes] = &mut self.slopes;
        if slopes.dt == dt {
            self.formulas.transition(from, controls, dt, to);
        }
        jacobian.copy_from(slopes.over(&mut self.formulas, from, controls, dt, to));
    }

    fn noise(&mut self, from: &[f64], controls: &[f64], dt: f64, noise: &mut Matrix) {
        let Continuous { formulas, deviations, to, slopes } = self;
        formulas.noise(from, controls, dt, deviations);
        noise.fill(0.0);
        for ((place, weight), slopes) in POINTS.into_iter().zip(slopes) {
            let slopes = slopes.over(formulas, from, controls, place * dt, to);
            for state in 0..deviations.ncols() {
                let deviation = at(deviations, state, state);
                if deviation != 0.0 {
                    add_outer(noise, weight * dt * deviation * deviation, column(slopes, state));
                }
            }
        }
    }

    fn expected(&mut self, sensor: usize, state: &[f64], controls: &[f64]) -> f64 {
        self.formulas.expected(sensor, state, controls)
    }

    fn gradient(&mut self, sensor: usize, state: &[f64], controls: &[f64], gradient: &mut [f64]) -> f64 {
        self.formulas.gradient(sensor, state, controls, gradient)
    }

    fn covariance(&mut self, one: usize, other: usize, state: &[f64], controls: &[f64]) -> f64 {
        self.formulas.covariance(one, other, state, controls).powi(2)
    }

    fn is_independent(&self) -> bool {
        self.formulas.is_independent()
    }

    fn turn(&self, sensor: usize) -> Option<f64> {
        self.formulas.turn(sensor)
    }
}

impl Ensemble for Continuous {
    fn transitions(&mut self, from: &Matrix, controls: &[f64], dt: f64, to: &mut Matrix) {
        self.formulas.transitions(from, controls, dt, to);
    }

    fn expectations(&mut self, sensor: usize, states: &Matrix, controls: &[f64], to: &mut [f64]) {
        self.formulas.expectations(sensor, states, controls, to);
    }
}

/// `to += factor * vector * vector'`.
fn add_outer(to: &mut Matrix, factor: f64, vector: &[f64]) {
    for (j, right) in vector.iter().enumerate().filter(|(_, right)| **right != 0.0) {
        for (i, left) in vector.iter().enumerate() {
            let sum = at(to, i, j) + factor * left * right;
            put(to, i, j, sum);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formulas::{Sensor, Vocabulary};
    use crate::matrix::propagate;

    fn chain() -> Continuous {
        let mut words = Vocabulary::default();
        ["p", "v", "a"].into_iter().for_each(|name| _ = words.add_number(name));
        let formula = |text: &str| words.formula("a test", text).unwrap();
        let noise = ["0", "0", "0", "0", "0", "2"].map(formula).to_vec();
        let transition = ["p + v*dt + a*dt^2/2", "v + a*dt", "a"].map(formula).to_vec();
        Continuous::new(Draft { transition, controls: 0, noise, sensors: Vec::new() }).unwrap()
    }

    #[test]
    fn noise_of_an_acceleration_is_that_of_the_textbook() {
        let (mut system, mut q) = (chain(), Matrix::zeros(3, 3));
        let dt: f64 = 0.7;
        system.noise(&[1.0, 2.0, 3.0], &[], dt, &mut q);
        let wanted = [
            [dt.powi(5) / 20.0, dt.powi(4) / 8.0, dt.powi(3) / 6.0],
            [dt.powi(4) / 8.0, dt.powi(3) / 3.0, dt.powi(2) / 2.0],
            [dt.powi(3) / 6.0, dt.powi(2) / 2.0, dt],
        ];
        for (row, wanted) in wanted.iter().enumerate() {
            for (column, wanted) in wanted.iter().enumerate() {
                assert!((q[(row, column)] - 4.0 * wanted).abs() < 1e-14, "{q}");
            }
        }
    }

    /// So a covariance stays one; the check of the model warns of such a formula.
    #[test]
    fn noise_below_zero_counts_by_its_magnitude() {
        let mut words = Vocabulary::default();
        words.add_number("x");
        let formula = |text: &str| words.formula("a test", text).unwrap();
        let noise = |text: &str| {
            let sensor =
                Sensor { name: "z".into(), formula: formula("x"), variance: formula(text), turn: None };
            let draft = Draft {
                transition: vec![formula("x")],
                controls: 0,
                noise: vec![formula(text)],
                sensors: vec![sensor],
            };
            let (mut system, mut q) = (Continuous::new(draft).unwrap(), Matrix::zeros(1, 1));
            system.noise(&[-2.0], &[], 1.0, &mut q);
            (q[(0, 0)], system.covariance(0, 0, &[-2.0], &[]))
        };
        assert_eq!(noise("0.5*x"), noise("0.5*abs(x)"));
        assert!(noise("0.5*x").1 == 1.0);
    }

    #[test]
    fn two_short_steps_are_as_one_long_one() {
        let (mut system, state) = (chain(), [0.0; 3]);
        let [mut f, mut q, mut p, mut once, mut work] = [(); 5].map(|()| Matrix::zeros(3, 3));
        for dt in [0.2, 0.5] {
            system.noise(&state, &[], dt, &mut q);
            system.linearised(&state, &[], dt, &mut [0.0; 3], &mut f);
            propagate(&f, &mut p, &q, &mut work);
        }
        system.noise(&state, &[], 0.7, &mut once);
        assert!((&p - &once).abs().max() < 1e-14, "{p} {once}");
    }
}
