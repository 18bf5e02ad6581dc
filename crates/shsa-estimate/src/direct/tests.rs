//! Tests of direct fusion: liars are outvoted, and what walks becomes uncertain.

use super::*;

fn measured(values: &[f64]) -> Vec<Measurement> {
    let all = values.iter().enumerate();
    all.map(|(sensor, value)| Measurement { sensor, value: *value, variance: None, bound: 0.0 }).collect()
}

#[track_caller]
fn check(rule: Rule, values: &[f64], expected: f64) {
    let mut direct = Direct::new(rule, &[1.0; 4], 0.5, (0.0, 9.0)).unwrap();
    direct.update(&measured(values), &[]);
    assert!((direct.mean()[0] - expected).abs() < 1e-12, "{}", direct.mean()[0]);
}

#[test]
fn a_liar_is_outvoted() {
    let faulty = Faulty { count: 1, deviations: 2.0 };
    check(Rule::Confidence, &[1.0, 2.0, 3.0], 2.0);
    check(Rule::Marzullo(faulty), &[1.0, 2.0, 3.0, 90.0], 2.0);
    check(Rule::Schmid(faulty), &[1.0, 2.0, 3.0, 90.0], 2.5);
    check(Rule::BrooksIyengar(faulty), &[1.0, 2.0, 3.0, 90.0], 2.0);
}

/// Two inputs are faulty, or only one speaks, which may be the faulty one: nothing is known, until enough agree.
#[test]
fn too_few_that_agree_make_it_unknown() {
    let faulty = Faulty { count: 1, deviations: 2.0 };
    for rule in [Rule::Marzullo(faulty), Rule::Schmid(faulty), Rule::BrooksIyengar(faulty)] {
        for values in [&[1.0, 2.0, 50.0, 90.0][..], &[1.0]] {
            let mut direct = Direct::new(rule.clone(), &[1.0; 4], 0.5, (0.0, 9.0)).unwrap();
            assert_eq!(direct.update(&measured(values), &[]).used, 0, "{rule:?} {values:?}");
            assert!(direct.spread()[(0, 0)].is_infinite(), "{rule:?} {values:?}");
            assert!(direct.predict(1.0, &[]) && direct.innovation(&measured(&[7.0])[0], &[]).is_some());
            direct.update(&measured(&[7.0, 7.0, 7.0]), &[]);
            assert!(direct.spread()[(0, 0)] < 2.0 && direct.mean()[0] == 7.0);
        }
    }
}

/// The variance of a mean of walking values, against the definition.
#[test]
fn what_walks_is_shared_by_all_older_values() {
    let (ages, weights): ([f64; 4], [f64; 4]) = ([0.0, 0.5, 0.5, 2.0], [0.4, 0.3, 0.2, 0.1]);
    let mut sum = 0.0;
    for i in 0..4 {
        (0..4).for_each(|j| sum += weights[i] * weights[j] * ages[i].min(ages[j]));
    }
    assert!((walked(ages.into_iter().zip(weights)) - sum).abs() < 1e-15);
    let mut direct = Direct::new(Rule::Confidence, &[1.0; 2], 0.5, (0.0, 9.0)).unwrap();
    direct.update_aged(&measured(&[3.0, 5.0]), &[4.0, 4.0]);
    assert!((direct.mean()[0] - 4.0).abs() < 1e-12);
    assert!((direct.spread()[(0, 0)] - (0.5 + 0.5 * 4.0)).abs() < 1e-12);
}

#[test]
fn without_input_the_variance_grows() {
    let mut direct = Direct::new(Rule::Confidence, &[1.0], 0.5, (0.0, 9.0)).unwrap();
    direct.update(&measured(&[3.0]), &[]);
    assert!(direct.predict(2.0, &[]));
    assert_eq!((direct.mean()[0], direct.spread()[(0, 0)]), (3.0, 2.0));
}

#[test]
fn a_window_goes_back_with_the_rest() {
    let mut direct = Direct::new(Rule::Median(Window::new(3)), &[1.0], 0.0, (0.0, 1.0)).unwrap();
    direct.update(&measured(&[1.0]), &[]);
    let mut memory = vec![0.0; direct.memory_len()];
    direct.save(&mut memory);
    let mut go_on = || {
        [5.0, 9.0].map(|value| {
            direct.update(&measured(&[value]), &[]);
            direct.mean()[0]
        })
    };
    assert_eq!(go_on(), [3.0, 5.0]);
    direct.restore(&memory);
    assert_eq!(direct.mean()[0], 1.0);
    direct.update(&measured(&[5.0]), &[]);
    assert_eq!(direct.mean()[0], 3.0);
}
