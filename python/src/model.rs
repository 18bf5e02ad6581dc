//! A checked model: its problems, substitutions, and what can be detected, isolated and survived.

use crate::problem::{refused, unknown};
use crate::work;
use pyo3::prelude::*;
use serde_json::{Value, json};
use shsa_core::analysis::{Options, analyze};
use shsa_core::engine::WatchBudget;
use shsa_core::knowledge::{KnowledgeBase, Need, Shape, Signal, SignalId, VariableId};
use shsa_core::plan::{self, Graph, Limits};
use shsa_message::source::Source;
use shsa_model::Located;
use shsa_model::live::{Live, Written};
use shsa_report::analysis::{self, shortened, unconfirmed, unwatched};
use shsa_report::shortfall::unmet;
use shsa_report::substitution::Names;
use std::path::Path;

/// A model without errors.
#[pyclass(frozen)]
pub(crate) struct Model {
    pub(crate) live: Live,
    /// What problems call the text.
    #[pyo3(get)]
    pub(crate) name: String,
    pub(crate) text: String,
    warnings: Vec<Located>,
}

impl Model {
    pub(crate) fn knowledge(&self) -> &KnowledgeBase {
        self.live.knowledge()
    }

    /// What a run calls it: the name of its file, without folders and extension.
    pub(crate) fn stem(&self) -> String {
        let name = Path::new(&self.name).file_stem().unwrap_or_default();
        name.to_string_lossy().into_owned()
    }

    pub(crate) fn written(&self) -> Written<'_> {
        Written { name: &self.name, text: &self.text }
    }

    /// The signal of a name.
    ///
    /// # Errors
    /// When the model has no such signal.
    pub(crate) fn signal(&self, py: Python<'_>, name: &str) -> PyResult<SignalId> {
        let known = self.knowledge().signals().iter().map(|signal| signal.name.as_str());
        self.knowledge().signal(name).ok_or_else(|| unknown(py, "signal", name, known))
    }

    fn variable(&self, py: Python<'_>, name: &str) -> PyResult<VariableId> {
        let known = self.knowledge().variables().iter().map(|variable| variable.name.as_str());
        self.knowledge().variable(name).ok_or_else(|| unknown(py, "variable", name, known))
    }
}

#[pymethods]
impl Model {
    #[new]
    fn parse(py: Python<'_>, text: String, name: String) -> PyResult<Model> {
        let (live, report) =
            Live::load(Written { name: &name, text: &text }).map_err(|it| refused(py, &it))?;
        let mut warnings = report.diagnostics;
        let more = unwatched(live.knowledge(), WatchBudget::default()).into_iter();
        let more = more.chain(shortened(unmet(live.knowledge())));
        warnings.extend(more.map(|message| Located::warning(&name, message)));
        let notes = unconfirmed(live.knowledge(), WatchBudget::default()).into_iter();
        warnings.extend(notes.map(|message| Located::note(&name, message)));
        Ok(Model { live, name, text, warnings })
    }

    fn check(&self) -> String {
        serde_json::to_string(&self.warnings).unwrap_or_default()
    }

    fn names(&self) -> String {
        let known = self.knowledge();
        json!({
            "variables": known.variables().iter().map(|it| &it.name).collect::<Vec<_>>(),
            "relations": known.relations().iter().map(|it| &it.name).collect::<Vec<_>>(),
            "signals": known.signals().iter().map(|it| &it.name).collect::<Vec<_>>(),
            "needs": known.needs().iter().map(|it| &it.signal).collect::<Vec<_>>(),
        })
        .to_string()
    }

    /// The signals that come from outside, with the places from which they come, and the needs.
    fn places(&self) -> String {
        let known = self.knowledge();
        let outside = known.signals().enumerate().filter(|(id, _)| !known.is_computed(*id));
        let signal = |(_, it): (SignalId, &Signal)| {
            let place = if it.source.is_empty() { &it.name } else { &it.source };
            let topic = place.parse().map_or_else(|_| place.as_str().into(), |it: Source| it.on_bus().0);
            let period_s = it.period().map(|period| period.seconds());
            json!({ "name": it.name, "place": place, "topic": &*topic, "holds": it.holds, "period_s": period_s })
        };
        let need = |it: &Need| {
            let variable = &known.variables()[it.variable];
            let unit = variable.unit.as_ref().map(ToString::to_string);
            json!({ "name": it.signal, "unit": unit, "is_vector": variable.shape == Shape::Vector })
        };
        let (signals, needs) = (outside.map(signal), known.needs().iter().map(need));
        json!({ "signals": signals.collect::<Vec<_>>(), "needs": needs.collect::<Vec<_>>() }).to_string()
    }

    fn plan(
        &self,
        py: Python<'_>,
        variable: &str,
        top: usize,
        exclude: Vec<String>,
        behind: bool,
        limit: Option<u64>,
    ) -> PyResult<String> {
        let known = self.knowledge();
        let variable = self.variable(py, variable)?;
        let forbidden_signals =
            exclude.iter().map(|name| self.signal(py, name)).collect::<PyResult<Vec<SignalId>>>()?;
        let excluded = |signal: SignalId| forbidden_signals.contains(&signal);
        let options = plan::Options {
            forbidden_signals: forbidden_signals.clone(),
            substitute_provided: behind,
            ..plan::Options::default()
        };
        let mut limits = Limits::default();
        limits.expansions = limit.unwrap_or(limits.expansions);
        let plan = py.detach(|| plan::best(&Graph::new(known), variable, &options, top, limits));
        let found = plan.substitutions.iter();
        let found = found.map(|(it, utility)| Names::of(known, it, &excluded).to_json(*utility));
        Ok(json!({
            "stop": plan.stop.to_string(),
            "expanded": plan.expanded,
            "bound": plan.bound,
            "substitutions": found.collect::<Vec<Value>>(),
        })
        .to_string())
    }

    fn analyze(&self, py: Python<'_>, additions: usize, only_runnable: bool) -> PyResult<String> {
        let mut options = Options { only_runnable, ..Options::default() };
        if additions == 0 {
            options.addition_steps = 0;
        }
        work::run(py, None, |_| {
            let mut analysis = analyze(self.knowledge(), options);
            analysis.additions.truncate(additions);
            let report = analysis::Report::new(self.knowledge(), &analysis, options, &self.name);
            serde_json::to_string(&report.json(0)).unwrap_or_default()
        })
    }
}
