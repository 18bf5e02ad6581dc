//! Why something was decided, as data: a stable code with arguments, made where the decision is made.
//!
//! The core tells no sentences. `shsa_format::words` puts a reason in words; files keep the code and the arguments. A reason
//! holds names, not ids: it outlives a change of the knowledge base and a restart.

mod argument;
mod table;

pub use argument::{Amount, Argument, Candidate, Kind, Probability, Proof, Range, ServedBy};
pub use table::Reason;

use alloc::string::String;
use alloc::vec::Vec;

/// What a code stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Described {
    /// The code: stable, unique.
    pub code: &'static str,
    /// The arguments: what each is called, and its kind.
    pub arguments: &'static [(&'static str, Kind)],
}

/// How a reason follows the one before it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Joint {
    /// It is the next one.
    #[default]
    Next,
    /// It says more exactly what the one before is about.
    Namely,
    /// Both together decided.
    And,
    /// It is one more of a list.
    Also,
    /// It gives the figures of the one before.
    With,
}

impl Joint {
    /// Every joint.
    pub const ALL: [Joint; 5] = [Joint::Next, Joint::Namely, Joint::And, Joint::Also, Joint::With];

    /// What it is called in files.
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

/// A reason among others.
#[derive(Clone, Debug, PartialEq)]
pub struct Clause {
    /// How it follows the one before; of the first, it means nothing.
    pub joint: Joint,
    /// The reason.
    pub reason: Reason,
}

/// Why something was decided: reasons in the order in which they are told.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Reasons(Vec<Clause>);

impl Reasons {
    /// Words as somebody else gave them.
    #[must_use]
    pub fn told(words: impl Into<String>) -> Reasons {
        Reasons::from(Reason::Told { words: words.into() })
    }

    /// These and more.
    #[must_use]
    pub fn then(mut self, joint: Joint, more: impl Into<Reasons>) -> Reasons {
        let first = self.0.len();
        self.0.extend(more.into().0);
        if let Some(clause) = self.0.get_mut(first) {
            clause.joint = joint;
        }
        self
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The reasons with how each follows the one before.
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
