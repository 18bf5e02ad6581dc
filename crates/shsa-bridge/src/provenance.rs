//! The provenance of a published value, in the terms of OPC UA.
//!
//! The names and numbers of the status codes are those of OPC 10000-4 (Services), 7.39, and 10000-8 (Data Access), 6.3.

use shsa_core::assurance::Ground;
use shsa_message::json;
use std::fmt::{self, Write};

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
    /// What safety contracts say of it; `None` where they demand nothing.
    pub admission: Option<Admission>,
}

impl Provenance {
    /// Of something of which no contract demands anything.
    #[must_use]
    pub fn new(quality: Quality, source: impl Into<String>) -> Provenance {
        Provenance { quality, source: source.into(), admission: None }
    }

    /// The names and texts that stand beside a value on MQTT.
    #[cfg(feature = "mqtt")]
    pub(crate) fn words(&self) -> impl Iterator<Item = (String, String)> + '_ {
        let own = [
            ("quality", self.quality.name().to_owned()),
            ("status", self.quality.code().to_string()),
            ("source", self.source.clone()),
        ];
        let own = own.into_iter().map(|(name, text)| (name.to_owned(), text));
        own.chain(self.admission.iter().flat_map(Admission::words))
    }
}

/// On which ground safety contracts let a value go out, and the integrity level that is given with it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Admission {
    /// Why it may go out.
    pub ground: Ground,
    /// The level with its scale (`SIL 2`); `None` where none is given.
    pub level: Option<String>,
    /// The place of the level on its scale, the lowest is 1; 0 where none is given. Another instance reads it as a number.
    pub rank: u32,
}

impl Admission {
    /// The properties that carry the level, by name; none without a level.
    #[cfg(feature = "mqtt")]
    pub(crate) fn words(&self) -> impl Iterator<Item = (String, String)> + use<> {
        let Admission { ground, level, rank } = self;
        let rest = [("admitted", ground.name().to_owned()), ("rank", rank.to_string())];
        let level = level.clone().map(|level| ("level", level));
        rest.into_iter().chain(level).map(|(name, word)| (name.to_owned(), word))
    }

    /// The members of a JSON object that carry the level, each after a comma.
    pub(crate) fn push_members(&self, text: &mut String) {
        let _cannot_fail = write!(text, r#","admitted":"{}","level":"#, self.ground.name());
        match &self.level {
            Some(level) => json::push_quoted(level, text),
            None => text.push_str("null"),
        }
        let _cannot_fail = write!(text, r#","rank":{}"#, self.rank);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::payload::Writer;
    use shsa_core::time::Time;

    #[test]
    fn an_envelope_tells_the_level() {
        let admission = |level: Option<&str>, rank| Admission {
            ground: Ground::Degraded,
            level: level.map(str::to_owned),
            rank,
        };
        let check = |admission, expected: &str| {
            let provenance = Provenance { admission: Some(admission), ..Provenance::new(Quality::Good, "a") };
            let written = Writer::envelope().write(None, Time(0), &provenance).unwrap().unwrap();
            let text = String::from_utf8(written.to_vec()).unwrap();
            assert!(text.ends_with(expected), "{text}");
            serde_json::from_str::<serde_json::Value>(&text).unwrap();
        };
        check(
            admission(Some("ASIL B"), 3),
            r#""source":"a","admitted":"degraded","level":"ASIL B","rank":3}"#,
        );
        check(admission(None, 0), r#""source":"a","admitted":"degraded","level":null,"rank":0}"#);
    }
}
