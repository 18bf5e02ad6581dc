//! A source whose witnesses have never spoken may lie from the start: it is at most uncertain, however often and late it speaks.

use proptest::prelude::*;
use shsa_core::engine::{Engine, Input, Options, Output, Publication, Quality};
use shsa_core::knowledge::{Bounds, Draft, Id, NeedDraft, SignalDraft, SignalId, Text, VariableDraft, build};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::{Span, Time};

const MS: i64 = 1_000_000;
const END_MS: i64 = 20_000;

fn text(text: impl Into<String>) -> Text {
    Text { text: text.into(), ..Text::default() }
}

#[derive(Clone, Debug)]
struct Sensor {
    period_ms: i64,
    /// Whether the model says so: then it can be silent.
    is_rated: bool,
    /// When it speaks.
    from_ms: i64,
    until_ms: i64,
}

fn engine(sensors: &[Sensor], max_age_ms: i64) -> Engine {
    let signal = |(at, sensor): (usize, &Sensor)| SignalDraft {
        name: text(format!("s{at}")),
        variable: Some(text("v")),
        rate: sensor.is_rated.then(|| text(format!("{} Hz", 1_000.0 / sensor.period_ms as f64))),
        value_error: Some(Bounds::One(text("0.1"))),
        ..SignalDraft::default()
    };
    let max_age = Some(text(format!("{max_age_ms} ms")));
    let draft = Draft {
        variables: vec![VariableDraft { name: text("v"), ..VariableDraft::default() }],
        signals: sensors.iter().enumerate().map(signal).collect(),
        needs: vec![NeedDraft { variable: text("v"), max_age, ..NeedDraft::default() }],
        ..Draft::default()
    };
    Engine::new(build(&draft).0, Options::default())
}

/// All publications while the first sensor is always wrong.
fn run(sensors: &[Sensor], max_age_ms: i64) -> Vec<Publication> {
    let mut engine = engine(sensors, max_age_ms);
    let mut published = Vec::new();
    let mut listen = |engine: &mut Engine| {
        let publications = std::iter::from_fn(|| engine.poll()).filter_map(|output| match output {
            Output::Publication(publication) => Some(publication),
            _ => None,
        });
        published.extend(publications);
    };
    for ms in 0..END_MS {
        let now = Time(ms * MS);
        while let Some(due) = engine.next_deadline().filter(|due| *due <= now) {
            engine.handle(Input::Tick(due));
            listen(&mut engine);
        }
        for (at, sensor) in sensors.iter().enumerate() {
            let speaks = (sensor.from_ms..sensor.until_ms).contains(&ms);
            if speaks && (ms - sensor.from_ms) % sensor.period_ms == 0 {
                let value = RawValue::Number(if at == 0 { 7.0 } else { 3.0 });
                let signal = SignalId::from_index(at);
                engine.handle(Input::Observation(Observation { signal, stamp: now, received: now, value }));
                engine.handle(Input::Tick(now));
                listen(&mut engine);
            }
        }
    }
    published
}

fn liar() -> impl Strategy<Value = Sensor> {
    (20..400_i64, any::<bool>(), 0..3_000_i64).prop_map(|(period_ms, is_rated, from_ms)| Sensor {
        period_ms,
        is_rated,
        from_ms,
        until_ms: END_MS,
    })
}

/// A sensor that never speaks, with a timeout of at most a second.
fn silent() -> impl Strategy<Value = Sensor> {
    (20..200_i64).prop_map(|period_ms| Sensor {
        period_ms,
        is_rated: true,
        from_ms: END_MS,
        until_ms: END_MS,
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    #[test]
    fn what_nobody_has_ever_confirmed_is_uncertain(
        liar in liar(),
        witnesses in prop::collection::vec(silent(), 1..5),
        max_age_ms in 500..5_000_i64,
    ) {
        let published = run(&[vec![liar], witnesses].concat(), max_age_ms);
        prop_assert!(published.len() > 10);
        let known: Vec<_> = published.iter().filter(|it| it.quality != Quality::Uncertain).collect();
        prop_assert!(known.is_empty(), "{} of {}: {:?}", known.len(), published.len(), known[0]);
    }

    /// One witness that speaks ends the wait; nothing that lies is good a moment after two of them have.
    #[test]
    fn witnesses_that_come_late_end_the_wait(
        liar in liar(),
        periods in prop::collection::vec(20..200_i64, 2..5),
        from_ms in 3_000..6_000_i64,
    ) {
        let sound = |period_ms| Sensor { period_ms, is_rated: true, from_ms, until_ms: END_MS };
        let sensors: Vec<Sensor> = [liar].into_iter().chain(periods.into_iter().map(sound)).collect();
        let published = run(&sensors, 5_000);
        let good = |it: &&Publication| it.quality != Quality::Uncertain;
        let early = published.iter().filter(good).filter(|it| it.time < Time(from_ms * MS)).count();
        prop_assert_eq!(early, 0);
        let last = published.last().unwrap();
        prop_assert!(last.quality != Quality::Uncertain && last.time > Time(END_MS * MS) - Span(5_000 * MS), "{:?}", last);
    }
}
