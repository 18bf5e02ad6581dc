//! One relation as a check: what it leaves at each moment, beside what it usually leaves.

use super::robust::{Fit, fit, inner_deviation, left, scale_at_once, spread};
use super::usual;
use crate::curve::Curve;
use crate::learning::{Regressors, Relation, Shape};
use crate::order::{median, quantile, sorted};
use shsa_core::unit::Dimension;

/// The most moments of a check, taken evenly, and the least.
const MOST_ROWS: usize = 6_000;
const LEAST_ROWS: usize = 60;

/// The share of the target's spread that a relation may leave: between signals of one kind by their names, between others that are equal
/// but for an offset, in proportion, and of any line.
const FAIR: f64 = 0.4;
const LITTLE: f64 = 0.25;
const OF_FACTOR: f64 = 0.12;
const OF_LINE: f64 = 0.05;

/// Factors of one size differ by no more than this share.
const ALIKE: f64 = 0.1;

/// A factor this near to 1 is 1.
pub(super) const ONE: f64 = 0.03;

/// The share of the target's changes that a relation may leave, over the best of some windows (parts of the recording): what only
/// drifts alike leaves its changes.
const OF_CHANGES: f64 = 0.5;
const WINDOWS: [usize; 3] = [20, 60, 200];

/// The parts of the time in most of which a relation must hold, and the multiple of its scale that it may leave in these.
pub(super) const PARTS: usize = 12;
const MOST_PARTS: f64 = 0.6;
const IN_PART: f64 = 3.0;

/// The share of a step of rounding that is usual at least.
const ROUNDED: f64 = 0.3;

/// The signals of a recording as curves, with what is known of each.
#[derive(Debug)]
pub(super) struct Data {
    /// The values, in SI units from the zeros of the signals' own units.
    pub(super) curves: Vec<Curve>,
    /// The longest time between two values over which a value is known, in seconds.
    pub(super) gaps_s: Vec<f64>,
    /// The step of rounding, in the units of the curves.
    pub(super) steps: Vec<f64>,
    /// A whole turn in the units of the curves, for angles that go round.
    pub(super) turns: Vec<Option<f64>>,
    /// The name without numbers.
    pub(super) kinds: Vec<String>,
    /// The dimension of each; `None` where it is unknown.
    pub(super) dimensions: Vec<Option<Dimension>>,
    /// Where sessions meet.
    pub(super) joints: Vec<f64>,
    /// Stretches of each signal that are no evidence, in seconds.
    pub(super) masks: Vec<Vec<(f64, f64)>>,
}

impl Data {
    /// The value of a signal at a time; `None` where it is silent.
    fn value(&self, signal: usize, time: f64) -> Option<f64> {
        let curve = &self.curves[signal];
        curve.gap_s(time).filter(|gap| *gap <= self.gaps_s[signal])?;
        curve.read(time).map(|it| it.0)
    }

    fn is_masked(&self, relation: &Relation, time: f64, window_s: f64) -> bool {
        let is_in = |it: &(f64, f64)| it.0 <= time && time - window_s <= it.1;
        relation.signals().iter().any(|signal| self.masks[*signal].iter().any(is_in))
    }
}

/// A relation with what it leaves.
#[derive(Clone, Debug)]
pub(super) struct Check {
    /// The relation, with robustly fitted constants.
    pub(super) relation: Relation,
    /// The moments in seconds.
    pub(super) times: Vec<f64>,
    /// The target, in the unit of its curve.
    pub(super) target: Vec<f64>,
    /// What the inputs say of it.
    pub(super) predicted: Vec<f64>,
    /// What the difference usually is, as a deviation, by how fast both move and how far out both are.
    pub(super) usual: Vec<f64>,
    /// The deviation of the difference.
    pub(super) scale: f64,
    /// The scale as a share of the target's spread.
    pub(super) share: f64,
    /// Whether it compares two signals of one kind by their names.
    pub(super) is_one_kind: bool,
}

/// The window over which a form looks back, in seconds.
pub(super) fn window_s(shape: &Shape) -> f64 {
    match shape {
        Shape::Rate { window_s } | Shape::Mean { window_s } => *window_s,
        _ => 0.0,
    }
}

/// The moments of a form with the target and its terms.
struct Rows {
    times: Vec<f64>,
    target: Vec<f64>,
    fixed: Vec<f64>,
    columns: Vec<Vec<f64>>,
}

impl Rows {
    fn of(data: &Data, relation: &Relation, most: usize) -> Rows {
        let mut rows = Rows { times: vec![], target: vec![], fixed: vec![], columns: vec![] };
        let regressors = Regressors::new(&data.curves, &relation.inputs, &relation.shape);
        let slowest = relation.signals().into_iter().max_by(|one, other| {
            let period = |it: &usize| data.curves[*it].period_s();
            period(one)
                .total_cmp(&period(other))
                .then((*one == relation.target).cmp(&(*other == relation.target)))
        });
        let times = data.curves[slowest.unwrap_or(relation.target)].times();
        let every = times.len().div_ceil(most).max(1);
        for &time in times.iter().step_by(every) {
            let target = match relation.shape {
                Shape::Rate { window_s } => data.curves[relation.target].at(time - window_s, time),
                _ => data.value(relation.target, time),
            };
            let is_known = relation.inputs.iter().all(|it| data.value(*it, time).is_some());
            let terms = regressors.at(time, |signal| data.value(signal, time)).filter(|_| is_known);
            let (Some(target), Some((fixed, terms))) = (target, terms) else { continue };
            if !(target.is_finite() && fixed.is_finite() && terms.iter().all(|it| it.is_finite())) {
                continue;
            }
            rows.times.push(time);
            rows.target.push(target);
            rows.fixed.push(fixed);
            rows.columns.resize_with(terms.len(), Vec::new);
            rows.columns.iter_mut().zip(terms).for_each(|(column, it)| column.push(it));
        }
        rows
    }

    fn fit(&self, data: &Data, relation: &Relation) -> Option<Fit> {
        let window_s = window_s(&relation.shape);
        let used: Vec<bool> =
            self.times.iter().map(|time| !data.is_masked(relation, *time, window_s)).collect();
        let rest: Vec<f64> =
            self.target.iter().zip(&self.fixed).map(|(target, fixed)| target - fixed).collect();
        let turn = data.turns[relation.target]
            .filter(|_| relation.inputs.iter().all(|it| data.turns[*it].is_some()));
        let rest: Vec<f64> = match turn {
            Some(turn) if matches!(relation.shape, Shape::Equal { .. }) => {
                rest.iter().map(|it| shortest(*it, turn)).collect()
            }
            _ => rest,
        };
        fit(&self.columns, &rest, &|row| used[row])
    }
}

/// An angle the shorter way round.
fn shortest(angle: f64, turn: f64) -> f64 {
    angle - turn * (angle / turn).round()
}

/// The scale that a form leaves of few moments, for the choice of a delay; infinite where it cannot be fitted.
pub(super) fn scale_of_few(data: &Data, relation: &Relation) -> f64 {
    const FEW: usize = 300;
    let rows = Rows::of(data, relation, FEW);
    let rest: Vec<f64> = rows.target.iter().zip(&rows.fixed).map(|(target, fixed)| target - fixed).collect();
    scale_at_once(&rows.columns, &rest)
}

impl Check {
    /// The check of a relation, if the relation holds most of the time. Time: O(rows log rows).
    pub(super) fn of(data: &Data, mut relation: Relation) -> Option<Check> {
        let rows = Rows::of(data, &relation, MOST_ROWS);
        if rows.times.len() < LEAST_ROWS {
            return None;
        }
        let fit = rows.fit(data, &relation).filter(|it| is_plausible(data, &relation, &it.numbers))?;
        let turn = data.turns[relation.target].filter(|_| matches!(relation.shape, Shape::Equal { .. }));
        let predicted = |row: usize| {
            let off = left(&rows.columns, &rows.target, &fit.numbers, row) - rows.fixed[row];
            rows.target[row] - turn.map_or(off, |turn| shortest(off, turn))
        };
        let predicted: Vec<f64> = (0..rows.times.len()).map(predicted).collect();
        relation.numbers = fit.numbers;
        let share = fit.scale / spread(&rows.target);
        let Rows { times, target, .. } = rows;
        let mut check = Check {
            relation,
            times,
            target,
            predicted,
            usual: Vec::new(),
            scale: fit.scale,
            share,
            is_one_kind: false,
        };
        check.is_one_kind = is_one_kind(data, &check.relation);
        if !check.holds(data) {
            return None;
        }
        check.usual = usual::of(&check, check.least(data));
        Some(check)
    }

    /// The difference at a row.
    pub(super) fn off(&self, row: usize) -> f64 {
        self.target[row] - self.predicted[row]
    }

    fn offs(&self) -> Vec<f64> {
        (0..self.times.len()).map(|row| self.off(row)).collect()
    }

    fn holds(&self, data: &Data) -> bool {
        let most = self.most_share();
        if !(self.share <= most && self.share.is_finite()) {
            return false;
        }
        let offs = self.offs();
        let least = self.least(data);
        let in_parts =
            parts(offs.len()).map(|rows| inner_deviation(&offs[rows]) <= (IN_PART * self.scale).max(least));
        let (count, holding) =
            in_parts.fold((0.0, 0.0), |(all, held), it| (all + 1.0, held + f64::from(u8::from(it))));
        let changes = WINDOWS.iter().map(|parts| self.of_changes(&offs, (offs.len() / parts).max(1)));
        holding >= MOST_PARTS * count && changes.fold(f64::INFINITY, f64::min) <= OF_CHANGES
    }

    /// The largest share of the target's spread that it may leave: the less a form says, the less it may leave.
    fn most_share(&self) -> f64 {
        let Relation { shape, numbers, .. } = &self.relation;
        match (shape, &numbers[..]) {
            _ if self.is_one_kind => FAIR,
            (Shape::Equal { .. }, _) => LITTLE,
            (Shape::Line { .. }, [factor, _]) if (factor - 1.0).abs() < ONE => LITTLE,
            (Shape::Line { .. }, [_, offset]) if offset.abs() < 3.0 * self.scale => OF_FACTOR,
            (Shape::Line { .. }, _) => OF_LINE,
            _ => OF_FACTOR,
        }
    }

    /// The share of the target's larger changes over some rows that is left.
    fn of_changes(&self, offs: &[f64], rows: usize) -> f64 {
        let all = 0..offs.len().saturating_sub(rows);
        // Beside the middle change: two that only grow evenly are not related.
        let changes = |of: &[f64]| -> Vec<f64> {
            let changes: Vec<f64> = all.clone().map(|row| of[row + rows] - of[row]).collect();
            let middle = median(changes.iter().copied());
            changes.into_iter().map(|it| (it - middle).abs()).collect()
        };
        let (moves, left) = (changes(&self.target), changes(offs));
        let large = quantile(&sorted(moves.iter().copied()), 0.7).filter(|it| *it > 0.0);
        let Some(large) = large else { return f64::INFINITY };
        let of_large = |of: &[f64]| median(of.iter().zip(&moves).filter(|it| *it.1 >= large).map(|it| *it.0));
        of_large(&left) / of_large(&moves)
    }

    /// The least usual difference: that of rounding.
    fn least(&self, data: &Data) -> f64 {
        let Relation { target, inputs, numbers, .. } = &self.relation;
        let factor = if inputs.len() == 1 && numbers.len() == 2 { numbers[0].abs() } else { 1.0 };
        let largest = self.target.iter().map(|it| it.abs()).fold(0.0, f64::max);
        let is_pair = inputs.len() == 1 && window_s(&self.relation.shape) == 0.0;
        let of_input = if is_pair { factor * data.steps[inputs[0]] } else { 0.0 };
        (ROUNDED * (data.steps[*target] + of_input)).max(1e-9 * largest).max(f64::MIN_POSITIVE)
    }
}

/// Whether a relation compares two signals of one kind by their names.
fn is_one_kind(data: &Data, relation: &Relation) -> bool {
    let [own, other] = [relation.target, relation.inputs[0]].map(|it| data.kinds[it].as_str());
    relation.inputs.len() == 1 && own == other && own.chars().filter(|it| it.is_alphabetic()).count() > 2
}

/// Whether the factors of a relation can be those of one: a rate in matching units has the factor 1 or -1; of three and more terms, all
/// have one size, as unlike factors can be fitted to anything that is smooth.
fn is_plausible(data: &Data, relation: &Relation, numbers: &[f64]) -> bool {
    let alike = |one: f64, other: f64| (one.abs() / other.abs() - 1.0).abs() < ALIKE;
    let dimension = |signal: usize| data.dimensions[signal];
    match (&relation.shape, numbers) {
        (Shape::Rate { .. }, [factor, ..]) => {
            let is_known = dimension(relation.target).and(dimension(relation.inputs[0])).is_some();
            !is_known || alike(*factor, 1.0)
        }
        (Shape::Sum | Shape::Terms(_), [factors @ .., _]) if factors.len() > 2 => {
            factors.iter().all(|it| alike(*it, factors[0]))
        }
        _ => true,
    }
}

/// The rows of each part of the time.
fn parts(count: usize) -> impl Iterator<Item = std::ops::Range<usize>> {
    let size = count.div_ceil(PARTS).max(1);
    (0..count).step_by(size).map(move |from| from..(from + size).min(count))
}
