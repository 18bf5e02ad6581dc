//! Relations as entries of a model: formula, tolerance, where it was seen to hold, and what it adds.

mod series;
mod subject;
mod serving;

pub use serving::Serving;
pub use subject::Subject;

use crate::LabError;
use crate::campaign::Progress;
use crate::campaign::parallel::on_all_cores;
use crate::learning::{Learned, Relation, Shape, Signal, formula, tolerances};
use crate::naming::{number, unique};
use shsa_core::analysis::{Options, analyze};
use shsa_core::knowledge::{KnowledgeBase, SignalId};
use shsa_model::Report;
use shsa_model::live::{Live, Written};
use std::collections::BTreeSet;

/// What the faults of a model's signals are to it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Worth {
    /// Signals whose fault is detectable.
    pub detectable: usize,
    /// Signals whose fault is isolable from the fault of every other signal.
    pub isolable: usize,
    /// Signals that something can stand in for.
    pub substitutable: usize,
    /// All signals that are measured.
    pub signals: usize,
}

/// A relation that is proposed.
#[derive(Clone, Debug)]
pub struct Proposal {
    /// Its name in the model.
    pub name: String,
    /// The formula.
    pub equation: String,
    /// The variables for which it is used; all for which it can be solved when empty.
    pub directions: Vec<String>,
    /// The variables in it.
    pub variables: Vec<String>,
    /// The kind of the formula.
    pub kind: &'static str,
    /// As it was learned.
    pub relation: Relation,
    /// The tolerance in the unit of the left side.
    pub error: f64,
    /// The values that each variable had.
    pub seen: Vec<(String, f64, f64)>,
    /// Whether its only ground is that it held in the recording.
    pub is_statistical: bool,
    /// Why the model cannot have it.
    pub refusal: Option<String>,
    /// What the model is with this relation alone added.
    pub worth: Worth,
}

/// All of them, and what they are worth together.
#[derive(Clone, Debug)]
pub struct Proposals {
    /// The proposals.
    pub all: Vec<Proposal>,
    /// What the model is without them.
    pub before: Worth,
    /// What the model is with all that are active.
    pub after: Worth,
}

impl Proposals {
    /// Tries each relation in the model, and reports the progress.
    ///
    /// # Errors
    /// When the model cannot be loaded again.
    pub fn new(subject: &Subject, learned: &Learned, progress: &dyn Progress) -> Result<Proposals, LabError> {
        let mut taken = BTreeSet::new();
        let is_known = |relation: &Relation| {
            let own: BTreeSet<String> =
                relation.signals().iter().map(|it| subject.signals[*it].name.clone()).collect();
            subject.knows(&own)
        };
        let relations: Vec<Relation> = learned.relations.iter().filter(|it| !is_known(it)).cloned().collect();
        let errors = tolerances(&subject.signals, &subject.joints, &relations);
        let with_error = relations.iter().zip(errors);
        let mut all: Vec<Proposal> =
            with_error.map(|(it, error)| proposal(&subject.signals, it, error, &mut taken)).collect();
        let before = worth(changed(subject, "")?.knowledge());
        let tried = |at: usize| {
            changed(subject, &format!("relations:\n{}", all[at].entry())).map(|live| worth(live.knowledge()))
        };
        let tried = on_all_cores(all.len(), None, progress, "relations, each tried in the model", tried)?;
        for (proposal, tried) in all.iter_mut().zip(tried) {
            match tried {
                Ok(worth) => proposal.worth = worth,
                Err(error) => proposal.refusal = Some(error.to_string()),
            }
        }
        let entries: String = all.iter().filter(|it| it.is_active()).map(Proposal::entry).collect();
        let change = if entries.is_empty() { String::new() } else { format!("relations:\n{entries}") };
        let after = changed(subject, &change).map_or(before, |live| worth(live.knowledge()));
        Ok(Proposals { all, before, after })
    }
}

impl Proposal {
    /// Whether it is proposed as it is, and not only as a comment.
    #[must_use]
    pub fn is_active(&self) -> bool {
        self.refusal.is_none() && !self.is_statistical
    }

    /// The lines of the model.
    #[must_use]
    pub fn entry(&self) -> String {
        let directions = match &*self.directions {
            [] => String::new(),
            names => format!(", for: [{}]", names.join(", ")),
        };
        let error = if self.error > 0.0 { format!(", error: {}", number(self.error)) } else { String::new() };
        format!("  {}: {{ equation: \"{}\"{directions}{error} }}\n", self.name, self.equation)
    }
}

fn proposal(signals: &[Signal], relation: &Relation, error: f64, taken: &mut BTreeSet<String>) -> Proposal {
    let name = |signal: usize| signals[signal].name.clone();
    let equation = formula(signals, relation, &name);
    let left = equation.split(" = ").next().unwrap_or_default().to_owned();
    let is_name = |text: &str| signals.iter().any(|it| it.name == text);
    let is_algebraic = matches!(relation.shape, Shape::Sum | Shape::Product(_))
        || matches!(relation.shape, Shape::Equal { lag_s } | Shape::Line { lag_s } if lag_s == 0.0);
    let directions = if is_algebraic || !is_name(&left) { Vec::new() } else { vec![left.clone()] };
    let variables: Vec<String> = relation.signals().into_iter().map(name).collect();
    let target = signals.iter().position(|it| it.name == left).unwrap_or(relation.target);
    let others: Vec<String> = variables.iter().filter(|it| **it != signals[target].name).cloned().collect();
    let text = format!("{}_from_{}", signals[target].name, others.join("_"));
    let seen = relation.signals().into_iter().filter_map(|it| seen(&signals[it])).collect();
    Proposal {
        name: unique(&text, taken),
        error,
        kind: relation.shape.kind(),
        is_statistical: relation.is_statistical(signals),
        directions,
        variables,
        seen,
        equation,
        relation: relation.clone(),
        refusal: None,
        worth: Worth::default(),
    }
}

fn seen(signal: &Signal) -> Option<(String, f64, f64)> {
    let first = signal.points.first()?.1;
    let ends = signal.points.iter().fold((first, first), |(low, high), it| (low.min(it.1), high.max(it.1)));
    Some((signal.name.clone(), ends.0, ends.1))
}

/// The model with a change.
fn changed(subject: &Subject, change: &str) -> Result<Live, LabError> {
    let described = |report: Report| {
        let first = report.without_notes().render(false);
        LabError::Unfit(first.lines().next().unwrap_or("the model refuses it").to_owned())
    };
    let (mut live, _) =
        Live::load(Written { name: &subject.model, text: &subject.text }).map_err(described)?;
    if !change.is_empty() {
        live.change(Written { name: "relation", text: change }).map_err(described)?;
    }
    Ok(live)
}

fn worth(knowledge: &KnowledgeBase) -> Worth {
    let analysis = analyze(knowledge, Options { addition_steps: 0, ..Options::default() });
    let signals = || knowledge.signals().ids().filter(|it| !knowledge.is_computed(*it));
    let is_isolable = |one: &SignalId| {
        analysis.faults.is_detectable(*one)
            && signals().all(|other| other == *one || analysis.faults.is_isolable_from(*one, other))
    };
    Worth {
        detectable: signals().filter(|it| analysis.faults.is_detectable(*it)).count(),
        isolable: signals().filter(is_isolable).count(),
        substitutable: signals().filter(|it| analysis.is_substitutable(*it)).count(),
        signals: signals().count(),
    }
}
