//! A sound source that sends its values in batches, as gateways and radio links do: where the need can wait for a batch, it settles on
//! one source, and stamps never go back.

use crate::driven::{Driven, MS, knowledge, need, rate, signal, variable};
use proptest::prelude::*;
use shsa_core::engine::Publication;
use shsa_core::knowledge::{Draft, SignalDraft};
use shsa_core::time::Time;

/// What is usual of a batch is known by then.
const SETTLED_MS: i64 = 120_000;
const END_MS: i64 = 180_000;
/// How late a batch may be.
const LATEST_MS: i64 = 60;

/// A sensor that reads in its period, and sends when it has read so many values.
#[derive(Clone, Debug)]
struct Sensor {
    period_ms: i64,
    offset_ms: i64,
    is_declared: bool,
    is_stamped: bool,
    /// The sizes of the batches, in turn.
    sizes: Vec<usize>,
    /// How late the batches are, in turn.
    delays_ms: Vec<i64>,
}

impl Sensor {
    /// Each value with its time of reading, and its time of arrival.
    fn readings(&self) -> Vec<(i64, i64)> {
        let mut given = Vec::new();
        let mut read_ms = self.offset_ms;
        let turns = self.sizes.iter().cycle().zip(self.delays_ms.iter().cycle());
        for (size, delay_ms) in turns {
            let reads: Vec<i64> = (0..*size as i64).map(|at| read_ms + at * self.period_ms).collect();
            let sent = reads.last().copied().unwrap_or(read_ms) + delay_ms;
            given.extend(reads.into_iter().map(|read| (read, sent)));
            read_ms += *size as i64 * self.period_ms;
            if read_ms > END_MS {
                return given;
            }
        }
        given
    }
}

fn steady() -> impl Strategy<Value = Sensor> {
    (50..250_i64, 0..50_i64, any::<bool>()).prop_map(|(period_ms, offset_ms, is_declared)| Sensor {
        period_ms,
        offset_ms,
        is_declared,
        is_stamped: false,
        sizes: vec![1],
        delays_ms: vec![0],
    })
}

/// The sizes of batches, in turn: one size, or any.
fn batched(sizes: impl Strategy<Value = Vec<usize>>) -> impl Strategy<Value = Sensor> {
    let delays = prop::collection::vec(0..LATEST_MS, 1..40);
    (steady(), any::<bool>(), sizes, delays).prop_map(|(steady, is_stamped, sizes, delays_ms)| Sensor {
        is_stamped,
        sizes,
        delays_ms,
        ..steady
    })
}

fn driven(sensors: &[Sensor], max_age_ms: i64) -> Driven {
    let signal = |(at, sensor): (usize, &Sensor)| SignalDraft {
        rate: sensor.is_declared.then(|| rate(sensor.period_ms)),
        ..signal(format!("s{at}"), "v", "0.1")
    };
    Driven::new(knowledge(&Draft {
        variables: vec![variable("v")],
        signals: sensors.iter().enumerate().map(signal).collect(),
        needs: vec![need("v", max_age_ms)],
        ..Draft::default()
    }))
}

fn run(sensors: &[Sensor], max_age_ms: i64) -> Vec<Publication> {
    let mut driven = driven(sensors, max_age_ms);
    let mut arrivals: Vec<(i64, i64, usize)> = Vec::new();
    for (at, sensor) in sensors.iter().enumerate() {
        let of = |(read, sent): (i64, i64)| (sent, if sensor.is_stamped { read } else { sent }, at);
        arrivals.extend(sensor.readings().into_iter().map(of));
    }
    arrivals.retain(|(sent, ..)| *sent <= END_MS);
    arrivals.sort_by_key(|(sent, ..)| *sent);
    let (mut before, mut number) = (0, 0);
    for (sent, stamp, at) in arrivals {
        // What comes together comes one after the other, 0.1 ms apart.
        number = if sent == before { number + 1 } else { 0 };
        before = sent;
        let now = Time(sent * MS + number * MS / 100);
        let stamp = if sensors[at].is_stamped { Time(stamp * MS) } else { now };
        driven.pass(now);
        driven.give(at, (stamp, now), 3.0 + 0.01 * ((sent % 17) as f64));
        driven.tick(now);
    }
    driven.publications().collect()
}

/// Checks the stamps and the gaps of all values; returns the values after two minutes that another source gave than the one before.
fn changes(sensors: &[Sensor], max_age_ms: i64) -> Result<Vec<Publication>, TestCaseError> {
    let published = run(sensors, max_age_ms);
    let stamps: Vec<Time> = published.iter().map(|it| it.validity.centre()).collect();
    prop_assert!(stamps.is_sorted(), "stamps go back");
    let late: Vec<&Publication> = published.iter().filter(|it| it.time.0 > SETTLED_MS * MS).collect();
    let longest = late.windows(2).map(|pair| (pair[1].time - pair[0].time).0 / MS).max();
    prop_assert!(longest.is_some_and(|longest| longest <= max_age_ms), "a gap of {longest:?} ms");
    let changed = late.windows(2).filter(|pair| pair[0].source != pair[1].source);
    Ok(changed.map(|pair| pair[1].clone()).collect())
}

proptest! {
        /// What the need can wait for changes no source.
    #[test]
    fn batches_change_no_source(
        first in batched(prop::collection::vec(1..=20_usize, 1..3)),
        others in prop::collection::vec(steady(), 1..3),
        more_ms in 0..1_000_i64,
    ) {
        let longest_ms = first.sizes.iter().max().map_or(0, |size| *size as i64 * first.period_ms) + LATEST_MS;
        let changes = changes(&[vec![first], others].concat(), 2 * longest_ms + 1 + more_ms)?;
        prop_assert!(changes.is_empty(), "{}: {:#?}", changes.len(), &changes[..changes.len().min(4)]);
    }

    /// The need is served in time, and no stamp goes back, whatever the need can wait for.
    #[test]
    fn batches_leave_no_gap(
        first in batched(prop::collection::vec(1..=20_usize, 2..30)),
        others in prop::collection::vec(steady(), 1..3),
        max_age_ms in 600..3_000_i64,
    ) {
        changes(&[vec![first], others].concat(), max_age_ms)?;
    }
}
