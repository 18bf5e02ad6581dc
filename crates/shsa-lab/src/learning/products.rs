//! Products and quotients of two signals.

use crate::learning::MOST_UNEXPLAINED;
use crate::learning::form::fit;
use crate::learning::shape::{Relation, Shape};
use crate::learning::signal::{Clock, Seen};

/// The number of moments at which candidates are tested before a fit, and the error that they may leave there.
const MOMENTS: usize = 200;
const PROMISING: f64 = 2.0 * MOST_UNEXPLAINED;

/// The products of two that a target is. Time: O(signals^2 * moments), for signals whose units match.
pub(crate) fn of(seen: &Seen<'_>, signals: &[usize], target: usize) -> Vec<Relation> {
    let mut found = Vec::new();
    for (at, &one) in signals.iter().enumerate().filter(|it| *it.1 != target) {
        for &other in signals[at + 1..].iter().filter(|it| **it != target) {
            if fits(seen, target, one, other) && promises(seen, target, one, other) {
                found.extend(turned(seen, target, one, other));
            }
        }
    }
    found
}

/// Whether the units of a product match.
fn fits(seen: &Seen<'_>, target: usize, one: usize, other: usize) -> bool {
    let is_point = |signal: usize| seen.signals[signal].unit.as_ref().is_some_and(|unit| unit.is_affine());
    if [target, one, other].into_iter().any(is_point) {
        return false;
    }
    match (seen.dimension(target), seen.dimension(one), seen.dimension(other)) {
        (Some(target), Some(one), Some(other)) => one.times(other) == Some(target),
        (target, one, other) => target.is_none() && one.is_none() && other.is_none(),
    }
}

/// Whether the product leaves little unexplained at some moments.
fn promises(seen: &Seen<'_>, target: usize, one: usize, other: usize) -> bool {
    let clock = seen.slowest([target, one, other]);
    let rows = rows(clock, target, one, other);
    let count = rows.len() as f64;
    let mean = rows.iter().map(|it| it.0).sum::<f64>() / count;
    let moves = rows.iter().map(|it| (it.0 - mean).powi(2)).sum::<f64>();
    let (together, size) =
        rows.iter().fold((0.0, 0.0), |(together, size), it| (together + it.0 * it.1, size + it.1 * it.1));
    let factor = together / size;
    let left = rows.iter().map(|it| (it.0 - factor * it.1).powi(2)).sum::<f64>();
    rows.len() >= 10 && left < PROMISING.powi(2) * moves
}

fn rows(clock: &Clock, target: usize, one: usize, other: usize) -> Vec<(f64, f64)> {
    let [target, one, other] = [target, one, other].map(|signal| &clock.values[signal]);
    let every = clock.times.len().div_ceil(MOMENTS).max(1);
    let row = |row: usize| (target[row], one[row] * other[row]);
    (0..clock.times.len())
        .step_by(every)
        .map(row)
        .filter(|(target, product)| target.is_finite() && product.is_finite())
        .collect()
}

/// The product, or one of its two quotients: the one that leaves least unexplained.
fn turned(seen: &Seen<'_>, target: usize, one: usize, other: usize) -> Option<Relation> {
    let turns =
        [(target, [one, other], [1, 1]), (one, [target, other], [1, -1]), (other, [target, one], [1, -1])];
    let fitted = turns
        .into_iter()
        .filter_map(|(target, inputs, powers)| fit(seen, target, &inputs, &Shape::Product(powers.to_vec())));
    fitted
        .filter(|it| it.score.worst() <= MOST_UNEXPLAINED)
        .min_by(|one, other| one.score.all().total_cmp(&other.score.all()))
}
