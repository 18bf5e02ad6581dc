//! Tests with measurements in any order, at any rate, wrong or absent.

use super::*;
use crate::formulas::{Draft, Formulas, Sensor, Vocabulary};
use crate::kalman::{Kalman, Loss};
use crate::matrix::Matrix;
use crate::random::Random;
use crate::unscented::{Points, Unscented};
use proptest::prelude::*;

/// Position and speed with random acceleration; two sensors of the position and one of the speed.
fn line() -> Formulas {
    let mut words = Vocabulary::default();
    words.add_number("p");
    words.add_number("v");
    let formula = |text: &str| words.formula("a test", text).unwrap();
    let sensor = |text: &str, variance: &str| Sensor {
        name: text.into(),
        formula: formula(text),
        variance: formula(variance),
        turn: None,
    };
    Formulas::new(Draft {
        transition: vec![formula("p + v*dt"), formula("v")],
        controls: 0,
        noise: vec![formula("0.4*dt^3/3"), formula("0.4*dt^2/2"), formula("0.4*dt")],
        sensors: vec![sensor("p", "0.5"), sensor("v", "0.1"), sensor("p", "0.5")],
    })
    .unwrap()
}

fn spread() -> Matrix {
    Matrix::from_row_slice(2, 2, &[10.0, 0.0, 0.0, 4.0])
}

const OPTIONS: Options =
    Options { horizon: Span(2_000_000_000), moments: 64, gate: None, unknown_after: Span(5_000_000_000) };

fn fusion(gate: Option<Gate>) -> Fusion {
    let method = Kalman::new(line(), &[0.0, 0.0], &spread(), Loss::Square).unwrap();
    Fusion::new(Box::new(method), Time(0), 3, 0, Options { gate, ..OPTIONS }).unwrap()
}

fn measured(sensor: usize, value: f64) -> Measurement {
    Measurement { sensor, value, variance: None, bound: 0.0 }
}

fn millis(at: i64) -> Time {
    Time(at * 1_000_000)
}

/// The bits of the estimate at the newest moment.
fn bits(fusion: &mut Fusion) -> Vec<u64> {
    let at = fusion.at();
    let estimate = fusion.estimate(at).expect("something is known");
    estimate.mean.iter().chain(estimate.spread.iter()).map(|number| number.to_bits()).collect()
}

/// A time in milliseconds, a sensor, a value.
type Arrival = (i64, usize, f64);

/// The same arrivals within the horizon, sorted and shuffled.
fn arrivals() -> impl Strategy<Value = (Vec<Arrival>, Vec<Arrival>)> {
    let one = (0_i64..40, 0_usize..3, -3.0..3.0_f64);
    prop::collection::vec(one, 1..40).prop_flat_map(|mut all| {
        all.iter_mut().for_each(|it| it.0 *= 40);
        all.sort_by_key(|it| (it.0, it.1));
        all.dedup_by_key(|it| (it.0, it.1));
        (Just(all.clone()), Just(all).prop_shuffle())
    })
}

proptest! {
    /// With and without a gate, every order of arrival gives the same bits.
    #[test]
    fn the_order_of_arrival_does_not_matter((sorted, shuffled) in arrivals(), is_gated in any::<bool>()) {
        let gate = is_gated.then(|| Gate::new(0.9, 2));
        let after = |all: &[Arrival]| {
            let mut fusion = fusion(gate);
            all.iter().for_each(|(at, sensor, value)| {
                fusion.measure(millis(*at), measured(*sensor, *value));
            });
            fusion.present().clone()
        };
        prop_assert_eq!(after(&sorted), after(&shuffled));
    }

    #[test]
    fn an_unscented_filter_does_not_mind_the_order_either((sorted, shuffled) in arrivals()) {
        let after = |all: &[Arrival]| {
            let method = Unscented::new(line(), &[0.0, 0.0], &spread(), Points::default()).unwrap();
            let mut fusion = Fusion::new(Box::new(method), Time(0), 3, 0, OPTIONS).unwrap();
            all.iter().for_each(|(at, sensor, value)| {
                fusion.measure(millis(*at), measured(*sensor, *value));
            });
            bits(&mut fusion)
        };
        prop_assert_eq!(after(&sorted), after(&shuffled));
    }

    /// No input causes a panic, or an estimate that is not a number.
    #[test]
    fn it_takes_whatever_comes(
        all in prop::collection::vec((any::<i64>(), 0_usize..5, prop_oneof![-1e9..1e9_f64, Just(f64::NAN)]), 0..60),
    ) {
        let mut fusion = fusion(Some(Gate::new(0.999, 3)));
        for (at, sensor, value) in all {
            fusion.measure(Time(at), measured(sensor, value));
            if let Some(estimate) = fusion.estimate(Time(at)) {
                prop_assert!(estimate.mean.iter().chain(estimate.spread.iter()).all(|it| it.is_finite()));
            }
        }
    }
}

/// The speed every 100 ms, and the only position every 200 ms, off by `jump` from 20 s on; without positions between `gap` and 20
/// s. Returns time, truth and estimate of each moment.
fn only_position(jump: f64, gap: i64, seed: u64) -> Vec<(i64, f64, Option<f64>)> {
    let (method, gate) = (Kalman::new(line(), &[0.0, 0.0], &spread(), Loss::Square), Gate::new(0.999, 5));
    let options = Options { gate: Some(gate), unknown_after: Span(1_000_000_000), ..OPTIONS };
    let mut fusion = Fusion::new(Box::new(method.unwrap()), Time(0), 3, 0, options).unwrap();
    let (mut random, mut estimates) = (Random::new(seed), Vec::new());
    for at in (100..=40_000_i64).step_by(100) {
        let truth = at as f64 / 1000.0 + if at > 20_000 { jump } else { 0.0 };
        let mut noisy = |value: f64, variance: f64| value + variance.sqrt() * random.normal();
        fusion.measure(millis(at), measured(1, noisy(1.0, 0.1)));
        if at % 200 == 0 && (at <= gap || at > 20_000) {
            fusion.measure(millis(at), measured(0, noisy(truth, 0.5)));
        }
        estimates.push((at, truth, fusion.estimate(millis(at)).map(|it| it.mean[0])));
    }
    estimates
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// For any jump: no estimate after the patience, and 5 s after the last measurement that counted that of the sensor.
    #[test]
    fn the_only_position_is_not_locked_out_by_reckoning(jump in 12.0..1e6_f64, is_back: bool, seed: u64) {
        for (at, truth, known) in only_position(if is_back { -jump } else { jump }, 20_000, seed) {
            let is_right = known.is_some_and(|it| (it - truth).abs() < 3.0);
            match at {
                10_000..=20_000 | 25_800.. => prop_assert!(is_right, "{at}: {known:?} for {truth}"),
                21_300..25_000 => prop_assert!(known.is_none(), "{at}: {known:?} for {truth}"),
                _ => {}
            }
        }
    }

    /// After being away for longer than a reckoning counts, the position is accepted after six measurements.
    #[test]
    fn after_a_gap_the_only_position_is_taken_back(jump in 60.0..1e6_f64, seed: u64) {
        for (at, truth, known) in only_position(jump, 10_000, seed).into_iter().filter(|it| it.0 > 21_500) {
            let error = (known.unwrap_or(f64::NAN) - truth).abs();
            prop_assert!(error < 3.0, "{at}: {known:?} for {truth}");
        }
    }
}

#[test]
fn measurements_of_one_moment_are_stacked_in_declared_order() {
    let after = |order: [usize; 3]| {
        let mut fusion = fusion(None);
        for sensor in order {
            assert_eq!(fusion.measure(millis(100), measured(sensor, 0.3 + sensor as f64)), Verdict::Used);
        }
        bits(&mut fusion)
    };
    assert_eq!(after([0, 1, 2]), after([2, 0, 1]));
}

#[test]
fn a_stamp_that_is_a_microsecond_off_moves_next_to_nothing() {
    let after = |shift: i64| {
        let mut fusion = fusion(None);
        fusion.measure(millis(100), measured(0, 1.0));
        fusion.measure(Time(100_000_000 + shift), measured(2, 1.5));
        fusion.measure(millis(200), measured(1, 1.0));
        let estimate = fusion.estimate(millis(200)).unwrap();
        (estimate.mean[0], estimate.spread[(0, 0)].sqrt())
    };
    let ((exact, sigma), (off, _)) = (after(0), after(1000));
    assert!((exact - off).abs() < sigma / 1000.0);
}

#[test]
fn what_became_of_each_measurement_is_counted() {
    let mut fusion = fusion(Some(Gate::new(0.999, 3)));
    let mut verdict_at = |at: i64, value: f64| fusion.measure(millis(at), measured(0, value));
    assert_eq!(verdict_at(4000, 1.0), Verdict::Used);
    assert_eq!(verdict_at(4000, 1.0), Verdict::Duplicate);
    assert_eq!(verdict_at(1000, 1.0), Verdict::TooLate);
    assert_eq!(verdict_at(4100, 99.0), Verdict::Rejected);
    assert_eq!(verdict_at(4100, f64::NAN), Verdict::Rejected);
    fusion.mask(0, true);
    assert_eq!(fusion.measure(millis(4200), measured(0, 1.0)), Verdict::Masked);
    let counts = Counts { used: 1, duplicate: 1, too_late: 1, rejected: 2, masked: 1 };
    assert_eq!(fusion.counts(0), Some(counts));
}

#[test]
fn a_full_ring_forgets_the_oldest_moment_and_keeps_what_it_knew() {
    let short = Options { moments: 2, ..OPTIONS };
    let method = Kalman::new(line(), &[0.0, 0.0], &spread(), Loss::Square).unwrap();
    let mut small = Fusion::new(Box::new(method), Time(0), 3, 0, short).unwrap();
    let mut large = fusion(None);
    for at in 1..9 {
        for fusion in [&mut small, &mut large] {
            assert_eq!(fusion.measure(millis(100 * at), measured(0, at as f64)), Verdict::Used);
        }
    }
    assert_eq!(bits(&mut small), bits(&mut large));
    assert_eq!(small.measure(millis(450), measured(1, 1.0)), Verdict::TooLate);
    assert_eq!(small.measure(millis(750), measured(1, 1.0)), Verdict::Used);
}

#[test]
fn without_input_it_becomes_less_certain_and_then_unknown() {
    let mut fusion = fusion(None);
    fusion.measure(millis(1000), measured(0, 1.0));
    let width = |fusion: &mut Fusion, at: i64| Some(fusion.estimate(millis(at))?.interval(0, 0.95).width());
    let (soon, late) = (width(&mut fusion, 1500), width(&mut fusion, 5500));
    assert!(soon < late && late.is_some());
    assert_eq!(width(&mut fusion, 6001), None);
    fusion.measure(millis(7000), measured(0, 1.0));
    assert!(width(&mut fusion, 7000).is_some());
}

/// Both position sensors and the speed, every 100 ms, with noise; `fault` changes a sensor's value at a moment.
fn run(fusion: &mut LeaveOneOut, fault: impl Fn(usize, i64, f64) -> f64, until: i64) {
    let mut random = Random::new(11);
    for at in (100..=until).step_by(100) {
        let truth = [at as f64 / 1000.0, 1.0, at as f64 / 1000.0];
        for (sensor, sigma) in [0.5_f64.sqrt(), 0.1_f64.sqrt(), 0.5_f64.sqrt()].into_iter().enumerate() {
            let value = truth[sensor] + sigma * random.normal();
            fusion.measure(millis(at), measured(sensor, fault(sensor, at, value)));
        }
    }
}

fn watched() -> LeaveOneOut {
    LeaveOneOut::new(3, || Ok::<_, Error>(fusion(Some(Gate::new(0.999, 5))))).unwrap()
}

#[test]
fn a_lasting_step_of_one_sensor_stays_out_while_the_others_hold() {
    let mut fusion = watched();
    run(
        &mut fusion,
        |sensor, at, value| if sensor == 0 && at > 10_000 { value + 20.0 } else { value },
        20_000,
    );
    let estimate = fusion.all().estimate(millis(20_000)).expect("the others hold it");
    assert!((estimate.mean[0] - 20.0).abs() < 1.0, "{}", estimate.mean[0]);
    assert_eq!(fusion.all().watch(0).map(|watch| watch.rejections), Some(100));
    // The sensor returns, and counts again at once.
    fusion.measure(millis(20_100), measured(0, 20.1));
    assert_eq!(fusion.all().watch(0).map(|watch| watch.rejections), Some(0));
}

#[test]
fn a_step_that_two_sensors_see_is_taken_in() {
    let mut fusion = watched();
    run(
        &mut fusion,
        |sensor, at, value| if sensor != 1 && at > 10_000 { value + 20.0 } else { value },
        12_000,
    );
    let estimate = fusion.all().estimate(millis(12_000)).expect("two agree");
    assert!((estimate.mean[0] - 32.0).abs() < 1.5, "{}", estimate.mean[0]);
}

#[test]
fn a_sensor_alone_in_conflict_with_its_past_makes_it_unknown() {
    let mut fusion = fusion(Some(Gate::new(0.999, 5)));
    for at in 1..=50 {
        fusion.measure(millis(100 * at), measured(0, if at > 30 { 80.0 } else { 0.0 }));
    }
    assert!(fusion.estimate(millis(5000)).is_none());
    fusion.restart(millis(5000));
    assert_eq!(fusion.measure(millis(5000), measured(0, 3.0)), Verdict::Used);
    assert!(fusion.estimate(millis(5000)).is_some());
}

#[test]
fn a_glitch_is_rejected_and_leaves_nothing_behind() {
    let mut fusion = watched();
    run(&mut fusion, |sensor, at, value| if sensor == 0 && at == 5000 { value + 7.07 } else { value }, 6000);
    let counts = fusion.all().counts(0).unwrap();
    assert!(counts.rejected >= 1 && counts.used >= 58, "{counts:?}");
}

#[test]
fn a_slow_drift_shows_in_the_mean_of_the_innovations_and_the_others_name_it() {
    let mut fusion = watched();
    let fault = |sensor: usize, at: i64, value: f64| {
        if sensor == 0 && at > 10_000 { value + 0.25 * (at - 10_000) as f64 / 1000.0 } else { value }
    };
    run(&mut fusion, |_, _, value| value, 10_000);
    let healthy: Vec<f64> = (0..3).filter_map(|it| fusion.all().watch(it)?.drift()).collect();
    assert!(healthy.len() == 3 && healthy.iter().all(|drift| drift.abs() < 3.5), "{healthy:?}");
    let mut fusion = watched();
    run(&mut fusion, fault, 22_000);
    let drift = fusion.all().watch(0).and_then(Watch::drift).unwrap();
    assert!(drift > 4.0, "{drift}");
    let far = |sensor: usize| fusion.innovation(sensor).unwrap().1.normalized_square();
    assert!(far(0) > 10.83 && far(1) < 10.83, "{} {} {}", far(0), far(1), far(2));
}
