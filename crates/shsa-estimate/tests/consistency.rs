//! Consistency of filters: over 200 runs the normalized estimation error squared is within its bounds, also while measurements
//! are missing, after they have returned, and where they come late.
//!
//! For a consistent filter `e' P^-1 e` is chi-square distributed with n degrees of freedom, and the mean over independent runs is
//! within bounds around n with a probability of 95 % (Y. Bar-Shalom and others, "Estimation with Applications to Tracking and
//! Navigation", 2001, 5.4, doi:10.1002/0471221279).
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::indexing_slicing,
    reason = "a test may fail loudly, in its helpers too"
)]

mod common;

use common::system;
use shsa_core::time::{Span, Time};
use shsa_estimate::formulas::Formulas;
use shsa_estimate::fusion::{Estimate, Fusion, Gate, Options};
use shsa_estimate::kalman::{Kalman, Loss};
use shsa_estimate::matrix::{Factors, Matrix};
use shsa_estimate::method::{Measurement, Method};
use shsa_estimate::normal::{Normal, two_sided};
use shsa_estimate::particle::{Particle, Particles};
use shsa_estimate::random::Random;
use shsa_estimate::system::System;
use shsa_estimate::unscented::{Points, Unscented};
use std::f64::consts::TAU;

fn line() -> Formulas {
    system(
        &["p", "v"],
        &["p + v*dt", "v"],
        &["0.4*dt^3/3", "0.4*dt^2/2", "0.4*dt"],
        &[("p", "0.5", None), ("v", "0.1", None)],
    )
}

/// A target measured by range and bearing.
fn target() -> Formulas {
    system(
        &["x", "y", "vx", "vy"],
        &["x + vx*dt", "y + vy*dt", "vx", "vy"],
        &[
            "0.05*dt^3/3",
            "0",
            "0.05*dt^2/2",
            "0",
            "0.05*dt^3/3",
            "0",
            "0.05*dt^2/2",
            "0.05*dt",
            "0",
            "0.05*dt",
        ],
        &[("hypot(x, y)", "0.25", None), ("atan2(y, x)", "0.0004", Some(TAU))],
    )
}

/// `e' P^-1 e`.
fn error_squared(estimate: &Estimate<'_>, truth: &[f64]) -> f64 {
    let mut apart: Vec<f64> = estimate.mean.iter().zip(truth).map(|(mean, truth)| mean - truth).collect();
    let mut factors = Factors::new(apart.len());
    factors.factor(estimate.spread, truth.len());
    factors.solve_lower(&mut apart);
    apart.iter().zip(&factors.d).map(|(y, d)| y * y / d).sum()
}

/// What is missing between two steps of a run, or late.
#[derive(Clone, Copy, Debug)]
enum Lost {
    Nothing,
    /// A sensor, from step 16 to 27.
    Sensor(usize),
    /// All sensors, from step 16 to 27.
    All,
    /// Each measurement is up to 5 steps late.
    Late,
}

const RUNS: usize = 200;
const STEPS: usize = 40;
const STEP: Span = Span(100_000_000);
/// The estimate is judged after these steps: at the end of a loss, after it, and at the end.
const JUDGED: [usize; 3] = [27, 28, STEPS];

impl Lost {
    /// The step at which the measurement of a step arrives.
    fn arrives(self, step: usize, sensor: usize, random: &mut Random) -> Option<usize> {
        let is_then = (16..=27).contains(&step);
        match self {
            Lost::Sensor(lost) if is_then && lost == sensor => None,
            Lost::All if is_then => None,
            Lost::Late => Some((step + (6.0 * random.share()) as usize).min(STEPS)),
            _ => Some(step),
        }
    }
}

/// The normalized error squared, and how many intervals of 95 % hold the truth, at one judged step of all runs.
#[derive(Clone, Copy, Debug, Default)]
struct Judged {
    sum: f64,
    held: u32,
}

/// Runs a filter against a world of its model, many times.
fn judged(
    make: fn() -> Formulas,
    (start, spread): (&[f64], &[f64]),
    gate: Option<Gate>,
    lost: Lost,
    filter: fn(Formulas, &[f64], &Matrix) -> Box<dyn Method>,
) -> [Judged; 3] {
    let n = start.len();
    let p = Matrix::from_fn(n, n, |i, j| if i == j { spread[i] } else { 0.0 });
    let options = Options { horizon: STEP.times(8), moments: 16, gate, unknown_after: STEP.times(15) };
    let mut all = [Judged::default(); 3];
    for run in 0..RUNS {
        let mut random = Random::new(1001 + run as u64);
        let (mut world, mut truth, mut next) = (make(), vec![0.0; n], vec![0.0; n]);
        Normal::new(start, &p).unwrap().sample(&mut random, &mut truth);
        let sensors = world.sensors();
        let mut fusion = Fusion::new(filter(make(), start, &p), Time(0), sensors, 0, options).unwrap();
        let mut arriving: Vec<Vec<(Time, Measurement)>> = vec![Vec::new(); STEPS + 1];
        for step in 1..=STEPS {
            let at = Time(0) + STEP.times(step as i64);
            world.transition(&truth, &[], STEP.seconds(), &mut next);
            let mut noise = Matrix::zeros(n, n);
            world.noise(&truth, &[], STEP.seconds(), &mut noise);
            Normal::new(&next, &noise).unwrap().sample(&mut random, &mut truth);
            for sensor in 0..sensors {
                let sigma = world.covariance(sensor, sensor, &truth, &[]).sqrt();
                let value = world.expected(sensor, &truth, &[]) + sigma * random.normal();
                let arrives = lost.arrives(step, sensor, &mut random);
                let measurement = Measurement { sensor, value, variance: None, bound: 0.0 };
                arrives.into_iter().for_each(|step| arriving[step].push((at, measurement)));
            }
            for (at, measurement) in &arriving[step] {
                fusion.measure(*at, *measurement);
            }
            if let Some(place) = JUDGED.iter().position(|judged| *judged == step) {
                let estimate = fusion.estimate(at).expect("an estimate within a second and a half");
                all[place].sum += error_squared(&estimate, &truth);
                let holds = |state: &usize| estimate.interval(*state, 0.95).contains(truth[*state]);
                all[place].held += (0..n).filter(holds).count() as u32;
            }
        }
    }
    all
}

/// Checks that the mean error is within its bounds, and the share of intervals that hold the truth within 3.5 % of 95 %.
#[track_caller]
fn check(
    make: fn() -> Formulas,
    begin: (&[f64], &[f64]),
    gate: Option<Gate>,
    lost: Lost,
    filter: fn(Formulas, &[f64], &Matrix) -> Box<dyn Method>,
) {
    for (judged, step) in judged(make, begin, gate, lost, filter).into_iter().zip(JUDGED) {
        // The sum is chi-square distributed with this many degrees of freedom, which is nearly normal.
        let degrees = (RUNS * begin.0.len()) as f64;
        let bounds = two_sided(0.95) * (2.0 * degrees).sqrt();
        let Judged { sum, held } = judged;
        assert!((sum - degrees).abs() <= bounds, "{lost:?} step {step}: {sum} is not {degrees} +- {bounds}");
        let share = f64::from(held) / degrees;
        assert!(
            (share - 0.95).abs() < 0.035,
            "{lost:?} step {step}: {share} of the truth is in the intervals"
        );
    }
}

fn kalman(system: Formulas, mean: &[f64], p: &Matrix) -> Box<dyn Method> {
    Box::new(Kalman::new(system, mean, p, Loss::Square).unwrap())
}

fn unscented(system: Formulas, mean: &[f64], p: &Matrix) -> Box<dyn Method> {
    Box::new(Unscented::new(system, mean, p, Points::default()).unwrap())
}

const START: [f64; 4] = [-31.0, 22.0, 0.5, -1.5];
const SPREAD: [f64; 4] = [1.0, 1.0, 1.0, 1.0];

const LINE: (&[f64], &[f64]) = (&[0.0, 1.0], &[4.0, 1.0]);
const TARGET: (&[f64], &[f64]) = (&START, &SPREAD);
const LOST: [Lost; 5] = [Lost::Nothing, Lost::Sensor(0), Lost::Sensor(1), Lost::All, Lost::Late];

#[test]
fn a_kalman_filter_is_consistent_also_after_drops() {
    LOST.into_iter().for_each(|lost| check(line, LINE, None, lost, kalman));
}

#[test]
fn a_gate_costs_no_consistency() {
    let gate = Some(Gate::new(0.999, 5));
    LOST.into_iter().for_each(|lost| check(line, LINE, gate, lost, kalman));
}

#[test]
fn an_extended_kalman_filter_is_consistent_also_after_drops() {
    LOST.into_iter().for_each(|lost| check(target, TARGET, None, lost, kalman));
}

#[test]
fn an_unscented_kalman_filter_is_consistent_also_after_drops() {
    LOST.into_iter().for_each(|lost| check(target, TARGET, None, lost, unscented));
}

#[test]
#[should_panic(expected = "is not 400")]
fn a_filter_that_believes_too_little_noise_is_found() {
    fn confident(_: Formulas, mean: &[f64], p: &Matrix) -> Box<dyn Method> {
        let sensors = [("p", "0.5", None), ("v", "0.1", None)];
        kalman(system(&["p", "v"], &["p + v*dt", "v"], &["0", "0", "0"], &sensors), mean, p)
    }
    check(line, LINE, None, Lost::Nothing, confident);
}

/// Robust filters weigh normal noise as if it had outliers, and particles are a sample: their intervals of 95 % hold at least 90 %.
#[test]
fn robust_filters_and_particles_hold_the_truth_also_after_drops() {
    fn huber(system: Formulas, mean: &[f64], p: &Matrix) -> Box<dyn Method> {
        Box::new(Kalman::new(system, mean, p, Loss::Huber(1.345)).unwrap())
    }
    fn student(system: Formulas, mean: &[f64], p: &Matrix) -> Box<dyn Method> {
        Box::new(Kalman::new(system, mean, p, Loss::Student(4.0)).unwrap())
    }
    fn particles(system: Formulas, mean: &[f64], p: &Matrix) -> Box<dyn Method> {
        Box::new(Particle::new(system, mean, p, Particles { count: 300, ..Particles::default() }).unwrap())
    }
    for (name, filter) in
        [("huber", huber as fn(_, &[f64], &_) -> _), ("student", student), ("particles", particles)]
    {
        for lost in LOST {
            for (judged, step) in judged(line, LINE, None, lost, filter).into_iter().zip(JUDGED) {
                let share = f64::from(judged.held) / (RUNS * 2) as f64;
                assert!(
                    share >= 0.9,
                    "{name} {lost:?} step {step}: {share} of the truth is in the intervals"
                );
            }
        }
    }
}
