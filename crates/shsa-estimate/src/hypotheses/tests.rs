//! A level that two sensors measure: a precise one with an offset, and a coarse one.

use super::*;
use crate::kalman::{Kalman, Loss};
use crate::matrix::Matrix;
use crate::random::Random;
use crate::system::Linear;

const JUMP: Fault = Fault::Jump(1, 5.0);
const NOISIER: Fault = Fault::Noisier(0, 10.0);

/// The level changes by 0.1 a step, the offset by 0.001; the noise of the sensors is 0.1 and 1.
fn filter() -> Box<dyn Method> {
    let diagonal = |values: [f64; 2]| Matrix::from_fn(2, 2, |i, j| if i == j { values[i] } else { 0.0 });
    let h = Matrix::from_fn(2, 2, |sensor, state| if sensor == 0 || state == 0 { 1.0 } else { 0.0 });
    let (a, b) = (Matrix::identity(2, 2), Matrix::zeros(2, 0));
    let system = Linear::new(a, b, &h, diagonal([0.01, 1e-6]), diagonal([0.01, 1.0])).unwrap();
    Box::new(Kalman::new(system, &[0.0, 0.0], &diagonal([1.0, 0.01]), Loss::Student(4.0)).unwrap())
}

/// The values of both sensors as measurements.
fn measured(values: [f64; 2]) -> [Measurement; 2] {
    [0, 1].map(|sensor| Measurement { sensor, value: values[sensor], variance: None, bound: 0.0 })
}

/// Follows the level for so many steps; the sensors are off by what `fault` makes of the step and a random number. Returns the root
/// mean square error of the level over the last hundred steps, and the last offset.
fn followed(method: &mut dyn Method, steps: usize, mut fault: impl FnMut(usize, f64) -> f64) -> (f64, f64) {
    let (mut random, mut level, mut sum) = (Random::new(5), 0.0, 0.0);
    for step in 0..steps {
        level += 0.1 * random.normal();
        assert!(method.predict(1.0, &[]));
        let values = [level + 0.1 * random.normal() + fault(step, random.normal()), level + random.normal()];
        method.update(&measured(values), &[]);
        let error = method.mean()[0] - level;
        sum += if step + 100 >= steps { error * error } else { 0.0 };
    }
    ((sum / 100.0).sqrt(), method.mean()[1])
}

fn both(steps: usize, fault: impl Fn(usize, f64) -> f64) -> [(f64, f64); 2] {
    let mut alone = filter();
    let mut beside = Hypotheses::new(filter(), 2, Faults::together(vec![JUMP, NOISIER], 10_000.0), 10.0);
    [followed(alone.as_mut(), steps, &fault), followed(&mut beside, steps, &fault)]
}

#[test]
fn an_offset_that_jumps_is_found() {
    let [alone, beside] = both(200, |step, _| if step < 100 { 0.0 } else { 3.0 });
    assert!(beside.0 < 0.5 && (beside.1 - 3.0).abs() < 0.5, "{beside:?}");
    assert!(alone.0 > 3.0 * beside.0, "{alone:?} {beside:?}");
}

#[test]
fn an_input_that_becomes_noisier_counts_for_less_until_it_is_well_again() {
    let [alone, beside] = both(200, |step, random| if step < 100 { 0.0 } else { 2.0 * random });
    assert!(beside.0 < 0.7 * alone.0, "{alone:?} {beside:?}");
    let [alone, beside] =
        both(400, |step, random| if (100..200).contains(&step) { 2.0 * random } else { 0.0 });
    assert!(beside.0 < 1.1 * alone.0, "{alone:?} {beside:?}");
}

#[test]
fn without_faults_the_estimate_is_that_of_the_filter() {
    let [alone, beside] = both(1_000, |_, _| 0.0);
    assert!((beside.0 - alone.0).abs() < 0.02 * alone.0, "{alone:?} {beside:?}");
    assert!(beside.1.abs() < 0.3, "{beside:?}");
}

#[test]
fn a_state_goes_on_where_it_was() {
    let mut one = Hypotheses::new(filter(), 2, Faults::together(vec![JUMP, NOISIER], 100.0), 10.0);
    let fault = |step: usize, random: f64| if step % 40 < 20 { 0.0 } else { 1.5 * random };
    followed(&mut one, 130, fault);
    assert!(one.count > 1);
    let mut memory = vec![0.0; one.memory_len()];
    one.save(&mut memory);
    let mut other = Hypotheses::new(filter(), 2, Faults::together(vec![JUMP, NOISIER], 100.0), 10.0);
    other.restore(&memory);
    assert_eq!(followed(&mut one, 130, fault), followed(&mut other, 130, fault));
}

/// The precise sensor shows one value for a hundred steps while the level goes on.
#[test]
fn a_sensor_that_is_stuck_is_left_out_until_its_value_changes() {
    let run = |faults: Vec<Fault>| {
        let mut method = Hypotheses::new(filter(), 2, Faults::together(faults, 10_000.0), 10.0);
        let (mut random, mut level, mut shown, mut sums) = (Random::new(7), 0.0, 0.0, [0.0; 2]);
        for step in 0..400 {
            level += if (100..300).contains(&step) { 0.1 } else { 0.0 };
            if !(100..200).contains(&step) {
                shown = level + 0.1 * random.normal();
            }
            assert!(method.predict(1.0, &[]));
            let values = [shown, level + random.normal()];
            method.update(&measured(values), &[]);
            let place = usize::from(step >= 210);
            sums[place] += if step >= 150 { (method.mean()[0] - level).powi(2) } else { 0.0 };
        }
        [(sums[0] / 60.0).sqrt(), (sums[1] / 190.0).sqrt()]
    };
    let ([during, after], [unknown, _]) = (run(vec![Fault::Stuck(0)]), run(vec![JUMP]));
    // The coarse sensor alone follows what rises that fast 1.2 behind.
    assert!(during < 1.5 && after < 0.2, "{during} {after}");
    assert!(unknown > 2.0 * during, "{unknown} {during}");
}

/// A steady quantity makes a sensor repeat itself: that is no evidence.
#[test]
fn a_value_that_repeats_itself_is_no_evidence() {
    let mut method = Hypotheses::new(filter(), 2, Faults::together(vec![Fault::Stuck(0)], 10_000.0), 10.0);
    let mut random = Random::new(3);
    for step in 0..2_000 {
        assert!(method.predict(1.0, &[]));
        let values = [1.0, 1.0 + random.normal()];
        method.update(&measured(values), &[]);
        assert!(step < 10 || (method.mean()[0] - 1.0).abs() < 0.3, "{step}: {:?}", method.mean());
    }
}

/// The precise sensor falls silent: what the coarse one shows then is no evidence of faults, and no copy gains or loses weight.
#[test]
fn a_lone_sensor_is_no_evidence_of_faults() {
    let mut one = Hypotheses::new(filter(), 2, Faults::together(vec![JUMP, NOISIER], 100.0), 10.0);
    followed(&mut one, 100, |_, _| 0.0);
    let weights = |method: &Hypotheses| method.used().iter().map(|it| it.weight).collect::<Vec<f64>>();
    let mut before = None;
    for step in 0..40 {
        assert!(one.predict(1.0, &[]));
        one.update(&[Measurement { sensor: 1, value: f64::from(step), variance: None, bound: 0.0 }], &[]);
        if step >= 10 {
            assert_eq!(*before.get_or_insert_with(|| weights(&one)), weights(&one));
        }
    }
}

/// A level with two precise sensors, each with an offset, and a coarse one without: sensor 1 fails, and much later sensor 0, too.
#[test]
fn which_sensor_fails_stays_open_until_it_is_decided_and_another_one_may_fail_later() {
    let diagonal = |values: [f64; 3]| Matrix::from_fn(3, 3, |i, j| if i == j { values[i] } else { 0.0 });
    let h = Matrix::from_fn(3, 3, |sensor, state| f64::from(state == 0 || state == sensor + 1));
    let (a, b) = (Matrix::identity(3, 3), Matrix::zeros(3, 0));
    let system = Linear::new(a, b, &h, diagonal([1.0, 1e-8, 1e-8]), diagonal([0.01, 0.01, 1.0])).unwrap();
    let filter = Kalman::new(system, &[0.0; 3], &diagonal([1.0, 1e-4, 1e-4]), Loss::Square).unwrap();
    let faults = Faults {
        all: vec![Fault::Jump(1, 3.0), Fault::Jump(2, 3.0)],
        groups: vec![0b01, 0b10],
        ..Faults::together(Vec::new(), 1_000.0)
    };
    let mut method = Hypotheses::new(Box::new(filter), 3, faults, 10.0);
    let mut random = Random::new(11);
    let mut share = Vec::new();
    for step in 0..1_200 {
        assert!(method.predict(1.0, &[]));
        let offsets = [if step < 700 { 0.0 } else { -2.0 }, if step < 100 { 0.0 } else { 1.5 }, 0.0];
        let measured = [0, 1, 2].map(|sensor| {
            let noise = random.normal() * if sensor == 2 { 1.0 } else { 0.1 };
            Measurement { sensor, value: offsets[sensor] + noise, variance: None, bound: 0.0 }
        });
        method.update(&measured, &[]);
        let sum = |group: usize| {
            let of_group = method.used().iter().filter(|copy| copy.group == group);
            of_group.map(|copy| copy.weight.exp()).sum::<f64>()
        };
        share.push(sum(1) / (sum(0) + sum(1)));
        if matches!(step, 600 | 1_199) {
            assert!(method.mean()[0].abs() < 0.3, "{step}: {:?}", method.mean());
        }
    }
    // Right after the failure both are possible; the coarse sensor decides.
    assert!((0.05..0.95).contains(&share[100]), "{}", share[100]);
    assert!(share[600] > 0.999, "{}", share[600]);
}

/// Of values that are closer in time than the errors of the model, each counts in proportion.
#[test]
fn evidence_counts_by_the_time_since_the_value_before() {
    let weights = |evidence_every: f64| {
        let faults = Faults { evidence_every, ..Faults::together(vec![NOISIER], 1e9) };
        let mut method = Hypotheses::new(filter(), 2, faults, 10.0);
        for values in [[0.0, 0.0], [0.1, 0.0]] {
            assert!(method.predict(1.0, &[]));
            method.update(&measured(values), &[]);
        }
        let [well, noisier, ..] = method.used() else { panic!("{:?}", method.used()) };
        noisier.weight - well.weight - libm::log(1e-9)
    };
    assert!((weights(4.0) - weights(1.0) / 4.0).abs() < 1e-9, "{} {}", weights(4.0), weights(1.0));
    assert_eq!(weights(0.5), weights(1.0));
}

/// A level that may be anywhere, and stays: the values of both sensors repeat themselves, and each is precise with the other one only.
#[test]
fn a_value_that_repeats_itself_is_expected_as_the_other_sensors_expect_it() {
    let diagonal = |values: [f64; 2]| Matrix::from_fn(2, 2, |i, j| if i == j { values[i] } else { 0.0 });
    let h = Matrix::from_fn(2, 2, |_, state| if state == 0 { 1.0 } else { 0.0 });
    let (a, b) = (Matrix::identity(2, 2), Matrix::zeros(2, 0));
    let system = Linear::new(a, b, &h, diagonal([25.0, 0.0]), diagonal([0.01, 0.01])).unwrap();
    let filter = Kalman::new(system, &[1.0, 0.0], &diagonal([1.0, 0.0]), Loss::Square).unwrap();
    let faults = Faults::together(vec![Fault::Stuck(0)], 10_000.0);
    let mut method = Hypotheses::new(Box::new(filter), 2, faults, 10.0);
    for _ in 0..30 {
        assert!(method.predict(1.0, &[]));
        method.update(&measured([1.0, 1.0]), &[]);
    }
    let oldest = method.used().iter().find(|copy| copy.fault == Some(0)).unwrap();
    assert!(oldest.age > 20.0 && (oldest.weight - libm::log(1e-4)).abs() < 3.0, "{oldest:?}");
}
