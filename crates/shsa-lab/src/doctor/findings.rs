//! Findings: who is wrong, where, how, by how much, who says so.

use super::Examined;
use super::blame::{Accused, Violation, factor};
use super::check::Check;
use super::kind::{Kind, Said, size};
use crate::curve::Curve;
use crate::drafting::Columns;
use crate::learning::{Shape, formula};
use crate::order::median;

/// The most findings that are told.
const MOST: usize = 12;

/// The delays that are tried, as shares of the stretch.
const DELAYS: usize = 28;
const LONGEST_DELAY: f64 = 0.3;

/// How far beyond what is needed something must be that no form of a fault explains: natural transients have none, either.
const OF_NO_FORM: f64 = 2.0;

/// The most moments of a chart.
const MOMENTS: usize = 240;

/// What is wrong.
#[derive(Clone, Debug)]
pub struct Finding {
    /// The columns of which one is wrong: one where it is known which. Of silence and of [`Kind::Swapped`], all of them are.
    pub signals: Vec<usize>,
    /// Whether all signals have it, and not one of them.
    pub are_all: bool,
    /// From when to when, in seconds of the columns, the strongest first.
    pub stretches: Vec<(f64, f64)>,
    /// How, of the first signal.
    pub kind: Kind,
    /// The column in whose unit the amounts are.
    pub in_unit_of: usize,
    /// The relations that say so.
    pub witnesses: Vec<Witness>,
    /// Columns whose own checks hold at this time, so that they are not it.
    pub cleared: Vec<usize>,
    /// How many times as large as in the remaining time it is.
    pub times: f64,
    /// How far beyond what is needed, for the order of findings.
    pub strength: f64,
    /// The stretch.
    pub chart: Chart,
}

/// A relation that is violated.
#[derive(Clone, Debug)]
pub struct Witness {
    /// The other columns in it.
    pub columns: Vec<usize>,
    /// The relation as a formula of the columns' names.
    pub formula: String,
    /// What it leaves in the stretch, as a root mean square, in the unit of its left side, and what it usually leaves.
    pub off: f64,
    /// See `off`.
    pub usual: f64,
    /// The column whose unit that is.
    pub target: usize,
}

/// A stretch with its surroundings: times in seconds, values in the unit of [`Finding::in_unit_of`].
#[derive(Clone, Debug, Default)]
pub struct Chart {
    /// What the signal says.
    pub own: Vec<(f64, f64)>,
    /// What the others say of it.
    pub expected: Vec<(f64, f64)>,
}

impl Finding {
    pub(super) fn alone(
        signals: Vec<usize>,
        stretch: (f64, f64),
        kind: Kind,
        times: f64,
        chart: Chart,
    ) -> Finding {
        Finding {
            in_unit_of: signals[0],
            signals,
            are_all: true,
            stretches: vec![stretch],
            kind,
            witnesses: Vec::new(),
            cleared: Vec::new(),
            times,
            strength: times,
            chart,
        }
    }

    /// Whether one signal is named.
    #[must_use]
    pub fn is_named(&self) -> bool {
        self.signals.len() == 1 || self.are_all
    }

    fn rank(&self) -> f64 {
        let witnesses = self.witnesses.len().clamp(1, 4) as f64;
        self.strength * witnesses * if self.is_named() { 2.0 } else { 1.0 }
    }
}

/// What a signal says and should say at all moments of a check, in its own unit, with the seconds by which it is earlier than those.
struct Sides {
    times: Vec<f64>,
    own: Vec<f64>,
    expected: Vec<f64>,
    usual: f64,
}

impl Examined {
    pub(super) fn findings(&self, read: &Columns) -> Vec<Finding> {
        let mut found: Vec<Finding> = Vec::new();
        for accused in &self.accused {
            let is_clear = |it: &Finding| !matches!(it.kind, Kind::Off(_)) || it.strength >= OF_NO_FORM;
            let Some(one) = self.finding(read, accused).filter(is_clear) else { continue };
            let is_same = |it: &&mut Finding| {
                it.signals == one.signals
                    && std::mem::discriminant(&it.kind) == std::mem::discriminant(&one.kind)
            };
            match found.iter_mut().find(is_same) {
                Some(known) => known.stretches.extend(one.stretches),
                None => found.push(one),
            }
        }
        self.swapped(&mut found);
        found.extend(self.alone.iter().cloned());
        found.sort_by(|one, other| other.rank().total_cmp(&one.rank()));
        found.truncate(MOST);
        found
    }

    fn finding(&self, read: &Columns, accused: &Accused) -> Option<Finding> {
        let first = accused.by.first()?;
        let signal = *accused.signals.first()?;
        let sides = self.sides(read, signal, accused);
        let (kind, chart, in_unit_of) = match &sides {
            Some(sides) => (self.kind(signal, sides, first), sides.chart(first), signal),
            None => self.off(read, first),
        };
        let mut cleared: Vec<usize> =
            accused.cleared.iter().flat_map(|it| self.checks[*it].relation.signals()).collect();
        cleared.sort_unstable();
        cleared.dedup();
        cleared.retain(|it| !accused.signals.contains(it));
        Some(Finding {
            signals: accused.signals.clone(),
            are_all: false,
            stretches: accused.stretches(),
            kind,
            in_unit_of,
            witnesses: accused.by.iter().map(|it| self.witness(read, &accused.signals, it)).collect(),
            cleared,
            times: first.stretch.times,
            strength: first.stretch.strength,
            chart,
        })
    }

    /// Both sides of the closest violated check that tells what the signal should say.
    fn sides(&self, read: &Columns, signal: usize, accused: &Accused) -> Option<Sides> {
        let has_value = |it: &&Violation| factor(&self.checks[it.check], signal).is_some();
        let closest = |it: &&Violation| {
            let check = &self.checks[it.check];
            check.scale / factor(check, signal).unwrap_or(1.0)
        };
        let best = accused
            .by
            .iter()
            .filter(has_value)
            .min_by(|one, other| closest(one).total_cmp(&closest(other)))?;
        let check = &self.checks[best.check];
        let scale = read.columns[signal].signal.unit.as_ref().map_or(1.0, |it| it.scale);
        let (own, expected): (Vec<f64>, Vec<f64>) = (0..check.times.len())
            .map(|row| {
                let (own, expected) = self.both(check, signal, row);
                (own / scale, expected / scale)
            })
            .unzip();
        let usual = check.scale / factor(check, signal)? / scale;
        Some(Sides { times: check.times.clone(), own, expected, usual })
    }

    /// What a signal says and should say at a row of a check.
    fn both(&self, check: &Check, signal: usize, row: usize) -> (f64, f64) {
        let relation = &check.relation;
        if relation.target == signal {
            return (check.target[row], check.predicted[row]);
        }
        let place = relation.inputs.iter().position(|it| *it == signal).unwrap_or(0);
        let (factor, lag_s) = match (&relation.shape, &relation.numbers[..]) {
            (Shape::Equal { lag_s }, _) => (1.0, *lag_s),
            (Shape::Line { lag_s }, numbers) => (numbers.first().copied().unwrap_or(1.0), *lag_s),
            (_, numbers) => (numbers.get(place).copied().unwrap_or(1.0), 0.0),
        };
        let own = self.data.curves[signal].read(check.times[row] - lag_s).map_or(f64::NAN, |it| it.0);
        (own, own + check.off(row) / factor)
    }

    fn kind(&self, signal: usize, sides: &Sides, by: &Violation) -> Kind {
        let within = |row: &usize| {
            by.from_s <= sides.times[*row] && sides.times[*row] <= by.to_s && sides.own[*row].is_finite()
        };
        let rows: Vec<usize> = (0..sides.times.len()).filter(within).collect();
        let of = |values: &[f64]| rows.iter().map(|row| values[*row]).collect::<Vec<f64>>();
        let said = Said {
            times: of(&sides.times),
            own: of(&sides.own),
            expected: of(&sides.expected),
            usual: sides.usual,
            repeated: self.facts[signal].as_ref().map_or(0.0, |it| it.repeated),
        };
        let curve = Curve::new(sides.times.iter().copied().zip(sides.expected.iter().copied()).collect());
        let earlier = |lag_s: f64| {
            said.times.iter().map(|it| curve.read(it - lag_s).map_or(f64::NAN, |it| it.0)).collect()
        };
        let (least, most) = (curve.period_s().max(1e-9), LONGEST_DELAY * (by.to_s - by.from_s));
        let delays: Vec<f64> = match most > least {
            true => {
                (0..DELAYS).map(|at| least * (most / least).powf(at as f64 / (DELAYS - 1) as f64)).collect()
            }
            false => Vec::new(),
        };
        said.kind(&delays, &earlier)
    }

    /// Of a check that does not tell what one signal should say: by how much its left side is off.
    fn off(&self, read: &Columns, by: &Violation) -> (Kind, Chart, usize) {
        let check = &self.checks[by.check];
        let target = check.relation.target;
        let scale = read.columns[target].signal.unit.as_ref().map_or(1.0, |it| it.scale);
        let of = |values: &[f64]| values.iter().map(|it| it / scale).collect::<Vec<f64>>();
        let sides = Sides {
            times: check.times.clone(),
            own: of(&check.target),
            expected: of(&check.predicted),
            usual: check.scale / scale,
        };
        let off: Vec<f64> = by.stretch.rows.clone().map(|row| check.off(row) / scale).collect();
        (Kind::Off(size(&off)), sides.chart(by), target)
    }

    fn witness(&self, read: &Columns, accused: &[usize], by: &Violation) -> Witness {
        let check = &self.checks[by.check];
        let relation = super::with_delay_ahead(&check.relation);
        let signals: Vec<_> = relation.signals();
        let all: Vec<_> = read.columns.iter().map(|it| it.signal.clone()).collect();
        let name = |column: usize| read.about[column].signal.clone();
        let scale = all[check.relation.target].unit.as_ref().map_or(1.0, |it| it.scale);
        let offs: Vec<f64> = by.stretch.rows.clone().map(|row| check.off(row) / scale).collect();
        Witness {
            columns: signals.into_iter().filter(|it| !accused.contains(it) || accused.len() > 1).collect(),
            formula: formula(&all, &relation, &name),
            off: size(&offs),
            usual: median(by.stretch.rows.clone().map(|row| check.usual[row])) / scale,
            target: check.relation.target,
        }
    }

    /// Joins two findings of one time, each signal of which says what the other one should say.
    fn swapped(&self, found: &mut Vec<Finding>) {
        let mut at = 0;
        while at < found.len() {
            let other = (at + 1..found.len()).find(|other| are_swapped(&found[at], &found[*other]));
            if let Some(other) = other {
                let other = found.remove(other);
                let one = &mut found[at];
                one.kind = Kind::Swapped(other.signals[0]);
                one.signals.extend(other.signals);
                one.witnesses.extend(other.witnesses);
                one.are_all = true;
                one.strength = one.strength.max(other.strength);
            }
            at += 1;
        }
    }
}

/// Whether each of two signals says in the first stretch what the other one should say.
fn are_swapped(one: &Finding, other: &Finding) -> bool {
    const LEFT: f64 = 0.3;
    let is_single = |it: &Finding| it.signals.len() == 1 && !it.witnesses.is_empty();
    let (from, to) = one.stretches[0];
    let shared = to.min(other.stretches[0].1) - from.max(other.stretches[0].0);
    if !is_single(one) || !is_single(other) || shared < 0.5 * (to - from) {
        return false;
    }
    let left = |own: &[(f64, f64)], expected: &[(f64, f64)]| {
        let curve = Curve::new(expected.to_vec());
        let inside = own.iter().filter(|it| from <= it.0 && it.0 <= to);
        size(&inside.filter_map(|it| Some(it.1 - curve.read(it.0)?.0)).collect::<Vec<_>>())
    };
    let [a, b] = [&one.chart, &other.chart];
    left(&a.own, &b.expected) < LEFT * left(&a.own, &a.expected)
        && left(&b.own, &a.expected) < LEFT * left(&b.own, &b.expected)
}

impl Sides {
    /// The stretch with as much before and after it.
    fn chart(&self, by: &Violation) -> Chart {
        let around =
            (by.to_s - by.from_s).max(self.times.last().map_or(0.0, |it| 0.02 * (it - self.times[0])));
        let is_near =
            |row: &usize| by.from_s - around <= self.times[*row] && self.times[*row] <= by.to_s + around;
        let rows: Vec<usize> = (0..self.times.len()).filter(is_near).collect();
        let every = rows.len().div_ceil(MOMENTS).max(1);
        let of = |values: &[f64]| {
            let points = rows.iter().step_by(every).map(|row| (self.times[*row], values[*row]));
            points.filter(|it| it.1.is_finite()).collect()
        };
        Chart { own: of(&self.own), expected: of(&self.expected) }
    }
}
