//! Consistency of filters: over 200 runs the normalized estimation error squared is within its bounds.
//!
//! For a consistent filter `e' P^-1 e` is chi-square distributed with n degrees of freedom, and the mean over independent runs is
//! within bounds around n with a probability of 95 % (Y. Bar-Shalom and others, "Estimation with Applications to Tracking and
//! Navigation", 2001, 5.4, doi:10.1002/0471221279).
#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a test may fail loudly, in its helpers too"
)]

use shsa_core::expression::Formula;
use shsa_estimate::formulas::{Draft, Formulas, Sensor, Vocabulary};
use shsa_estimate::kalman::{Kalman, Loss};
use shsa_estimate::matrix::{Factors, Matrix};
use shsa_estimate::method::{Measurement, Method};
use shsa_estimate::normal::{Normal, two_sided};
use shsa_estimate::random::Random;
use shsa_estimate::system::System;
use shsa_estimate::unscented::{Points, Unscented};
use std::f64::consts::TAU;

const RUNS: usize = 200;
const STEPS: usize = 40;
const DT: f64 = 0.1;

/// A system by names of states, transition, upper triangle of noise, and sensors with variance and turn.
fn system(
    states: &[&str],
    transition: &[&str],
    noise: &[&str],
    sensors: &[(&str, &str, Option<f64>)],
) -> Formulas {
    let mut words = Vocabulary::default();
    for state in states {
        words.add_number(*state);
    }
    let formula = |text: &str| words.formula("a test", text).unwrap();
    let all = |texts: &[&str]| -> Vec<Formula> { texts.iter().map(|text| formula(text)).collect() };
    let sensor = |(text, variance, turn): &(&str, &str, Option<f64>)| Sensor {
        name: (*text).into(),
        formula: formula(text),
        variance: formula(variance),
        turn: *turn,
    };
    let sensors = sensors.iter().map(sensor).collect();
    Formulas::new(Draft { transition: all(transition), controls: 0, noise: all(noise), sensors }).unwrap()
}

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
fn error_squared(method: &dyn Method, truth: &[f64]) -> f64 {
    let mut apart: Vec<f64> = method.mean().iter().zip(truth).map(|(mean, truth)| mean - truth).collect();
    let mut factors = Factors::new(apart.len());
    factors.factor(method.spread(), truth.len());
    factors.solve_lower(&mut apart);
    apart.iter().zip(&factors.d).map(|(y, d)| y * y / d).sum()
}

/// Checks that the mean at the end of many runs is within the bounds, and the shares of intervals in the middle.
#[track_caller]
fn check(
    make: impl Fn() -> Formulas,
    start: &[f64],
    spread: &[f64],
    filter: impl Fn(Formulas, &[f64], &Matrix) -> Box<dyn Method>,
) {
    let n = start.len();
    let p = Matrix::from_fn(n, n, |i, j| if i == j { spread[i] } else { 0.0 });
    let reach = two_sided(0.95);
    let (mut sum, mut held, mut count) = (0.0, 0_u32, 0_u32);
    for run in 0..RUNS {
        let mut random = Random::new(1 + run as u64);
        let (mut world, mut truth, mut next) = (make(), vec![0.0; n], vec![0.0; n]);
        Normal::new(start, &p).unwrap().sample(&mut random, &mut truth);
        let mut filter = filter(make(), start, &p);
        for _ in 0..STEPS {
            world.transition(&truth, &[], DT, &mut next);
            let mut noise = Matrix::zeros(n, n);
            world.noise(&truth, &[], DT, &mut noise);
            Normal::new(&next, &noise).unwrap().sample(&mut random, &mut truth);
            let measurements: Vec<Measurement> = (0..world.sensors())
                .map(|sensor| {
                    let sigma = world.covariance(sensor, sensor, &truth, &[]).sqrt();
                    let value = world.expected(sensor, &truth, &[]) + sigma * random.normal();
                    Measurement { sensor, value, variance: None }
                })
                .collect();
            assert!(filter.predict(DT, &[]));
            assert!(!filter.update(&measurements, &[]).healed);
        }
        sum += error_squared(&*filter, &truth);
        for (state, truth) in truth.iter().enumerate() {
            let sigma = filter.spread()[(state, state)].sqrt();
            held += u32::from((filter.mean()[state] - truth).abs() <= reach * sigma);
            count += 1;
        }
    }
    // The sum is chi-square distributed with this many degrees of freedom, which is nearly normal.
    let degrees = (RUNS * n) as f64;
    let bounds = reach * (2.0 * degrees).sqrt();
    assert!((sum - degrees).abs() <= bounds, "{sum} is not {degrees} +- {bounds}");
    let share = f64::from(held) / f64::from(count);
    assert!((share - 0.95).abs() < 0.035, "{share} of the truth is in the intervals");
}

fn kalman(system: Formulas, mean: &[f64], p: &Matrix) -> Box<dyn Method> {
    Box::new(Kalman::new(system, mean, p, Loss::Square).unwrap())
}

fn unscented(system: Formulas, mean: &[f64], p: &Matrix) -> Box<dyn Method> {
    Box::new(Unscented::new(system, mean, p, Points::default()).unwrap())
}

const START: [f64; 4] = [-31.0, 22.0, 0.5, -1.5];
const SPREAD: [f64; 4] = [1.0, 1.0, 1.0, 1.0];

#[test]
fn a_kalman_filter_is_consistent() {
    check(line, &[0.0, 1.0], &[4.0, 1.0], kalman);
}

#[test]
fn an_extended_kalman_filter_is_consistent() {
    check(target, &START, &SPREAD, kalman);
}

#[test]
fn an_unscented_kalman_filter_is_consistent() {
    check(target, &START, &SPREAD, unscented);
}

#[test]
#[should_panic(expected = "is not 400")]
fn a_filter_that_believes_too_little_noise_is_found() {
    let confident = || {
        system(&["p", "v"], &["p + v*dt", "v"], &["0", "0", "0"], &[("p", "0.5", None), ("v", "0.1", None)])
    };
    check(line, &[0.0, 1.0], &[4.0, 1.0], |_, mean, p| kalman(confident(), mean, p));
}
