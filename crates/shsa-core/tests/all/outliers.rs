//! Single wrong readings among three and more random sensors: each is named as it is compared, and no sound reading is.

use crate::noise::Random;
use crate::trust::{Run, text};
use core::f64::consts::TAU;
use proptest::prelude::*;
use shsa_core::engine::EventKind;
use shsa_core::knowledge::{Bounds, Draft, Id, SignalDraft, SignalId, VariableDraft, build};

/// The error of each sensor, the largest rate a second, and how long the recording is.
const ERROR: f64 = 1.0;
const RATE: f64 = 2.0;
const SECONDS: i64 = 60;

/// Random sensors of one variable, of which one is wrong once.
#[derive(Clone, Debug)]
struct World {
    /// Each sensor's period and offset, in milliseconds.
    sensors: Vec<(i64, i64)>,
    declares_rate: bool,
    liar: usize,
    /// Which of its readings is wrong, as a share of the recording, and by how much.
    share: f64,
    off: f64,
    seed: u64,
}

impl World {
    fn truth(seconds: f64) -> f64 {
        0.9 * RATE * 20.0 / TAU * (seconds * TAU / 20.0).sin()
    }

    fn draft(&self) -> Draft {
        let x = VariableDraft { name: text("x"), ..VariableDraft::default() };
        let max_rate = self.declares_rate.then(|| text(&RATE.to_string()));
        let signal = |(number, (period, _)): (usize, &(i64, i64))| SignalDraft {
            name: text(&format!("s{number}")),
            variable: Some(text("x")),
            rate: Some(text(&format!("{} Hz", 1e3 / *period as f64))),
            value_error: Some(Bounds::One(text(&ERROR.to_string()))),
            ..SignalDraft::default()
        };
        Draft {
            variables: vec![VariableDraft { max_rate, ..x }],
            signals: self.sensors.iter().enumerate().map(signal).collect(),
            ..Draft::default()
        }
    }

    /// The run, and when the wrong reading comes, in nanoseconds.
    fn run(&self) -> (Run, i64) {
        let (knowledge, _) = build(&self.draft());
        let mut observations = Vec::new();
        let mut random = Random(self.seed);
        let wrong = (self.share * (SECONDS * 1000 / self.sensors[self.liar].0) as f64) as i64;
        let mut at = 0;
        for (number, &(period, offset)) in self.sensors.iter().enumerate() {
            for step in 0..SECONDS * 1000 / period {
                let stamp = (step * period + offset) * 1_000_000;
                let is_wrong = number == self.liar && step == wrong;
                let off = if is_wrong { self.off } else { ERROR * (2.0 * random.share() - 1.0) };
                at = if is_wrong { stamp } else { at };
                observations.push((stamp, number, World::truth(stamp as f64 * 1e-9) + off));
            }
        }
        observations.sort_by_key(|&(stamp, number, _)| (stamp, number));
        let mut run = Run::new(knowledge);
        for (stamp, number, value) in observations {
            run.pass(stamp);
            run.give(number, stamp, stamp, value);
        }
        (run, at)
    }
}

fn world() -> impl Strategy<Value = World> {
    let period = prop_oneof![Just(100_i64), Just(200), Just(250)];
    let sensor = (period, 0.0..1.0_f64).prop_map(|(period, phase)| (period, (phase * period as f64) as i64));
    let off = (any::<bool>(), 6.0..60.0_f64).prop_map(|(up, off)| if up { off } else { -off });
    let sensors = prop::collection::vec(sensor, 3..6);
    (sensors, any::<bool>(), 0..3_usize, 0.2..0.8_f64, off, any::<u64>()).prop_map(
        |(sensors, declares_rate, liar, share, off, seed)| World {
            sensors,
            declares_rate,
            liar,
            share,
            off,
            seed,
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_wrong_reading_is_named_and_changes_nothing(mut world in world()) {
        // What no other is compared with cannot be seen: the liar delivers no more often than the others.
        world.sensors[world.liar].0 = 250;
        if !world.declares_rate {
            // What the value does between samples is open then.
            world.sensors.iter_mut().for_each(|sensor| *sensor = (250, 0));
        }
        let (run, at) = world.run();
        let events: Vec<_> = EventKind::ALL.into_iter().flat_map(|kind| run.events(kind)).collect();
        prop_assert_eq!(events.len(), 1, "{:?}", events);
        prop_assert_eq!(events[0].kind, EventKind::Outlier);
        prop_assert_eq!(events[0].signal, Some(SignalId::from_index(world.liar)));
        let later = events[0].time.0 - at;
        prop_assert!((0..=300_000_000).contains(&later), "{} ns later", later);
    }

    // A small wrong reading is possible after the one before it, so that the right ones after it seem to jump.
    #[test]
    fn a_reading_that_others_refute_fails_no_sensor(mut world in world(), small in 2.5..4.0_f64) {
        world.declares_rate = true;
        world.off = small.copysign(world.off);
        let (run, _) = world.run();
        let failed = run.events(EventKind::Failed);
        prop_assert!(failed.is_empty(), "{:?}", failed);
    }

    #[test]
    fn one_wrong_reading_of_whatever_size_fails_no_sole_sensor(mut world in world(), off in -60.0..60.0_f64) {
        world.declares_rate = true;
        world.off = off;
        world.sensors.truncate(1);
        world.liar = 0;
        let (run, _) = world.run();
        let failed = run.events(EventKind::Failed);
        prop_assert!(failed.is_empty(), "{:?}", failed);
    }
}
