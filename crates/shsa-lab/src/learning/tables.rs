//! Characteristic curves under a load: lines between points of one signal, and a multiple of a second one.

use crate::learning::form::{Design, fit};
use crate::learning::pairs::TRENDING;
use crate::learning::rows::Rows;
use crate::learning::shape::{Relation, Shape};
use crate::learning::signal::Seen;
use crate::learning::{BEATS_TIME, MOST_UNEXPLAINED};
use crate::order::{quantile, sorted};

/// The moments at which a candidate is tested before a fit, and the share that it may leave there.
const MOMENTS: usize = 400;
const PROMISING: f64 = 1.5 * MOST_UNEXPLAINED;

/// The largest share that the curve alone may leave, for the load to be tried.
const CURVED: f64 = 0.6;

/// The share of the error of any simpler relation of the same signals that is left at most.
const NEEDED: f64 = 0.5;

/// The parts into which the width and the samples of a signal are divided: between them a curve may bend.
const PARTS: usize = 16;

/// The most points of a curve, and how much more than with the most points is left at most with the fewest that are enough.
const MOST_POINTS: usize = 9;
const ENOUGH: f64 = 1.05;

/// How much longer the way along the values of a characteristic curve is than its rise or fall, at most: a curve that turns back and
/// forth fits anything.
const DETOUR: f64 = 1.1;

/// The least distance of two points, as a share of the width.
const APART: f64 = 0.01;

/// The best curve of a target over another signal with the load of a third one.
/// Time: O(signals^2 * parts * moments), and more for each two signals that promise.
pub(crate) fn of(
    seen: &Seen<'_>,
    signals: &[usize],
    target: usize,
    is_same: &dyn Fn(usize, usize) -> bool,
) -> Option<Relation> {
    let others: Vec<usize> = signals
        .iter()
        .copied()
        .filter(|it| *it != target && !is_same(*it, target) && seen.dimension(*it).is_some())
        .collect();
    seen.dimension(target)?;
    let rows = Rows::new(seen, target, &others, MOMENTS)?;
    let mut rated: Vec<(f64, [usize; 2])> = Vec::new();
    for &input in others.iter().filter(|it| rows.scatter(**it) < CURVED) {
        let beside = rows.beside(columns(&places(rows.value(input)), rows.value(input)));
        for &load in others.iter().filter(|it| **it != input && !is_same(**it, input)) {
            let left = beside.left_with(rows.value(load));
            if left < PROMISING && left < NEEDED * beside.left() {
                rated.push((left, [input, load]));
            }
        }
    }
    rated.sort_by(|one, other| one.0.total_cmp(&other.0));
    let best = rated.into_iter().take(3).filter_map(|(_, inputs)| loaded(seen, &rows, target, inputs));
    best.min_by(|one, other| one.score.all().total_cmp(&other.score.all()))
}

/// The curve of the first input with the load of the second one, when both and the bends of the curve are needed.
fn loaded(seen: &Seen<'_>, rows: &Rows, target: usize, inputs: [usize; 2]) -> Option<Relation> {
    let [input, load] = inputs;
    let arguments = arguments(rows, rows.value(input), rows.value(load))?;
    let points = arguments.len();
    let shape = Shape::Table(arguments);
    let found = fit(seen, target, &inputs, &shape)
        .filter(|it| it.score.worst() <= MOST_UNEXPLAINED && rises_or_falls(it.numbers.get(..points)))?;
    let design = Design::new(seen, target, &inputs, &found.shape);
    let by_time = design.left_by_time();
    let says_more = by_time >= TRENDING && design.left(&found.shape, &found.numbers) <= BEATS_TIME * by_time;
    let simpler = [
        fit(seen, target, &[input], &shape),
        fit(seen, target, &[load], &Shape::Line { lag_s: 0.0 }),
        fit(seen, target, &inputs, &Shape::Terms(vec![vec![1, 0], vec![0, 1]])),
    ];
    let is_needed = simpler.into_iter().flatten().all(|it| found.score.all() < NEEDED * it.score.all());
    (says_more && is_needed).then_some(found)
}

/// Whether values rise throughout, or fall, but for small returns.
fn rises_or_falls(values: Option<&[f64]>) -> bool {
    let Some(values @ [first, .., last]) = values else { return false };
    let way: f64 = values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum();
    way <= DETOUR * (last - first).abs()
}

/// The arguments of the points of a curve under a load: the ends, and the fewest others that leave little more than the most points
/// do, of which each is the one that leaves least beside those before it; `None` where a line is enough.
fn arguments(rows: &Rows, values: &[f64], load: &[f64]) -> Option<Vec<f64>> {
    let left = |arguments: &[f64]| {
        let mut columns = columns(arguments, values);
        columns.push(load.to_vec());
        rows.left(&columns, &(0..columns.len()).collect::<Vec<_>>())
    };
    let places = places(values);
    let ends = vec![*places.first()?, *places.last()?];
    let mut curves = vec![(left(&ends), ends)];
    while curves.len() + 1 < MOST_POINTS {
        let (_, chosen) = curves.last()?;
        let with = |place: &f64| {
            let mut with: Vec<f64> = chosen.iter().copied().chain([*place]).collect();
            with.sort_by(f64::total_cmp);
            (left(&with), with)
        };
        let tried = places.iter().filter(|it| !chosen.contains(it)).map(with);
        let Some(best) = tried.min_by(|one, other| one.0.total_cmp(&other.0)) else { break };
        curves.push(best);
    }
    let least = curves.iter().map(|it| it.0).fold(f64::INFINITY, f64::min);
    let (_, fewest) = curves.into_iter().find(|it| it.0 <= ENOUGH * least)?;
    (fewest.len() > 2).then_some(fewest)
}

/// The ends of parts of one width and of parts with equally many values, in order, without those near to another one.
fn places(values: &[f64]) -> Vec<f64> {
    let sorted = sorted(values.iter().copied());
    let Some((low, high)) = sorted.first().copied().zip(sorted.last().copied()) else { return Vec::new() };
    let share = |part: usize| part as f64 / PARTS as f64;
    let even = (1..PARTS).map(|part| low + (high - low) * share(part));
    let often = (1..PARTS).filter_map(|part| quantile(&sorted, share(part)));
    let mut places: Vec<f64> = even.chain(often).collect();
    places.sort_by(f64::total_cmp);
    let apart = APART * (high - low);
    let mut last = low;
    places.retain(|place| {
        let is_apart = *place - last > apart && high - *place > apart;
        last = if is_apart { *place } else { last };
        is_apart
    });
    [low].into_iter().chain(places).chain([high]).collect()
}

/// The shares of all points but the first at each value; together with a constant, these give each curve through the points.
fn columns(arguments: &[f64], values: &[f64]) -> Vec<Vec<f64>> {
    let mut columns = vec![Vec::with_capacity(values.len()); arguments.len().saturating_sub(1)];
    for value in values {
        let shares = between(arguments, *value);
        columns.iter_mut().zip(shares.into_iter().skip(1)).for_each(|(column, share)| column.push(share));
    }
    columns
}

/// The share of each point of a curve in its value at an argument; beyond the outer points their lines go on.
pub(crate) fn between(arguments: &[f64], at: f64) -> Vec<f64> {
    let mut shares = vec![0.0; arguments.len()];
    let inner = arguments.get(1..arguments.len().saturating_sub(1)).unwrap_or_default();
    let place = inner.partition_point(|it| *it <= at);
    if let (Some(low), Some(high)) = (arguments.get(place), arguments.get(place + 1)) {
        let share = (at - low) / (high - low);
        (shares[place], shares[place + 1]) = (1.0 - share, share);
    }
    shares
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_may_return_a_little() {
        assert!(rises_or_falls(Some(&[3.1, 3.6, 3.59, 4.2])));
        assert!(rises_or_falls(Some(&[4.2, 3.6, 3.1])));
        assert!(!rises_or_falls(Some(&[-11.7, 4.7, -10.3, 2.3])));
        assert!(!rises_or_falls(Some(&[1.0])) && !rises_or_falls(None));
    }
}
