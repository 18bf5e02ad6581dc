//! Relations of two signals: equal, linear, polynomial, rates and integrals, with or without a delay of the target.

use crate::learning::form::{Design, fit};
use crate::learning::shape::{Relation, Shape};
use crate::learning::lag::{lag_between, smoothed};
use crate::learning::signal::Seen;
use crate::learning::{BEATS_TIME, MOST_UNEXPLAINED, WORTH};
use shsa_core::unit::Dimension;

/// Windows of rates and means in periods of the slower signal, and the longest window as a share of the recording.
const WINDOWS: [f64; 7] = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0];
const LONGEST_WINDOW: f64 = 0.1;

/// The relative error of the factor of an integral whose units are known; a correct factor is 1.
const OFF_UNITY: f64 = 0.04;

/// The share of the error of a parabola in time that an integral may leave at most: the integral of any positive signal grows
/// with time.
const INTEGRAL_BEATS_TIME: f64 = 0.8;

/// The relative error of that factor beside a parabola in time.
const OFF_BESIDE_TIME: f64 = 0.25;

/// The best relation of each pair of some signals.
pub(crate) fn all(seen: &Seen<'_>, signals: &[usize]) -> Vec<Relation> {
    let later = |(at, one): (usize, &usize)| {
        signals[at + 1..].iter().filter_map(|other| of(seen, *one, *other)).collect::<Vec<Relation>>()
    };
    signals.iter().enumerate().flat_map(later).collect()
}

/// The best relation of two signals, if there is any.
pub(crate) fn of(seen: &Seen<'_>, one: usize, other: usize) -> Option<Relation> {
    let mut best: Option<Relation> = None;
    for (target, inputs, shape) in shapes(seen, one, other) {
        let Some(found) = fit(seen, target, &inputs, &shape).filter(|found| holds(seen, found)) else {
            continue;
        };
        let is_worth = |best: &Relation| found.score.all() < needed(best, &found) * best.score.all();
        if best.as_ref().is_none_or(is_worth) {
            best = Some(found);
        }
    }
    best
}

/// The share of the error of an earlier, simpler form that a form may leave; an equally simple form only has to be better.
fn needed(best: &Relation, found: &Relation) -> f64 {
    let is_turned = best.numbers.len() == found.numbers.len() && best.shape != found.shape
        || std::mem::discriminant(&best.shape) == std::mem::discriminant(&found.shape)
            && best.target != found.target;
    if is_turned { 1.0 } else { WORTH }
}

/// Whether a relation leaves little unexplained, and less than time alone.
fn holds(seen: &Seen<'_>, found: &Relation) -> bool {
    if found.score.worst() > MOST_UNEXPLAINED {
        return false;
    }
    let design = Design::new(seen, found.target, &found.inputs, &found.shape);
    let left = design.left(&found.shape, &found.numbers) / design.left_by_time();
    match (&found.shape, is_unity(seen, found)) {
        (Shape::Integral, Some(false)) => false,
        (Shape::Integral, Some(true)) => left < INTEGRAL_BEATS_TIME || bends_alike(&design, found.numbers[0]),
        _ => left < BEATS_TIME,
    }
}

/// Whether the factor is 1 in matching units; `None` where the units are unknown.
fn is_unity(seen: &Seen<'_>, found: &Relation) -> Option<bool> {
    seen.dimension(found.target).and(seen.dimension(found.inputs[0]))?;
    Some((found.numbers[0] - 1.0).abs() < OFF_UNITY)
}

/// Whether the factor is the same beside a parabola in time, in both halves: then the integral follows the input beyond its
/// growth with time, whatever slower noise there is.
fn bends_alike(design: &Design, factor: f64) -> bool {
    let beside = design.factors_beside_time();
    beside.is_some_and(|halves| halves.iter().all(|half| (half / factor - 1.0).abs() < OFF_BESIDE_TIME))
}

/// The forms that two signals may have, simple ones first.
fn shapes(seen: &Seen<'_>, one: usize, other: usize) -> Vec<(usize, Vec<usize>, Shape)> {
    let both = [(one, other), (other, one)];
    let mut shapes = Vec::new();
    let mut add = |target: usize, input: usize, shape: Shape| shapes.push((target, vec![input], shape));
    if seen.is_addable(one, other) {
        add(one, other, Shape::Equal { lag_s: 0.0 });
        let lag = lag_between(seen, one, other);
        let lagged = |lag: f64| if lag > 0.0 { (one, other, lag) } else { (other, one, -lag) };
        if let Some((target, input, lag_s)) = lag.map(lagged) {
            add(target, input, Shape::Equal { lag_s });
        }
        both.iter().for_each(|(target, input)| add(*target, *input, Shape::Line { lag_s: 0.0 }));
        if let Some((target, input, lag_s)) = lag.map(lagged) {
            add(target, input, Shape::Line { lag_s });
        }
        both.iter().for_each(|(target, input)| add(*target, *input, Shape::Saturated));
        for (target, input) in both {
            let smoothed = smoothed(seen, target, input);
            smoothed.into_iter().flatten().for_each(|shape| add(target, input, shape));
        }
    } else {
        both.iter().for_each(|(target, input)| add(*target, *input, Shape::Line { lag_s: 0.0 }));
    }
    for degree in [2, 3] {
        both.iter().for_each(|(target, input)| add(*target, *input, Shape::Polynomial(degree)));
    }
    let longest = LONGEST_WINDOW * seen.duration_s;
    let period = seen.period_s(one).max(seen.period_s(other));
    for (target, input) in both.into_iter().filter(|(target, input)| is_rate(seen, *target, *input)) {
        let windows = WINDOWS.iter().map(|periods| periods * period).filter(|it| *it <= longest);
        windows.for_each(|window_s| add(target, input, Shape::Rate { window_s }));
        add(input, target, Shape::Integral);
    }
    shapes
}

/// Whether the target may be the rate of the input.
fn is_rate(seen: &Seen<'_>, target: usize, input: usize) -> bool {
    match (seen.dimension(target), seen.dimension(input)) {
        (Some(target), Some(input)) => input.over(Dimension::TIME) == Some(target),
        _ => true,
    }
}
