//! A sample of the worlds, with what holds of them today. `workshop/measured/worlds.md` says what does not.

use super::faulty::{self, Liars};
use super::kinds::{KINDS, kind, world};
use super::watch::{Watched, Wrong};
use super::{report, sound};

/// Kinds of which sound signals are accused today.
const NOT_YET: [&str; 1] = ["mean_over"];
/// What is not asserted of any kind today.
const NOT_ASSERTED: [Wrong; 1] = [Wrong::Unnamed];

/// Asserts that nothing is wrong with a world but what is not asserted.
#[track_caller]
fn check(name: &str, seed: u64, watched: &Watched) {
    let is_wrong = watched.findings.iter().any(|it| !NOT_ASSERTED.contains(&it.wrong));
    assert!(watched.untrue.is_none() && !is_wrong, "{name} {seed}: {:#?}", report::lines(watched));
}

/// The kinds that hold, with the numbers of some of their worlds.
fn sample(seeds: std::ops::Range<u64>) -> Vec<(&'static str, u64)> {
    let kinds = KINDS.iter().map(|it| it.name).filter(|it| !NOT_YET.contains(it));
    kinds.flat_map(|name| seeds.clone().map(move |seed| (name, seed))).collect()
}

/// Checks a sample in two threads.
fn check_all(sample: &[(&'static str, u64)], watch: impl Fn(&str, u64) + Sync) {
    let half = sample.len() / 2;
    let (first, second) = sample.split_at(half);
    std::thread::scope(|scope| {
        scope.spawn(|| first.iter().for_each(|(name, seed)| watch(name, *seed)));
        second.iter().for_each(|(name, seed)| watch(name, *seed));
    });
}

#[test]
fn nothing_is_wrong_with_sound_worlds() {
    check_all(&sample(0..6), |name, seed| {
        let watched = sound::watch(&[kind(name).unwrap()], seed).unwrap();
        assert!(
            watched.counts[0] > 0 || !watched.findings.is_empty() || watched.world.has_losses,
            "{name} {seed}"
        );
        check(name, seed, &watched);
    });
}

#[test]
fn one_liar_is_told_and_no_sound_signal_fails() {
    check_all(&sample(0..2), |name, seed| {
        if let Some(watched) = faulty::watch(&[kind(name).unwrap()], seed, Liars::One).unwrap() {
            check(name, seed, &watched);
        }
    });
}

/// The oracle can fail: a sensor that lies in a world that counts as sound is untrue.
#[test]
fn a_reading_beyond_its_declared_error_is_untrue() {
    for seed in 0..20 {
        let (world, mut chance) = world(&[kind("redundant").unwrap()], seed, 1.0);
        let mut readings = world.readings(&mut chance);
        assert_eq!(world.untrue(&readings), None);
        let middle = readings.len() / 2;
        let signal = &world.signals[readings[middle].signal];
        let far = world.meant(signal, readings[middle].values[0]) + 1.1 * (signal.error.1 - signal.error.0);
        readings[middle].values[0] = world.raw(signal, far);
        assert!(world.untrue(&readings).is_some(), "{seed}");
    }
}

#[test]
fn the_document_lists_every_kind() {
    let document = include_str!("../../../measured/worlds.md");
    for it in KINDS {
        let row = format!("| `{}` | {} |", it.name, it.about);
        assert!(document.contains(&row), "{row}");
    }
}

#[test]
fn a_world_is_always_the_same() {
    for it in KINDS {
        let texts = [0, 1].map(|_| {
            let (world, mut chance) = world(&[it], 7, 1.0);
            let readings = world.readings(&mut chance);
            (world.model(super::written::Names::Plain, super::written::Order::Written), readings)
        });
        assert_eq!(texts[0], texts[1], "{}", it.name);
    }
}
