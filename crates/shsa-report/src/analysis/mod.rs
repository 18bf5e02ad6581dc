//! Which faults a model can detect, isolate and heal, before anything runs: the results of `shsa_core::analysis` with the names of
//! the model.

mod figures;
mod naming;
mod partly;
mod text;
mod json;
mod liars;
mod matrix;
mod page;
mod unwatched;

pub use liars::Liars;
pub use unwatched::{shortened, unconfirmed, unwatched};

use crate::Style;
use figures::Figures;
use naming::Names;
use serde::Serialize;
use shsa_core::analysis::{
    Addition, Analysis, Candidate, Hidden, Limited, Obstacle, Options, Tolerance, Watch,
};
use shsa_core::engine::WatchBudget;
use shsa_core::knowledge::{KnowledgeBase, NeedId, Relation, SignalId, SignalSet, VariableId};
use shsa_core::trust::Component;
use shsa_format::text::counted;
use std::collections::BTreeSet;

/// An analysis and its model.
///
/// # Example
/// ```
/// use shsa_core::analysis::{Options, analyze};
/// use shsa_report::{Style, analysis::Report};
///
/// let model = "{ shsa: 1, variables: { v: { unit: m/s } }, signals: { /a: { variable: v }, /b: { variable: v } } }";
/// let knowledge = shsa_model::load(model, "two.yaml").knowledge;
/// let (options, analysis) = (Options::default(), analyze(&knowledge, Options::default()));
/// let report = Report::new(&knowledge, &analysis, options, "two.yaml");
/// assert!(report.text(Style::PLAIN).contains("Faults that cannot be told apart:\n  /a, /b"));
/// assert!(report.page().starts_with("<!DOCTYPE html>"));
/// let json = serde_json::to_value(report.json(0))?;
/// assert_eq!(json["signals"][0]["detectable"], true);
/// # Ok::<(), serde_json::Error>(())
/// ```
pub struct Report<'a> {
    knowledge: &'a KnowledgeBase,
    analysis: &'a Analysis,
    figures: Figures,
    only_runnable: bool,
    /// The budget of monitoring.
    watch: WatchBudget,
    /// The model's file.
    title: String,
    /// The relations that were tried as additions.
    given: &'a [Relation],
    /// The liars that the needs withstand, where they were counted.
    liars: Option<&'a Liars>,
}

impl<'a> Report<'a> {
    /// The report of an analysis that was made of this model with these options; `title` is the name of the model's file.
    #[must_use]
    pub fn new(
        knowledge: &'a KnowledgeBase,
        analysis: &'a Analysis,
        options: Options,
        title: &str,
    ) -> Report<'a> {
        Report {
            knowledge,
            analysis,
            figures: Figures::of(knowledge),
            only_runnable: options.only_runnable,
            watch: options.watch,
            title: title.to_owned(),
            given: &[],
            liars: None,
        }
    }

    /// The same report with the liars that the needs withstand, in text and JSON.
    #[must_use]
    pub fn with_liars(self, liars: Option<&'a Liars>) -> Report<'a> {
        Report { liars, ..self }
    }

    /// The same report, of an analysis that ranks these relations, too.
    #[must_use]
    pub fn with_given(self, given: &'a [Relation]) -> Report<'a> {
        Report { given, ..self }
    }

    /// Tables of signals, fusions, relations, needs and additions, then the weaknesses in sentences.
    #[must_use]
    pub fn text(&self, style: Style) -> String {
        text::text(self, style)
    }

    /// One object; `left_out` is the number of signals that the model had more than what was analysed. Each signal lists all
    /// those that its fault is isolable from, so they are made one at a time as they are written.
    pub fn json(&self, left_out: usize) -> impl Serialize + '_ {
        json::Object { report: self, left_out }
    }

    /// A page for the browser.
    #[must_use]
    pub fn page(&self) -> String {
        page::page(self)
    }

    fn signal(&self, signal: SignalId) -> &'a str {
        &self.knowledge.signals()[signal].name
    }

    /// The name of a signal or relation.
    fn component(&self, component: Component) -> &'a str {
        Names::new(self.knowledge).component(component)
    }

    fn variable(&self, variable: VariableId) -> &'a str {
        &self.knowledge.variables()[variable].name
    }

    fn need(&self, need: NeedId) -> &'a str {
        &self.knowledge.needs()[need].signal
    }

    fn signals(&self, signals: &SignalSet) -> Vec<&'a str> {
        signals.iter().map(|signal| self.signal(signal)).collect()
    }

    fn needs_lost(&self, signal: SignalId) -> Vec<&'a str> {
        self.analysis.needs_lost(signal).map(|need| self.need(need)).collect()
    }

    /// The signals whose faults nothing shows; what is computed does not fail by itself.
    fn undetectable(&self) -> SignalSet {
        let hidden = |&signal: &SignalId| {
            !self.analysis.faults.is_detectable(signal) && !self.knowledge.is_computed(signal)
        };
        self.knowledge.signals().ids().filter(hidden).collect()
    }

    /// How many ways of a variable are monitored: `3 of 3`, `32 of 256 or more`.
    fn ways(watch: &Watch) -> String {
        naming::ways(watch)
    }

    /// Describes what the selection of ways hides about a signal.
    fn hidden(&self, hidden: &Hidden) -> String {
        let signal = self.signal(hidden.signal);
        match hidden.undetected {
            true => format!("{signal} does not show"),
            false => format!("{signal} is taken for {}", self.signals(&hidden.taken_for).join(", ")),
        }
    }

    /// Describes the obstacles of a residual.
    fn obstacles(&self, obstacles: &[Obstacle]) -> String {
        Names::new(self.knowledge).obstacles(obstacles)
    }

    /// Faults that the structure could detect or isolate and no comparison does, one line for each reason.
    fn gaps(&self) -> Vec<String> {
        Names::new(self.knowledge).by_reason(&self.analysis.gaps)
    }

    /// The relations that are structure only, in file order.
    fn without_formula(&self) -> Vec<&'a str> {
        let relations = self.knowledge.relations().iter();
        relations
            .filter(|relation| relation.formulas.is_empty())
            .map(|relation| relation.name.as_str())
            .collect()
    }

    /// Describes an addition.
    fn addition(&self, candidate: Candidate) -> String {
        match candidate {
            Candidate::Sensor(variable) => match self.knowledge.carriers(variable).len() {
                0 => format!("a sensor of {}", self.variable(variable)),
                _ => format!("one more sensor of {}", self.variable(variable)),
            },
            Candidate::Relation(one, other) => {
                format!("a relation of {} and {}", self.variable(one), self.variable(other))
            }
            Candidate::Given(place) => {
                self.given.get(place).map_or(String::new(), |it| format!("{}: {}", it.name, it.text))
            }
        }
    }

    /// The variables of a relation that was tried, each once, in file order.
    fn variables_of_given(&self, place: usize) -> Vec<VariableId> {
        let of = |it: &Relation| it.inputs.iter().chain(&it.outputs).copied().collect::<BTreeSet<_>>();
        self.given.get(place).map(of).unwrap_or_default().into_iter().collect()
    }

    /// `0 to 1 for /need`, for each need that would survive more losses.
    fn survives(&self, addition: &Addition) -> Vec<String> {
        let described = |survives: &shsa_core::analysis::Survives| {
            let (now, then) = (losses(&survives.now), losses(&survives.then));
            format!("{now} to {then} for {}", self.need(survives.need))
        };
        addition.survives.iter().map(described).collect()
    }

    /// Sentences about the method of the analysis.
    fn notes(&self) -> Vec<String> {
        let without = self.without_formula().len();
        let structure = (without > 0).then(|| {
            let relations = counted(without, "relation");
            match (self.only_runnable, without) {
                (true, 1) => format!("{relations} without a formula is left out."),
                (true, _) => format!("{relations} without a formula are left out."),
                (false, 1) => {
                    format!("{relations} has no formula and counts as if it had one (not so with --only-runnable).")
                }
                (false, _) => {
                    format!("{relations} have no formula and count as if they had one (not so with --only-runnable).")
                }
            }
        });
        structure.into_iter().chain(self.analysis.limited.iter().map(limited)).collect()
    }
}

/// The number of losses that a need survives, in a word.
fn losses(tolerance: &Tolerance) -> String {
    match tolerance.survives {
        _ if !tolerance.known && !tolerance.exact => "unclear".to_owned(),
        _ if !tolerance.known => "not known".to_owned(),
        None => "all".to_owned(),
        Some(count) if tolerance.exact => count.to_string(),
        Some(count) => format!("{count} or more"),
    }
}

fn limited(limited: &Limited) -> String {
    match limited {
        Limited::Ways { variables } => format!(
            "Of {} the monitor watches a choice of ways (--watch, --watch-cost): those that tell most faults apart.",
            counted(*variables, "variable")
        ),
        Limited::Skipped { variables } => format!(
            "The ways of {} were not looked for (limit of steps): more faults may show.",
            counted(*variables, "variable")
        ),
        Limited::Needs { needs } => {
            format!("{} may survive more losses than was proven (limit of steps).", counted(*needs, "need"))
        }
        Limited::Variables { variables } => format!(
            "{} may survive more losses than was proven (limit of steps).",
            counted(*variables, "variable")
        ),
        Limited::Additions { tried, of } => {
            format!("{tried} of {of} possible additions were tried (limit of steps): others may help more.")
        }
    }
}
