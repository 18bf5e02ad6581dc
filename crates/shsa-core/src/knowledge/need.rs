//! Needs: which variables must stay available, and what may serve them.

use super::ids::VariableId;
use crate::time::Span;
use alloc::string::String;

/// A variable that must stay available.
#[derive(Clone, Debug)]
pub struct Need {
    /// The variable that is needed.
    pub variable: VariableId,
    /// The name under which it is published.
    pub signal: String,
    /// How old a published value may be.
    pub max_age: Span,
    /// How wide a published interval may be, SI.
    pub max_width: Option<f64>,
    /// The least integrity level of all that serves it, `A` to `D`.
    pub integrity: Option<char>,
    /// The least rate of the signals that serve it, observations a second.
    pub min_rate_hz: Option<f64>,
    /// What goes out while all that could serve it is suspect.
    pub when_unsure: WhenUnsure,
    /// How switching behaves.
    pub switching: Switching,
    /// Whether its substitutes are to be computed in processes of their own, where the system has such.
    pub is_isolated: bool,
}

/// What serves a need while all of its sources are suspect: one of them lies, and nothing tells which.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WhenUnsure {
    /// All that enough of the candidates hold possible, as an interval: the truth is in it. Usual where a largest width is
    /// stated.
    Hull,
    /// The last trusted value, until it is too old.
    Last,
    /// Nothing. Usual where no largest width is stated.
    #[default]
    Withhold,
}

impl WhenUnsure {
    /// Every choice.
    pub const ALL: [WhenUnsure; 3] = [WhenUnsure::Hull, WhenUnsure::Last, WhenUnsure::Withhold];

    /// The word for it in models.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            WhenUnsure::Hull => "hull",
            WhenUnsure::Last => "last",
            WhenUnsure::Withhold => "withhold",
        }
    }
}

/// Where substitutes of a need are computed, as models name it, and whether that is in processes of their own.
pub const ISOLATIONS: [(&str, bool); 2] = [("engine", false), ("process", true)];

/// Integrity levels with their numbers in the property `integrity`, the highest last.
pub const INTEGRITY_LEVELS: [(&str, f64); 4] = [("A", 1.0), ("B", 2.0), ("C", 3.0), ("D", 4.0)];

/// The number of an integrity level.
#[must_use]
pub fn integrity_level(name: &str) -> Option<f64> {
    INTEGRITY_LEVELS.iter().find(|(known, _)| *known == name).map(|(_, level)| *level)
}

/// How a need switches between its sources.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Switching {
    /// At most one voluntary switch in this time; a lost source is replaced at once.
    pub hold: Span,
    /// How long a recovered source must stay healthy before the need goes back to it.
    pub probation: Span,
    /// How long the output moves from the old source to the new one; zero switches at once.
    pub blend: Span,
    /// By how much better the utility of a trusted source must be to leave a healthy one, as a share.
    pub hysteresis: f64,
}

impl Default for Switching {
    fn default() -> Self {
        Switching {
            hold: Span::from_millis(1_000),
            probation: Span::from_millis(5_000),
            blend: Span::ZERO,
            hysteresis: 0.0,
        }
    }
}
