//! Signals with declared noise of a variable that moves as fast as declared: late, out of phase, at different rates, by a sum. Random
//! systems, as the statistics must not count what lies between two samples.

use crate::trust::{Run, text};
use core::f64::consts::TAU;
use proptest::prelude::*;
use shsa_core::knowledge::{BodyDraft, Bounds, Draft, Id, RelationDraft, SignalDraft, VariableDraft, build};

/// A signal: its period, offset and lateness in milliseconds, its time error as a share of the period, and what part of the truth
/// it measures.
#[derive(Clone, Debug)]
struct Sensor {
    variable: &'static str,
    part: f64,
    period: i64,
    offset: i64,
    late: i64,
    time_error: f64,
}

#[derive(Clone, Debug)]
struct World {
    sensors: Vec<Sensor>,
    /// The largest change in 100 ms as a multiple of the error of a value, and the period of the movement in seconds.
    pace: f64,
    movement: f64,
    path: Path,
    deviations: f64,
}

#[derive(Clone, Copy, Debug)]
enum Path {
    Sine,
    Corners,
    AtRest,
}

const ERROR: f64 = 1.0;

impl World {
    /// The truth at a time in seconds, at 0.95 of the largest rate of change.
    fn truth(&self, seconds: f64) -> f64 {
        let rate = 0.95 * self.max_rate();
        let turns = seconds / self.movement;
        match self.path {
            Path::Sine => rate * self.movement / TAU * (turns * TAU).sin(),
            Path::Corners => rate * self.movement * ((turns.fract() - 0.5).abs() - 0.25),
            Path::AtRest => 0.0,
        }
    }

    fn max_rate(&self) -> f64 {
        10.0 * self.pace * ERROR
    }

    fn draft(&self) -> Draft {
        let variable = |(name, part): (&str, f64)| VariableDraft {
            name: text(name),
            max_rate: Some(text(&format!("{}", part * self.max_rate()))),
            ..VariableDraft::default()
        };
        let signal = |(number, sensor): (usize, &Sensor)| SignalDraft {
            name: text(&format!("s{number}")),
            variable: Some(text(sensor.variable)),
            rate: Some(text(&format!("{} Hz", 1e3 / sensor.period as f64))),
            value_error: Some(Bounds::One(text(&format!("{ERROR}")))),
            time_error: Some(Bounds::One(text(&format!("{} s", sensor.error_ns() as f64 * 1e-9)))),
            noise: Some(text(&format!("{}", ERROR / self.deviations))),
            ..SignalDraft::default()
        };
        Draft {
            variables: [("x", 1.0), ("y", 0.6), ("z", 0.4)].map(variable).into(),
            relations: vec![RelationDraft::new(text("sum"), BodyDraft::Equation(text("x = y + z")))],
            signals: self.sensors.iter().enumerate().map(signal).collect(),
            ..Draft::default()
        }
    }

    /// Two minutes; the first sensor is off by `fault` in the second one.
    fn run(&self, seed: u64, fault: f64) -> Run {
        let (knowledge, problems) = build(&self.draft());
        let errors: Vec<_> = problems.iter().filter(|it| format!("{it:?}").contains("Error")).collect();
        assert!(errors.is_empty(), "{errors:?}");
        let mut random = Random(seed);
        let mut observations = Vec::new();
        for (number, sensor) in self.sensors.iter().enumerate() {
            let shift = sensor.error_ns() as f64 * 1e-9 * (2.0 * random.share() - 1.0);
            for step in 0..120_000 / sensor.period {
                let stamp = (step * sensor.period + sensor.offset) * 1_000_000;
                let seconds = stamp as f64 * 1e-9;
                let off = if number == 0 && seconds > 60.0 { fault } else { 0.0 };
                let value = sensor.part * self.truth(seconds + shift)
                    + off
                    + random.normal() * ERROR / self.deviations;
                observations.push((stamp + sensor.late * 1_000_000, number, stamp, value));
            }
        }
        observations.sort_by_key(|&(received, number, ..)| (received, number));
        let mut run = Run::new(knowledge);
        for (received, number, stamp, value) in observations {
            run.pass(received);
            run.give(number, stamp, received, value);
        }
        run
    }
}

impl Sensor {
    fn error_ns(&self) -> i64 {
        (self.time_error * self.period as f64 * 1e6) as i64
    }
}

fn sensor(variable: &'static str, part: f64) -> impl Strategy<Value = Sensor> {
    let share = prop_oneof![Just(0.0), 0.0..1.5_f64];
    let time_error = prop_oneof![3 => Just(0.0), 1 => 0.0..0.3_f64];
    (prop_oneof![Just(50_i64), Just(100), Just(200)], 0.0..1.0_f64, share, time_error).prop_map(
        move |(period, phase, late, time_error)| {
            let of_period = |share: f64| (share * period as f64) as i64;
            let (offset, late) = (of_period(phase), 2 + of_period(late));
            Sensor { variable, part, period, offset, late, time_error }
        },
    )
}

fn world() -> impl Strategy<Value = World> {
    let summands = (sensor("y", 0.6), sensor("z", 0.4), any::<bool>());
    let all = (prop::collection::vec(sensor("x", 1.0), 2..4), summands).prop_map(|(mut all, (y, z, has))| {
        all.extend(has.then_some([y, z]).into_iter().flatten());
        all
    });
    let path = prop_oneof![Just(Path::Sine), Just(Path::Corners)];
    (all, 0.05..8.0_f64, 8.0..60.0_f64, path, 4.0..6.0_f64).prop_map(
        |(sensors, pace, movement, path, deviations)| World { sensors, pace, movement, path, deviations },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn what_lies_between_two_samples_is_no_fault(world in world(), seed in any::<u64>()) {
        prop_assert!(world.run(seed, 0.0).accused().is_empty());
    }

    /// At rest, a bias of the size of the error, half of what single values can hide, is told however fast the variable may be.
    #[test]
    fn a_bias_within_the_errors_is_told_at_rest(world in world(), seed in any::<u64>()) {
        let sensors = world.sensors.iter().filter(|it| it.variable == "x").cloned().collect();
        let at_rest = World { sensors, path: Path::AtRest, ..world };
        prop_assert!(at_rest.run(seed, ERROR).accused().iter().any(|it| it.index() == 0));
    }
}

/// A generator of D. E. Knuth (MMIX), and the sum of twelve of its numbers as a normal one.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn share(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.share()).sum::<f64>() - 6.0
    }
}
