//! The steps of filters that are measured, each beside the same step written by hand.
#![allow(dead_code, reason = "each measurement uses a part")]
#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    reason = "a measurement that cannot run may say so loudly"
)]

use nalgebra::{SMatrix, SVector};
use shsa_estimate::formulas::{Draft, Formulas, Sensor, Vocabulary};
use shsa_estimate::kalman::{Kalman, Loss};
use shsa_estimate::matrix::Matrix;
use shsa_estimate::method::{Measurement, Method};
use shsa_estimate::particle::{Particle, Particles};
use shsa_estimate::system::{Linear, System};
use std::hint::black_box;

/// A step: predict and update.
pub(crate) type Step = Box<dyn FnMut()>;

/// What is measured, and what the same is called that is written by hand.
pub(crate) const STEPS: [(&str, Option<&str>); 4] = [
    ("kalman 6x3", Some("kalman 6x3 by hand")),
    ("extended 5x4", Some("extended 5x4 by hand")),
    ("particles 1000x3", None),
    ("particles 1000x3, precise", None),
];

/// The step with a name.
pub(crate) fn step(name: &str) -> Option<Step> {
    match name {
        "kalman 6x3" => Some(of(linear(), vec![0.3, -0.2, 0.1], 1.0)),
        "kalman 6x3 by hand" => Some(linear_by_hand()),
        "extended 5x4" => Some(of(extended(formulas()), FIXES.to_vec(), 0.1)),
        "extended 5x4 by hand" => Some(of(extended(ByHand), FIXES.to_vec(), 0.1)),
        "particles 1000x3" => Some(of(particles("0.5"), vec![0.0, 0.0], 0.1)),
        "particles 1000x3, precise" => Some(of(particles("0.0001"), vec![0.0, 0.0], 0.1)),
        _ => None,
    }
}

/// The step of a filter with these measurements.
fn of(mut filter: impl Method + 'static, values: Vec<f64>, dt: f64) -> Step {
    let all = values.iter().enumerate();
    let measurements: Vec<Measurement> = all
        .map(|(sensor, value)| Measurement { sensor, value: *value, variance: None, bound: 0.0 })
        .collect();
    Box::new(move || {
        filter.predict(dt, &[]);
        black_box(filter.update(black_box(&measurements), &[]));
    })
}

/// A full stable matrix of six states, so that no zeros are left out.
fn a(i: usize, j: usize) -> f64 {
    if i == j { 0.9 } else { 0.01 * ((3 * i + 5 * j) % 7) as f64 - 0.03 }
}

/// Six states and three measurements of them.
fn h(i: usize, j: usize) -> f64 {
    if j == 2 * i { 1.0 } else { 0.1 }
}

fn linear() -> Kalman<Linear> {
    let (q, r) = (Matrix::identity(6, 6) * 0.1, Matrix::identity(3, 3) * 0.5);
    let (full_a, full_h) = (Matrix::from_fn(6, 6, a), Matrix::from_fn(3, 6, h));
    let system = Linear::new(full_a, Matrix::zeros(6, 0), &full_h, q, r).expect("a system");
    Kalman::new(system, &[0.0; 6], &Matrix::identity(6, 6), Loss::Square).expect("a filter")
}

/// The same with matrices of fixed sizes, in Joseph's form, without checks.
fn linear_by_hand() -> Step {
    type Square = SMatrix<f64, 6, 6>;
    let (a, h) = (Square::from_fn(a), SMatrix::<f64, 3, 6>::from_fn(h));
    let (q, r) = (Square::identity() * 0.1, SMatrix::<f64, 3, 3>::identity() * 0.5);
    let (mut x, mut p) = (SVector::<f64, 6>::zeros(), Square::identity());
    let z = SVector::<f64, 3>::new(0.3, -0.2, 0.1);
    Box::new(move || {
        x = a * x;
        p = a * p * a.transpose() + q;
        let z = black_box(z);
        let s = h * p * h.transpose() + r;
        let Some(inverse) = s.try_inverse() else { return };
        let gain = p * h.transpose() * inverse;
        x += gain * (z - h * x);
        let left = Square::identity() - gain * h;
        p = left * p * left.transpose() + gain * r * gain.transpose();
        black_box((&x, &p));
    })
}

/// A rover: position, heading, speed, turn rate; position fixes, heading, speed.
const STATES: [&str; 5] = ["x", "y", "h", "v", "w"];
const TRANSITION: [&str; 5] = ["x + v*dt*cos(h)", "y + v*dt*sin(h)", "h + w*dt", "v", "w"];
const SENSORS: [&str; 4] = ["x", "y", "v", "atan2(y, x)"];
const NOISE: [f64; 5] = [1e-4, 1e-4, 1e-4, 1e-2, 1e-2];

fn formulas() -> Formulas {
    let mut words = Vocabulary::default();
    for state in STATES {
        words.add_number(state);
    }
    let formula = |text: &str| words.formula("a benchmark", text).expect("a formula");
    let places = (0..5).flat_map(|i| (i..5).map(move |j| (i, j)));
    let noise =
        places.map(|(i, j)| if i == j { formula(&format!("{} * dt", NOISE[i])) } else { formula("0") });
    let sensor = |text: &str| Sensor {
        name: text.into(),
        formula: formula(text),
        variance: formula("0.5"),
        turn: None,
    };
    Formulas::new(Draft {
        transition: TRANSITION.map(formula).into(),
        controls: 0,
        noise: noise.collect(),
        sensors: SENSORS.map(sensor).into(),
    })
    .expect("a model")
}

/// The same system by hand.
struct ByHand;

impl System for ByHand {
    fn states(&self) -> usize {
        5
    }

    fn sensors(&self) -> usize {
        4
    }

    fn transition(&mut self, from: &[f64], _: &[f64], dt: f64, to: &mut [f64]) {
        let [x, y, h, v, w] = *from else { return };
        to.copy_from_slice(&[x + v * dt * libm::cos(h), y + v * dt * libm::sin(h), h + w * dt, v, w]);
    }

    fn linearised(&mut self, from: &[f64], u: &[f64], dt: f64, to: &mut [f64], jacobian: &mut Matrix) {
        self.transition(from, u, dt, to);
        let [_, _, h, v, _] = *from else { return };
        let (sin, cos) = (libm::sin(h), libm::cos(h));
        jacobian.fill_with_identity();
        for (row, column, slope) in
            [(0, 2, -v * dt * sin), (0, 3, dt * cos), (1, 2, v * dt * cos), (1, 3, dt * sin), (2, 4, dt)]
        {
            jacobian[(row, column)] = slope;
        }
    }

    fn noise(&mut self, _: &[f64], _: &[f64], dt: f64, noise: &mut Matrix) {
        (0..5).for_each(|i| noise[(i, i)] = NOISE[i] * dt);
    }

    fn expected(&mut self, sensor: usize, state: &[f64], _: &[f64]) -> f64 {
        let [x, y, _, v, _] = *state else { return f64::NAN };
        [x, y, v, libm::atan2(y, x)][sensor]
    }

    fn gradient(&mut self, sensor: usize, state: &[f64], u: &[f64], gradient: &mut [f64]) -> f64 {
        let [x, y, ..] = *state else { return f64::NAN };
        let square = x * x + y * y;
        gradient.fill(0.0);
        match sensor {
            0 => gradient[0] = 1.0,
            1 => gradient[1] = 1.0,
            2 => gradient[3] = 1.0,
            _ => (gradient[0], gradient[1]) = (-y / square, x / square),
        }
        self.expected(sensor, state, u)
    }

    fn covariance(&mut self, one: usize, other: usize, _: &[f64], _: &[f64]) -> f64 {
        if one == other { 0.5 } else { 0.0 }
    }

    fn is_independent(&self) -> bool {
        true
    }

    fn turn(&self, _: usize) -> Option<f64> {
        None
    }
}

/// Values of the sensors.
const FIXES: [f64; 4] = [10.0, 5.0, 1.0, 0.46];

/// An extended filter over the rover.
fn extended<S: System>(system: S) -> Kalman<S> {
    let start = [10.0, 5.0, 0.3, 1.0, 0.1];
    Kalman::new(system, &start, &Matrix::identity(5, 5), Loss::Square).expect("a filter")
}

/// 1,000 particles of three states, whose measurements have this variance.
fn particles(variance: &str) -> Particle<Formulas> {
    let mut words = Vocabulary::default();
    for state in ["x", "y", "h"] {
        words.add_number(state);
    }
    let formula = |text: &str| words.formula("a benchmark", text).expect("a formula");
    let sensor = |text: &str| Sensor {
        name: text.into(),
        formula: formula(text),
        variance: formula(variance),
        turn: None,
    };
    let system = Formulas::new(Draft {
        transition: ["x + dt*cos(h)", "y + dt*sin(h)", "h"].map(formula).into(),
        controls: 0,
        noise: ["0.01*dt", "0", "0", "0.01*dt", "0", "0.01*dt"].map(formula).into(),
        sensors: ["x", "y"].map(sensor).into(),
    })
    .expect("a model");
    Particle::new(system, &[0.0; 3], &Matrix::identity(3, 3), Particles::default()).expect("a filter")
}
