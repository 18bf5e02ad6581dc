//! The provenance of a published value, in the terms of OPC UA.
//!
//! The names and numbers of the status codes are those of OPC 10000-4 (Services), 7.39, and 10000-8 (Data Access), 6.3.

use std::fmt;

/// The quality of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Quality {
    /// From the need's own source, which is trusted.
    Good,
    /// Computed by a substitute, within its stated interval.
    Substitute,
    /// No trusted source can serve the need: the value lies within the stated bounds, and their midpoint is no estimate.
    Uncertain,
    /// Nothing serves the need now; this is the last value, which is still fresh enough.
    LastUsable,
    /// Nothing serves the need.
    Bad,
}

impl Quality {
    /// Every quality, the best first.
    pub const ALL: [Quality; 5] =
        [Quality::Good, Quality::Substitute, Quality::Uncertain, Quality::LastUsable, Quality::Bad];

    /// The name of its status code.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Quality::Good => "Good",
            Quality::Substitute => "UncertainSubstituteValue",
            Quality::Uncertain => "UncertainSubNormal",
            Quality::LastUsable => "UncertainLastUsableValue",
            Quality::Bad => "Bad",
        }
    }

    /// The quality with this name; `None` for other words.
    #[must_use]
    pub fn named(name: &str) -> Option<Quality> {
        Quality::ALL.into_iter().find(|quality| quality.name() == name)
    }

    /// The number of its status code.
    #[must_use]
    pub fn code(self) -> u32 {
        match self {
            Quality::Good => 0x0000_0000,
            Quality::Substitute => 0x4091_0000,
            Quality::Uncertain => 0x4095_0000,
            Quality::LastUsable => 0x4090_0000,
            Quality::Bad => 0x8000_0000,
        }
    }
}

impl fmt::Display for Quality {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The provenance of a value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Provenance {
    /// The quality.
    pub quality: Quality,
    /// The source: signals and relations, as events name them.
    pub source: String,
}
