//! Errors within declared bounds need not average out: intervals hold the truth whatever they are, and are hardly wider than that needs.
#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a test may fail loudly, in its helpers too"
)]

use proptest::prelude::*;
use shsa_core::time::{Span, Time};
use shsa_estimate::bounded::Bounded;
use shsa_estimate::fusion::{Fusion, Gate, Options};
use shsa_estimate::kalman::{Kalman, Loss};
use shsa_estimate::matrix::Matrix;
use shsa_estimate::method::{Measurement, Method};
use shsa_estimate::particle::{Particle, Particles};
use shsa_estimate::random::Random;
use shsa_estimate::system::Linear;
use shsa_estimate::unscented::{Points, Unscented};
use std::f64::consts::TAU;

/// A random system of up to three states, and the bounds of its sensors.
struct Plant {
    a: Matrix,
    h: Matrix,
    q: Matrix,
    bounds: Vec<f64>,
}

fn uniform(random: &mut Random, from: f64, to: f64) -> f64 {
    from + (to - from) * (random.bits() >> 11) as f64 / (1_u64 << 53) as f64
}

impl Plant {
    /// States that integrate each other, decay or turn, seen by one to four sensors of any mixture of them.
    fn draw(random: &mut Random) -> Plant {
        let n = 1 + (random.bits() % 3) as usize;
        let m = 1 + (random.bits() % 4) as usize;
        let step = 10_f64.powf(uniform(random, -2.0, 0.0));
        let a = match random.bits() % 3 {
            0 => Matrix::from_fn(n, n, |i, j| {
                (i..j).fold(if j >= i { 1.0 } else { 0.0 }, |all, place| all * step / (1 + place - i) as f64)
            }),
            1 => Matrix::from_fn(n, n, |i, j| if i == j { 1.0 - 0.3 * step } else { 0.1 * step }),
            _ if n > 1 => {
                let (sin, cos) = step.sin_cos();
                let turn = [[cos, -sin], [sin, cos]];
                Matrix::from_fn(n, n, |i, j| if i < 2 && j < 2 { turn[i][j] } else { f64::from(i == j) })
            }
            _ => Matrix::identity(n, n),
        };
        let mut h = Matrix::from_fn(m, n, |_, _| {
            if random.bits().is_multiple_of(3) { 0.0 } else { uniform(random, -1.0, 1.0) }
        });
        h[(0, 0)] = 1.0;
        let noise = 10_f64.powf(uniform(random, -3.0, 0.5));
        let q = Matrix::from_fn(n, n, |i, j| if i == j { noise * noise * step } else { 0.0 });
        let bounds = (0..m).map(|_| 10_f64.powf(uniform(random, -2.0, 0.5))).collect();
        Plant { a, h, q, bounds }
    }

    fn system(&self) -> Linear {
        let m = self.bounds.len();
        let r =
            Matrix::from_fn(m, m, |i, j| if i == j { self.bounds[i] * self.bounds[i] / 3.0 } else { 0.0 });
        Linear::new(self.a.clone(), Matrix::zeros(self.a.nrows(), 0), &self.h, self.q.clone(), r).unwrap()
    }
}

/// How the error of a sensor goes on, within its bound.
#[derive(Clone, Copy, Debug)]
enum Course {
    Constant(f64),
    Wave(f64, f64),
    Square(f64),
    Uniform,
    /// Always away from the truth of the estimate.
    Worst(f64),
}

impl Course {
    fn draw(random: &mut Random) -> Course {
        let sign = if random.bits().is_multiple_of(2) { 1.0 } else { -1.0 };
        match random.bits() % 5 {
            0 => Course::Constant(sign),
            1 => Course::Wave(uniform(random, 0.0, TAU), 10_f64.powf(uniform(random, -2.0, 0.5))),
            2 => Course::Square(10_f64.powf(uniform(random, 0.3, 2.0))),
            3 => Course::Uniform,
            _ => Course::Worst(sign),
        }
    }

    fn at(self, step: i32, off: f64, random: &mut Random) -> f64 {
        match self {
            Course::Constant(share) => share,
            Course::Wave(begin, rate) => (begin + rate * f64::from(step)).sin(),
            Course::Square(period) => {
                if (f64::from(step) / period) % 2.0 < 1.0 {
                    1.0
                } else {
                    -1.0
                }
            }
            Course::Uniform => uniform(random, -1.0, 1.0),
            Course::Worst(sign) => {
                if off < 0.0 {
                    -sign
                } else {
                    sign
                }
            }
        }
    }
}

type Make = fn(Linear, &[f64], &Matrix) -> Box<dyn Method>;

fn kalman(system: Linear, mean: &[f64], spread: &Matrix) -> Box<dyn Method> {
    Box::new(Kalman::new(system, mean, spread, Loss::Square).unwrap())
}

fn huber(system: Linear, mean: &[f64], spread: &Matrix) -> Box<dyn Method> {
    Box::new(Kalman::new(system, mean, spread, Loss::Huber(1.345)).unwrap())
}

fn student(system: Linear, mean: &[f64], spread: &Matrix) -> Box<dyn Method> {
    Box::new(Kalman::new(system, mean, spread, Loss::Student(4.0)).unwrap())
}

fn unscented(system: Linear, mean: &[f64], spread: &Matrix) -> Box<dyn Method> {
    Box::new(Unscented::new(system, mean, spread, Points::default()).unwrap())
}

fn particle(system: Linear, mean: &[f64], spread: &Matrix) -> Box<dyn Method> {
    let options = Particles { count: 300, ..Particles::default() };
    Box::new(Particle::new(system, mean, spread, options).unwrap())
}

/// The errors of all states over 300 moments, and how far the estimate says that it may be off: within bounds alone, and with noise of
/// this probability. All sensors but the first miss moments; with noise, the truth is as far from the initial mean and moves as declared.
fn run(seed: u64, make: Make, gate: Option<Gate>, is_noisy: bool, share: f64) -> Vec<(f64, f64)> {
    let mut random = Random::new(seed);
    let plant = Plant::draw(&mut random);
    let (n, m) = (plant.a.nrows(), plant.bounds.len());
    let mean = vec![0.0; n];
    let spread = Matrix::from_fn(n, n, |i, j| if i == j { 4.0 } else { 0.0 });
    let method = make(plant.system(), &mean, &spread);
    let options = Options { horizon: Span(0), moments: 4, gate, unknown_after: Span::MAX };
    let bounded = Box::new(Bounded::new(method, plant.system()));
    let mut fusion = Fusion::new(bounded, Time(0), m, 0, options).unwrap();
    let courses: Vec<Course> = (0..m).map(|_| Course::draw(&mut random)).collect();
    let misses: Vec<u64> = (0..m as u64).map(|sensor| 1 + sensor.min(1) * (random.bits() % 5)).collect();
    let noise =
        |random: &mut Random, variance: f64| if is_noisy { variance.sqrt() * random.normal() } else { 0.0 };
    let mut truth = Matrix::from_fn(n, 1, |_, _| noise(&mut random, 4.0));
    let (mut off, mut told) = (0.0, Vec::new());
    for step in 1..=300 {
        truth = &plant.a * truth;
        for i in 0..n {
            truth[(i, 0)] += noise(&mut random, plant.q[(i, i)]);
        }
        let at = Time(i64::from(step) * 1_000_000_000);
        for sensor in 0..m {
            let bound = plant.bounds[sensor];
            let error = bound * courses[sensor].at(step, off, &mut random);
            if random.bits().is_multiple_of(misses[sensor]) {
                let value = (plant.h.row(sensor) * &truth)[(0, 0)] + error;
                fusion.measure(at, Measurement { sensor, value, variance: Some(bound * bound / 3.0), bound });
            }
        }
        if let Some(estimate) = fusion.estimate(at) {
            off = estimate.mean[0] - truth[(0, 0)];
            let of_state = |state: usize| {
                let reach = 0.5 * estimate.interval(state, share).width();
                ((estimate.mean[state] - truth[(state, 0)]).abs(), reach)
            };
            told.extend((0..n).map(of_state));
        }
    }
    told
}

const ALL: [(&str, Make); 4] =
    [("kalman", kalman), ("huber", huber), ("student", student), ("unscented", unscented)];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]
    /// Without noise, bounds alone hold the error of every state, whatever the filter makes of the measurements.
    #[test]
    fn bounds_hold_any_error_within_them(seed: u64, is_gated: bool) {
        for (name, make) in ALL {
            let gate = is_gated.then(|| Gate::new(0.999, 5));
            for (off, reach) in run(seed, make, gate, false, 1e-12) {
                prop_assert!(off <= reach + 1e-9 * (1.0 + reach), "{name}: {off} beyond {reach}");
            }
        }
    }
}

/// With noise as declared, intervals of 95 % hold at least so many values.
#[test]
fn intervals_hold_the_truth_with_noise_too() {
    for (name, make) in ALL.into_iter().chain([("particle", particle as Make)]) {
        let told: Vec<(f64, f64)> = (0..60).flat_map(|seed| run(seed, make, None, true, 0.95)).collect();
        let held = told.iter().filter(|(off, reach)| off <= reach).count() as f64 / told.len() as f64;
        assert!(held >= 0.95, "{name}: {held}");
    }
}

/// For a position with a speed, the bound is at most 1.3 times as far as the worst errors lead: the sum of the responses to each of them.
#[test]
fn bounds_are_hardly_wider_than_the_worst_errors_need() {
    for (step, noise) in [(0.1, 0.3), (0.1, 0.01), (1.0, 1.0), (0.01, 1.0)] {
        let a = Matrix::from_row_slice(2, 2, &[1.0, step, 0.0, 1.0]);
        let shape = [step * step * step / 3.0, step * step / 2.0, step * step / 2.0, step];
        let q = Matrix::from_row_slice(2, 2, &shape) * (noise * noise);
        let h = Matrix::from_row_slice(1, 2, &[1.0, 0.0]);
        let system =
            Linear::new(a.clone(), Matrix::zeros(2, 0), &h, q, Matrix::from_element(1, 1, 1.0 / 3.0))
                .unwrap();
        let filter = kalman(system.clone(), &[0.0, 0.0], &Matrix::identity(2, 2));
        let mut filter = Bounded::new(filter, system);
        for _ in 0..20_000 {
            filter.predict(step, &[]);
            filter.update(&[Measurement { sensor: 0, value: 0.0, variance: None, bound: 1.0 }], &[]);
        }
        let gain = filter.spread() * h.transpose() * 3.0;
        let (mut response, mut worst) = (gain.clone(), [0.0; 2]);
        for _ in 0..20_000 {
            (0..2).for_each(|state| worst[state] += response[(state, 0)].abs());
            response = (Matrix::identity(2, 2) - &gain * &h) * &a * response;
        }
        for (state, worst) in worst.into_iter().enumerate() {
            let reach = filter.bias().unwrap().reach[(state, state)].sqrt();
            assert!((1.0..1.3).contains(&(reach / worst)), "{step} {noise} {state}: {reach} for {worst}");
        }
    }
}
