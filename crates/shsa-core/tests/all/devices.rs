//! A signal that is sent on change and has no timeout: it is silent when nothing of one of its devices has spoken for the longest timeout
//! there, and back with its next value.

use crate::driven::{Driven, MS, knowledge, text, variable};
use proptest::prelude::*;
use shsa_core::engine::{EventKind, Output};
use shsa_core::knowledge::{Draft, Id, SignalDraft, SignalId};
use shsa_core::time::Time;
use std::collections::BTreeSet;

const END_MS: i64 = 60_000;

/// The timeout of each signal but the first, in milliseconds, and the devices of all: the first has both.
#[derive(Clone, Debug)]
struct Plant {
    others: Vec<(i64, usize)>,
    /// Who speaks when, in milliseconds; no two at one time.
    spoken: Vec<(i64, usize)>,
}

fn plants() -> impl Strategy<Value = Plant> {
    let others = prop::collection::vec((200..8_000_i64, 0..3_usize), 1..5);
    let spoken = prop::collection::vec((0..END_MS, any::<prop::sample::Index>()), 1..40);
    (others, spoken).prop_map(|(others, spoken)| {
        let count = others.len() + 1;
        let mut spoken: Vec<(i64, usize)> =
            spoken.into_iter().map(|(at, who)| (at, who.index(count))).collect();
        spoken.sort_unstable();
        spoken.dedup_by_key(|(at, _)| *at);
        Plant { others, spoken }
    })
}

/// The changes of the first signal: when, and whether it is silent then.
fn decided(plant: &Plant) -> Vec<(i64, bool)> {
    let device = |at: usize| (text(format!("device{at}")), None);
    let first = SignalDraft {
        name: text("s0"),
        variable: Some(text("v0")),
        hold: Some(text("true")),
        shares: vec![device(0), device(1)],
        ..SignalDraft::default()
    };
    let other = |(at, (timeout_ms, of)): (usize, &(i64, usize))| SignalDraft {
        name: text(format!("s{}", at + 1)),
        variable: Some(text(format!("v{}", at + 1))),
        timeout: Some(text(format!("{timeout_ms} ms"))),
        shares: vec![device(*of)],
        ..SignalDraft::default()
    };
    let mut driven = Driven::new(knowledge(&Draft {
        variables: (0..=plant.others.len()).map(|at| variable(format!("v{at}"))).collect(),
        signals: std::iter::once(first).chain(plant.others.iter().enumerate().map(other)).collect(),
        ..Draft::default()
    }));
    for (at, who) in &plant.spoken {
        let now = Time(MS * at);
        driven.pass(now);
        driven.give(*who, (now, now), 1.0);
        driven.tick(now);
    }
    driven.pass(Time(2 * END_MS * MS));
    let events = driven.outputs().filter_map(|output| match output {
        Output::Event(event) if event.signal == Some(SignalId::from_index(0)) => Some(event),
        _ => None,
    });
    events.map(|event| (event.time.0 / MS, event.kind == EventKind::Silent)).collect()
}

/// When the first signal falls silent, by the definition, looked at each millisecond from the first value of anybody on.
fn expected(plant: &Plant) -> Option<i64> {
    let devices: BTreeSet<usize> = plant.others.iter().map(|(_, of)| *of).filter(|of| *of < 2).collect();
    let mut last: Vec<i64> = vec![plant.spoken[0].0; plant.others.len() + 1];
    let mut spoken = plant.spoken.iter().peekable();
    for now in plant.spoken[0].0..2 * END_MS {
        let is_dead = |device: &usize| {
            let of = || plant.others.iter().enumerate().filter(|(_, (_, of))| of == device);
            let heard = of().map(|(at, _)| last[at + 1]).max().unwrap_or(0).max(last[0]);
            of().map(|(_, (timeout, _))| *timeout).max().is_some_and(|timeout| now > heard + timeout)
        };
        if devices.iter().any(is_dead) {
            return Some(now - 1);
        }
        if let Some((_, who)) = spoken.next_if(|(at, _)| *at == now) {
            last[*who] = now;
        }
    }
    None
}

proptest! {
    /// The first silence: one that comes again within the probation is no news.
    #[test]
    fn what_stands_is_silent_with_its_device(plant in plants()) {
        let found = decided(&plant).into_iter().find(|(_, is_silent)| *is_silent).map(|(at, _)| at);
        prop_assert_eq!(found, expected(&plant));
    }
}
