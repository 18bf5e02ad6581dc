//! One source at a time gives the values of a need, under its own name, whatever fails together: stamps never go back, no two
//! values are closer than the periods of their sources, and what events say of a source is true.

use proptest::prelude::*;
use shsa_core::engine::{Engine, Event, Input, Options, Output, Publication, PublishedValue, Quality};
use shsa_core::knowledge::{
    BodyDraft, Bounds, Draft, Id, NeedDraft, RelationDraft, Severity, SignalDraft, SignalId, Text,
    VariableDraft, build,
};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::order::{Order, Subject};
use shsa_core::reason::{Reason, ServedBy};
use shsa_core::time::Time;

const MS: i64 = 1_000_000;
const MAX_AGE_MS: i64 = 2_000;
const END_MS: i64 = 20_000;

fn text(text: impl Into<String>) -> Text {
    Text { text: text.into(), ..Text::default() }
}

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

fn engine(sensors: &[Sensor]) -> Engine {
    let signal = |(at, sensor): (usize, &Sensor)| SignalDraft {
        name: text(format!("s{at}")),
        variable: Some(text("v")),
        rate: Some(text(format!("{} Hz", 1_000.0 / sensor.period_ms as f64))),
        value_error: Some(Bounds::One(text(format!("{}", Sensor::error(at))))),
        ..SignalDraft::default()
    };
    let v = VariableDraft { name: text("v"), max_rate: Some(text("1")), ..VariableDraft::default() };
    let need = NeedDraft {
        variable: text("v"),
        max_age: Some(text(format!("{MAX_AGE_MS} ms"))),
        when_unsure: Some(text("withhold")),
        ..NeedDraft::default()
    };
    let (knowledge, problems) = build(&Draft {
        variables: vec![v],
        signals: sensors.iter().enumerate().map(signal).collect(),
        needs: vec![need],
        ..Draft::default()
    });
    assert!(problems.iter().all(|it| it.severity != Severity::Error), "{problems:?}");
    Engine::new(knowledge, Options::default())
}

/// A reading: of which sensor, its stamp, and the value.
type Given = (usize, i64, f64);

/// Everything that was given, and that came out.
fn run(sensors: &[Sensor], world: World) -> (Vec<Given>, Vec<Output>) {
    let (mut engine, mut outputs, mut given, mut held) =
        (engine(sensors), Vec::new(), Vec::new(), Vec::new());
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
            while let Some(due) = engine.next_deadline().filter(|due| *due <= now) {
                engine.handle(Input::Tick(due));
                outputs.extend(core::iter::from_fn(|| engine.poll()));
            }
            given.push((at, stamp.0, value));
            engine.handle(Input::Observation(Observation {
                signal: SignalId::from_index(at),
                stamp,
                received: now,
                value: RawValue::Number(value),
            }));
            outputs.extend(core::iter::from_fn(|| engine.poll()));
        }
    }
    (given, outputs)
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
    let signal = |name: &str| SignalDraft {
        name: text(name),
        variable: Some(text(name)),
        rate: Some(text("1 Hz")),
        value_error: Some(Bounds::One(text("1"))),
        ..SignalDraft::default()
    };
    let body = BodyDraft::Equation(text("a = b"));
    let spare = RelationDraft {
        directions: Some(vec![text("a")]),
        condition: Some(text("mode > 0.5")),
        ..RelationDraft::new(text("spare"), body)
    };
    let (knowledge, problems) = build(&Draft {
        variables: ["a", "b", "mode"]
            .map(|it| VariableDraft { name: text(it), ..VariableDraft::default() })
            .into(),
        relations: vec![spare],
        signals: ["a", "b", "mode"].map(signal).into(),
        needs: vec![NeedDraft { variable: text("a"), max_age: Some(text("3 s")), ..NeedDraft::default() }],
        ..Draft::default()
    });
    assert!(problems.iter().all(|it| it.severity != Severity::Error), "{problems:?}");
    for mode in [-2.0, 5.0] {
        let mut engine = Engine::new(knowledge.clone(), Options::default());
        let mut outputs = Vec::new();
        for second in 0..60 {
            let now = Time(second * 1_000 * MS);
            while let Some(due) = engine.next_deadline().filter(|due| *due <= now) {
                engine.handle(Input::Tick(due));
            }
            let all = [(second < 20).then_some(5.0), Some(5.0), Some(mode)];
            for (at, value) in all.into_iter().enumerate().filter_map(|(at, value)| Some((at, value?))) {
                engine.handle(Input::Observation(Observation {
                    signal: SignalId::from_index(at),
                    stamp: now,
                    received: now,
                    value: RawValue::Number(value),
                }));
            }
            outputs.extend(core::iter::from_fn(|| engine.poll()));
        }
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
    let mut engine = engine(&[sensor(), sensor()]);
    let mut published = Vec::new();
    let mut given = |engine: &mut Engine, at: usize, ms: i64| {
        let now = Time(ms * MS);
        while let Some(due) = engine.next_deadline().filter(|due| *due <= now) {
            engine.handle(Input::Tick(due));
        }
        let value = RawValue::Number(1.0);
        engine.handle(Input::Observation(Observation {
            signal: SignalId::from_index(at),
            stamp: now,
            received: now,
            value,
        }));
        let outputs = core::iter::from_fn(|| engine.poll());
        published.extend(outputs.filter_map(|output| match output {
            Output::Publication(publication) => Some((publication.time.0 / MS, source(&publication))),
            _ => None,
        }));
    };
    for step in 0..20 {
        given(&mut engine, 0, 100 * step);
        given(&mut engine, 1, 100 * step);
    }
    let order = Order::Forbid(Subject::Signal("s0".to_owned()));
    engine.handle(Input::Order { time: Time(1_900 * MS), order });
    given(&mut engine, 1, 1_901);
    given(&mut engine, 0, 5_000);
    assert_eq!(published.last(), Some(&(2_200, 1)), "{published:?}");
}

/// A source whose values are about as old as the need allows leaves no gap beside another one, whatever its delay and rate.
#[test]
fn who_gives_old_values_leaves_no_gap() {
    for (delay_ms, period_ms) in
        [(0, 90), (50, 103), (120, 103), (170, 80), (170, 103), (170, 115), (150, 130), (195, 60)]
    {
        let signal = |name: &str, rate: String, delay: String| SignalDraft {
            name: text(name),
            properties: vec![(text("accuracy"), text(if name == "slow" { "1.0" } else { "0.9" }))],
            variable: Some(text("v")),
            rate: Some(text(rate)),
            delay: Some(text(delay)),
            timeout: Some(text("900 ms")),
            value_error: Some(Bounds::One(text("0.1"))),
            ..SignalDraft::default()
        };
        let need = NeedDraft { variable: text("v"), max_age: Some(text("200 ms")), ..NeedDraft::default() };
        let slow = signal("slow", format!("{} Hz", 1_000.0 / f64::from(period_ms)), format!("{delay_ms} ms"));
        let (knowledge, problems) = build(&Draft {
            variables: vec![VariableDraft { name: text("v"), ..VariableDraft::default() }],
            signals: vec![slow, signal("fast", "80 Hz".into(), "0 ms".into())],
            needs: vec![need],
            ..Draft::default()
        });
        assert!(problems.iter().all(|it| it.severity != Severity::Error), "{problems:?}");
        let mut engine = Engine::new(knowledge, Options::default());
        let mut last = Time(0);
        for ms in 0..10_000_i64 {
            let now = Time(ms * MS);
            while let Some(due) = engine.next_deadline().filter(|due| *due <= now) {
                engine.handle(Input::Tick(due));
            }
            // The fast one comes in bursts, as over a busy network; the slow one leaves out a value now and then.
            let period = i64::from(period_ms);
            let given = [(0, ms % period == 0 && ms / period % 5 < 4), (1, ms % 140 < 3)];
            for (at, _) in given.into_iter().filter(|given| given.1) {
                let value = RawValue::Number(1.0);
                let signal = SignalId::from_index(at);
                engine.handle(Input::Observation(Observation { signal, stamp: now, received: now, value }));
            }
            while let Some(output) = engine.poll() {
                let Output::Publication(publication) = output else { continue };
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
