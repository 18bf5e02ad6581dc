//! Why a substitution falls short, in numbers.

use crate::knowledge::{INTEGRITY_LEVELS, KnowledgeBase, RelationId, SignalId, VariableId};
use crate::reason::Reason;
use crate::time::Span;
use alloc::string::{String, ToString};

/// A reason why a substitution falls short.
#[derive(Clone, Debug, PartialEq)]
pub enum Shortfall {
    /// The signal is forbidden or unavailable; no other signal carries the variable.
    Signal(VariableId),
    /// The relation is forbidden.
    Relation(RelationId),
    /// No usable signal of a variable is fast enough: the fastest rate, and the required one.
    Rate(VariableId, f64, f64),
    /// No usable signal of a variable has the level: the highest, and the required one.
    SignalIntegrity(VariableId, f64, f64),
    /// A relation does not have the level: its own, and the required one.
    RelationIntegrity(RelationId, f64, f64),
    /// A relation leaves open which of several values holds.
    Alternatives(RelationId),
    /// All signals of a variable have an origin in common with a suspect.
    Shared(VariableId, SignalId),
    /// The age of the inputs, and the largest allowed one.
    Latency(Span, Span),
    /// The time between two values, and the longest allowed one.
    Period(Span, Span),
    /// The least width of values, and the largest allowed one, SI.
    Width(f64, f64),
}

impl Shortfall {
    /// The shortfall as a reason, with names and SI units.
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
            Shortfall::Alternatives(id) => Reason::OneOfSeveral { relation: relation(id) },
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
