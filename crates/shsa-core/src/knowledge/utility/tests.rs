//! Tests of the thesis's norm with numbers.

use super::*;

#[track_caller]
fn check_norm(count: u32, unprovided: u32, cost: f64, accuracy: f64, expected: f64) {
    let inputs = Inputs { count: f64::from(count), unprovided: f64::from(unprovided), accuracy };
    let value = Utility::Norm.of_relation(Numbers { relation: &[cost], output: &[9.0] }, &inputs);
    assert!((value - expected).abs() < 1e-12, "{value}");
}

#[test]
fn norm_as_in_the_thesis() {
    check_norm(1, 0, 1.0, 1.0, 1.0);
    check_norm(0, 0, 1.0, 1.0, 1.0);
    check_norm(2, 1, 1.0, 1.0, 1.2 / 1.4);
    check_norm(3, 0, 2.0, 0.5, 0.7 / 1.4);
    check_norm(1, 0, f64::INFINITY, 0.0, 0.4 / 1.4);
}
