//! A draft as a model file that is valid: what cannot be written is left out by name.

use super::{Columns, Drafted, Group, Needed, Role, model_text};
use crate::LabError;
use shsa_model::load;

/// The model file of a draft, made from recordings with these names. Signals that a model cannot have are left out of the draft, with
/// a warning each.
///
/// # Errors
/// When the draft is no valid model without them, either.
pub fn checked_text(read: &mut Columns, drafted: &mut Drafted, recordings: &str) -> Result<String, LabError> {
    let text = model_text(read, drafted, recordings);
    let Some(problem) = problem(&text) else { return Ok(text) };
    leave_out(read, drafted);
    let text = model_text(read, drafted, recordings);
    let is_valid = !drafted.groups.is_empty() && self::problem(&text).is_none();
    if is_valid { Ok(text) } else { Err(LabError::Draft(problem)) }
}

/// Why a text is no model; `None` where it is one.
fn problem(text: &str) -> Option<String> {
    let report = load(text, "draft").report;
    (!report.ok()).then(|| report.render(false))
}

/// Leaves out each group and each copy that is no valid model by itself.
fn leave_out(read: &mut Columns, drafted: &mut Drafted) {
    for column in 0..drafted.roles.len() {
        let Role::Copy(copy) = &drafted.roles[column] else { continue };
        let original = drafted.groups.iter().find(|group| has(group, copy.of)).cloned();
        if let Some(problem) = alone(read, drafted, original, Some(column)) {
            drafted.roles[column] = Role::Signal;
            read.leave_out(column, &problem);
        }
    }
    let needs = std::mem::take(&mut drafted.needs);
    for (at, group) in std::mem::take(&mut drafted.groups).into_iter().enumerate() {
        if let Some(problem) = alone(read, drafted, Some(group.clone()), None) {
            group.members.iter().for_each(|it| read.leave_out(it.column, &problem));
            continue;
        }
        let moved = |need: &Needed| Needed { group: drafted.groups.len(), ..need.clone() };
        drafted.needs.extend(needs.iter().filter(|need| need.group == at).map(moved));
        drafted.groups.push(group);
    }
}

fn has(group: &Group, column: usize) -> bool {
    group.members.iter().any(|member| member.column == column)
}

/// Why a group with one of its copies is no model by itself; without the copy where the group alone is none.
fn alone(read: &Columns, drafted: &Drafted, group: Option<Group>, copy: Option<usize>) -> Option<String> {
    let role = |column: usize| match copy {
        Some(copy) if copy == column => drafted.roles[column].clone(),
        _ => Role::Signal,
    };
    let draft = Drafted {
        facts: drafted.facts.clone(),
        roles: (0..drafted.roles.len()).map(role).collect(),
        groups: group.into_iter().collect(),
        ..Drafted::default()
    };
    problem(&model_text(read, &draft, ""))
}

impl Columns {
    fn leave_out(&mut self, column: usize, problem: &str) {
        let source = self.about[column].source.clone();
        let first = problem.lines().next().unwrap_or_default().trim_start_matches("error: ");
        let reason = format!("no model can have it: {first}");
        self.warnings.push(format!("{source} is left out: {reason}"));
        self.left_out.push((source, reason));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drafting::{Series, draft};

    fn drafted(values: &[(&str, &dyn Fn(f64) -> f64)]) -> (Columns, Drafted) {
        let series = values.iter().map(|(name, value)| Series {
            topic: "one".to_owned(),
            path: (*name).to_owned(),
            source: format!("one#{name}"),
            points: (0..200).map(f64::from).map(|time| (time, value(time))).collect(),
        });
        let columns = Columns::of_series(series.collect());
        let drafted = draft(&columns.columns, &[], &()).unwrap();
        (columns, drafted)
    }

    #[test]
    fn any_numbers_give_a_valid_draft() {
        let wave = |time: f64| (0.3 * time).sin();
        let (mut columns, mut drafted) = drafted(&[
            ("missing", &|_| f64::NAN),
            ("rarely", &|time| if time % 7.0 == 0.0 { wave(time) } else { f64::NAN }),
            ("infinite", &|time| if time % 9.0 == 0.0 { f64::INFINITY } else { wave(time) }),
            ("huge", &|time| wave(time) * f64::MAX),
            ("large", &|time| wave(time) * 1e140),
            ("tiny", &|time| wave(time) * 1e-300),
            ("fine", &|time| 5.0 + wave(time) * 1e-13),
            ("once", &|time| if time == 3.0 { 1.0 } else { f64::NAN }),
            ("twice", &|time| if time < 2.0 { time } else { f64::NAN }),
            ("wave", &wave),
        ]);
        let text = checked_text(&mut columns, &mut drafted, "a test").unwrap();
        assert_eq!(problem(&text), None, "{text}");
        assert_eq!(columns.warnings, [] as [&str; 0], "{text}");
    }

    #[test]
    fn what_no_model_can_have_is_left_out_by_name() {
        let wave = |time: f64| (0.3 * time).sin();
        let (mut columns, mut drafted) = drafted(&[("good", &wave), ("bad", &|time| wave(time).powi(3))]);
        columns.about[1].variable = "bad: {".to_owned();
        let text = checked_text(&mut columns, &mut drafted, "a test").unwrap();
        assert!(text.contains("  good:") && text.contains("#   one#bad: no model can have it"), "{text}");
        assert!(columns.warnings[0].starts_with("one#bad is left out"), "{:?}", columns.warnings);
    }
}
