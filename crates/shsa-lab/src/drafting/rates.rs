//! Quantities that are likely to be the rates of others: by their units, and as far as a noisy recording shows it.

use super::{Column, Group};
use crate::curve::Curve;
use crate::learning::{Relation, Score, Shape, solve};
use crate::order::variance;
use shsa_core::unit::Dimension;

/// Windows in periods of the slower column, and the longest one as a share of the recording.
const WINDOWS: [f64; 9] = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0, 256.0];
const LONGEST: f64 = 0.1;

/// The most moments at which two columns are compared, and the least.
const MOMENTS: usize = 1_000;
const LEAST_MOMENTS: usize = 30;

/// The share of the target's spread that may stay unexplained in either half: noise of a rate is large.
const FAIR: f64 = 0.4;

/// How far from 1 the factor between the target and the rate in one unit may be, to either side.
const LEAST_FACTOR: f64 = 0.6;

/// The rates among the first columns of groups, of those in no known relation: pairs whose units say so, with a factor near to 1 or
/// to -1.
///
/// Time: O(pairs of such units), with bounded moments each.
pub(super) fn of(columns: &[Column], groups: &[Group], known: &[Relation]) -> Vec<Relation> {
    let first: Vec<usize> = groups.iter().map(|group| group.members[0].column).collect();
    let dimension = |column: usize| columns[column].signal.unit.as_ref().map(|unit| unit.dimension);
    let is_rate = |target: usize, input: usize| {
        let rate = dimension(input).and_then(|it| it.over(Dimension::TIME));
        rate.is_some() && rate == dimension(target)
    };
    let is_known = |target: &&usize| known.iter().any(|it| it.signals().contains(target));
    let mut found = Vec::new();
    for &target in first.iter().filter(|it| !is_known(it)) {
        for &input in first.iter().filter(|it| is_rate(target, **it)) {
            found.extend(rate(columns, target, input));
        }
    }
    found
}

/// The rate over the window that leaves least of the target, if any leaves little enough.
fn rate(columns: &[Column], target: usize, input: usize) -> Option<Relation> {
    let [own, other] = [target, input].map(|column| Curve::new(in_si(&columns[column])));
    let period_s = own.period_s().max(other.period_s());
    let times = if own.period_s() >= other.period_s() { own.times() } else { other.times() };
    let lasts_s = times.last()? - times.first()?;
    let windows = WINDOWS.iter().map(|periods| periods * period_s).filter(|it| *it <= LONGEST * lasts_s);
    let over = |window_s: f64| {
        let at = |time: &f64| {
            let rate = (other.read(*time)?.0 - other.read(time - window_s)?.0) / window_s;
            Some((own.at(time - window_s, *time)?, rate))
        };
        let every = times.len().div_ceil(MOMENTS).max(1);
        let pairs: Vec<(f64, f64)> = times.iter().step_by(every).filter_map(at).collect();
        let (numbers, score) = fitted(&pairs)?;
        let (inputs, shape) = (vec![input], Shape::Rate { window_s });
        Some(Relation { target, inputs, shape, numbers, window_s: None, score })
    };
    let best = windows
        .filter_map(over)
        .min_by(|one, other| one.score.worst().total_cmp(&other.score.worst()))
        .filter(|it| it.score.worst() <= FAIR)?;
    let factor = best.numbers.first()?.abs();
    (LEAST_FACTOR..=1.0 / LEAST_FACTOR).contains(&factor).then_some(best)
}

/// The values in SI units from the zero of the unit.
fn in_si(column: &Column) -> Vec<(f64, f64)> {
    let scale = column.signal.unit.as_ref().map_or(1.0, |unit| unit.scale);
    column.signal.points.iter().map(|(time, value)| (*time, value * scale)).collect()
}

/// The factor and the offset of pairs of a target and a rate, by the first half, with the shares of the target that are left in either
/// half beside an offset of its own.
fn fitted(pairs: &[(f64, f64)]) -> Option<(Vec<f64>, Score)> {
    let half = pairs.len() / 2;
    if half < LEAST_MOMENTS {
        return None;
    }
    let target: Vec<f64> = pairs.iter().map(|it| it.0).collect();
    let columns = [pairs.iter().map(|it| it.1).collect(), vec![1.0; pairs.len()]];
    let numbers = solve(&columns, &target, |row| row < half)?;
    let factor = *numbers.first()?;
    let share = |part: &[(f64, f64)]| {
        let left: Vec<f64> = part.iter().map(|it| it.0 - factor * it.1).collect();
        let own: Vec<f64> = part.iter().map(|it| it.0).collect();
        (variance(&left) / variance(&own)).sqrt()
    };
    let (early, late) = pairs.split_at(half);
    let unseen = share(late);
    Some((numbers, Score { fitted: share(early), chosen: unseen, unseen }))
}
