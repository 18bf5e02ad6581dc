//! Why a substitution is no answer, in numbers.

use crate::knowledge::{INTEGRITY_LEVELS, KnowledgeBase, RelationId, SignalId, VariableId};
use crate::reason::Reason;
use crate::time::Span;
use alloc::string::{String, ToString};

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
    /// With names, SI units.
    #[must_use]
    pub fn reason(&self, knowledge: &KnowledgeBase) -> Reason {
        let variable = |id: VariableId| knowledge.variables()[id].name.clone();
        let relation = |id: RelationId| knowledge.relations()[id].name.clone();
        match *self {
            Shortfall::Signal(id) => Reason::NoSignalOf { variable: variable(id) },
            Shortfall::Relation(id) => Reason::RelationBarred { relation: relation(id) },
            Shortfall::Rate(id, rate_hz, least_hz) => {
                Reason::RateTooLow { variable: variable(id), rate_hz, least_hz }
            }
            Shortfall::SignalIntegrity(id, own, least) => {
                Reason::SignalsIntegrity { variable: variable(id), level: letter(own), least: letter(least) }
            }
            Shortfall::RelationIntegrity(id, own, least) => {
                Reason::RelationIntegrity { relation: relation(id), level: letter(own), least: letter(least) }
            }
            Shortfall::Shared(id, signal) => {
                let signal = knowledge.signals()[signal].name.clone();
                Reason::NotIndependent { variable: variable(id), signal }
            }
            Shortfall::Latency(own, most) => {
                Reason::RestsOnOld { age_s: own.seconds(), most_s: most.seconds() }
            }
            Shortfall::Period(own, most) => {
                Reason::ComesRarely { period_s: own.seconds(), most_s: most.seconds() }
            }
            Shortfall::Width(width, most) => Reason::TooWide { width, most },
        }
    }
}

fn letter(level: f64) -> String {
    let held = INTEGRITY_LEVELS.iter().rev().find(|(_, least)| level >= *least);
    held.map_or("none", |(name, _)| *name).to_string()
}
