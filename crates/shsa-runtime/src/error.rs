//! What goes wrong with a run.

use shsa_bridge::BridgeError;
use std::error::Error;
use std::io;
use thiserror::Error as ThisError;

/// Why a run could not be begun, could not go on, or did not do what it was asked for.
#[derive(Debug, ThisError)]
pub enum RuntimeError {
    /// A model, an option and the bus do not fit each other.
    #[error("{0}")]
    Unfit(String),
    /// The bus refuses.
    #[error(transparent)]
    Bus(#[from] BridgeError),
    /// The operating system refuses: a file, a thread, an address.
    #[error(transparent)]
    System(#[from] io::Error),
    /// Something went wrong while something else was done.
    #[error("{doing}")]
    While {
        /// What was done.
        doing: String,
        /// What went wrong.
        source: Box<RuntimeError>,
    },
    /// The run does not do what it was asked for, for this reason; nothing has changed.
    #[error("{0}")]
    Refused(String),
    /// There is no answer: the run has ended, or too many wait for one.
    #[error("the run has ended, or too many requests wait")]
    NoAnswer,
}

impl RuntimeError {
    /// The error with all that caused it, in a line.
    pub(crate) fn chain(&self) -> String {
        let mut text = self.to_string();
        let mut cause = self.source();
        while let Some(error) = cause {
            text.push_str(&format!(": {error}"));
            cause = error.source();
        }
        text
    }
}

/// Says what was done when something went wrong.
pub(crate) trait Context<T> {
    /// In these words.
    ///
    /// # Errors
    /// What went wrong, below what was done.
    fn context(self, doing: impl Into<String>) -> Result<T, RuntimeError>;

    /// As [`Context::context`], in words that are made only then.
    ///
    /// # Errors
    /// As there.
    fn with_context(self, doing: impl FnOnce() -> String) -> Result<T, RuntimeError>;
}

impl<T, E: Into<RuntimeError>> Context<T> for Result<T, E> {
    fn context(self, doing: impl Into<String>) -> Result<T, RuntimeError> {
        self.with_context(|| doing.into())
    }

    fn with_context(self, doing: impl FnOnce() -> String) -> Result<T, RuntimeError> {
        self.map_err(|error| RuntimeError::While { doing: doing(), source: Box::new(error.into()) })
    }
}

impl<T> Context<T> for Option<T> {
    fn context(self, doing: impl Into<String>) -> Result<T, RuntimeError> {
        self.with_context(|| doing.into())
    }

    fn with_context(self, doing: impl FnOnce() -> String) -> Result<T, RuntimeError> {
        self.ok_or_else(|| RuntimeError::Unfit(doing()))
    }
}

/// An error about what does not fit, in these words.
pub(crate) fn unfit(why: impl ToString) -> RuntimeError {
    RuntimeError::Unfit(why.to_string())
}
