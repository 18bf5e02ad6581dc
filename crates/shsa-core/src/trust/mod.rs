//! Trust: how far each signal and relation may be relied on, and what that rests on, in one table.
//!
//! The judge, the detectors, silences, operators, a restart and a changed model all change the same [`Ledger`]. It has a
//! [`Standing`] for each component that is not simply sound, and the standing's state carries its own data: since when, by what
//! evidence, what supports the component again. [`Trust`] is the one scale that needs, estimators and contracts read from it.
//!
//! ```
//! use shsa_core::trust::Trust;
//! // A need takes the first rung on which it has a source.
//! assert!(Trust::Trusted < Trust::Returning && Trust::Unproven < Trust::Suspect);
//! ```

mod standing;
mod ledger;

pub use ledger::{ConflictPair, Ledger};
pub use standing::{Accusation, Accused, By, MOST_CONFLICTS, Record, Standing, Support};

use crate::knowledge::{CauseId, RelationId, SignalId};

/// A component that can be faulty.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Component {
    /// The signal gives wrong values.
    Signal(SignalId),
    /// A common cause has failed: all its signals may give wrong values.
    Cause(CauseId),
    /// The relation does not hold (a fault of the plant).
    Relation(RelationId),
}

/// The verdict on a signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// No independent witness has evidence about the signal.
    Unknown,
    /// An independent witness agrees with the signal.
    Healthy,
    /// The signal may be faulty, or others are.
    Suspect,
    /// The signal is faulty.
    Failed,
}

/// How far a component, or all that a way rests on, may be relied on; the best first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Trust {
    /// Nothing speaks against the component.
    #[default]
    Trusted,
    /// The signal has just come back after a silence.
    Returning,
    /// No evidence accuses the component any more, and none supports it.
    Unproven,
    /// The component may be wrong.
    Suspect,
    /// The component is wrong, or an operator has forbidden it.
    Excluded,
}

impl Trust {
    /// The rungs on which a need looks for a source, the best first: it takes the first on which it has one. The last rung gives
    /// bounds that hold whoever of the suspects is right, and nothing else.
    pub const RUNGS: [Trust; 4] = [Trust::Trusted, Trust::Returning, Trust::Unproven, Trust::Suspect];
}
