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

/// The parts into which a signal is divided for a first curve, and the places at which a point of a curve is tried.
const PARTS: usize = 8;
const PLACES: usize = 16;

/// The most points of a curve, and the share of the error without it that a further point leaves at most.
const MOST_POINTS: usize = 9;
const BETTER: f64 = 0.93;

/// The least distance of two points, as a share of the width.
const APART: f64 = 0.01;

/// The best curve of a target over another signal with the load of a third one.
/// Time: O(signals^2 * moments), and more for each two signals that promise.
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
        let arguments = parts(rows.value(input));
        let mut columns = columns(&arguments, rows.value(input));
        let curve: Vec<usize> = (0..columns.len()).collect();
        let alone = rows.left(&columns, &curve);
        for &load in others.iter().filter(|it| **it != input && !is_same(**it, input)) {
            columns.push(rows.value(load).to_vec());
            let left = rows.left(&columns, &(0..columns.len()).collect::<Vec<_>>());
            columns.pop();
            if left < PROMISING && left < NEEDED * alone {
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
    let shape = Shape::Table(arguments);
    let found = fit(seen, target, &inputs, &shape).filter(|it| it.score.worst() <= MOST_UNEXPLAINED)?;
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

/// The arguments of the points of a curve under a load: the ends, and one after the other that which leaves least, as long as it is
/// worth it; `None` where a line is enough.
fn arguments(rows: &Rows, values: &[f64], load: &[f64]) -> Option<Vec<f64>> {
    let left = |arguments: &[f64]| {
        let mut columns = columns(arguments, values);
        columns.push(load.to_vec());
        rows.left(&columns, &(0..columns.len()).collect::<Vec<_>>())
    };
    let sorted = sorted(values.iter().copied());
    let mut chosen = vec![*sorted.first()?, *sorted.last()?];
    let width = chosen[1] - chosen[0];
    let even = (1..PLACES).map(|place| chosen[0] + width * place as f64 / PLACES as f64);
    let often = (1..PLACES).filter_map(|place| quantile(&sorted, place as f64 / PLACES as f64));
    let places: Vec<f64> = even.chain(often).collect();
    let mut least = left(&chosen);
    while chosen.len() < MOST_POINTS {
        let is_apart = |place: &&f64| chosen.iter().all(|it| (it - **place).abs() > APART * width);
        let with = |place: &f64| {
            let mut with: Vec<f64> = chosen.iter().copied().chain([*place]).collect();
            with.sort_by(f64::total_cmp);
            (left(&with), with)
        };
        let tried = places.iter().filter(is_apart).map(with);
        let best = tried.min_by(|one, other| one.0.total_cmp(&other.0));
        let Some((left, with)) = best.filter(|it| it.0 < BETTER * least) else { break };
        (least, chosen) = (left, with);
    }
    (chosen.len() > 2).then_some(chosen)
}

/// The ends of parts with equally many values.
fn parts(values: &[f64]) -> Vec<f64> {
    let sorted = sorted(values.iter().copied());
    let ends = (0..=PARTS).filter_map(|part| quantile(&sorted, part as f64 / PARTS as f64));
    let mut ends: Vec<f64> = ends.collect();
    let width = ends.last().copied().unwrap_or(0.0) - ends.first().copied().unwrap_or(0.0);
    ends.dedup_by(|later, earlier| *later - *earlier <= APART * width);
    ends
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
