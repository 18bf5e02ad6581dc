//! Needs: the variables that must stay available, and the demands on their sources.

use super::ids::VariableId;
use crate::time::Span;
use alloc::string::String;

/// A variable that must stay available.
#[derive(Clone, Debug)]
pub struct Need {
    /// The needed variable.
    pub variable: VariableId,
    /// The name of the publication.
    pub signal: String,
    /// How old a published value may be.
    pub max_age: Span,
    /// How wide a published interval may be, SI.
    pub max_width: Option<f64>,
    /// The least integrity level of the sources, `A` to `D`.
    pub integrity: Option<char>,
    /// The least rate of the sources' signals, observations a second.
    pub min_rate_hz: Option<f64>,
    /// What is published while every source is suspect.
    pub when_unsure: WhenUnsure,
    /// The switching between sources.
    pub switching: Switching,
    /// Whether substitutes are computed in processes of their own, where the system has such.
    pub is_isolated: bool,
}

/// What is published for a need while every source is suspect: one source is faulty, and the faulty one is unknown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WhenUnsure {
    /// The interval of what enough of the candidates hold possible, which holds the truth. The default where a largest width is
    /// stated.
    Hull,
    /// The last trusted value, until it is too old.
    Last,
    /// Nothing.
    Withhold,
    /// Nothing while sources contradict each other, and the event tells what would serve; a source that nothing contradicts any more
    /// serves as uncertain. The default where no largest width is stated.
    #[default]
    Unstated,
}

impl WhenUnsure {
    /// Every choice that a model can state.
    pub const ALL: [WhenUnsure; 3] = [WhenUnsure::Hull, WhenUnsure::Last, WhenUnsure::Withhold];

    /// The choice's name in models.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            WhenUnsure::Hull => "hull",
            WhenUnsure::Last => "last",
            WhenUnsure::Withhold | WhenUnsure::Unstated => "withhold",
        }
    }
}

/// The places where substitutes are computed, by their names in models, and whether that is a process of its own.
pub const ISOLATIONS: [(&str, bool); 2] = [("engine", false), ("process", true)];

/// Integrity levels and their numbers in the property `integrity`, the highest last.
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
    /// By what share the utility of a trusted source must be better to leave a healthy one.
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
