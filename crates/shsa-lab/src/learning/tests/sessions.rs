//! What is learned from several sessions does not depend on their order, nor on the time between them.

use super::{DURATION_S, signal, wave};
use crate::learning::{Signal, learn_sessions};
use proptest::prelude::*;

/// A part of the signals as a session: from when, to when, and how much is added to the second signal.
type Part = (f64, f64, f64);

/// The forms that are found in sessions with this time between them, each with its signals.
fn found(whole: &[Signal], parts: &[Part], between_s: f64) -> Vec<(&'static str, Vec<usize>)> {
    let mut signals: Vec<Signal> =
        whole.iter().map(|it| Signal { points: Vec::new(), ..it.clone() }).collect();
    let (mut begin, mut joints) = (0.0, Vec::new());
    for (from, to, added) in parts {
        for (number, (signal, whole)) in signals.iter_mut().zip(whole).enumerate() {
            let added = if number == 1 { *added } else { 0.0 };
            let points = whole.points.iter().filter(|it| (*from..*to).contains(&it.0));
            signal.points.extend(points.map(|(time, value)| (time - from + begin, value + added)));
        }
        begin += to - from + between_s;
        joints.push(begin - 0.5 * between_s);
    }
    joints.pop();
    let relations = learn_sessions(&signals, &joints, &()).unwrap().relations;
    relations.iter().map(|it| (it.shape.kind(), it.signals())).collect()
}

/// What is found in the parts in their order, which is also what is found when the last one comes first.
#[track_caller]
fn in_any_order(whole: &[Signal], parts: &[Part], between_s: f64) -> Vec<(&'static str, Vec<usize>)> {
    let forward = found(whole, parts, between_s);
    let backward: Vec<Part> = parts.iter().rev().copied().collect();
    assert_eq!(forward, found(whole, &backward, between_s), "{parts:?}");
    forward
}

/// Two or three parts, none of which is short.
fn parts() -> impl Strategy<Value = Vec<Part>> {
    let cut = 0.35..0.65_f64;
    (cut, any::<bool>()).prop_map(|(cut, are_three)| {
        let ends = if are_three { vec![0.0, 0.75 * cut, cut + 0.1, 1.0] } else { vec![0.0, cut, 1.0] };
        ends.windows(2).map(|ends| (DURATION_S * ends[0], DURATION_S * ends[1], 0.0)).collect()
    })
}

fn room(number: u32, lag_s: f64) -> impl Fn(f64) -> f64 {
    move |time| 20.0 + 0.4 * wave(number, time - lag_s)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn delays_and_lines(parts in parts(), number in 1..9_u32, lag_s in 0.8..4.0_f64, between_s in 7.0..300.0_f64) {
        let late = [signal("room", "degC", 0.005, room(number, 0.0)), signal("late", "degC", 0.005, room(number, lag_s))];
        prop_assert_eq!(in_any_order(&late, &parts, between_s), [("delay", vec![0, 1])]);
        let line = [
            signal("room", "degC", 0.005, room(number, 0.0)),
            signal("heat", "W", 0.5, move |time| 40.0 * room(number, 0.0)(time)),
        ];
        prop_assert_eq!(in_any_order(&line, &parts, between_s), [("line", vec![0, 1])]);
    }

    #[test]
    fn integrals_that_begin_anew(mut parts in parts(), number in 1..9_u32, between_s in 7.0..300.0_f64, begins in any::<[u8; 3]>()) {
        parts.iter_mut().zip(begins).for_each(|(part, begin)| part.2 = f64::from(begin));
        let level = move |time: f64| 50.0 + 20.0 * wave(number, time);
        let flow = move |time: f64| (level(time + 1e-3) - level(time - 1e-3)) / 2e-3;
        let tank = [signal("flow", "l/s", 0.02, flow), signal("level", "l", 0.005, level)];
        prop_assert_eq!(in_any_order(&tank, &parts, between_s).into_iter().map(|it| it.1).collect::<Vec<_>>(), [[0, 1]]);
    }

    #[test]
    fn gears_and_limits_of_which_a_session_shows_one_only(cut in 0.4..0.6_f64, number in 1..9_u32, between_s in 7.0..300.0_f64) {
        let parts = [(0.0, cut * DURATION_S, 0.0), (cut * DURATION_S, DURATION_S, 0.0)];
        let gear = move |time: f64| if time < cut * DURATION_S { 1.0 } else { (time / 11.0).floor() % 3.0 + 1.0 };
        let engine = move |time: f64| 1500.0 + 300.0 * wave(number, time);
        let wheel = move |time: f64| [3.0, 2.0, 1.25][gear(time) as usize - 1] * engine(time);
        let car = [signal("engine", "rpm", 0.0, engine), signal("wheel", "rpm", 0.0, wheel), signal("gear", "1", 0.0, gear)];
        prop_assert_eq!(in_any_order(&car, &parts, between_s).into_iter().map(|it| it.1).collect::<Vec<_>>(), [[0, 1, 2]]);
        let swing = move |time: f64| if time < cut * DURATION_S { 8.0 } else { 20.0 };
        let open = move |time: f64| 50.0 + swing(time) * wave(2, time);
        let flow = move |time: f64| (1.2 * open(time) - 5.0).clamp(-40.0, 80.0);
        let valve = [signal("open", "%", 0.0, open), signal("flow", "%", 0.0, flow)];
        prop_assert_eq!(in_any_order(&valve, &parts, between_s), [("saturation", vec![0, 1])]);
    }

    #[test]
    fn what_drifts_alike_in_each_session_is_not_related(parts in parts(), number in 1..9_u32, between_s in 7.0..300.0_f64) {
        let begin = |time: f64| parts.iter().map(|it| it.0).filter(|it| *it <= time).fold(0.0, f64::max);
        let drift = |number: u32, slope: f64| move |time: f64| 20.0 + slope * (time - begin(time)) + 0.3 * wave(number, time);
        let warm = [signal("one", "degC", 0.02, drift(number, 0.1)), signal("two", "V", 0.02, drift(number + 1, 0.2))];
        prop_assert_eq!(in_any_order(&warm, &parts, between_s), []);
    }
}
