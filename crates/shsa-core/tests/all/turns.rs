//! One source at a time gives the values of a need, under its own name, whatever fails together: stamps never go back, no two
//! values are closer than the periods of their sources, and what events say of a source is true.

use crate::driven::{Driven, MS, knowledge, need, rate, signal, text, variable};
use proptest::prelude::*;
use shsa_core::engine::{Event, Input, Output, Publication, PublishedValue, Quality};
use shsa_core::knowledge::{BodyDraft, Draft, NeedDraft, RelationDraft, SignalDraft, Text, VariableDraft};
use shsa_core::order::{Order, Subject};
use shsa_core::reason::{Reason, ServedBy};
use shsa_core::time::Time;

const MAX_AGE_MS: i64 = 2_000;
const END_MS: i64 = 20_000;

/// A sensor of the variable, with what happens to it.
#[derive(Clone, Debug)]
struct Sensor {
    period_ms: i64,
    offset_ms: i64,
    /// From when to when it is silent.
    stall: Option<(i64, i64)>,
    /// Whether it jumps when the others jump.
    jumps: bool,
}

impl Sensor {
    /// Each sensor has a width of its own, which identifies its values.
    fn error(at: usize) -> f64 {
        0.1 + at as f64 * 1e-5
    }

    fn is_silent(&self, ms: i64) -> bool {
        self.stall.is_some_and(|(from, to)| (from..to).contains(&ms))
    }

    fn reads(&self, ms: i64) -> bool {
        ms >= self.offset_ms && (ms - self.offset_ms) % self.period_ms == 0
    }
}

/// What happens to all together.
#[derive(Clone, Copy, Debug)]
struct World {
    jump_ms: i64,
    jump: f64,
    /// From when to when the machine takes nothing in; then all comes at once, with its own stamps or stamped on arrival.
    stall: Option<(i64, i64)>,
    stamps_arrival: bool,
}

fn sensor() -> impl Strategy<Value = Sensor> {
    let stall = prop::option::weighted(0.3, (4_000..12_000_i64, 200..4_000_i64));
    (50..400_i64, 0..400_i64, stall, prop::bool::weighted(0.4)).prop_map(
        |(period_ms, offset_ms, stall, jumps)| Sensor {
            period_ms,
            offset_ms,
            stall: stall.map(|(from, span)| (from, from + span)),
            jumps,
        },
    )
}

fn world() -> impl Strategy<Value = World> {
    let stall = prop::option::weighted(0.5, (3_000..15_000_i64, 100..2_500_i64));
    (5_000..10_000_i64, prop_oneof![2.0..9.0_f64, -9.0..-2.0_f64], stall, any::<bool>()).prop_map(
        |(jump_ms, jump, stall, stamps_arrival)| World {
            jump_ms,
            jump,
            stall: stall.map(|(from, span)| (from, from + span)),
            stamps_arrival,
        },
    )
}

fn driven(sensors: &[Sensor]) -> Driven {
    let signal = |(at, sensor): (usize, &Sensor)| SignalDraft {
        rate: Some(rate(sensor.period_ms)),
        ..signal(format!("s{at}"), "v", Sensor::error(at).to_string())
    };
    Driven::new(knowledge(&Draft {
        variables: vec![VariableDraft { max_rate: Some(text("1")), ..variable("v") }],
        signals: sensors.iter().enumerate().map(signal).collect(),
        needs: vec![NeedDraft { when_unsure: Some(text("withhold")), ..need("v", MAX_AGE_MS) }],
        ..Draft::default()
    }))
}

/// A reading: of which sensor, its stamp, and the value.
type Given = (usize, i64, f64);

/// Everything that was given, and that came out.
fn run(sensors: &[Sensor], world: World) -> (Vec<Given>, Vec<Output>) {
    let (mut driven, mut given, mut held) = (driven(sensors), Vec::new(), Vec::new());
    for ms in 0..END_MS {
        for (at, sensor) in sensors.iter().enumerate().filter(|(_, it)| it.reads(ms) && !it.is_silent(ms)) {
            let right = 0.3 * (ms as f64 / 1_000.0).sin();
            let jump = if sensor.jumps && ms >= world.jump_ms { world.jump } else { 0.0 };
            held.push((at, ms, right + jump));
        }
        if world.stall.is_some_and(|(from, to)| (from..to).contains(&ms)) {
            continue;
        }
        for (number, (at, stamp_ms, value)) in held.drain(..).enumerate() {
            // What was held up comes in a burst. No two are stamped alike: two readings of one time would be one value.
            let now = Time(ms * MS + number as i64 * 1_000);
            let stamp = if world.stamps_arrival { now } else { Time(stamp_ms * MS) };
            driven.pass(now);
            given.push((at, stamp.0, value));
            driven.give(at, (stamp, now), value);
        }
    }
    (given, driven.outputs().collect())
}

fn interval(publication: &Publication) -> (f64, f64) {
    match &publication.value {
        PublishedValue::Scalar(value) => (value.lo(), value.hi()),
        PublishedValue::Vector(_) => panic!("a vector"),
    }
}

fn source(publication: &Publication) -> usize {
    match &*publication.source {
        ServedBy::Way(name) => name.trim_start_matches('s').parse().unwrap(),
        other => panic!("{other:?}"),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, ..ProptestConfig::default() })]

    #[test]
    fn one_source_at_a_time_is_named_right(sensors in prop::collection::vec(sensor(), 1..6), world in world()) {
        let (given, outputs) = run(&sensors, world);
        let mut last: Option<&Publication> = None;
        for publication in outputs.iter().filter_map(|output| match output {
            Output::Publication(publication) => Some(publication),
            _ => None,
        }) {
            let at = source(publication);
            let stamp = publication.validity.centre();
            let ((lo, hi), error) = (interval(publication), Sensor::error(at));
            if publication.quality != Quality::Uncertain {
                let is_of = |&(of, then, value): &Given| {
                    of == at && then == stamp.0 && (value - error - lo).abs() < 1e-9 && (value + error - hi).abs() < 1e-9
                };
                prop_assert!(given.iter().any(is_of), "{publication:?} was not given by s{at}");
            }
            if let Some(before) = last {
                let apart = stamp - before.validity.centre();
                prop_assert!(apart.0 >= 0, "{publication:?} after {before:?}");
                let of = source(before);
                let least = sensors[at].period_ms.min(sensors[of].period_ms);
                let is_due = (publication.time - before.time).0 > (MAX_AGE_MS / 2).min(3 * least) * MS;
                prop_assert!(at == of || is_due || 2 * apart.0 >= least * MS, "{publication:?} after {before:?}");
            }
            last = Some(publication);
        }
        for event in outputs.iter().filter_map(event) {
            for reason in event.because.iter() {
                let Reason::NotInTime { source } = reason else { continue };
                let at: usize = source.trim_start_matches('s').parse().unwrap();
                let sensor = &sensors[at];
                let now_ms = event.time.0 / MS;
                // It did not read, or nothing was taken in, or its jumped values were refused.
                let since = now_ms - sensor.period_ms;
                let is_quiet = |ms: i64| sensor.is_silent(ms) || world.stall.is_some_and(|(from, to)| (from..=to + MAX_AGE_MS).contains(&ms));
                let is_refused = sensor.jumps && now_ms >= world.jump_ms;
                prop_assert!(is_refused || is_quiet(now_ms) || is_quiet(since), "{event:?}");
            }
        }
    }
}

fn event(output: &Output) -> Option<&Event> {
    match output {
        Output::Event(event) => Some(event),
        _ => None,
    }
}

/// A spare that holds under a condition only, which never holds: it takes nothing over, and what is said is true.
#[test]
fn what_gives_nothing_takes_nothing_over() {
    let signal = |name| SignalDraft { rate: Some(text("1 Hz")), ..signal(name, name, "1") };
    let body = BodyDraft::Equation(text("a = b"));
    let spare = RelationDraft {
        directions: Some(vec![text("a")]),
        condition: Some(text("mode > 0.5")),
        ..RelationDraft::new(text("spare"), body)
    };
    let knowledge = knowledge(&Draft {
        variables: ["a", "b", "mode"].map(variable).into(),
        relations: vec![spare],
        signals: ["a", "b", "mode"].map(signal).into(),
        needs: vec![need("a", 3_000)],
        ..Draft::default()
    });
    for mode in [-2.0, 5.0] {
        let mut driven = Driven::new(knowledge.clone());
        for second in 0..60 {
            let now = Time(second * 1_000 * MS);
            driven.pass(now);
            let all = [(second < 20).then_some(5.0), Some(5.0), Some(mode)];
            for (at, value) in all.into_iter().enumerate().filter_map(|(at, value)| Some((at, value?))) {
                driven.give(at, (now, now), value);
            }
        }
        let outputs: Vec<Output> = driven.outputs().collect();
        let said =
            |is: fn(&Reason) -> bool| outputs.iter().filter_map(event).any(|it| it.because.iter().any(is));
        let holds = mode > 0.5;
        assert_eq!(said(|it| matches!(it, Reason::TakesOver { .. })), holds, "{outputs:?}");
        assert_eq!(said(|it| matches!(it, Reason::NoValue { .. })), !holds, "{outputs:?}");
    }
}

/// A single value after an order of the operator comes too soon after the one before: it goes out when none has followed.
#[test]
fn a_value_that_nothing_follows_goes_out() {
    let sensor = || Sensor { period_ms: 100, offset_ms: 0, stall: None, jumps: false };
    let mut driven = driven(&[sensor(), sensor()]);
    let given = |driven: &mut Driven, at: usize, ms: i64| {
        let now = Time(ms * MS);
        driven.pass(now);
        driven.give(at, (now, now), 1.0);
    };
    for step in 0..20 {
        given(&mut driven, 0, 100 * step);
        given(&mut driven, 1, 100 * step);
    }
    let order = Order::Forbid(Subject::Signal("s0".to_owned()));
    driven.handle(Input::Order { time: Time(1_900 * MS), order });
    given(&mut driven, 1, 1_901);
    given(&mut driven, 0, 5_000);
    let published: Vec<(i64, usize)> =
        driven.publications().map(|it| (it.time.0 / MS, source(&it))).collect();
    assert_eq!(published.last(), Some(&(2_200, 1)), "{published:?}");
}

/// A source whose values are about as old as the need allows leaves no gap beside another one, whatever its delay and rate.
#[test]
fn who_gives_old_values_leaves_no_gap() {
    for (delay_ms, period_ms) in
        [(0, 90), (50, 103), (120, 103), (170, 80), (170, 103), (170, 115), (150, 130), (195, 60)]
    {
        let signal = |name: &str, accuracy: &str, rate: Text, delay: String| SignalDraft {
            properties: vec![(text("accuracy"), text(accuracy))],
            rate: Some(rate),
            delay: Some(text(delay)),
            timeout: Some(text("900 ms")),
            ..signal(name, "v", "0.1")
        };
        let slow = signal("slow", "1.0", rate(period_ms), format!("{delay_ms} ms"));
        let mut driven = Driven::new(knowledge(&Draft {
            variables: vec![variable("v")],
            signals: vec![slow, signal("fast", "0.9", text("80 Hz"), "0 ms".into())],
            needs: vec![need("v", 200)],
            ..Draft::default()
        }));
        let mut last = Time(0);
        for ms in 0..10_000_i64 {
            let now = Time(ms * MS);
            driven.pass(now);
            // The fast one comes in bursts, as over a busy network; the slow one leaves out a value now and then.
            let given = [(0, ms % period_ms == 0 && ms / period_ms % 5 < 4), (1, ms % 140 < 3)];
            for (at, _) in given.into_iter().filter(|given| given.1) {
                driven.give(at, (now, now), 1.0);
            }
            for publication in driven.publications() {
                let gap = publication.time - last;
                assert!(
                    gap.0 <= 200 * MS || ms < 1_000,
                    "{delay_ms} {period_ms}: {gap:?} before {publication:?}"
                );
                last = publication.time;
            }
        }
        assert!(last.0 > 9_800 * MS, "{delay_ms} {period_ms}: nothing after {last:?}");
    }
}
