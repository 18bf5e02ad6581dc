//! Worlds in which nothing is wrong.

use super::kinds::{Kind, world};
use super::watch::{ORIGIN, Watched, findings, known, run};
use super::written::Names;

/// Watches a sound world.
///
/// # Errors
/// The generator has written a model that is none.
pub(super) fn watch(kinds: &[&Kind], seed: u64) -> anyhow::Result<Watched> {
    let (world, mut chance) = world(kinds, seed, 1.0);
    let readings = world.readings(&mut chance);
    let untrue = world.untrue(&readings);
    let mut watched =
        Watched { world, readings, untrue, counts: [0; 3], findings: Vec::new(), faults: Vec::new() };
    if watched.untrue.is_none() {
        let run = run(&watched.world, known(&watched.world)?, &watched.readings, Names::Plain, ORIGIN);
        watched.counts[0] = run.publications.len();
        watched.findings = findings(&watched.world, &run);
    }
    Ok(watched)
}
