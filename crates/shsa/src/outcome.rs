//! The outcomes of a command and their exit statuses.

use crate::show;
use std::fmt;
use std::process::ExitCode;

/// The outcome of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// Done.
    Done,
    /// Done, and the answer is no: no substitution, a need unmet, a contract violated.
    No,
    /// Bad input or usage; nothing was done.
    Bad,
    /// Done, but not with all of the input: a truncated recording, say.
    Degraded,
    /// The bus cannot be reached; nothing was received or published.
    Unreachable,
}

impl Outcome {
    /// Tells an error, and returns its outcome.
    pub(crate) fn from_result(result: anyhow::Result<Outcome>) -> Outcome {
        result.unwrap_or_else(|error| {
            if is_closed_pipe(&error) {
                return Outcome::Done;
            }
            if !error.is::<AlreadyReported>() {
                show::fail(format_args!("{error:#}"));
            }
            Outcome::Bad
        })
    }
}

impl From<Outcome> for ExitCode {
    fn from(outcome: Outcome) -> ExitCode {
        ExitCode::from(match outcome {
            Outcome::Done => 0,
            Outcome::No => 1,
            Outcome::Bad => 2,
            Outcome::Degraded => 3,
            Outcome::Unreachable => 4,
        })
    }
}

/// An error that has already been reported.
#[derive(Debug)]
pub(crate) struct AlreadyReported;

impl fmt::Display for AlreadyReported {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("see above")
    }
}

impl std::error::Error for AlreadyReported {}

/// Whether the reader of our output has stopped reading, as `head` does; this is no error of the user.
fn is_closed_pipe(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        cause
            .downcast_ref::<std::io::Error>()
            .is_some_and(|error| error.kind() == std::io::ErrorKind::BrokenPipe)
    })
}
