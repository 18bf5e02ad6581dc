//! What is to be explained.

use shsa_core::time::Span;

/// A question about a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Question {
    /// All decisions.
    All,
    /// Why a signal was, or was not, accused.
    Signal {
        /// The name of the signal.
        name: String,
        /// The moment from the beginning of the run; without one, its first accusation.
        at: Option<Span>,
    },
    /// Why the decision with this number in the list was made; counted from 1.
    Decision(usize),
}
