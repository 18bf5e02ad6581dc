//! Columns that measure the same quantity.

use super::column::{Column, Facts};
use super::{Because, Group, Member};
use crate::curve::Curve;
use crate::learning::{Relation, Shape, between};
use crate::order::{median, quantile, sorted, winsorised};

/// The most that two columns of one kind may differ, as a share of the spread of the one that moves less; by their names alone they
/// are likely to measure the same.
const FAIR: f64 = 0.4;

/// The share of their spread beside a parabola in time that they may differ by at most: two that drift are not the same.
const BEATS_TIME: f64 = 0.75;

/// The share of the differences that a delay leaves at most, to be worth its name.
const WORTH: f64 = 0.75;

/// The most moments at which two columns are compared.
const MOMENTS: usize = 4_000;

/// The least letters of a name that says what is measured.
const LETTERS: usize = 3;

/// The groups of some columns, each column in one of them; those of equal content by relations, then those of one kind that are
/// nearly equal. `joints` are times between sessions.
pub(super) fn of(
    columns: &[Column],
    joints: &[f64],
    facts: &[Option<Facts>],
    own: &[usize],
    equal: &[Relation],
) -> Vec<Group> {
    let mut parts = Parts { of: (0..columns.len()).collect() };
    let curves: Vec<Curve> =
        columns.iter().map(|it| Curve::of_sessions(it.signal.points.clone(), joints)).collect();
    let measured = Measured { columns, joints, facts, curves: &curves };
    for relation in equal.iter().filter(|it| matches!(it.shape, Shape::Equal { .. })) {
        parts.join(relation.target, relation.inputs[0]);
    }
    for (at, &one) in own.iter().enumerate() {
        for &other in &own[at + 1..] {
            if parts.of[one] != parts.of[other] && measured.is_one_kind(one, other) {
                parts.join(one, other);
            }
        }
    }
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for &column in own {
        match groups.iter_mut().find(|group| parts.of[group[0]] == parts.of[column]) {
            Some(group) => group.push(column),
            None => groups.push(vec![column]),
        }
    }
    groups.into_iter().map(|members| measured.group(members)).collect()
}

/// The group of each column, by one of its columns.
struct Parts {
    of: Vec<usize>,
}

impl Parts {
    fn join(&mut self, one: usize, other: usize) {
        let (kept, gone) = (self.of[one].min(self.of[other]), self.of[one].max(self.of[other]));
        self.of.iter_mut().filter(|it| **it == gone).for_each(|it| *it = kept);
    }
}

/// The columns with what is known of them, and their values as curves.
struct Measured<'a> {
    columns: &'a [Column],
    joints: &'a [f64],
    facts: &'a [Option<Facts>],
    curves: &'a [Curve],
}

impl Measured<'_> {
    /// Whether two columns have one kind and one dimension, and nearly the same values but for an offset.
    fn is_one_kind(&self, one: usize, other: usize) -> bool {
        let (first, second) = (&self.columns[one], &self.columns[other]);
        let says_something = first.kind.chars().filter(|it| it.is_alphabetic()).count() >= LETTERS;
        let dimension = |of: &Column| of.signal.unit.as_ref().map(|unit| unit.dimension);
        let same_unit = dimension(first) == dimension(second);
        let is_choice =
            [one, other].iter().any(|it| self.facts[*it].as_ref().is_none_or(|it| it.levels.is_some()));
        if first.kind != second.kind || !says_something || !same_unit || is_choice || first.turn.is_some() {
            return false;
        }
        let pairs = self.together(one, other, 0.0);
        if pairs.len() < 30 {
            return false;
        }
        let spread = |values: &dyn Fn(&(f64, f64)) -> f64, of: &[(f64, f64)]| {
            winsorised(&of.iter().map(values).collect::<Vec<f64>>()).sqrt()
        };
        let apart = |of: &[(f64, f64)]| spread(&|it| it.0 - it.1, of);
        let moves = |of: &[(f64, f64)]| [spread(&|it| it.0, of), spread(&|it| it.1, of)];
        let [one_moves, other_moves] = moves(&pairs);
        let least = one_moves.min(other_moves).min(beside_time(&pairs) * BEATS_TIME / FAIR);
        let (early, late) = pairs.split_at(pairs.len() / 2);
        let holds = |half: &[(f64, f64)]| {
            let [one, other] = moves(half);
            apart(half) <= FAIR * one.max(other)
        };
        apart(&pairs) <= FAIR * least && holds(early) && holds(late)
    }

    /// The values of two signals at the moments of the slower one, in SI units; the second one earlier by a delay.
    fn together(&self, one: usize, other: usize, delay_s: f64) -> Vec<(f64, f64)> {
        let si = |column: usize, value: f64| match &self.columns[column].signal.unit {
            Some(unit) => unit.to_si(value),
            None => value,
        };
        let curves = [one, other].map(|it| &self.curves[it]);
        let by_one = curves[0].period_s() >= curves[1].period_s();
        let shift = if by_one { 0.0 } else { delay_s };
        let times = curves[usize::from(!by_one)].times();
        let every = times.len().div_ceil(MOMENTS).max(1);
        let at = |time: &f64| {
            let time = time + shift;
            Some((si(one, curves[0].read(time)?.0), si(other, curves[1].read(time - delay_s)?.0)))
        };
        times.iter().step_by(every).filter_map(at).collect()
    }

    /// A group with its members compared with one that none of them is ahead of.
    fn group(&self, mut members: Vec<usize>) -> Group {
        let period = |column: usize| self.facts[column].as_ref().map_or(f64::INFINITY, |it| it.period_s);
        members.sort_by(|one, other| period(*one).total_cmp(&period(*other)).then(one.cmp(other)));
        let mut first = members[0];
        let lags = members[1..].iter().map(|it| (self.delay(*it, first).0, *it));
        let earliest = lags.min_by(|one, other| one.0.total_cmp(&other.0));
        if let Some((_, column)) = earliest.filter(|it| it.0 < -period(it.1)) {
            first = column;
        }
        let mut found = vec![Member {
            column: first,
            delay_s: 0.0,
            offset: 0.0,
            apart: 0.0,
            share: 0.0,
            because: Because::First,
        }];
        members.retain(|it| *it != first);
        members.sort_unstable();
        found.extend(members.into_iter().map(|column| self.member(column, first)));
        Group { members: found }
    }

    /// The delay of a column after another, where a relation shows one, and whether a relation shows that both are equal.
    fn delay(&self, column: usize, first: usize) -> (f64, bool) {
        let signals = [column, first].map(|it| self.columns[it].signal.clone());
        let Some(found) = between(&signals, self.joints) else { return (0.0, false) };
        match found.shape {
            Shape::Equal { lag_s } if found.target == 0 => (lag_s, true),
            Shape::Equal { lag_s } => (-lag_s, true),
            _ => (0.0, false),
        }
    }

    fn member(&self, column: usize, first: usize) -> Member {
        let (delay_s, is_equal) = self.delay(column, first);
        let differs = |delay_s: f64| {
            let pairs = self.together(column, first, delay_s);
            winsorised(&pairs.iter().map(|it| it.0 - it.1).collect::<Vec<f64>>())
        };
        let is_later = delay_s > 0.0 && differs(delay_s) < WORTH.powi(2) * differs(0.0);
        let delay_s = if is_later { delay_s } else { 0.0 };
        let pairs = self.together(column, first, delay_s);
        let scale = self.columns[column].signal.unit.as_ref().map_or(1.0, |unit| unit.scale);
        let offset = median(pairs.iter().map(|it| it.0 - it.1));
        let apart = sorted(pairs.iter().map(|it| (it.0 - it.1 - offset).abs()));
        let moves = winsorised(&pairs.iter().map(|it| it.1).collect::<Vec<f64>>()).sqrt();
        let differs = winsorised(&pairs.iter().map(|it| it.0 - it.1).collect::<Vec<f64>>()).sqrt();
        Member {
            column,
            delay_s,
            offset: offset / scale,
            apart: quantile(&apart, 0.95).unwrap_or(0.0) / scale,
            share: if moves > 0.0 { differs / moves } else { 0.0 },
            because: if is_equal { Because::Equal } else { Because::Named },
        }
    }
}

/// The smaller spread of two beside a parabola in time.
fn beside_time(pairs: &[(f64, f64)]) -> f64 {
    let share = |row: usize| row as f64 / pairs.len() as f64;
    let columns = [0, 1, 2].map(|power| (0..pairs.len()).map(|row| share(row).powi(power)).collect());
    let left = |target: Vec<f64>| {
        let Some(numbers) = crate::learning::solve(&columns, &target, |_| true) else { return f64::INFINITY };
        let predicted = |row: usize| (0..3).map(|it| numbers[it] * columns[it][row]).sum::<f64>();
        let left: Vec<f64> = target.iter().enumerate().map(|(row, value)| value - predicted(row)).collect();
        winsorised(&left).sqrt()
    };
    left(pairs.iter().map(|it| it.0).collect()).min(left(pairs.iter().map(|it| it.1).collect()))
}

#[cfg(test)]
mod tests {
    use crate::drafting::Column;
    use crate::drafting::draft;
    use crate::learning::Signal;
    use shsa_core::unit::Unit;

    /// A temperature that two sensors measure, each with noise of its own, written in a unit.
    fn column(unit: &str, seed: u32, offset_k: f64) -> Column {
        let unit = Unit::parse(unit).unwrap();
        let noise = |at: u32| (f64::from(at * seed).sin() * 43_758.547).fract();
        let kelvin = |at: u32| 295.0 + 8.0 * (f64::from(at) / 60.0).sin() + 0.1 * noise(at) + offset_k;
        let points = (0..800).map(|at| (f64::from(at), unit.from_si(kelvin(at)))).collect();
        let signal = Signal { name: format!("temperature_{seed}"), unit: Some(unit), points };
        Column { signal, breaks: Vec::new(), kind: "temperature".to_owned(), turn: None }
    }

    #[test]
    fn members_of_a_group_are_apart_by_what_they_differ_by_in_any_units() {
        const UNITS: [&str; 4] = ["K", "degC", "degF", "mK"];
        for (at, (one, other)) in UNITS.iter().flat_map(|one| UNITS.map(|other| (one, other))).enumerate() {
            let offset_k = f64::from(at as u32) / 8.0 - 1.0;
            let columns = [column(one, 1, 0.0), column(other, 7_919, offset_k)];
            let drafted = draft(&columns, &[], &()).unwrap();
            let scale = columns[1].signal.unit.as_ref().unwrap().scale;
            assert_eq!(drafted.groups.len(), 1, "{one} {other}: {:?}", drafted.groups);
            let members = &drafted.groups[0].members;
            assert_eq!((members[0].column, members[1].column), (0, 1));
            assert!((members[1].offset * scale - offset_k).abs() < 0.05, "{one} {other}: {members:?}");
            assert!(members[1].apart * scale < 0.3, "{one} {other}: {members:?}");
        }
    }
}
