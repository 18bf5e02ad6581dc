//! The reasons of decisions, as data: a stable code with arguments, made together with the decision.
//!
//! The core makes no sentences. `shsa_format::words` puts a reason in words; files store the code and the arguments. A reason
//! holds names, not ids, so that it outlives a change of the knowledge base and a restart.

mod argument;
mod declared;
mod table;

pub use argument::{Amount, Argument, Candidate, Kind, Probability, Proof, Range, ServedBy};
pub use table::Reason;

use alloc::string::String;
use alloc::vec::Vec;

/// The description of a code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Described {
    /// The code: stable, unique.
    pub code: &'static str,
    /// The name and the kind of each argument.
    pub arguments: &'static [(&'static str, Kind)],
}

/// The relation of a reason to the one before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Joint {
    /// The next reason.
    #[default]
    Next,
    /// A more exact statement of the reason before.
    Namely,
    /// A second reason that decided together with the one before.
    And,
    /// A further element of a list.
    Also,
    /// The figures of the reason before.
    With,
}

impl Joint {
    /// Every joint.
    pub const ALL: [Joint; 5] = [Joint::Next, Joint::Namely, Joint::And, Joint::Also, Joint::With];

    /// The joint's name in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Joint::Next => "next",
            Joint::Namely => "namely",
            Joint::And => "and",
            Joint::Also => "also",
            Joint::With => "with",
        }
    }
}

/// A reason in a list.
#[derive(Clone, Debug, PartialEq)]
pub struct Clause {
    /// The relation to the reason before; without meaning for the first reason.
    pub joint: Joint,
    /// The reason.
    pub reason: Reason,
}

/// The reasons of a decision, in the order in which they are reported.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reasons(Vec<Clause>);

impl Reasons {
    /// A reason in words from outside.
    #[must_use]
    pub fn in_words(words: impl Into<String>) -> Reasons {
        Reasons::from(Reason::Text { words: words.into() })
    }

    /// Appends further reasons.
    #[must_use]
    pub fn then(mut self, joint: Joint, more: impl Into<Reasons>) -> Reasons {
        let first = self.0.len();
        self.0.extend(more.into().0);
        if let Some(clause) = self.0.get_mut(first) {
            clause.joint = joint;
        }
        self
    }

    /// Whether there is no reason.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The reasons, each with its relation to the one before.
    #[must_use]
    pub fn clauses(&self) -> &[Clause] {
        &self.0
    }

    /// The reasons alone.
    pub fn iter(&self) -> impl Iterator<Item = &Reason> {
        self.0.iter().map(|clause| &clause.reason)
    }
}

impl From<Reason> for Reasons {
    fn from(reason: Reason) -> Reasons {
        Reasons(Vec::from([Clause { joint: Joint::Next, reason }]))
    }
}

impl FromIterator<Clause> for Reasons {
    fn from_iter<I: IntoIterator<Item = Clause>>(clauses: I) -> Reasons {
        Reasons(clauses.into_iter().collect())
    }
}
