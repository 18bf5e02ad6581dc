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

/// The share of the target's spread that may stay unexplained in either half: noise of a rate is large, and what else is in the target,
/// such as the slope of a road in an acceleration, is not seen.
const FAIR: f64 = 0.5;

/// How far from 1 the factor between the target and the rate in one unit may be, to either side, and how far those of the halves may be
/// from each other: of what is unrelated, two halves do not show one and the same plausible factor.
const LEAST_FACTOR: f64 = 0.6;
const ALIKE: f64 = 0.75;

/// The rates among the first columns of groups, of those in no known relation: pairs whose units say so, with a factor near to 1 or
/// to -1. `joints` are times between sessions.
///
/// Time: O(pairs of such units), with bounded moments each.
pub(super) fn of(columns: &[Column], joints: &[f64], groups: &[Group], known: &[Relation]) -> Vec<Relation> {
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
            found.extend(rate(
                [target, input].map(|column| Curve::of_sessions(in_si(&columns[column]), joints)),
                target,
                input,
            ));
        }
    }
    found
}

/// The rate over the window that leaves least of the target, if any leaves little enough.
fn rate([own, other]: [Curve; 2], target: usize, input: usize) -> Option<Relation> {
    let period_s = own.period_s().max(other.period_s());
    let times = if own.period_s() >= other.period_s() { own.times() } else { other.times() };
    let lasts_s = times.last()? - times.first()?;
    let windows = WINDOWS.iter().map(|periods| periods * period_s).filter(|it| *it <= LONGEST * lasts_s);
    let over = |window_s: f64| {
        let at = |time: &f64| {
            let rate = (other.read(*time)?.0 - other.before(*time, window_s)?) / window_s;
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
/// half beside an offset of its own; `None` where the second half has another factor.
fn fitted(pairs: &[(f64, f64)]) -> Option<(Vec<f64>, Score)> {
    let half = pairs.len() / 2;
    if half < LEAST_MOMENTS {
        return None;
    }
    let (early, late) = pairs.split_at(half);
    let numbers = line(early)?;
    let factor = *numbers.first()?;
    let ratio = line(late)?.first()? / factor;
    let share = |part: &[(f64, f64)]| {
        let left: Vec<f64> = part.iter().map(|it| it.0 - factor * it.1).collect();
        let own: Vec<f64> = part.iter().map(|it| it.0).collect();
        (variance(&left) / variance(&own)).sqrt()
    };
    let unseen = share(late);
    let score = Score { fitted: share(early), chosen: unseen, unseen };
    (ALIKE..=1.0 / ALIKE).contains(&ratio).then_some((numbers, score))
}

/// The factor and the offset of a line through pairs of a target and a rate.
fn line(pairs: &[(f64, f64)]) -> Option<Vec<f64>> {
    let target: Vec<f64> = pairs.iter().map(|it| it.0).collect();
    let columns = [pairs.iter().map(|it| it.1).collect(), vec![1.0; pairs.len()]];
    solve(&columns, &target, |_| true)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drafting::{Because, Member};
    use crate::learning::Signal;
    use shsa_core::unit::Unit;
    use std::f64::consts::TAU;

    fn column(name: &str, unit: &str, value: impl Fn(f64) -> f64) -> Column {
        let points = (0..6_000).map(|at| f64::from(at) / 100.0).map(|time| (time, value(time))).collect();
        let signal = Signal { name: name.to_owned(), unit: Some(Unit::parse(unit).unwrap()), points };
        Column { signal, breaks: Vec::new(), kind: name.to_owned(), turn: None }
    }

    fn rates_of(columns: &[Column]) -> Vec<(usize, Vec<usize>)> {
        let because = Because::First;
        let member = |column| Member { column, delay_s: 0.0, offset: 0.0, apart: 0.0, share: 0.0, because };
        let groups: Vec<Group> =
            (0..columns.len()).map(|column| Group { members: vec![member(column)] }).collect();
        of(columns, &[], &groups, &[]).into_iter().map(|it| (it.target, it.inputs)).collect()
    }

    fn speed(time: f64) -> f64 {
        15.0 + 3.0 * (TAU * time / 13.0).sin() + 2.0 * (TAU * time / 7.1).sin()
    }

    fn acceleration(time: f64) -> f64 {
        (speed(time + 1e-3) - speed(time - 1e-3)) / 2e-3
    }

    #[test]
    fn an_acceleration_is_the_rate_of_a_speed_though_the_slope_of_the_road_is_in_it() {
        let slope = |time: f64| 1.0 * (TAU * time / 23.0).sin();
        let columns = [
            column("speed", "m/s", speed),
            column("forward", "m/s^2", move |time| 0.9 * acceleration(time) + slope(time) + 0.7),
            column("sideward", "m/s^2", slope),
        ];
        assert_eq!(rates_of(&columns), [(1, vec![0])]);
    }

    #[test]
    fn halves_with_other_factors_show_no_rate() {
        let factor = |time: f64| if time < 30.0 { 0.7 } else { 1.4 };
        let columns = [
            column("speed", "m/s", speed),
            column("forward", "m/s^2", move |time| factor(time) * acceleration(time)),
        ];
        assert_eq!(rates_of(&columns), []);
    }
}
