//! Which signal explains the checks that are violated at one time: it is in all of them, and in none that would have shown its fault
//! and does not.

use super::check::Check;
use super::stretch::Stretch;
use crate::learning::Shape;

/// Two stretches are one event where they share this part of the shorter one.
const SHARED: f64 = 0.5;

/// A check clears a signal where it leaves less than this part of what the fault would leave there, and this many deviations would be
/// left of it.
const CLEARS: f64 = 0.35;
const WOULD_SHOW: f64 = 3.0;

/// A check that is not violated still speaks against a signal where it leaves this part of what the fault would leave.
const SUPPORTS: f64 = 0.6;

/// A check that is violated in a stretch.
#[derive(Clone, Debug)]
pub(super) struct Violation {
    /// The check.
    pub(super) check: usize,
    /// Where.
    pub(super) stretch: Stretch,
    /// From when to when, in seconds.
    pub(super) from_s: f64,
    pub(super) to_s: f64,
}

/// What was wrong at one time.
#[derive(Clone, Debug)]
pub(super) struct Accused {
    /// The signals of which one explains it; one where it is known.
    pub(super) signals: Vec<usize>,
    /// The violations that it explains, the strongest first.
    pub(super) by: Vec<Violation>,
    /// Checks of these signals that hold at this time although they would show the fault.
    pub(super) cleared: Vec<usize>,
}

/// Who is accused in each event, the strongest event first. Time: O(violations^2 + events * signals * checks).
pub(super) fn all(checks: &[Check], mut violations: Vec<Violation>) -> Vec<Accused> {
    violations.sort_by(|one, other| {
        other.stretch.strength.total_cmp(&one.stretch.strength).then(one.check.cmp(&other.check))
    });
    let mut found = Vec::new();
    while let Some(first) = violations.first().cloned() {
        let (mut event, rest): (Vec<_>, Vec<_>) = violations.into_iter().partition(|it| is_one(&first, it));
        violations = rest;
        while !event.is_empty() {
            let accused = best(checks, &event);
            let explains = |it: &Violation| accused.by.iter().any(|by| by.check == it.check);
            event.retain(|it| !explains(it));
            found.push(accused);
        }
    }
    found
}

fn is_one(first: &Violation, other: &Violation) -> bool {
    let shared = first.to_s.min(other.to_s) - first.from_s.max(other.from_s);
    let shorter = (first.to_s - first.from_s).min(other.to_s - other.from_s);
    shared >= SHARED * shorter && shared >= 0.0
}

/// The signals that explain most of an event, with what they explain.
fn best(checks: &[Check], event: &[Violation]) -> Accused {
    let mut signals: Vec<usize> = event.iter().flat_map(|it| checks[it.check].relation.signals()).collect();
    signals.sort_unstable();
    signals.dedup();
    let rated: Vec<(f64, usize, Vec<usize>)> = signals
        .iter()
        .map(|signal| {
            let (value, cleared) = rate(checks, event, *signal);
            (value, *signal, cleared)
        })
        .collect();
    let most = rated.iter().map(|it| it.0).fold(f64::NEG_INFINITY, f64::max);
    let top: Vec<usize> = rated.iter().filter(|it| it.0 == most).map(|it| it.1).collect();
    // What any of the best ones explains together: the strongest violation decides which of them belong together.
    let has = |it: &Violation, signal: usize| checks[it.check].relation.signals().contains(&signal);
    let strongest = event.iter().find(|it| top.iter().any(|signal| has(it, *signal)));
    let signals: Vec<usize> =
        top.into_iter().filter(|signal| strongest.is_some_and(|it| has(it, *signal))).collect();
    let by: Vec<Violation> =
        event.iter().filter(|it| signals.iter().any(|signal| has(it, *signal))).cloned().collect();
    let others = strongest.map(|it| checks[it.check].relation.signals()).unwrap_or_default();
    let of_others = rated.iter().filter(|it| others.contains(&it.1) && !signals.contains(&it.1));
    let cleared = of_others.flat_map(|it| it.2.iter().copied()).collect();
    Accused { signals, by, cleared }
}

/// How well a signal explains an event, and the checks that speak for it.
fn rate(checks: &[Check], event: &[Violation], signal: usize) -> (f64, Vec<usize>) {
    let own = |it: &&Violation| checks[it.check].relation.signals().contains(&signal);
    let accusing: Vec<&Violation> = event.iter().filter(own).collect();
    let mut value = accusing.len() as f64;
    let size = accusing.iter().find_map(|it| {
        let factor = factor(&checks[it.check], signal)?;
        let rows = it.stretch.rows.clone();
        let offs: f64 = rows.clone().map(|row| checks[it.check].off(row).powi(2)).sum();
        Some(((offs / rows.len().max(1) as f64).sqrt() / factor, it.from_s, it.to_s))
    });
    let Some((size, from_s, to_s)) = size else { return (value, Vec::new()) };
    let mut cleared = Vec::new();
    for (at, check) in checks.iter().enumerate() {
        let is_accusing = event.iter().any(|it| it.check == at);
        let Some(factor) = factor(check, signal).filter(|_| !is_accusing) else { continue };
        let Some((would, is)) = shown(check, size * factor, from_s, to_s) else { continue };
        if would >= WOULD_SHOW && is <= CLEARS * would {
            value -= 1.0;
            cleared.push(at);
        } else if is >= SUPPORTS * would && is >= WOULD_SHOW {
            value += 0.5;
        }
    }
    (value, cleared)
}

/// How many deviations a difference of some size would leave of a check between two times, and how many it leaves.
fn shown(check: &Check, size: f64, from_s: f64, to_s: f64) -> Option<(f64, f64)> {
    let rows = check.times.partition_point(|it| *it < from_s)..check.times.partition_point(|it| *it <= to_s);
    let count = rows.len() as f64;
    if rows.is_empty() {
        return None;
    }
    let mean =
        |of: &dyn Fn(usize) -> f64| (rows.clone().map(|row| of(row).powi(2)).sum::<f64>() / count).sqrt();
    Some((mean(&|row| size / check.usual[row]), mean(&|row| check.off(row) / check.usual[row])))
}

/// How much a signal moves what a check leaves; `None` where that is not one number.
pub(super) fn factor(check: &Check, signal: usize) -> Option<f64> {
    let relation = &check.relation;
    if relation.target == signal {
        return Some(1.0);
    }
    let place = relation.inputs.iter().position(|it| *it == signal)?;
    match relation.shape {
        Shape::Equal { .. } => Some(1.0),
        Shape::Line { .. } | Shape::Sum => relation.numbers.get(place).map(|it| it.abs()),
        _ => None,
    }
    .filter(|it| *it > 0.0)
}
