//! What is learned from: one series for each variable of a model, or of the draft of a model.

use crate::LabError;
use crate::drafting::{Columns, Role, draft, model_text, variable_names};
use crate::learning::Signal;
use crate::naming::number;
use shsa_core::knowledge::{KnowledgeBase, Relation, SignalId, VariableId};
use shsa_core::observation::RawValue;
use shsa_format::model::live::Written;
use shsa_format::recording::Recording;
use std::collections::BTreeSet;

/// The series, with what is known of them.
#[derive(Clone, Debug)]
pub struct Subject {
    /// One for each variable that is recorded, named as the variable.
    pub signals: Vec<Signal>,
    /// The name of the model.
    pub model: String,
    /// Its text.
    pub text: String,
    /// Signals that measure the same, as found; with a model, which says so itself, none.
    pub equal: Vec<String>,
    /// The variables of each relation that the model has.
    pub known: Vec<BTreeSet<String>>,
    /// Whether a part of the recording is lost.
    pub degraded: bool,
}

impl Subject {
    /// The variables of the draft that recordings give; `recordings` are their names.
    ///
    /// # Errors
    /// When a thread panics.
    pub fn of_draft(read: &Columns, recordings: &str) -> Result<Subject, LabError> {
        let drafted = draft(&read.columns)?;
        let names = variable_names(read, &drafted);
        let mut signals = Vec::new();
        let mut equal = Vec::new();
        for (group, name) in drafted.groups.iter().zip(&names) {
            let first = &read.columns[group.members[0].column].signal;
            signals.push(Signal { name: name.clone(), ..first.clone() });
            let also = group.members[1..].iter().map(|it| {
                let delay = match it.delay_s {
                    delay if delay > 0.0 => format!(" {} s later", number(delay)),
                    _ => String::new(),
                };
                format!(
                    "{}{delay}, apart by {} % of its spread",
                    read.about[it.column].signal,
                    number(100.0 * it.share)
                )
            });
            let first = &read.about[group.members[0].column].signal;
            equal.extend(also.map(|other| format!("{name}: {first} and {other}")));
        }
        for (column, role) in drafted.roles.iter().enumerate() {
            if let Role::Copy(copy) = role {
                let (own, of) = (&read.about[column].signal, &read.about[copy.of].signal);
                equal.push(format!("{own} is computed from {of}: no witness"));
            }
        }
        let text = model_text(read, &drafted, recordings);
        let (model, known) = ("the draft".to_owned(), Vec::new());
        Ok(Subject { signals, model, text, equal, known, degraded: read.degraded })
    }

    /// The variables of a model, each by its fastest recorded signal that is derived from no other. `wanted` of the recording are the
    /// signals that are measured, in the order of the model.
    #[must_use]
    pub fn of_model(model: Written<'_>, knowledge: &KnowledgeBase, recording: &Recording) -> Subject {
        let measured: Vec<SignalId> =
            knowledge.signals().ids().filter(|it| !knowledge.is_computed(*it)).collect();
        let mut series = series(knowledge, &measured, recording);
        let mut signals = Vec::new();
        for (variable, name) in knowledge.variables().enumerate().map(|(id, it)| (id, &it.name)) {
            let of = |at: &usize| {
                let signal = &knowledge.signals()[measured[*at]];
                signal.variable == variable && signal.derived_from.is_empty()
            };
            let best = (0..measured.len()).filter(of).max_by_key(|at| series[*at].len());
            if let Some(points) = best.map(|at| std::mem::take(&mut series[at])) {
                let unit = knowledge.variables()[variable].unit.clone();
                signals.push(Signal { name: name.clone(), unit, points });
            }
        }
        let relation = |it: &Relation| {
            let is_measurable = |id: &&VariableId| knowledge.variables()[**id].constant.is_none();
            let members = it.inputs.iter().chain(&it.outputs).filter(is_measurable);
            members.map(|id| knowledge.variables()[*id].name.clone()).collect()
        };
        let known = knowledge.relations().iter().map(relation).collect();
        let (text, degraded) = (model.text.to_owned(), recording.degraded);
        Subject { signals, model: model.name.to_owned(), text, equal: Vec::new(), known, degraded }
    }
}

/// The values of each signal in the unit of its variable, at the moments at which they were measured; sessions follow each
/// other.
fn series(knowledge: &KnowledgeBase, measured: &[SignalId], recording: &Recording) -> Vec<Vec<(f64, f64)>> {
    let mut series = vec![Vec::new(); measured.len()];
    let mut shift_s = 0.0;
    for (_, samples) in recording.by_session() {
        let Some(first) = samples.first().map(|it| it.time) else { continue };
        let mut last_s: f64 = shift_s;
        for sample in samples {
            let (RawValue::Number(reading), Some(id)) = (&sample.value, measured.get(sample.wanted)) else {
                continue;
            };
            let signal = &knowledge.signals()[*id];
            let time_s = (sample.time - first - signal.delay).seconds() + shift_s;
            last_s = last_s.max(time_s);
            series[sample.wanted].push((time_s, in_unit_of_variable(knowledge, *id, *reading)));
        }
        shift_s = last_s + 1.0;
    }
    series
}

fn in_unit_of_variable(knowledge: &KnowledgeBase, id: SignalId, reading: f64) -> f64 {
    let signal = &knowledge.signals()[id];
    let value = signal.scaling.map_or(reading, |scaling| scaling.value(reading));
    let own = signal.unit.as_ref().map_or(value, |unit| unit.to_si(value));
    let unit = knowledge.variables()[signal.variable].unit.as_ref();
    unit.map_or(own, |unit| (own - unit.offset) / unit.scale)
}
