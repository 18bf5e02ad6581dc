//! Signals made of known relations: which relations are found, and which are not.

mod sessions;

use super::{Signal, formula, learn};
use crate::calibration::Chance;
use shsa_core::unit::Unit;
use std::f64::consts::TAU;

const DURATION_S: f64 = 300.0;
const RATE_HZ: f64 = 10.0;

/// A slow wave of several periods, unrelated to those of other numbers.
fn wave(number: u32, time: f64) -> f64 {
    let of = |part: u32| {
        let hz = (3.0 + 2.3 * f64::from(part * part) + 0.37 * f64::from(number * (part + 2))) / DURATION_S;
        (TAU * hz * time + f64::from(number * 7 + part * 3)).sin() / f64::from(part + 1)
    };
    (0..5).map(of).sum()
}

fn signal(name: &str, unit: &str, noise: f64, value: impl Fn(f64) -> f64) -> Signal {
    let mut chance = Chance::new(name.bytes().map(u64::from).sum());
    let times = (0..(DURATION_S * RATE_HZ) as usize).map(|at| at as f64 / RATE_HZ);
    let points = times.map(|time| (time, value(time) + noise * chance.normal())).collect();
    Signal { name: name.to_owned(), unit: Some(Unit::parse(unit).unwrap()), points }
}

#[track_caller]
fn check(signals: &[Signal], expected: &[&str]) {
    let learned = learn(signals, &()).unwrap();
    let name = |signal: usize| signals[signal].name.clone();
    let copies = learned.copies.iter().map(|it| format!("{} is a copy of {}", name(it.signal), name(it.of)));
    let relations = learned.relations.iter().map(|it| formula(signals, it, &name));
    assert_eq!(copies.chain(relations).collect::<Vec<_>>(), expected);
}

#[test]
fn two_that_say_the_same_with_an_offset_and_later() {
    let speed = |time: f64| 12.0 + 4.0 * wave(1, time);
    let other = signal("other", "km/h", 0.0, move |time| 3.6 * speed(time - 0.7));
    check(&[signal("speed", "m/s", 0.0, speed), other], &["other = delay(speed, 0.7 s)"]);
}

#[test]
fn what_only_drifts_or_swings_alike_is_not_related() {
    let drift = |number: u32| move |time: f64| 20.0 + 9.0 * time / DURATION_S + 0.3 * wave(number, time);
    check(&[signal("one", "degC", 0.02, drift(1)), signal("two", "V", 0.02, drift(2))], &[]);
    let swing = |number: u32| move |time: f64| 5.0 * (TAU * time / 40.0).sin() + 0.8 * wave(number, time);
    check(&[signal("one", "degC", 0.02, swing(3)), signal("two", "V", 0.02, swing(4))], &[]);
    let until = |time: f64| if time < 0.55 * DURATION_S { wave(5, time) } else { wave(6, time) };
    check(&[signal("one", "m", 0.01, |time| wave(5, time)), signal("two", "m", 0.01, until)], &[]);
}

#[test]
fn products_and_sums_have_to_come_out_in_units() {
    let (volts, amps) = (|time: f64| 24.0 + 3.0 * wave(1, time), |time: f64| 15.0 + 3.0 * wave(2, time));
    let signals = |unit: &str| {
        let product = signal("power", unit, 0.5, move |time| volts(time) * amps(time));
        [signal("volts", "V", 0.01, volts), signal("amps", "A", 0.01, amps), product]
    };
    check(&signals("W"), &["power = volts * amps"]);
    check(&signals("N"), &[]);
}

#[test]
fn a_sum_has_the_terms_that_it_is_made_of() {
    let signals = [
        signal("total", "A", 0.01, |time| wave(1, time) - 0.5 * wave(2, time) + 2.0 * wave(3, time) + 5.0),
        signal("one", "A", 0.01, |time| wave(1, time)),
        signal("two", "A", 0.01, |time| wave(2, time)),
        signal("three", "A", 0.01, |time| wave(3, time)),
        signal("four", "A", 0.01, |time| wave(4, time)),
    ];
    let learned = learn(&signals, &()).unwrap();
    let found: Vec<Vec<usize>> = learned.relations.iter().map(super::Relation::signals).collect();
    assert_eq!(found, [[0, 1, 2, 3]]);
}

#[test]
fn rates_saturations_and_gears() {
    let way = |time: f64| 50.0 + 20.0 * wave(1, time);
    let speed = move |time: f64| (way(time + 1e-3) - way(time - 1e-3)) / 2e-3;
    let found = learn(
        &[signal("way", "m", 0.01, way), signal("speed", "km/h", 0.01, move |time| 3.6 * speed(time))],
        &(),
    )
    .unwrap();
    assert!(
        matches!(found.relations[..], [super::Relation { shape: super::Shape::Rate { .. }, .. }]),
        "{found:?}"
    );

    let open = |time: f64| 50.0 + 20.0 * wave(2, time);
    let flow = move |time: f64| (1.2 * open(time) - 5.0).clamp(15.0, 70.0);
    check(
        &[signal("open", "%", 0.0, open), signal("flow", "%", 0.0, flow)],
        &["flow = min(max(1.2 * open - 5 %, 15 %), 70 %)"],
    );

    let gear = |time: f64| (time / 11.0 * 1.7).floor() % 3.0 + 1.0;
    let engine = |time: f64| 1500.0 + 300.0 * wave(3, time);
    let wheel = move |time: f64| [3.0, 2.0, 1.25][gear(time) as usize - 1] * engine(time);
    check(
        &[
            signal("engine", "rpm", 0.0, engine),
            signal("gear", "1", 0.0, gear),
            signal("wheel", "rpm", 0.0, wheel),
        ],
        &["wheel = if(gear < 1.5, 3, if(gear < 2.5, 2, 1.25)) * engine"],
    );
}

#[test]
fn a_limit_may_be_reached_late_only_and_what_no_sample_shows_is_no_limit() {
    let swing = |time: f64| if time < 0.6 * DURATION_S { 8.0 } else { 20.0 };
    let open = move |time: f64| 50.0 + swing(time) * wave(2, time);
    let flow = move |time: f64| (1.2 * open(time) - 5.0).clamp(-40.0, 80.0);
    check(
        &[signal("open", "%", 0.0, open), signal("flow", "%", 0.0, flow)],
        &["flow = min(1.2 * open - 5 %, 80 %)"],
    );
}

#[test]
fn two_that_rise_are_no_gears_of_each_other() {
    let way = |number: u32| move |time: f64| 12.0 * time + 20.0 * wave(number, time);
    let gear = |time: f64| (time / 11.0 * 1.7).floor() % 3.0 + 1.0;
    check(
        &[signal("one", "m", 0.02, way(1)), signal("two", "m", 0.02, way(2)), signal("gear", "1", 0.0, gear)],
        &[],
    );
}

#[test]
fn a_copy_is_reported_and_is_no_witness() {
    let one = signal("one", "m", 0.1, |time| 3.0 * wave(1, time));
    let points = one.points.iter().map(|(time, value)| (*time, 2.0 * value + 1.0)).collect();
    let copy = Signal { name: "copy".to_owned(), points, ..one.clone() };
    check(&[one, copy], &["copy is a copy of one"]);
}

#[test]
fn nothing_is_learned_of_nothing() {
    check(&[], &[]);
    check(&[Signal { name: "one".to_owned(), unit: None, points: Vec::new() }], &[]);
    check(&[signal("one", "m", 0.0, |_| 1.0), signal("two", "m", 0.0, |_| 1.0)], &[]);
}

#[test]
fn a_follower_a_larger_one_and_a_mode() {
    let fast = |time: f64| 20.0 + 4.0 * wave(1, time);
    let step = 0.01;
    let mut last = fast(0.0);
    let followed: Vec<f64> = (0..(DURATION_S / step) as usize)
        .map(|at| {
            last += step / 4.0 * (fast(at as f64 * step) - last);
            last
        })
        .collect();
    let slow = move |time: f64| followed[((time / step).round() as usize).min(followed.len() - 1)];
    let found =
        learn(&[signal("fast", "degC", 0.01, fast), signal("slow", "degC", 0.01, slow)], &()).unwrap();
    let [relation] = &found.relations[..] else { panic!("{found:?}") };
    assert!(
        matches!(relation.shape, super::Shape::Follower { tau_s } if (tau_s - 4.0).abs() < 0.2),
        "{found:?}"
    );

    let (one, two) = (|time: f64| wave(1, time), |time: f64| wave(2, time));
    let larger = move |time: f64| one(time).max(two(time));
    check(
        &[
            signal("one", "A", 0.001, one),
            signal("two", "A", 0.001, two),
            signal("larger", "A", 0.001, larger),
        ],
        &["larger = max(one, two)"],
    );
    let mode = |time: f64| (time / 13.0 * 1.7).floor() % 2.0;
    let chosen = move |time: f64| if mode(time) == 0.0 { 9.0 + one(time) } else { 12.0 + two(time) };
    check(
        &[
            signal("one", "A", 0.0, move |time| 9.0 + one(time)),
            signal("two", "A", 0.0, move |time| 12.0 + two(time)),
            signal("mode", "1", 0.0, mode),
            signal("chosen", "A", 0.0, chosen),
        ],
        &["chosen = if(mode < 0.5, one, two)"],
    );
}

#[test]
fn two_terms_a_projection_and_a_power() {
    let (volts, amps) = (|time: f64| 24.0 + 3.0 * wave(1, time), |time: f64| 15.0 + 3.0 * wave(2, time));
    check(
        &[
            signal("open", "V", 0.001, volts),
            signal("amps", "A", 0.001, amps),
            signal("pole", "V", 0.001, move |time| volts(time) - 0.5 * amps(time)),
        ],
        &["pole = open - 0.5 ohm * amps"],
    );
    let course = |time: f64| 40.0 + 60.0 * wave(3, time);
    check(
        &[
            signal("speed", "m/s", 0.001, volts),
            signal("course", "deg", 0.001, course),
            signal("north", "m/s", 0.001, move |time| volts(time) * course(time).to_radians().cos()),
        ],
        &["north = speed * cos(course)"],
    );
    check(
        &[signal("speed", "m/s", 0.0, volts), signal("time", "s", 0.0, move |time| 100.0 / volts(time))],
        &["time = 100 m * speed^-1"],
    );
}

#[test]
fn a_radius_is_no_matter_of_statistics_whichever_way_it_is_read() {
    let turning = |time: f64| 50.0 + 20.0 * wave(1, time);
    let of = |noises: [f64; 2], unit: &str| {
        let signals = [
            signal("turns", "rad/s", noises[0], turning),
            signal("speed", unit, noises[1], move |time| 0.3 * turning(time)),
        ];
        let learned = learn(&signals, &()).unwrap();
        let [relation] = &learned.relations[..] else { panic!("{learned:?}") };
        (relation.target, relation.is_statistical(&signals))
    };
    let targets = [of([0.5, 0.0], "m/s"), of([0.0, 0.3], "m/s")];
    assert!(targets.iter().all(|(_, is_statistical)| !is_statistical), "{targets:?}");
    assert!(of([0.5, 0.0], "V").1);
}

#[test]
fn two_trends_are_on_a_line_by_chance() {
    let road = |number: u32, slope: f64| move |time: f64| slope * time + 0.5 * wave(number, time);
    check(&[signal("north", "m", 0.001, road(1, 0.1)), signal("east", "m", 0.001, road(2, 0.05))], &[]);
}

#[test]
fn a_curve_under_a_load_is_a_table() {
    let charge = |time: f64| 15.0 + 6.0 * wave(1, time);
    let current = |time: f64| 12.0 * wave(2, time);
    // An open-circuit voltage: steep at first, nearly flat after it, a bit steeper at last.
    let open = |charge: f64| {
        3.9 + 0.12 * (charge - 10.0).min(0.0) + 0.02 * (charge - 10.0) + 0.05 * (charge - 20.0).max(0.0)
    };
    let signals = [
        signal("voltage", "V", 0.002, move |time| open(charge(time)) + 0.01 * current(time)),
        signal("charge", "Ah", 0.01, charge),
        signal("current", "A", 0.02, current),
    ];
    let learned = learn(&signals, &()).unwrap();
    let name = |signal: usize| signals[signal].name.clone();
    let found: Vec<String> = learned.relations.iter().map(|it| formula(&signals, it, &name)).collect();
    let [found] = &*found else { panic!("{found:?}") };
    assert!(found.starts_with("voltage = table(charge, [") && found.ends_with(" * current"), "{found}");
}

#[test]
fn a_curve_is_found_though_most_samples_are_at_its_ends() {
    // Charged, left alone, discharged, and left alone again.
    let phase = |time: f64| time % 60.0;
    let charge = move |time: f64| match phase(time) {
        at if at < 12.0 => 2.5 * at,
        at if at < 30.0 => 30.0,
        at if at < 36.0 => 30.0 - 5.0 * (at - 30.0),
        _ => 0.0,
    };
    let current = move |time: f64| match phase(time) {
        at if at < 12.0 => 15.0,
        at if (30.0..36.0).contains(&at) => -30.0,
        _ => 0.0,
    };
    let open = |charge: f64| 3.15 + 0.22 * charge.min(2.0) + 0.02 * (charge - 2.0).max(0.0);
    let signals = [
        signal("voltage", "V", 0.01, move |time| open(charge(time)) + 0.004 * current(time)),
        signal("charge", "Ah", 0.01, charge),
        signal("current", "A", 0.02, current),
    ];
    let learned = learn(&signals, &()).unwrap();
    let is_curve = |it: &&super::Relation| matches!(it.shape, super::Shape::Table(_));
    let found = learned.relations.iter().find(is_curve).unwrap_or_else(|| panic!("{learned:?}"));
    assert_eq!((found.target, &*found.inputs), (0, &[1, 2][..]));
    let resistance = found.numbers.last().copied().unwrap_or(0.0);
    assert!((resistance / 0.004 - 1.0).abs() < 0.05, "{found:?}");
}
