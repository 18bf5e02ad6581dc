//! What a step of a search leads to.

/// The result of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Progress {
    /// The decisions made are a substitution.
    Answer,
    /// A variable was decided, or a state dropped.
    Decision,
    /// No state is open.
    End,
}
