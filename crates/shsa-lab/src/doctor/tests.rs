//! How often faults that are planted in simulated recordings are found, and how often sound recordings give findings.

mod plant;

use super::{Diagnosis, examine};
use plant::{FAULTS, Fault, Planted, Sight};
use std::collections::BTreeMap;

fn examined(mut planted: Planted) -> (Planted, Diagnosis) {
    let found = examine(&mut planted.columns, "a test", &()).unwrap();
    (planted, found)
}

/// Whether a planted fault is among the first three findings, as whom it can be seen by lets it be told.
fn is_found(planted: &Planted, found: &Diagnosis) -> bool {
    let (from, to) = planted.stretch;
    found.findings.iter().take(3).any(|it| {
        let overlaps = it.stretches.iter().any(|it| it.0 < to && from < it.1);
        let is_told = match planted.sight {
            Sight::Two => it.is_named() && it.signals.contains(&planted.signal),
            Sight::One => it.signals.contains(&planted.signal) && it.signals.len() <= 3,
        };
        overlaps && is_told
    })
}

/// How many of the recordings with seeds from `seeds` on are told rightly, by fault and by sight; with a line for each that is not.
fn tally(seeds: std::ops::Range<u64>, fault: Option<Fault>) -> BTreeMap<String, (usize, usize)> {
    let mut tally: BTreeMap<String, (usize, usize)> = BTreeMap::new();
    for seed in seeds {
        for sight in [Sight::Two, Sight::One] {
            let Some(planted) = plant::planted(seed, sight, fault) else { continue };
            let (planted, found) = examined(planted);
            let is_right = match fault {
                Some(_) => is_found(&planted, &found),
                None => found.findings.is_empty(),
            };
            let name = fault.map_or("sound".to_owned(), |it| format!("{it:?} {sight:?}"));
            let counts = tally.entry(name.clone()).or_default();
            counts.0 += usize::from(is_right);
            counts.1 += 1;
            if !is_right {
                let told = found.findings.iter().take(3);
                let told: Vec<String> = told
                    .map(|it| {
                        format!("{:?} {:?} {:.0?} {:.1}", it.signals, it.kind, it.stretches[0], it.strength)
                    })
                    .collect();
                println!("{name} {seed}: {} in {:.0?}; told: {told:?}", planted.signal, planted.stretch);
            }
        }
    }
    tally
}

#[test]
fn planted_faults_are_found_and_sound_recordings_give_no_finding() {
    let sound = tally(0..6, None)["sound"];
    assert!(sound.0 + 1 >= sound.1, "{sound:?}");
    let mut all = (0, 0);
    for fault in FAULTS {
        for (found, of) in tally(0..1, Some(fault)).into_values() {
            all = (all.0 + found, all.1 + of);
        }
    }
    assert!(all.0 * 10 >= all.1 * 8, "{all:?}");
}

#[test]
#[ignore = "it takes minutes: the table of docs/doctor.md"]
fn table_of_planted_faults() {
    let seeds = std::env::var("SEEDS").ok().and_then(|it| it.parse().ok()).unwrap_or(40);
    let from = std::env::var("FROM").ok().and_then(|it| it.parse().ok()).unwrap_or(1_000);
    let sound = tally(from..from + seeds, None);
    println!("{sound:?}");
    for fault in FAULTS {
        println!("{:?}", tally(from..from + seeds / 2, Some(fault)));
    }
}
