//! The steps of a comparison, printed as a table or as JSON lines.

use super::method::Step;
use super::{Comparison, Mode};
use crate::show;
use serde_json::{Value, json};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{KnowledgeBase, VariableId};
use shsa_core::reason::Range;
use shsa_core::substitution::Way;
use shsa_core::time::Time;
use shsa_format::text::counted;
use shsa_report::Paint;
use std::collections::BTreeMap;
use std::io::{Write, stdout};

/// The width of an error column in characters.
const WIDTH: usize = 8;

/// `null` instead of infinity, which JSON lacks.
fn finite(value: f64) -> Option<f64> {
    Some(value).filter(|value| value.is_finite())
}

pub(super) struct Printer<'a> {
    knowledge: &'a KnowledgeBase,
    variable: VariableId,
    mode: Mode,
    json: bool,
    /// The origin of the times in the text.
    start: Time,
    steps: usize,
    /// Whether left-out combinations were reported.
    truncated: bool,
    /// The number of steps in which each way has failed.
    failures: BTreeMap<usize, usize>,
}

impl<'a> Printer<'a> {
    pub(super) fn new(
        knowledge: &'a KnowledgeBase,
        variable: VariableId,
        comparison: &Comparison<'_>,
        start: Option<Time>,
    ) -> Printer<'a> {
        let (mode, json, start) = (comparison.settings.mode, comparison.json, start.unwrap_or_default());
        Printer {
            knowledge,
            variable,
            mode,
            json,
            start,
            steps: 0,
            truncated: false,
            failures: BTreeMap::new(),
        }
    }

    pub(super) fn head(&self, ways: &[Way]) -> anyhow::Result<()> {
        if self.json {
            return Ok(());
        }
        let mut output = stdout().lock();
        let variable = &self.knowledge.variables()[self.variable];
        writeln!(output, "{} is known in {}:", variable.name, counted(ways.len(), "way"))?;
        for (number, way) in ways.iter().enumerate() {
            writeln!(output, "{number:>4}  {}", way.describe(self.knowledge))?;
        }
        let unit = variable.unit.as_ref().map_or(String::new(), |unit| format!(" in {unit}"));
        match self.mode {
            Mode::Thesis => {
                writeln!(output, "Errors: how far a way is from each other one, summed{unit}.\n")?
            }
            Mode::Default => {
                writeln!(
                    output,
                    "Errors: the share of recent comparisons with each other way that disagree, summed.\n"
                )?;
            }
        }
        let columns: String =
            (0..ways.len()).map(|number| format!("  {:>WIDTH$}", format!("way {number}"))).collect();
        writeln!(output, "{}", show::style().paint(Paint::Bold, &format!("{:>12}{columns}", "time")))?;
        Ok(())
    }

    pub(super) fn foot(&self, ways: &[Way]) -> anyhow::Result<()> {
        if self.json {
            return Ok(());
        }
        let mut output = stdout().lock();
        writeln!(output, "\n{}", counted(self.steps, "step"))?;
        for (&number, count) in &self.failures {
            let way = ways.get(number).map_or(String::new(), |way| way.describe(self.knowledge));
            writeln!(output, "way {number} ({way}) failed in {count} of them")?;
        }
        Ok(())
    }

    /// The bounds of a value in the variable's unit.
    fn shown(&self, value: Interval) -> [Option<f64>; 2] {
        let Range { lo, hi, .. } = Range::of(self.knowledge, self.variable, value);
        [finite(lo), finite(hi)]
    }

    pub(super) fn step(&mut self, step: &Step) -> anyhow::Result<()> {
        self.steps += 1;
        if step.truncated && !std::mem::replace(&mut self.truncated, true) {
            show::warn(
                "too many combinations of observations: errors are of a part of them; a smaller --buffer or --period helps",
            );
        }
        if let Some(failed) = step.failed {
            *self.failures.entry(failed).or_default() += 1;
        }
        let mut output = stdout().lock();
        if self.json {
            writeln!(output, "{}", self.to_json(step))?;
        } else {
            writeln!(output, "{}", self.to_text(step))?;
        }
        Ok(())
    }

    fn to_json(&self, step: &Step) -> Value {
        let outputs: Vec<Value> = step
            .outputs
            .iter()
            .map(|output| {
                json!({
                    "substitution": output.way,
                    "value": self.shown(output.value),
                    "time": output.validity.map(|validity| [validity.from.0, validity.to.0]),
                })
            })
            .collect();
        let mut object = json!({
            "time_ns": step.time.0,
            "outputs": outputs,
            "errors": step.errors.iter().map(|error| finite(self.error(*error))).collect::<Vec<_>>(),
            "failed": step.failed.map_or(-1, |way| i64::try_from(way).unwrap_or(-1)),
        });
        if let (false, Some(object)) = (step.verdicts.is_empty(), object.as_object_mut()) {
            let verdicts: serde_json::Map<String, Value> =
                step.verdicts.iter().map(|(signal, verdict)| (signal.clone(), json!(verdict))).collect();
            object.insert("verdicts".to_owned(), verdicts.into());
        }
        object
    }

    /// An error: in thesis mode a difference of values, in the default mode a number of pairs.
    fn error(&self, error: f64) -> f64 {
        match (self.mode, &self.knowledge.variables()[self.variable].unit) {
            (Mode::Thesis, Some(unit)) => error / unit.scale,
            _ => error,
        }
    }

    fn to_text(&self, step: &Step) -> String {
        let cell = |error: &f64| format!("  {:>WIDTH$.3}", self.error(*error));
        let errors: String = step.errors.iter().map(cell).collect();
        let time = (step.time - self.start).seconds();
        let line = format!("{time:>10.3} s{errors}  {}", self.findings(step).join(", "));
        line.trim_end().to_owned()
    }

    /// The failed way; in the default mode, every signal that is not healthy.
    fn findings(&self, step: &Step) -> Vec<String> {
        if self.mode == Mode::Thesis {
            let failed = step.failed.map(|way| show::style().paint(Paint::Red, &format!("way {way} failed")));
            return failed.into_iter().collect();
        }
        let unwell = step.verdicts.iter().filter(|(_, verdict)| *verdict != "healthy");
        unwell
            .map(|(signal, verdict)| show::style().verdict(verdict, &format!("{signal} {verdict}")))
            .collect()
    }
}
