//! The results of the comparisons of a run that accuse no signal: comparisons that were not made, and differences within the
//! declared errors.

use crate::words;
use serde_json::{Value, json};
use shsa_core::engine::Engine;
use shsa_core::knowledge::{KnowledgeBase, VariableId};
use shsa_core::monitor::{Coverage, Note, WayIndex};

/// A note on two ways to compute a variable.
pub struct Noted {
    variable: String,
    one: String,
    other: String,
    note: Note,
    /// The mean difference in the unit of the variable; `shown` is the same in words.
    mean: f64,
    shown: String,
}

impl Noted {
    /// The subject of the note in words.
    #[must_use]
    pub fn name(&self) -> String {
        let Noted { variable, one, other, .. } = self;
        format!("{variable}: {one} and {other}")
    }

    /// The whole note in words.
    #[must_use]
    pub fn text(&self) -> String {
        let Noted { variable, one, other, shown, .. } = self;
        match self.note {
            Note::Scatter => {
                format!("{variable}: {one} and {other} scatter against each other, within their errors")
            }
            Note::Drift { mean, parts_in } => {
                let (more, less) = if mean < 0.0 { (other, one) } else { (one, other) };
                let until = parts_in.map_or(String::new(), |span| {
                    format!("; at this pace they part in {}", words::span(span))
                });
                format!(
                    "{variable}: {more} has said {shown} more than {less} on average, within their errors{until}"
                )
            }
        }
    }

    /// The whole note as a JSON object.
    #[must_use]
    pub fn json(&self) -> Value {
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

/// The present notes.
pub fn notes(engine: &Engine) -> impl Iterator<Item = Noted> + '_ {
    let (monitor, knowledge) = (engine.monitor(), engine.knowledge());
    let way = |index: WayIndex| {
        monitor.way(index).map(|way| way.computation.way().describe(knowledge)).unwrap_or_default()
    };
    monitor.residuals().iter().filter_map(move |pair| {
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
            shown: words::difference(knowledge, variable, mean.abs()),
        })
    })
}

fn in_unit(knowledge: &KnowledgeBase, variable: VariableId, difference: f64) -> f64 {
    knowledge.variables()[variable].unit.as_ref().map_or(difference, |unit| difference / unit.scale)
}

/// A comparison, how often it was made and how often it was possible.
#[derive(Clone)]
pub struct Compared {
    variable: String,
    one: String,
    other: String,
    coverage: Coverage,
}

impl Compared {
    /// The compared ways in words.
    #[must_use]
    pub fn name(&self) -> String {
        let Compared { variable, one, other, .. } = self;
        format!("{variable}: {one} and {other}")
    }

    /// The comparison and its counts as a JSON object.
    #[must_use]
    pub fn json(&self) -> Value {
        let Compared { variable, one, other, coverage } = self;
        let Coverage { made, possible, .. } = coverage;
        json!({ "variable": variable, "one": one, "other": other, "made": made, "possible": possible })
    }

    /// The warning about the comparison when it was never made although there were values, or rarely.
    #[must_use]
    pub fn warning(&self) -> Option<String> {
        let coverage = &self.coverage;
        let how = match (coverage.is_missing(), coverage.is_rare()) {
            (true, _) if coverage.is_conditional => {
                "were never compared: a condition never held while both spoke"
            }
            (true, _) => "were never compared: there is no moment about which both say something",
            (_, true) => "were rarely compared",
            _ => return None,
        };
        Some(format!("{} {how} ({} times of {})", self.name(), coverage.made, coverage.possible))
    }
}

/// The comparisons of several runs of one model, with the counts added up.
#[must_use]
pub fn compared<'e>(engines: impl Iterator<Item = &'e Engine>) -> Vec<Compared> {
    let mut all: Vec<Compared> = Vec::new();
    for engine in engines {
        for (at, coverage) in engine.monitor().coverage(engine.knowledge()).enumerate() {
            let (variable, one, other) = described(engine, &coverage);
            let new = Compared { variable, one, other, coverage };
            match all.get_mut(at).filter(|known| known.name() == new.name()) {
                Some(known) => {
                    known.coverage.made += coverage.made;
                    known.coverage.possible += coverage.possible;
                }
                None => all.push(new),
            }
        }
    }
    all
}

/// The variable and the two ways of a comparison.
fn described(engine: &Engine, coverage: &Coverage) -> (String, String, String) {
    let (monitor, knowledge) = (engine.monitor(), engine.knowledge());
    let way = |index: WayIndex| {
        monitor.way(index).map(|way| way.computation.way().describe(knowledge)).unwrap_or_default()
    };
    let variable = monitor.way(coverage.way).map(|way| knowledge.variables()[way.variable()].name.clone());
    (variable.unwrap_or_default(), way(coverage.way), way(coverage.other))
}
