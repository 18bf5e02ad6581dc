//! What is learned from: one series for each variable of a model, or of the draft of a model.

use crate::LabError;
use crate::campaign::Progress;
use crate::drafting::{Columns, Role, draft, model_text, variable_names};
use crate::learning::Signal;
use crate::naming::number;
use crate::proposal::series::{computed, joints, measured};
use shsa_core::knowledge::{KnowledgeBase, Relation, VariableId};
use shsa_model::live::Written;
use shsa_recording::Recording;
use std::collections::BTreeSet;

/// The series, with what is known of them.
#[derive(Clone, Debug)]
pub struct Subject {
    /// One for each variable that is recorded, named as the variable.
    pub signals: Vec<Signal>,
    /// A time between each two sessions, in order, in seconds of the series.
    pub joints: Vec<f64>,
    /// The name of the model.
    pub model: String,
    /// Its text.
    pub text: String,
    /// Signals that measure the same, as found; with a model, which says so itself, none.
    pub equal: Vec<String>,
    /// The variables of each relation that the model has.
    pub known: Vec<BTreeSet<String>>,
    /// Variables that no signal measures, each with the variables from which it is computed.
    pub rests_on: Vec<(String, BTreeSet<String>)>,
    /// Whether a part of the recording is lost.
    pub degraded: bool,
}

impl Subject {
    /// The variables of the draft that recordings give; `recordings` are their names.
    ///
    /// # Errors
    /// When a thread panics.
    pub fn of_draft(read: &Columns, recordings: &str, progress: &dyn Progress) -> Result<Subject, LabError> {
        let drafted = draft(&read.columns, &read.joints, progress)?;
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
        let (model, known, rests_on) = ("the draft".to_owned(), Vec::new(), Vec::new());
        let joints = read.joints.clone();
        Ok(Subject { signals, joints, model, text, equal, known, rests_on, degraded: read.degraded })
    }

    /// The variables of a model, each by its fastest recorded signal that is derived from no other; one that no signal measures, by its
    /// best substitution. `wanted` of the recording are the signals that are measured, in the order of the model.
    #[must_use]
    pub fn of_model(model: Written<'_>, knowledge: &KnowledgeBase, recording: &Recording) -> Subject {
        let mut signals = measured(knowledge, recording);
        let computed = computed(knowledge, recording);
        let rests_on: Vec<(String, BTreeSet<String>)> =
            computed.iter().map(|it| (it.signal.name.clone(), it.rests_on.clone())).collect();
        signals.extend(computed.into_iter().map(|it| it.signal));
        let relation = |it: &Relation| {
            let is_measurable = |id: &&VariableId| knowledge.variables()[**id].constant.is_none();
            let members = it.inputs.iter().chain(&it.outputs).filter(is_measurable);
            members.map(|id| knowledge.variables()[*id].name.clone()).collect()
        };
        let known = knowledge.relations().iter().map(relation).collect();
        let (text, degraded) = (model.text.to_owned(), recording.degraded);
        Subject {
            signals,
            joints: joints(recording),
            model: model.name.to_owned(),
            text,
            equal: Vec::new(),
            known,
            rests_on,
            degraded,
        }
    }

    /// Whether the model has a relation of these variables, or computes one of them from the others.
    pub(crate) fn knows(&self, variables: &BTreeSet<String>) -> bool {
        let is_computed = |(variable, from): &(String, BTreeSet<String>)| {
            variables.contains(variable) && variables.iter().all(|it| it == variable || from.contains(it))
        };
        self.known.contains(variables) || self.rests_on.iter().any(is_computed)
    }
}
