//! Evidence as it is read at a moment.

use crate::interval::Truth;
use crate::knowledge::{ContractId, Watched};
use crate::substitution::Way;
use crate::time::Time;

/// The truth of a piece of evidence at a moment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reading {
    /// Whether the evidence is true.
    pub truth: Truth,
    /// When the passing of time alone may change the truth; [`Time::MAX`] where it cannot.
    pub until: Time,
}

impl Reading {
    /// The reading of evidence of which nothing is known.
    pub const UNKNOWN: Reading = Reading::lasting(Truth::Unknown);

    /// A reading that time alone does not change.
    #[must_use]
    pub const fn lasting(truth: Truth) -> Reading {
        Reading { truth, until: Time::MAX }
    }
}

/// Reads a piece of evidence of a contract, while a way serves the need.
pub type Read<'r> = &'r (dyn Fn(ContractId, &Watched, &Way) -> Reading + Sync);
