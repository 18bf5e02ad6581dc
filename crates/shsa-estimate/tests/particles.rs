//! The particle filter against exact answers: where a state is not observed, where the linearisation is wrong, and where
//! measurements come one by one.
#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a test may fail loudly, in its helpers too"
)]

mod common;

use common::system;
use shsa_estimate::formulas::Formulas;
use shsa_estimate::kalman::{Kalman, Loss};
use shsa_estimate::matrix::Matrix;
use shsa_estimate::method::{Measurement, Method};
use shsa_estimate::normal::log_density;
use shsa_estimate::particle::{Particle, Particles};
use shsa_estimate::random::Random;
use std::f64::consts::TAU;

fn particles(system: Formulas, mean: &[f64], p: &Matrix, count: usize, seed: u64) -> Particle<Formulas> {
    Particle::new(system, mean, p, Particles { count, seed, ..Particles::default() }).unwrap()
}

fn of(sensor: usize, value: f64) -> Measurement {
    Measurement { sensor, value, variance: None, bound: 0.0 }
}

/// The speed is measured precisely; nothing shows the position.
fn odometry() -> Formulas {
    system(&["p", "v"], &["p + v*dt", "v"], &["0", "0", "0.4*dt"], &[("v", "0.0001", None)])
}

#[test]
fn a_position_that_nothing_observes_stays_as_uncertain_as_it_is() {
    let (start, p) = ([0.0, 1.0], Matrix::identity(2, 2));
    let mut off = Vec::new();
    for seed in 1..=10 {
        let mut random = Random::new(900 + seed);
        let mut exact = Kalman::new(odometry(), &start, &p, Loss::Square).unwrap();
        let mut filter = particles(odometry(), &start, &p, 1000, seed);
        let mut speed = 1.0 + random.normal();
        for _ in 0..400 {
            speed += (0.4_f64 * 0.1).sqrt() * random.normal();
            let measured = [of(0, speed + 0.01 * random.normal())];
            for method in [&mut exact as &mut dyn Method, &mut filter] {
                assert!(method.predict(0.1, &[]));
                assert_eq!(method.update(&measured, &[]).used, 1);
            }
        }
        let (variance, wanted) = (filter.spread()[(0, 0)], exact.spread()[(0, 0)]);
        assert!((0.5..2.0).contains(&(variance / wanted)), "seed {seed}: {variance} is not {wanted}");
        off.push((filter.mean()[0] - exact.mean()[0]) / wanted.sqrt());
    }
    assert!(off.iter().all(|off| off.abs() < 0.6), "{off:?}");
}

#[test]
fn mean_and_variance_are_those_of_the_kalman_filter() {
    let line = || {
        let noise = ["0.4*dt^3/3", "0.4*dt^2/2", "0.4*dt"];
        system(&["p", "v"], &["p + v*dt", "v"], &noise, &[("p", "0.5", None), ("v", "0.001", None)])
    };
    let (start, p) = ([0.0, 1.0], Matrix::from_diagonal(&[4.0, 1.0].to_vec().into()));
    let (mut squares, mut ratios, mut likelihoods) = (0.0, [0.0; 2], 0.0);
    let (seeds, steps) = (20, 60);
    for seed in 1..=seeds {
        let mut random = Random::new(40 + seed);
        let mut exact = Kalman::new(line(), &start, &p, Loss::Square).unwrap();
        let mut filter = particles(line(), &start, &p, 1000, seed);
        let (mut position, mut speed) = (2.0 * random.normal(), 1.0 + random.normal());
        for _ in 0..steps {
            let before = speed;
            speed += 0.2 * random.normal();
            position += 0.1 * (before + speed) / 2.0;
            let all =
                [of(0, position + 0.5_f64.sqrt() * random.normal()), of(1, speed + 0.03 * random.normal())];
            let told = [&mut exact as &mut dyn Method, &mut filter].map(|method| {
                method.predict(0.1, &[]);
                method.update(&all, &[]).log_likelihood
            });
            likelihoods += told[1] - told[0];
            for (state, ratio) in ratios.iter_mut().enumerate() {
                let variance = exact.spread()[(state, state)];
                squares += (filter.mean()[state] - exact.mean()[state]).powi(2) / variance;
                *ratio += filter.spread()[(state, state)] / variance;
            }
        }
    }
    let count = (seeds * steps) as f64;
    assert!(squares / count < 0.2, "{}", squares / count);
    assert!(ratios.iter().all(|sum| (sum / count - 1.0).abs() < 0.1), "{:?}", ratios.map(|sum| sum / count));
    assert!((likelihoods / count).abs() < 0.05, "{}", likelihoods / count);
}

/// Mean and variance after a step and a measurement of one state, by a sum over a grid; the prediction is normal.
fn by_grid((mean, variance): (f64, f64), likelihood: impl Fn(f64) -> f64) -> (f64, f64) {
    let points = (-200_000..=200_000).map(|place| mean + 1e-4 * f64::from(place) * variance.sqrt());
    let (mut total, mut sum, mut square) = (0.0, 0.0, 0.0);
    for x in points {
        let weight = (log_density(x - mean, variance) + likelihood(x)).exp();
        let weight = if weight.is_nan() { 0.0 } else { weight };
        (total, sum, square) = (total + weight, sum + weight * x, square + weight * x * x);
    }
    (sum / total, square / total - (sum / total).powi(2))
}

/// Checks a step and a precise measurement against the grid: a state with this mean and variance 1, with noise of variance 1.
#[track_caller]
fn check_step(
    measured: (&str, Option<f64>),
    function: fn(f64) -> f64,
    mean: f64,
    value: f64,
    tolerance: f64,
) {
    const DEVIATION: f64 = 0.05;
    let make = || system(&["x"], &["x"], &["dt"], &[(measured.0, "0.0025", measured.1)]);
    let wanted = by_grid((mean, 2.0), |x| {
        let apart = value - function(x);
        let apart = measured.1.map_or(apart, |turn| apart - turn * (apart / turn).round());
        log_density(apart, DEVIATION * DEVIATION)
    });
    for seed in 1..=5 {
        let mut filter = particles(make(), &[mean], &Matrix::identity(1, 1), 20_000, seed);
        filter.predict(1.0, &[]);
        assert_eq!(filter.update(&[of(0, value)], &[]).used, 1);
        let found = (filter.mean()[0], filter.spread()[(0, 0)]);
        let scale = wanted.1.sqrt();
        let is_right =
            (found.0 - wanted.0).abs() < tolerance * scale && (found.1 / wanted.1 - 1.0).abs() < tolerance;
        assert!(is_right, "{} seed {seed}: {found:?} is not {wanted:?}", measured.0);
    }
}

#[test]
fn a_wrong_linearisation_costs_no_correctness() {
    check_step(("x", None), |x| x, 0.3, 1.5, 0.1);
    check_step(("abs(x)", None), f64::abs, 0.3, 1.5, 0.1);
    check_step(("x^2", None), |x| x * x, 0.3, 1.5, 0.1);
    check_step(("x^3", None), |x| x.powi(3), 0.0, 1.5, 0.15);
    check_step(("sin(3*x)", None), |x| (3.0 * x).sin(), 0.3, 0.4, 0.1);
    // No derivative at the mean, and no value for half of the particles.
    check_step(("sqrt(x)", None), f64::sqrt, -0.5, 1.0, 0.2);
    check_step(("x", Some(3.0)), |x| x, 0.3, 1.4, 0.15);
}

/// Two sensors of a target, one of them an angle.
fn target() -> Particle<Formulas> {
    let sensors = [("hypot(x, y)", "0.01", None), ("atan2(y, x)", "0.0001", Some(TAU))];
    let noise = ["0.2*dt", "0", "0.2*dt"];
    particles(
        system(&["x", "y"], &["x", "y"], &noise, &sensors),
        &[-3.0, 0.1],
        &Matrix::identity(2, 2),
        500,
        3,
    )
}

#[test]
fn measurements_of_a_moment_give_the_same_one_by_one_and_together() {
    let (mut together, mut single) = (target(), target());
    for step in 0..20 {
        let all = [of(0, 3.0 + 0.01 * f64::from(step)), of(1, 3.1)];
        for filter in [&mut together, &mut single] {
            assert!(filter.predict(0.1, &[]));
        }
        let wanted = together.update(&all, &[]);
        let found = all.map(|measurement| single.update(&[measurement], &[]));
        assert_eq!(found.map(|found| found.used), [1, 1]);
        let sum = found[0].log_likelihood + found[1].log_likelihood;
        assert!((sum - wanted.log_likelihood).abs() < 1e-9);
        assert_eq!(single.gaussian(), together.gaussian());
    }
}

#[test]
fn what_rules_out_all_particles_changes_nothing() {
    let make = || system(&["x"], &["x"], &["dt"], &[("x", "0.01", None), ("sqrt(-1 - x^2)", "0.01", None)]);
    let mut filter = particles(make(), &[0.0], &Matrix::identity(1, 1), 500, 3);
    filter.predict(1.0, &[]);
    let before = filter.gaussian().clone();
    assert!(filter.update(&[of(1, 1.0)], &[]).healed);
    assert_eq!(*filter.gaussian(), before);
    filter.update(&[of(0, 1.0)], &[]);
    let before = filter.gaussian().clone();
    assert_eq!(filter.update(&[of(1, 1.0)], &[]).used, 0);
    assert_eq!(*filter.gaussian(), before);
}

/// A constant that two sensors measure, of which the second sees a multiple.
fn constant(deviation: f64) -> Formulas {
    let variance = format!("{}", deviation * deviation);
    system(&["x"], &["x"], &["0"], &[("x", &variance, None), ("2*x", &variance, None)])
}

/// Whatever the spread of the begin, the noise of the sensors and the number of particles, from 50 on: where few particles would be left, the filter is
/// as certain as the exact one, or less, and where it is not certain it says so. Nothing moves the state.
#[test]
fn few_particles_are_never_too_certain() {
    let (mut off, mut count, mut unknown) = (0, 0, 0);
    for seed in 1..=60 {
        let mut random = Random::new(300 + seed);
        let spread = 10_f64.powf(5.0 * random.share());
        let deviation = 10_f64.powf(2.0 * random.share() - 2.0);
        let particle_count = 50 + (1950.0 * random.share().powi(2)) as usize;
        let truth = spread * random.normal();
        let p = Matrix::from_element(1, 1, spread * spread);
        let mut exact = Kalman::new(constant(deviation), &[0.0], &p, Loss::Square).unwrap();
        let mut filter = particles(constant(deviation), &[0.0], &p, particle_count, seed);
        for step in 0..150 {
            let (sensor, times) = if random.share() < 0.5 { (0, 1.0) } else { (1, 2.0) };
            let measured = [of(sensor, times * truth + deviation * random.normal())];
            for method in [&mut exact as &mut dyn Method, &mut filter] {
                assert!(method.predict(0.1, &[]));
                method.update(&measured, &[]);
            }
            let (variance, wanted) = (filter.spread()[(0, 0)], exact.spread()[(0, 0)]);
            let told = format!("spread {spread}, noise {deviation}, {particle_count} particles, step {step}");
            assert!(variance > 0.3 * wanted, "{told}: {variance} is not {wanted}");
            (count, unknown) = (count + 1, unknown + u32::from(variance.is_infinite()));
            off += u32::from((filter.mean()[0] - truth).abs() > 3.0 * variance.sqrt());
        }
    }
    // Of normal values, 0.3 % are further off.
    assert!(f64::from(off) < 0.02 * f64::from(count), "{off} of {count} are off");
    assert!(f64::from(unknown) < 0.05 * f64::from(count), "{unknown} of {count} are unknown");
}
