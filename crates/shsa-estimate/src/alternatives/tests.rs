//! A tank that two sensors watch: its inflow, which is switched, and its level.

use super::*;
use crate::formulas::{Draft, Sensor, Vocabulary};
use crate::kalman::{Kalman, Loss};
use crate::matrix::Matrix;
use crate::random::Random;
use shsa_core::knowledge::StepsAt;

const OUTLIER: Outlier = Outlier { sensor: 0, deviation: 30.0 };
const STEP: Step = Step { state: 0, deviation: 10.0, at: StepsAt::Any };

/// The inflow, then the level, which has the inflow added in each second. Noise of 0.05 and 1.
fn system() -> Continuous {
    let mut words = Vocabulary::default();
    ["inflow", "level"].into_iter().for_each(|name| _ = words.add_number(name));
    let formula = |text: &str| words.formula("a test", text).unwrap();
    let sensor = |text: &str, noise: &str| Sensor {
        name: text.into(),
        formula: formula(text),
        variance: formula(noise),
        turn: None,
    };
    Continuous::new(Draft {
        transition: vec![formula("inflow"), formula("level + inflow*(dt/(1 s))")],
        controls: 0,
        noise: ["0.02", "0", "0"].map(formula).to_vec(),
        sensors: vec![sensor("inflow", "0.05"), sensor("level", "1")],
    })
    .unwrap()
}

fn filter() -> Box<dyn Method> {
    let spread = Matrix::from_fn(2, 2, |i, j| if i == j { 1.0 } else { 0.0 });
    Box::new(Kalman::new(system(), &[0.0, 0.0], &spread, Loss::Square).unwrap())
}

fn alternatives() -> Alternatives {
    Alternatives::new(filter(), system(), vec![OUTLIER], vec![STEP], 600.0)
}

/// Follows an inflow over moments ten seconds apart, with its sensor off by `fault`. Returns the greatest error of the level, and the
/// errors of inflow and level at last.
fn followed(
    method: &mut dyn Method,
    moments: usize,
    inflow: impl Fn(usize) -> f64,
    fault: impl Fn(usize) -> f64,
) -> [f64; 3] {
    let (mut random, mut level, mut greatest) = (Random::new(3), 0.0, 0.0_f64);
    for moment in 0..moments {
        let own = inflow(moment);
        level += 10.0 * own;
        assert!(method.predict(10.0, &[]));
        let values = [own + 0.05 * random.normal() + fault(moment), level + random.normal()];
        let all = values.iter().enumerate();
        let all: Vec<Measurement> = all
            .map(|(sensor, value)| Measurement { sensor, value: *value, variance: None, bound: 0.0 })
            .collect();
        method.update(&all, &[]);
        greatest = greatest.max((method.mean()[1] - level).abs());
    }
    let last = method.mean();
    [greatest, (last[0] - inflow(moments - 1)).abs(), (last[1] - level).abs()]
}

/// The errors with alternatives and without.
fn both(moments: usize, inflow: impl Fn(usize) -> f64, fault: impl Fn(usize) -> f64) -> [[f64; 3]; 2] {
    [
        followed(&mut alternatives(), moments, &inflow, &fault),
        followed(filter().as_mut(), moments, &inflow, &fault),
    ]
}

#[test]
fn a_step_is_followed_at_once() {
    let [with, without] = both(21, |moment| if moment < 20 { 0.0 } else { 8.0 }, |_| 0.0);
    assert!(with[0] < 4.0 && with[1] < 0.2, "{with:?} {without:?}");
    assert!(without[0] > 3.0 * with[0], "{with:?} {without:?}");
}

/// That the inflow has been switched just now, and the level does not show it yet, is possible for a moment.
#[test]
fn an_outlier_moves_nothing_that_integrates_it() {
    let [with, without] = both(22, |_| 1.0, |moment| if moment == 20 { 8.0 } else { 0.0 });
    assert!(with[0] < 4.0 && with[1] < 0.2, "{with:?} {without:?}");
    assert!(without[0] > 3.0 * with[0], "{with:?} {without:?}");
}

#[test]
fn a_moment_without_surprise_is_as_usual() {
    let mut own = alternatives();
    let mut usual = filter();
    for level in [0.3, 0.5, 0.1] {
        let measured = [
            Measurement { sensor: 0, value: 0.01, variance: None, bound: 0.0 },
            Measurement { sensor: 1, value: level, variance: None, bound: 0.0 },
        ];
        assert!(own.predict(1.0, &[]) && usual.predict(1.0, &[]));
        assert_eq!(own.update(&measured, &[]), usual.update(&measured, &[]));
        assert_eq!(own.gaussian(), usual.gaussian());
    }
}

/// Only the inflow is measured: the level is as uncertain as the time of the step.
#[test]
fn what_integrates_a_step_is_uncertain_with_its_time() {
    let mut own = alternatives();
    let inflow = |value: f64| [Measurement { sensor: 0, value, variance: None, bound: 0.0 }];
    for _ in 0..20 {
        assert!(own.predict(10.0, &[]));
        own.update(&inflow(0.0), &[]);
    }
    assert!(own.predict(10.0, &[]));
    own.update(&inflow(8.0), &[]);
    let (level, deviation) = (own.mean()[1], own.spread()[(1, 1)].sqrt());
    assert!((20.0..60.0).contains(&level), "{level}");
    assert!((20.0..60.0).contains(&deviation), "{deviation}");
}

#[test]
fn a_state_goes_on_where_it_was() {
    let (inflow, fault) = (
        |moment: usize| (moment / 7) as f64,
        |moment: usize| if moment.is_multiple_of(5) { 9.0 } else { 0.0 },
    );
    let mut one = alternatives();
    followed(&mut one, 33, inflow, fault);
    assert!(one.predict(3.0, &[]));
    let mut memory = vec![0.0; one.memory_len()];
    one.save(&mut memory);
    let mut other = alternatives();
    other.restore(&memory);
    assert_eq!(followed(&mut one, 33, inflow, fault), followed(&mut other, 33, inflow, fault));
}
