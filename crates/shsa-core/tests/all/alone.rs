//! A source whose witnesses have never spoken may lie from the start: it is at most uncertain, however often and late it speaks.

use crate::driven::{Driven, MS, knowledge, need, rate, signal, variable};
use proptest::prelude::*;
use shsa_core::engine::{Publication, Quality};
use shsa_core::knowledge::{Draft, SignalDraft};
use shsa_core::time::{Span, Time};

const END_MS: i64 = 20_000;

#[derive(Clone, Debug)]
struct Sensor {
    period_ms: i64,
    /// Whether the model says so: then it can be silent.
    is_rated: bool,
    /// When it speaks.
    from_ms: i64,
    until_ms: i64,
}

fn driven(sensors: &[Sensor], max_age_ms: i64) -> Driven {
    let signal = |(at, sensor): (usize, &Sensor)| SignalDraft {
        rate: sensor.is_rated.then(|| rate(sensor.period_ms)),
        ..signal(format!("s{at}"), "v", "0.1")
    };
    Driven::new(knowledge(&Draft {
        variables: vec![variable("v")],
        signals: sensors.iter().enumerate().map(signal).collect(),
        needs: vec![need("v", max_age_ms)],
        ..Draft::default()
    }))
}

/// All publications while the first sensor is always wrong.
fn run(sensors: &[Sensor], max_age_ms: i64) -> Vec<Publication> {
    let mut driven = driven(sensors, max_age_ms);
    for ms in 0..END_MS {
        let now = Time(ms * MS);
        driven.pass(now);
        for (at, sensor) in sensors.iter().enumerate() {
            let speaks = (sensor.from_ms..sensor.until_ms).contains(&ms);
            if speaks && (ms - sensor.from_ms) % sensor.period_ms == 0 {
                driven.give(at, (now, now), if at == 0 { 7.0 } else { 3.0 });
                driven.tick(now);
            }
        }
    }
    driven.publications().collect()
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
