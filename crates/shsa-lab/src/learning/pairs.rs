//! Relations of two signals: equal, linear, polynomial, rates and integrals, with or without a delay of the target.

use crate::learning::form::{Design, fit};
use crate::learning::lag::{lag_between, smoothed};
use crate::learning::least_squares::solve;
use crate::learning::shape::{Relation, Shape};
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

/// A target of which a parabola in time leaves no more than this share is a trend: a fitted line or curve proves nothing about it,
/// as any other trend is near to it.
pub(crate) const TRENDING: f64 = 0.1;

/// The largest power of an input.
const MOST_POWER: f64 = 4.0;

/// The relative error of that factor beside a parabola in time.
const OFF_BESIDE_TIME: f64 = 0.25;

/// Which forms are tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Forms {
    /// Equal signals, with delays; rates and integrals.
    Motion,
    /// All.
    All,
}

/// The best relation of two signals, if there is any.
pub(crate) fn of(seen: &Seen<'_>, one: usize, other: usize, forms: Forms) -> Option<Relation> {
    let mut best: Option<Relation> = None;
    for (target, inputs, shape) in shapes(seen, one, other, forms) {
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
    let by_time = design.left_by_time();
    let left = design.left(&found.shape, &found.numbers) / by_time;
    let extrapolates = || match found.shape {
        Shape::Polynomial(_) => design.left_at_ends(1) <= MOST_UNEXPLAINED,
        _ => true,
    };
    if by_time < TRENDING && is_free(found) || !extrapolates() {
        return false;
    }
    match (&found.shape, is_unity(seen, found)) {
        (Shape::Integral, Some(false)) => false,
        (Shape::Integral, Some(true)) => left < INTEGRAL_BEATS_TIME || bends_alike(&design, found.numbers[0]),
        _ => left < BEATS_TIME,
    }
}

/// Whether a relation fits a trend by its constants alone.
fn is_free(found: &Relation) -> bool {
    match &found.shape {
        Shape::Line { .. } | Shape::Mean { .. } | Shape::Follower { .. } => found.numbers != [1.0, 0.0],
        Shape::Polynomial(_) | Shape::Power(_) | Shape::Absolute | Shape::Saturated => true,
        _ => false,
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
fn shapes(seen: &Seen<'_>, one: usize, other: usize, forms: Forms) -> Vec<(usize, Vec<usize>, Shape)> {
    let both = [(one, other), (other, one)];
    let mut shapes = Vec::new();
    if seen.is_addable(one, other) {
        shapes.extend(alike(seen, one, other));
    }
    if forms == Forms::All {
        for (target, _) in both {
            shapes.push((target, Shape::Line { lag_s: 0.0 }));
            shapes.push((target, Shape::Saturated));
        }
        for (target, input) in both {
            let powers = power(seen, target, input).into_iter().flatten();
            shapes.extend(powers.map(|power| (target, Shape::Power(power))));
            shapes.push((target, Shape::Absolute));
        }
        let degrees = [2, 3].into_iter().flat_map(|degree| both.map(|(target, _)| (target, degree)));
        shapes.extend(degrees.map(|(target, degree)| (target, Shape::Polynomial(degree))));
        if seen.is_addable(one, other) {
            for (target, input) in both {
                shapes
                    .extend(smoothed(seen, target, input).into_iter().flatten().map(|shape| (target, shape)));
            }
        }
    }
    let longest = LONGEST_WINDOW * seen.duration_s;
    let period = seen.period_s(one).max(seen.period_s(other));
    for (target, input) in both.into_iter().filter(|(target, input)| is_rate(seen, *target, *input)) {
        let windows = WINDOWS.iter().map(|periods| periods * period).filter(|it| *it <= longest);
        shapes.extend(windows.map(|window_s| (target, Shape::Rate { window_s })));
        shapes.push((input, Shape::Integral));
    }
    let with_input =
        |(target, shape): (usize, Shape)| (target, vec![if target == one { other } else { one }], shape);
    shapes.into_iter().map(with_input).collect()
}

/// Equal, perhaps with a delay, or a line after a delay.
fn alike(seen: &Seen<'_>, one: usize, other: usize) -> Vec<(usize, Shape)> {
    let mut shapes = vec![(one, Shape::Equal { lag_s: 0.0 })];
    let lag = lag_between(seen, one, other);
    let lagged = lag.map(|lag| if lag > 0.0 { (one, lag) } else { (other, -lag) });
    shapes.extend(lagged.map(|(target, lag_s)| (target, Shape::Equal { lag_s })));
    shapes.extend(lagged.map(|(target, lag_s)| (target, Shape::Line { lag_s })));
    shapes
}

/// The powers of the input that are nearest to the target: the fitted one, and the nearest half; `None` where one of the two is not
/// above 0.
fn power(seen: &Seen<'_>, target: usize, input: usize) -> Option<Vec<f64>> {
    let clock = seen.slowest([target, input]);
    let pairs = clock.values[target].iter().zip(&clock.values[input]);
    let pairs: Vec<(f64, f64)> =
        pairs.filter(|it| it.0.is_finite() && it.1.is_finite()).map(|it| (*it.0, *it.1)).collect();
    let is_point = |signal: usize| seen.signals[signal].unit.as_ref().is_some_and(|unit| unit.is_affine());
    let is_positive = pairs.iter().all(|it| it.0 > 0.0 && it.1 > 0.0);
    if !is_positive || is_point(target) || is_point(input) {
        return None;
    }
    let columns = [pairs.iter().map(|it| it.1.ln()).collect(), vec![1.0; pairs.len()]];
    let logarithms: Vec<f64> = pairs.iter().map(|it| it.0.ln()).collect();
    let fitted = solve(&columns, &logarithms, |_| true)?[0];
    let nearest = (2.0 * fitted).round() / 2.0;
    let powers =
        [nearest, fitted].into_iter().filter(|it| *it != 0.0 && *it != 1.0 && it.abs() <= MOST_POWER);
    Some(powers.collect())
}

/// Whether the target may be the rate of the input.
fn is_rate(seen: &Seen<'_>, target: usize, input: usize) -> bool {
    match (seen.dimension(target), seen.dimension(input)) {
        (Some(target), Some(input)) => input.over(Dimension::TIME) == Some(target),
        _ => true,
    }
}
