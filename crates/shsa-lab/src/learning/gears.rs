//! Factors that another signal selects: gears, ranges, modes.

use crate::learning::form::{Design, fit};
use crate::learning::shape::{Relation, Shape};
use crate::learning::signal::Seen;
use crate::learning::{BEATS_TIME, MOST_UNEXPLAINED};

/// The most levels of a selecting signal, and the share of the samples that each level needs.
const MOST_LEVELS: usize = 8;
const LEAST_SHARE: f64 = 0.03;

/// The share that may stay unexplained when the samples around each change count, too.
const WITH_CHANGES: f64 = 0.12;

/// The relations `y = k_i x` in which a signal with few levels selects k.
pub(crate) fn of(seen: &Seen<'_>, signals: &[usize], chooser: usize) -> Vec<Relation> {
    let Some(levels) = levels(seen, chooser) else { return Vec::new() };
    let shape = Shape::Gears(levels);
    let others = || signals.iter().copied().filter(|it| *it != chooser);
    let mut found = Vec::new();
    for target in others() {
        for input in others().filter(|it| *it != target && seen.is_addable(*it, target)) {
            found.extend(fit(seen, target, &[input, chooser], &shape).filter(|it| holds(seen, it)));
        }
    }
    found
}

/// Whether a relation with steps leaves little, also around its changes, and less than time alone: whatever rises with time is near to
/// a multiple of anything else that does.
pub(crate) fn holds(seen: &Seen<'_>, found: &Relation) -> bool {
    if found.score.worst() > MOST_UNEXPLAINED {
        return false;
    }
    let design = Design::new(seen, found.target, &found.inputs, &found.shape);
    let by_time = design.left_by_time();
    design.left(&found.shape, &found.numbers) <= WITH_CHANGES && found.score.all() <= BEATS_TIME * by_time
}

/// The levels of a signal that has few whole ones.
pub(crate) fn levels(seen: &Seen<'_>, signal: usize) -> Option<Vec<f64>> {
    let values = seen.curves[signal].values();
    let mut levels: Vec<(f64, usize)> = Vec::new();
    for value in values {
        match levels.iter().position(|(level, _)| level == value) {
            Some(place) => levels[place].1 += 1,
            None if value.fract() == 0.0 && levels.len() < 2 * MOST_LEVELS => levels.push((*value, 1)),
            None => return None,
        }
    }
    levels.retain(|(_, count)| *count as f64 >= LEAST_SHARE * values.len() as f64);
    levels.sort_by(|one, other| one.0.total_cmp(&other.0));
    (2..=MOST_LEVELS).contains(&levels.len()).then(|| levels.into_iter().map(|(level, _)| level).collect())
}
