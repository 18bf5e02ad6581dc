//! Models: checked with every problem at its place, laid out, drawn, analysed.

use crate::Problem;
use serde_json::{Value, json};
use shsa_core::analysis::{Options, analyze_with};
use shsa_core::knowledge::KnowledgeBase;
use shsa_drawing::Marks;
use shsa_model::live::{Live, Written};
use shsa_model::{layout, load};
use shsa_report::analysis::Report;
use wasm_bindgen::prelude::wasm_bindgen;

/// Reads and checks a model; returns what `shsa check --json` prints. `name` is the file in the diagnostics.
#[wasm_bindgen]
#[must_use]
pub fn check(text: &str, name: &str) -> String {
    let mut loaded = load(text, name);
    shsa_report::check::complete(&mut loaded, name);
    shsa_report::check::json(&loaded).to_string()
}

/// A model without errors.
#[wasm_bindgen]
pub struct Model {
    live: Live,
    name: String,
    text: String,
}

impl Model {
    pub(crate) fn knowledge(&self) -> &KnowledgeBase {
        self.live.knowledge()
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    pub(crate) fn text(&self) -> &str {
        &self.text
    }
}

#[wasm_bindgen]
impl Model {
    /// Reads a model in YAML or JSON.
    ///
    /// # Errors
    /// All problems of the text, with their places.
    #[wasm_bindgen(constructor)]
    pub fn new(text: &str, name: &str) -> Result<Model, Problem> {
        let (live, _) = Live::load(Written { name, text })?;
        Ok(Model { live, name: name.to_owned(), text: text.to_owned() })
    }

    /// The names of variables, relations, signals and needs, with what a list shows of them.
    #[must_use]
    pub fn parts(&self) -> String {
        let known = self.knowledge();
        let unit = |variable| known.variables()[variable].unit.as_ref().map(ToString::to_string);
        let name = |variable| known.variables()[variable].name.as_str();
        let variables: Vec<&str> = known.variables().iter().map(|it| it.name.as_str()).collect();
        let relations: Vec<&str> = known.relations().iter().map(|it| it.name.as_str()).collect();
        let signal = |it: &shsa_core::knowledge::Signal| json!({ "name": it.name, "variable": name(it.variable), "unit": unit(it.variable), "source": it.source });
        let need = |it: &shsa_core::knowledge::Need| json!({ "signal": it.signal, "variable": name(it.variable), "unit": unit(it.variable) });
        let signals: Vec<Value> = known.signals().iter().map(signal).collect();
        let needs: Vec<Value> = known.needs().iter().map(need).collect();
        json!({ "variables": variables, "relations": relations, "signals": signals, "needs": needs })
            .to_string()
    }

    /// The text as `shsa fmt` lays it out.
    ///
    /// # Errors
    /// A text that is no YAML.
    pub fn formatted(&self) -> Result<String, Problem> {
        Ok(layout::laid_out(Written { name: &self.name, text: &self.text })?)
    }

    /// The knowledge graph as SVG.
    ///
    /// # Errors
    /// A model that is too large to draw.
    pub fn svg(&self) -> Result<String, Problem> {
        shsa_drawing::svg(self.knowledge(), &Marks::default()).map_err(Problem::of)
    }

    /// Which faults can be detected, isolated and healed: what `shsa analyze --json` prints.
    #[must_use]
    pub fn analyze(&self, additions: usize) -> String {
        self.analysis(additions, |report| serde_json::to_string(&report.json(0)).unwrap_or_default())
    }

    /// The analysis as a page for the browser.
    #[must_use]
    pub fn analysis_page(&self, additions: usize) -> String {
        self.analysis(additions, |report| report.page())
    }

    fn analysis(&self, additions: usize, write: impl Fn(&Report<'_>) -> String) -> String {
        let mut options = Options::default();
        if additions == 0 {
            options.addition_steps = 0;
        }
        let mut analysis = analyze_with(self.knowledge(), &[], options);
        analysis.additions.truncate(additions);
        write(&Report::new(self.knowledge(), &analysis, options, &self.name))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_problem_has_its_place() {
        let text = "shsa: 1\nvariables: { v: { unit: m/s, range: [0, 60] } }\n\nsignals: { wheel: { variable: w } }\n";
        let checked: Value = serde_json::from_str(&check(text, "car.yaml")).unwrap();
        let all = checked["diagnostics"].as_array().unwrap();
        let unknown = all.iter().find(|it| it["message"] == "there is no variable `w`").unwrap();
        assert_eq!((&unknown["file"], &unknown["line"]), (&json!("car.yaml"), &json!(4)));
        assert!(matches!(Model::new(text, "car.yaml"), Err(Problem::Model(_))));
    }
}
