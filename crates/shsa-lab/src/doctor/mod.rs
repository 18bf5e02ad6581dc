//! What is wrong in a recording, without a model and without a healthy recording.
//!
//! `columns -> likely pairs -> checks (robust fits that hold most of the time) -> stretches in which a check leaves what it does otherwise
//! -> who explains them -> masks, relations learned without them, once more -> findings, the largest first`

mod robust;
mod likely;
mod check;
mod usual;
mod stretch;
mod blame;
mod kind;
mod relations;
mod alone;
mod findings;
mod model;
#[cfg(test)]
mod tests;

pub use findings::{Chart, Finding, Witness};
pub use kind::Kind;

use crate::LabError;
use crate::campaign::Progress;
use crate::campaign::parallel::on_all_cores;
use crate::curve::Curve;
use crate::drafting::{Column, Columns, Facts, Role, roles};
use crate::learning::{Relation, Shape, formula};
use crate::order::{quantile, sorted};
use blame::{Accused, Violation};
use check::{Check, Data};

/// A value is known between two that are this many times as far apart as 99 % of them.
const GAP: f64 = 2.5;

/// The least values of a signal that is checked.
const LEAST_VALUES: usize = 40;

/// What was found out about a recording.
#[derive(Clone, Debug, Default)]
pub struct Diagnosis {
    /// What is wrong, the largest first.
    pub findings: Vec<Finding>,
    /// The relations that hold, with their errors.
    pub relations: Vec<Known>,
    /// Columns that measure the same, each in one group at most.
    pub groups: Vec<Vec<usize>>,
    /// Columns that nothing here can check, with the reason.
    pub unchecked: Vec<(usize, &'static str)>,
    /// Columns with one witness: a fault would be seen, and it would stay open which of the two has it.
    pub open: Vec<(usize, usize)>,
    /// A model of these columns, ready to edit.
    pub model: String,
}

/// A relation that holds.
#[derive(Clone, Debug)]
pub struct Known {
    /// The columns in it.
    pub columns: Vec<usize>,
    /// As a formula of the columns' names.
    pub formula: String,
    /// The deviation of what it leaves, in the unit of its left side.
    pub deviation: f64,
    /// That as a share of the spread of the left side.
    pub share: f64,
}

/// Examines the columns of recordings with these names, and reports the progress. Equal columns give equal results.
///
/// Time: O(columns^2) with bounded moments each, and O(n log n) for each column; on all cores. Memory: 16 bytes a value, and 48 bytes for each
/// moment of each check, of which each has at most 6000.
///
/// # Errors
/// When a thread panics, or nothing in the recordings can be a signal.
pub fn examine(read: &mut Columns, names: &str, progress: &dyn Progress) -> Result<Diagnosis, LabError> {
    let (facts, roles) = roles(&read.columns, &read.joints, progress)?;
    let found = Examined::of(read, facts, roles, progress)?;
    let mut diagnosis = found.diagnosis(read);
    diagnosis.model = model::text(read, &found, &diagnosis, names)?;
    Ok(diagnosis)
}

/// All that is found on the way.
struct Examined {
    facts: Vec<Option<Facts>>,
    roles: Vec<Role>,
    data: Data,
    /// The columns that can be checked.
    own: Vec<usize>,
    checks: Vec<Check>,
    accused: Vec<Accused>,
    alone: Vec<Finding>,
}

impl Examined {
    fn of(
        read: &Columns,
        facts: Vec<Option<Facts>>,
        roles: Vec<Role>,
        progress: &dyn Progress,
    ) -> Result<Examined, LabError> {
        let is_own = |it: &usize| {
            let column = &read.columns[*it];
            can_be_checked(&roles[*it], facts[*it].as_ref()) && !takes_steps(column) && !counts_time(column)
        };
        let own: Vec<usize> = (0..read.columns.len()).filter(is_own).collect();
        let mut data = Data::of(read, &facts);
        let extent = extent(&read.columns);
        let alone = alone::all(read, &facts, &roles, extent.1);
        alone.iter().for_each(|it| data.mask(&it.signals, &it.stretches));
        let pairs = relations::pairs(&data, &own, extent, progress)?;
        let mut checks = checks(&data, pairs, progress)?;
        let mut accused = accused(&data, &checks, progress)?;
        accused.iter().for_each(|it| data.mask(&it.signals, &it.stretches()));
        let pairs: Vec<Relation> = checks.iter().map(|it| it.relation.clone()).collect();
        let larger = relations::larger(read, &data, &own, &checks, progress)?;
        checks = self::checks(&data, pairs.into_iter().chain(larger).collect(), progress)?;
        accused.extend(self::accused(&data, &checks, progress)?);
        data.masks.iter_mut().for_each(Vec::clear);
        alone.iter().for_each(|it| data.mask(&it.signals, &it.stretches));
        accused.iter().for_each(|it| data.mask(&it.signals, &it.stretches()));
        let relations = checks.into_iter().map(|it| it.relation).collect();
        let checks = self::checks(&data, relations, progress)?;
        let accused = self::accused(&data, &checks, progress)?;
        Ok(Examined { facts, roles, data, own, checks, accused, alone })
    }

    fn diagnosis(&self, read: &Columns) -> Diagnosis {
        let groups = model::groups(&self.checks, &self.own, read);
        let unchecked =
            (0..read.columns.len()).filter_map(|column| Some((column, self.unchecked(column)?))).collect();
        let partners = |column: usize| {
            let mut all: Vec<usize> = self
                .checks
                .iter()
                .map(|it| it.relation.signals())
                .filter(|it| it.contains(&column))
                .flatten()
                .collect();
            all.sort_unstable();
            all.dedup();
            all.retain(|it| *it != column);
            all
        };
        let open = |column: &usize| match partners(*column)[..] {
            [other] if *column < other && partners(other).len() == 1 => Some((*column, other)),
            _ => None,
        };
        let open = self.own.iter().filter_map(open).collect();
        let mut relations: Vec<Known> = self.checks.iter().map(|it| known(read, it)).collect();
        relations.sort_by(|one, other| one.share.total_cmp(&other.share));
        Diagnosis { findings: self.findings(read), relations, groups, unchecked, open, model: String::new() }
    }

    /// Why nothing can check a column; `None` where something does, or it is no signal.
    fn unchecked(&self, column: usize) -> Option<&'static str> {
        let is_in = self.checks.iter().any(|it| it.relation.signals().contains(&column));
        match (&self.roles[column], &self.facts[column]) {
            _ if is_in => None,
            (Role::Constant, _) => Some("it never changes"),
            (Role::Copy(_) | Role::RunningMaximum(_), _) => {
                Some("it is computed from another one: no witness")
            }
            (Role::Untimed | Role::Clock, _) | (_, None) => None,
            (_, Some(facts)) if facts.levels.is_some() => Some("it takes few values only"),
            (_, Some(facts)) if facts.count < LEAST_VALUES => Some("too few values"),
            _ if !self.own.contains(&column) => Some("it takes steps, as commands do, or counts the time"),
            _ => Some("nothing else here implies it"),
        }
    }
}

fn can_be_checked(role: &Role, facts: Option<&Facts>) -> bool {
    *role == Role::Signal && facts.is_some_and(|it| it.levels.is_none() && it.count >= LEAST_VALUES)
}

/// Whether a column mostly stands and else takes large steps, as commands and set points do: others follow it as they can.
fn takes_steps(column: &Column) -> bool {
    const STANDS: f64 = 0.8;
    const LARGE: f64 = 0.1;
    let values: Vec<f64> = column.signal.points.iter().map(|it| it.1).collect();
    let changes = sorted(values.windows(2).map(|it| (it[1] - it[0]).abs()).filter(|it| *it > 0.0));
    let values = sorted(values.into_iter());
    let width = quantile(&values, 0.95).unwrap_or(0.0) - quantile(&values, 0.05).unwrap_or(0.0);
    let is_large = quantile(&changes, 0.5).is_some_and(|it| it > LARGE * width);
    (values.len() - changes.len()) as f64 > STANDS * values.len() as f64 && is_large
}

/// Whether a column grows evenly with time, but for jumps: a clock that begins again.
fn counts_time(column: &Column) -> bool {
    const NEARLY_ALL: f64 = 0.9;
    const EVEN: f64 = 0.1;
    let rates = column.signal.points.windows(2).filter(|it| it[1].0 > it[0].0);
    let rates = sorted(rates.map(|it| (it[1].1 - it[0].1) / (it[1].0 - it[0].0)));
    let Some(usual) = quantile(&rates, 0.5).filter(|it| *it > 0.0) else { return false };
    let even = rates.iter().filter(|it| (**it / usual - 1.0).abs() < EVEN).count();
    even as f64 > NEARLY_ALL * rates.len() as f64
}

/// The first and the last moment of all columns.
fn extent(columns: &[Column]) -> (f64, f64) {
    let times =
        columns.iter().flat_map(|it| it.signal.points.first().into_iter().chain(it.signal.points.last()));
    times.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), it| (low.min(it.0), high.max(it.0)))
}

impl Data {
    fn of(read: &Columns, facts: &[Option<Facts>]) -> Data {
        let scale = |column: &Column| column.signal.unit.as_ref().map_or(1.0, |it| it.scale);
        let turn = |(column, facts): (&Column, &Option<Facts>)| {
            column.turn.filter(|_| facts.as_ref().is_some_and(|it| it.wraps)).map(|it| it * scale(column))
        };
        let turns: Vec<Option<f64>> = read.columns.iter().zip(facts).map(turn).collect();
        let curve = |(column, turn): (&Column, &Option<f64>)| {
            let points = column.signal.points.iter().map(|(time, value)| (*time, value * scale(column)));
            let points = match turn {
                Some(turn) => unwrapped(points, *turn),
                None => points.collect(),
            };
            Curve::of_sessions(points, &read.joints)
        };
        let curves: Vec<Curve> = read.columns.iter().zip(&turns).map(curve).collect();
        let gap = |curve: &Curve| {
            let gaps = sorted(curve.times().windows(2).map(|pair| pair[1] - pair[0]));
            GAP * quantile(&gaps, 0.99).unwrap_or(f64::INFINITY)
        };
        let step = |(column, facts): (&Column, &Option<Facts>)| {
            facts.as_ref().map_or(0.0, |it| it.quantum * scale(column))
        };
        Data {
            gaps_s: curves.iter().map(gap).collect(),
            steps: read.columns.iter().zip(facts).map(step).collect(),
            kinds: read.columns.iter().map(|it| it.kind.clone()).collect(),
            dimensions: read
                .columns
                .iter()
                .map(|it| it.signal.unit.as_ref().map(|it| it.dimension))
                .collect(),
            joints: read.joints.clone(),
            masks: vec![Vec::new(); curves.len()],
            turns,
            curves,
        }
    }

    fn mask(&mut self, signals: &[usize], stretches: &[(f64, f64)]) {
        signals.iter().for_each(|it| self.masks[*it].extend(stretches));
    }
}

/// Angles without jumps by a turn.
fn unwrapped(points: impl Iterator<Item = (f64, f64)>, turn: f64) -> Vec<(f64, f64)> {
    let mut before: Option<f64> = None;
    let mut next = |(time, value): (f64, f64)| {
        let value = before.map_or(value, |it| value + turn * ((it - value) / turn).round());
        before = Some(value);
        (time, value)
    };
    points.map(&mut next).collect()
}

/// The checks of those relations that hold most of the time.
fn checks(data: &Data, relations: Vec<Relation>, progress: &dyn Progress) -> Result<Vec<Check>, LabError> {
    let of = |at: usize| Check::of(data, relations[at].clone());
    let found = on_all_cores(relations.len(), None, progress, "relations", of)?;
    Ok(found.into_iter().flatten().collect())
}

/// Who explains the violations of checks.
fn accused(data: &Data, checks: &[Check], progress: &dyn Progress) -> Result<Vec<Accused>, LabError> {
    let of = |at: usize| {
        let check = &checks[at];
        let looks_back_s = check::window_s(&check.relation.shape);
        let violation = |stretch: stretch::Stretch| Violation {
            check: at,
            from_s: check.times[stretch.rows.start] - looks_back_s,
            to_s: check.times[stretch.rows.end - 1],
            stretch,
        };
        stretch::of(check, &data.joints).into_iter().map(violation).collect::<Vec<_>>()
    };
    let violations = on_all_cores(checks.len(), None, progress, "checks", of)?;
    Ok(blame::all(checks, violations.into_iter().flatten().collect()))
}

impl Accused {
    /// From when to when, in seconds: the stretch of the strongest violation.
    fn stretches(&self) -> Vec<(f64, f64)> {
        self.by.first().map(|it| (it.from_s, it.to_s)).into_iter().collect()
    }
}

/// A check in words.
fn known(read: &Columns, check: &Check) -> Known {
    let signals: Vec<_> = read.columns.iter().map(|it| it.signal.clone()).collect();
    let name = |column: usize| read.about[column].signal.clone();
    let scale = signals[check.relation.target].unit.as_ref().map_or(1.0, |it| it.scale);
    Known {
        columns: check.relation.signals(),
        formula: formula(&signals, &with_delay_ahead(&check.relation), &name),
        deviation: check.scale / scale,
        share: check.share,
    }
}

/// The relation with a delay above 0: of one that is ahead, the other one is later.
fn with_delay_ahead(relation: &Relation) -> Relation {
    match (&relation.shape, &relation.inputs[..], &relation.numbers[..]) {
        (Shape::Equal { lag_s }, [input], [offset]) if *lag_s < 0.0 => Relation {
            target: *input,
            inputs: vec![relation.target],
            shape: Shape::Equal { lag_s: -lag_s },
            numbers: vec![-offset],
            ..relation.clone()
        },
        (Shape::Line { lag_s }, [input], [factor, offset]) if *lag_s < 0.0 && *factor != 0.0 => Relation {
            target: *input,
            inputs: vec![relation.target],
            shape: Shape::Line { lag_s: -lag_s },
            numbers: vec![1.0 / factor, -offset / factor],
            ..relation.clone()
        },
        _ => relation.clone(),
    }
}
