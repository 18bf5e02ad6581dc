//! The model of an examined recording: a draft with the groups and relations that were found, and their robust errors.

use super::relations::is_equal;
use super::{Check, Diagnosis, Examined};
use crate::LabError;
use crate::drafting::{
    Because, Columns, Drafted, Group, Member, Needed, Role, checked_text, variable_names, why_nothing,
};
use crate::learning::{Shape, Signal, formula};
use crate::naming::{number, unique};
use crate::order::median;
use shsa_model::load;
use std::collections::BTreeSet;

/// How many deviations an error of the model is: beyond nearly all that was seen outside of the findings.
const DEVIATIONS: f64 = 4.0;

/// Columns that are equal but for an offset, each in one group at most, the closest with each other.
pub(super) fn groups(checks: &[Check], own: &[usize], read: &Columns) -> Vec<Vec<usize>> {
    let dimension = |column: usize| read.columns[column].signal.unit.as_ref().map(|it| it.dimension);
    let mut groups: Vec<Vec<usize>> = own.iter().map(|it| vec![*it]).collect();
    for check in checks.iter().filter(|it| is_equal(it)) {
        let (one, other) = (check.relation.target, check.relation.inputs[0]);
        let place = |groups: &[Vec<usize>], column| groups.iter().position(|it| it.contains(&column));
        let places = place(&groups, one).zip(place(&groups, other));
        if let Some((one, other)) = places.filter(|it| it.0 != it.1 && dimension(one) == dimension(other)) {
            let joined = groups.remove(one.max(other));
            groups[one.min(other)].extend(joined);
        }
    }
    groups.retain(|it| it.len() > 1);
    groups.iter_mut().for_each(|it| it.sort_unstable());
    groups
}

/// The text of the model.
///
/// # Errors
/// When nothing in the recordings can be a signal.
pub(super) fn text(
    read: &mut Columns,
    found: &Examined,
    diagnosis: &Diagnosis,
    names: &str,
) -> Result<String, LabError> {
    let mut drafted = drafted(read, found, &diagnosis.groups);
    if drafted.groups.is_empty() {
        return Err(LabError::Unfit(why_nothing(read, &drafted)));
    }
    let text = checked_text(read, &mut drafted, names)?.replacen(
        "Drafted by `shsa draft`",
        "Made by `shsa doctor`",
        1,
    );
    Ok(with_relations(&text, read, found, &drafted))
}

fn drafted(read: &Columns, found: &Examined, groups: &[Vec<usize>]) -> Drafted {
    let is_alone =
        |it: &usize| found.roles[*it] == Role::Signal && groups.iter().all(|group| !group.contains(it));
    let alone = (0..read.columns.len()).filter(is_alone).map(|it| vec![it]);
    let mut all: Vec<Vec<usize>> = groups.iter().cloned().chain(alone).collect();
    all.sort_by_key(|it| it[0]);
    let groups = all.into_iter().map(|members| group(read, found, &members)).collect();
    let drafted =
        Drafted { facts: found.facts.clone(), roles: found.roles.clone(), groups, ..Drafted::default() };
    Drafted { needs: needs(found, &drafted), ..drafted }
}

/// What something else can stand in for; where nothing is, the first quantity, so that the model watches at all.
fn needs(found: &Examined, drafted: &Drafted) -> Vec<Needed> {
    let is_checked = |group: &usize| {
        let members = &drafted.groups[*group].members;
        let is_in = |check: &Check| members.iter().any(|it| check.relation.signals().contains(&it.column));
        members.len() > 1 || found.checks.iter().any(is_in)
    };
    let mut checked: Vec<usize> = (0..drafted.groups.len()).filter(is_checked).collect();
    if checked.is_empty() {
        checked.extend(drafted.most_measured());
    }
    checked.into_iter().map(|group| Needed { group, max_age: drafted.usual_age(group) }).collect()
}

/// A group with its members compared with one that none of them is ahead of.
fn group(read: &Columns, found: &Examined, members: &[usize]) -> Group {
    let check = |one: usize, other: usize| {
        found
            .checks
            .iter()
            .find(|it| is_equal(it) && it.relation.signals() == [one.min(other), one.max(other)])
    };
    // How much later the one says the same than the other.
    let lag_s = |one: usize, other: usize| {
        let found = check(one, other)?;
        let (Shape::Line { lag_s } | Shape::Equal { lag_s }) = found.relation.shape else { return None };
        Some(if found.relation.target == one { lag_s } else { -lag_s })
    };
    let behind = |it: &usize| members.iter().filter_map(|other| lag_s(*it, *other)).fold(0.0_f64, f64::max);
    let first =
        members.iter().copied().min_by(|one, other| behind(one).total_cmp(&behind(other))).unwrap_or(0);
    let member = |column: usize| {
        let scale = read.columns[column].signal.unit.as_ref().map_or(1.0, |it| it.scale);
        let own = check(column, first).or_else(|| {
            found.checks.iter().find(|it| is_equal(it) && it.relation.signals().contains(&column))
        });
        let apart = own.map_or(0.0, |it| DEVIATIONS * it.scale / scale);
        let sign = if own.is_some_and(|it| it.relation.target == column) { 1.0 } else { -1.0 };
        let offset = own.map_or(0.0, |it| sign * offset(it, read) / scale);
        Member {
            column,
            delay_s: lag_s(column, first).map_or(0.0, |it| it.max(0.0)),
            offset: if column == first { 0.0 } else { offset },
            apart: if column == first { 0.0 } else { apart },
            share: own.map_or(0.0, |it| it.share),
            because: if column == first { Because::First } else { Because::Equal },
        }
    };
    let others = members.iter().filter(|it| **it != first).map(|it| member(*it));
    Group { members: std::iter::once(member(first)).chain(others).collect() }
}

/// How much more the target says than the input, in SI units.
fn offset(check: &Check, read: &Columns) -> f64 {
    let zero = |column: usize| read.columns[column].signal.unit.as_ref().map_or(0.0, |it| it.offset);
    let input = |row: usize| match (&check.relation.shape, &check.relation.numbers[..]) {
        (Shape::Line { .. }, [factor, offset]) => (check.predicted[row] - offset) / factor,
        (_, [offset]) => check.predicted[row] - offset,
        _ => check.predicted[row],
    };
    median((0..check.times.len()).map(|row| check.target[row] - input(row))) + zero(check.relation.target)
        - zero(check.relation.inputs[0])
}

/// The model with those relations in it with which it is valid; the others are comments.
fn with_relations(text: &str, read: &Columns, found: &Examined, drafted: &Drafted) -> String {
    let variables = variable_names(read, drafted);
    let group =
        |column: usize| drafted.groups.iter().position(|it| it.members.iter().any(|it| it.column == column));
    let name = |column: usize| group(column).and_then(|it| variables.get(it).cloned()).unwrap_or_default();
    let signals: Vec<Signal> = read.columns.iter().map(|it| it.signal.clone()).collect();
    let mut known: BTreeSet<BTreeSet<String>> = BTreeSet::new();
    let mut taken: BTreeSet<String> = variables.iter().cloned().collect();
    let (mut active, mut comments) = (String::new(), String::new());
    for check in &found.checks {
        let relation = super::with_delay_ahead(&check.relation);
        let names: BTreeSet<String> = relation.signals().into_iter().map(name).collect();
        if names.len() < relation.signals().len() || names.contains("") || !known.insert(names.clone()) {
            continue;
        }
        let equation = formula(&signals, &relation, &name);
        let left = equation.split(" = ").next().unwrap_or_default().to_owned();
        let target = relation.signals().into_iter().find(|it| name(*it) == left);
        let scale = signals[check.relation.target].unit.as_ref().map_or(1.0, |it| it.scale);
        let factor = if relation.target == check.relation.target {
            1.0
        } else {
            relation.numbers.first().map_or(1.0, |it| it.abs())
        };
        let error = number(DEVIATIONS * factor * check.scale / scale);
        let is_sum = matches!(relation.shape, Shape::Sum | Shape::Line { .. } | Shape::Equal { .. });
        let directions = if is_sum || target.is_none() { String::new() } else { format!(", for: [{left}]") };
        let own =
            unique(&format!("{}_implied", names.iter().next().cloned().unwrap_or_default()), &mut taken);
        let entry = format!("  {own}: {{ equation: \"{equation}\"{directions}, error: {error} }}\n");
        if load(&inserted(text, &format!("{active}{entry}"), ""), "doctor").report.ok() {
            active += &entry;
        } else {
            comments += &format!("# {entry}");
        }
    }
    inserted(text, &active, &comments)
}

/// The text with a section of relations before that of the signals.
fn inserted(text: &str, active: &str, comments: &str) -> String {
    let section = match (active.is_empty(), comments.is_empty()) {
        (true, true) => return text.to_owned(),
        (true, false) => format!("\n# relations:\n{comments}"),
        _ => format!("\nrelations:\n{active}{comments}"),
    };
    text.replacen("\nsignals:\n", &format!("{section}\nsignals:\n"), 1)
}
