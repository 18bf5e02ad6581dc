//! Tests of the points' places, and of angles that wrap.

use super::*;

#[test]
fn points_that_lie_nowhere_are_refused() {
    let weights = |kappa| Points { kappa, ..Points::default() }.weights(2);
    assert!(weights(-2.0).is_err() && weights(f64::NAN).is_err() && weights(0.0).is_ok());
}

#[test]
fn a_linear_function_is_transformed_exactly() {
    let spread = Matrix::from_row_slice(2, 2, &[4.0, 1.0, 1.0, 2.0]);
    let sum = |x: &[f64], y: &mut [f64]| y[0] = x[0] + 2.0 * x[1];
    let (y, own, cross) = transform(&[1.0, 2.0], &spread, Points::default(), 1, sum).unwrap();
    assert!((y[0] - 5.0).abs() < 1e-12 && (own[(0, 0)] - 16.0).abs() < 1e-12);
    assert!((cross - Matrix::from_row_slice(2, 1, &[6.0, 5.0])).amax() < 1e-12);
}

/// An unknown heading: its points lie more than a turn apart, and are not confused.
#[test]
fn a_heading_that_is_unknown_at_first_is_found() {
    use crate::formulas::{Draft, Formulas, Sensor, Vocabulary};
    use std::f64::consts::{PI, TAU};
    let mut words = Vocabulary::default();
    words.add_number("h");
    words.add_number("w");
    let formula = |text: &str| words.formula("a test", text).unwrap();
    let sensor = |says: &str, turn| Sensor {
        name: says.into(),
        formula: formula(says),
        variance: formula("0.01"),
        turn,
    };
    let draft = Draft {
        transition: vec![formula("h + w*dt"), formula("w")],
        controls: 0,
        noise: ["0.01*dt", "0", "0.01*dt"].map(formula).into(),
        sensors: vec![sensor("h", Some(TAU)), sensor("w", None)],
    };
    let spread = Matrix::from_row_slice(2, 2, &[PI * PI, 0.0, 0.0, 1.0]);
    let system = Formulas::new(draft).unwrap();
    let mut filter = Unscented::new(system, &[0.0, 0.0], &spread, Points::default()).unwrap();
    for step in 1..=20 {
        filter.predict(0.1, &[]);
        let heading = wrapped(2.5 + 0.03 * f64::from(step), Some(TAU));
        filter.update(&[Measurement { sensor: 0, value: heading, variance: None, bound: 0.0 }], &[]);
        filter.update(&[Measurement { sensor: 1, value: 0.3, variance: None, bound: 0.0 }], &[]);
        let apart = wrapped(filter.mean()[0] - heading, Some(TAU));
        assert!(apart.abs() < 0.02, "{step}: {apart}");
    }
}
