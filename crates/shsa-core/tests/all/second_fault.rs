//! Evidence that comes later. A second fault soon after the first: a signal that is sound again bears witness before it is trusted. And two suspects, of which one has
//! nothing more to show: the other one is not proved right by that. And a witness that comes after the accusation.

use crate::driven::{Driven, MS, knowledge, need, rate, signal, text, variable};
use proptest::prelude::*;
use shsa_core::engine::{PublishedValue, Quality};
use shsa_core::knowledge::{BodyDraft, Draft, RelationDraft, VariableDraft};
use shsa_core::time::Time;
use shsa_core::trust::Verdict;

/// How a sensor is wrong, from a moment on, in SI.
#[derive(Clone, Copy, Debug)]
enum Wrong {
    Bias(f64),
    Drift(f64),
    Stuck,
}

const PERIOD: i64 = 100;

fn truth(at: i64) -> f64 {
    10.0 + 3.0 * (at as f64 * 0.000_314).sin()
}

fn model(errors: &[f64]) -> Driven {
    let range = Some((text("-50"), text("500")));
    let value = VariableDraft { max_rate: Some(text("2")), range, ..variable("x") };
    let sensor = |(at, error): (usize, &f64)| {
        let mut sensor = signal(format!("s{at}"), "x", format!("{error}"));
        sensor.rate = Some(rate(PERIOD));
        sensor
    };
    let signals = errors.iter().enumerate().map(sensor).collect();
    let draft = Draft { variables: vec![value], signals, needs: vec![need("x", 500)], ..Draft::default() };
    Driven::new(knowledge(&draft))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn who_is_sound_again_bears_witness(
        count in 3_usize..6, first in 0_usize..6, second in 1_usize..6, bias in 1.5..6.0_f64, lasts in 10_i64..60, pause in -10_i64..45,
        wrong in prop_oneof![(1.0..4.0_f64).prop_map(Wrong::Bias), (0.3..1.5_f64).prop_map(Wrong::Drift), Just(Wrong::Stuck)],
        noise in prop::collection::vec(-0.25..0.25_f64, 97), is_gradual: bool,
    ) {
        let (first, second) = (first % count, (first + 1 + second % (count - 1)) % count);
        let (from, until) = (50, 50 + lasts);
        let begins = until + pause;
        let mut run = model(&vec![0.3; count]);
        let mut held = 0.0;
        let (mut last, mut longest) = (0, 0);
        for step in 0..1_500_i64 {
            let at = step * PERIOD;
            for sensor in 0..count {
                let sound = truth(at) + noise[(step as usize * 5 + sensor * 13) % 97];
                let value = match sensor {
                    it if it == first && (from..until).contains(&step) => {
                        sound + if is_gradual { bias * ((step - from) as f64 / 10.0).min(1.0) } else { bias }
                    }
                    it if it == second && step >= begins => match wrong {
                        Wrong::Bias(by) => sound - by,
                        Wrong::Drift(by) => sound - (by * (step - begins) as f64 * 0.1).min(3.0),
                        Wrong::Stuck => held,
                    },
                    _ => sound,
                };
                if sensor == second && step < begins {
                    held = sound;
                }
                let time = Time(at * MS);
                run.give(sensor, (time, time), value);
            }
            run.pass(Time((at + PERIOD - 1) * MS));
            for it in run.publications() {
                longest = longest.max(step - last);
                last = step;
                let PublishedValue::Scalar(value) = it.value else { continue };
                // A drift shows once it is larger than both errors, and a sensor that stands still once the truth has moved.
                prop_assert!(step < begins + 60 || value.contains(truth(at)), "{step}: {value:?}");
            }
        }
        longest = longest.max(1_500 - last);
        // While two are wrong at once, a majority of three has no word.
        prop_assert!(longest < 120, "unserved for {longest} steps");
        for sensor in (0..count).filter(|it| *it != second) {
            prop_assert_eq!(run.verdict(sensor), Verdict::Healthy, "s{}", sensor);
        }
    }

    /// Of two that contradict each other, one sends what is no number, or no possible value, from then on.
    #[test]
    fn nothing_to_show_is_no_confession(off in 1.0..20.0_f64, wait in 20_i64..200, is_invalid: bool, witness: bool) {
        let errors: &[f64] = if witness { &[0.3, 0.1, 40.0] } else { &[0.3, 0.1] };
        let mut run = model(errors);
        for step in 0..1_000_i64 {
            let at = step * PERIOD;
            let time = Time(at * MS);
            let wrong = step >= 50;
            for sensor in 0..errors.len() {
                let value = match sensor {
                    0 if wrong => truth(at) - off,
                    1 if step >= 50 + wait => if is_invalid { f64::NAN } else { 900.0 },
                    _ => truth(at),
                };
                run.give(sensor, (time, time), value);
            }
            run.pass(Time((at + PERIOD - 1) * MS));
            for it in run.publications() {
                let PublishedValue::Scalar(value) = it.value else { continue };
                let is_right = value.contains(truth(at)) || it.quality == Quality::Uncertain;
                prop_assert!(is_right || step < 60, "{step}: {value:?} {:?}", it.quality);
            }
        }
    }

    /// Three are suspect, as `m = o + d` says only that one of them is wrong. A second sensor of a sound one comes later: the other two
    /// stay suspect, and the one that it agrees with is trusted.
    #[test]
    fn a_witness_that_comes_later_rules_a_suspect_out(
        wrong in 0_usize..3, of in 0_usize..2, off in 3.0..20.0_f64, comes in 100_i64..400, every in 1_i64..20,
        noise in prop::collection::vec(-0.25..0.25_f64, 97),
    ) {
        let sound = (wrong + 1 + of) % 3;
        let names = ["m", "o", "d"];
        let sensor = |(at, name): (usize, &str)| {
            let mut sensor = signal(format!("s{at}"), name, "0.3");
            sensor.rate = Some(rate(if at < 3 { PERIOD } else { every * PERIOD }));
            sensor
        };
        let sum = RelationDraft::new(text("sum"), BodyDraft::Equation(text("m = o + d")));
        let draft = Draft {
            variables: names.map(variable).to_vec(),
            relations: vec![sum],
            signals: names.into_iter().chain([names[sound]]).enumerate().map(sensor).collect(),
            ..Draft::default()
        };
        let mut run = Driven::new(knowledge(&draft));
        for step in 0..1_000_i64 {
            let at = step * PERIOD;
            let time = Time(at * MS);
            let truths = [truth(at) + 5.0, truth(at), 5.0];
            for sensor in 0..4 {
                if sensor == 3 && (step < 50 + comes || step % every != 0) {
                    continue;
                }
                let measures = if sensor == 3 { sound } else { sensor };
                let error = noise[(step as usize * 5 + sensor * 13) % 97];
                let lie = if sensor == wrong && step >= 50 { off } else { 0.0 };
                run.give(sensor, (time, time), truths[measures] + error + lie);
            }
            run.pass(Time((at + PERIOD - 1) * MS));
            if step == 40 + comes {
                prop_assert!((0..3).all(|it| run.verdict(it) == Verdict::Suspect), "at {step}");
            }
        }
        prop_assert_eq!(run.verdict(sound), Verdict::Healthy);
        prop_assert_eq!(run.verdict(3), Verdict::Healthy);
        prop_assert_eq!(run.verdict(wrong), Verdict::Suspect);
    }
}
