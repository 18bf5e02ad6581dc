//! What comparisons show that the declared bounds allow: notes, which accuse nobody.

use serde_json::{Value, json};
use shsa_core::engine::{Engine, difference_text, span_text};
use shsa_core::knowledge::{KnowledgeBase, VariableId};
use shsa_core::monitor::{Note, WayIndex};

/// A note of two ways of knowing a variable.
pub(crate) struct Noted {
    variable: String,
    one: String,
    other: String,
    note: Note,
    /// The mean difference in the unit of the variable, and in words.
    mean: f64,
    shown: String,
}

impl Noted {
    /// What it is about, in words.
    pub(crate) fn name(&self) -> String {
        let Noted { variable, one, other, .. } = self;
        format!("{variable}: {one} and {other}")
    }

    /// All of it, in words.
    pub(crate) fn text(&self) -> String {
        let Noted { variable, one, other, shown, .. } = self;
        match self.note {
            Note::Scatter => {
                format!("{variable}: {one} and {other} scatter against each other, within their errors")
            }
            Note::Drift { mean, parts_in } => {
                let (more, less) = if mean < 0.0 { (other, one) } else { (one, other) };
                let until = parts_in
                    .map_or(String::new(), |span| format!("; at this pace they part in {}", span_text(span)));
                format!(
                    "{variable}: {more} has said {shown} more than {less} on average, within their errors{until}"
                )
            }
        }
    }

    pub(crate) fn json(&self) -> Value {
        let Noted { variable, one, other, mean, .. } = self;
        let about = json!({ "variable": variable, "one": one, "other": other });
        let more = match self.note {
            Note::Scatter => json!({ "shows": "scatter" }),
            Note::Drift { parts_in, .. } => {
                json!({ "shows": "drift", "mean": mean, "parts_in_s": parts_in.map(|it| it.seconds()) })
            }
        };
        let fields = [about, more].into_iter().filter_map(|it| it.as_object().cloned()).flatten();
        Value::Object(fields.collect())
    }
}

/// What shows now.
pub(crate) fn notes(engine: &Engine) -> impl Iterator<Item = Noted> + '_ {
    let (monitor, knowledge) = (engine.monitor(), engine.knowledge());
    let way = |index: WayIndex| {
        monitor.way(index).map(|way| way.computation.way().describe(knowledge)).unwrap_or_default()
    };
    monitor.pairs().iter().filter_map(move |pair| {
        let note = pair.trend.note()?;
        let variable = monitor.way(pair.way)?.variable();
        let mean = match note {
            Note::Drift { mean, .. } => mean,
            Note::Scatter => 0.0,
        };
        Some(Noted {
            variable: knowledge.variables()[variable].name.clone(),
            one: way(pair.way),
            other: way(pair.other),
            note,
            mean: in_unit(knowledge, variable, mean),
            shown: difference_text(knowledge, variable, mean.abs()),
        })
    })
}

fn in_unit(knowledge: &KnowledgeBase, variable: VariableId, difference: f64) -> f64 {
    knowledge.variables()[variable].unit.as_ref().map_or(difference, |unit| difference / unit.scale)
}
