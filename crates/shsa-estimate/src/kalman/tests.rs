//! Tests of a Kalman filter with a single state.

use super::*;
use crate::system::Linear;

fn constant(sensors: usize, loss: Loss) -> Kalman<Linear> {
    let matrix = |rows: usize, columns: usize| Matrix::from_element(rows, columns, 1.0);
    let r = Matrix::identity(sensors, sensors);
    let b = Matrix::zeros(1, 0);
    let system = Linear::new(matrix(1, 1), b, &matrix(sensors, 1), matrix(1, 1), r).unwrap();
    Kalman::new(system, &[0.0], &matrix(1, 1), loss).unwrap()
}

fn measured(values: &[f64]) -> Vec<Measurement> {
    let all = values.iter().enumerate();
    all.map(|(sensor, value)| Measurement { sensor, value: *value, variance: None, bound: 0.0 }).collect()
}

#[test]
fn without_measurements_nothing_is_corrected() {
    let mut filter = constant(1, Loss::Square);
    assert!(filter.predict(1.0, &[]));
    assert_eq!(filter.update(&[], &[]), Updated::NOTHING);
    assert_eq!((filter.mean()[0], filter.spread()[(0, 0)]), (0.0, 2.0));
    let updated = filter.update(&measured(&[3.0]), &[]);
    assert_eq!((filter.mean()[0], updated.used, updated.normalized_square), (2.0, 1, 3.0));
    assert!((filter.spread()[(0, 0)] - 2.0 / 3.0).abs() < 1e-15);
}

#[test]
fn a_measurement_that_is_no_number_is_not_used() {
    let mut filter = constant(2, Loss::Square);
    assert_eq!(filter.update(&measured(&[f64::NAN, 1.0]), &[]).used, 1);
    assert_eq!(filter.innovation(&measured(&[f64::INFINITY])[0], &[]), None);
    let own = Measurement { sensor: 0, value: 1.0, variance: Some(-1.0), bound: 0.0 };
    assert_eq!(filter.update(&[own], &[]).used, 0);
}

#[test]
fn an_outlier_moves_a_robust_filter_little() {
    let after = |loss| {
        let mut filter = constant(5, loss);
        filter.update(&measured(&[0.1, -0.2, 0.1, 0.0, 100.0]), &[]);
        filter.mean()[0]
    };
    assert!(after(Loss::Square) > 16.0);
    assert!(after(Loss::Huber(1.345)).abs() < 0.4, "{}", after(Loss::Huber(1.345)));
    assert!(after(Loss::Student(4.0)).abs() < 0.05, "{}", after(Loss::Student(4.0)));
}

#[test]
fn the_huber_estimate_has_the_gradient_zero() {
    let (values, limit) = ([0.3, -0.2, 5.0, 1.0, 0.4], 1.345);
    let mut filter = constant(5, Loss::Huber(limit));
    filter.update(&measured(&values), &[]);
    let x = filter.mean()[0];
    let gradient = x - values.iter().map(|z| (z - x).clamp(-limit, limit)).sum::<f64>();
    assert!(gradient.abs() < 1e-4, "{gradient} at {x}");
}

#[test]
fn a_spoilt_covariance_is_reported_and_healed() {
    let mut filter = constant(1, Loss::Square);
    filter.restore(&[0.0, -0.5]);
    assert!(filter.update(&measured(&[1.0]), &[]).healed);
    assert!(filter.spread()[(0, 0)] >= 0.0);
}
