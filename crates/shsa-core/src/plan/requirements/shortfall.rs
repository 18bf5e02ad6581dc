//! Why a substitution is no answer, in numbers and in words.

use crate::knowledge::{INTEGRITY_LEVELS, KnowledgeBase, RelationId, SignalId, VariableId};
use crate::time::Span;
use alloc::format;
use alloc::string::String;

/// Why a substitution is no answer.
#[derive(Clone, Debug, PartialEq)]
pub enum Shortfall {
    /// Forbidden, or not available; no other signal carries the variable.
    Signal(VariableId),
    /// Forbidden.
    Relation(RelationId),
    /// No usable signal of a variable is as fast: the fastest, and what was asked.
    Rate(VariableId, f64, f64),
    /// No usable signal of a variable has the level: the highest, and what was asked.
    SignalIntegrity(VariableId, f64, f64),
    /// A relation does not have the level: its own, and what was asked.
    RelationIntegrity(RelationId, f64, f64),
    /// All signals of a variable share something with a suspect.
    Shared(VariableId, SignalId),
    /// The age of what it rests on, and the largest that was asked.
    Latency(Span, Span),
    /// The time between two of its values, and the longest that was asked.
    Period(Span, Span),
    /// The least width of its values, and the largest that was asked, SI.
    Width(f64, f64),
}

impl Shortfall {
    /// In words, with names, SI units.
    #[must_use]
    pub fn describe(&self, knowledge: &KnowledgeBase) -> String {
        let variable = |id: &VariableId| knowledge.variables()[*id].name.as_str();
        let relation = |id: &RelationId| knowledge.relations()[*id].name.as_str();
        match self {
            Shortfall::Signal(id) => format!("no signal of {} may be used", variable(id)),
            Shortfall::Relation(id) => format!("{} may not be used", relation(id)),
            Shortfall::Rate(id, rate, least) => {
                format!("signals of {} come {rate} times a second, not {least}", variable(id))
            }
            Shortfall::SignalIntegrity(id, own, least) => {
                format!("signals of {} have integrity {}, not {}", variable(id), letter(*own), letter(*least))
            }
            Shortfall::RelationIntegrity(id, own, least) => {
                format!("{} has integrity {}, not {}", relation(id), letter(*own), letter(*least))
            }
            Shortfall::Shared(id, signal) => {
                let signal = &knowledge.signals()[*signal].name;
                format!(
                    "{} is known only by {signal}, which is not independent of the suspects",
                    variable(id)
                )
            }
            Shortfall::Latency(own, most) => {
                format!("it rests on values {} s old, more than {} s", own.seconds(), most.seconds())
            }
            Shortfall::Period(own, most) => {
                format!("its values come every {} s, and may be {} s old", own.seconds(), most.seconds())
            }
            Shortfall::Width(own, most) => format!("its values are at least {own} wide, more than {most}"),
        }
    }
}

fn letter(level: f64) -> &'static str {
    INTEGRITY_LEVELS.iter().rev().find(|(_, least)| level >= *least).map_or("none", |(name, _)| *name)
}
