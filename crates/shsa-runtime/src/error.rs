//! Errors of a run.

use shsa_bridge::BridgeError;
use std::error::Error;
use std::io;
use thiserror::Error as ThisError;

/// Why a run could not begin, could not go on, or did not carry out an order.
#[derive(Debug, ThisError)]
pub enum RuntimeError {
    /// A model, an option and the bus do not fit each other.
    #[error("{0}")]
    Unfit(String),
    /// An error of the bus.
    #[error(transparent)]
    Bus(#[from] BridgeError),
    /// An error of the operating system: a file, a thread, an address.
    #[error(transparent)]
    System(#[from] io::Error),
    /// An error with the action during which it occurred.
    #[error("{doing}")]
    While {
        /// The action.
        doing: String,
        /// The error.
        source: Box<RuntimeError>,
    },
    /// The reason why the run does not carry out an order; nothing has changed.
    #[error("{0}")]
    Refused(String),
    /// The run gives no answer: it has ended, or too many requests wait.
    #[error("the run has ended, or too many requests wait")]
    NoAnswer,
}

impl RuntimeError {
    /// The error and its causes in one line.
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

/// Adds the action to an error.
pub(crate) trait Context<T> {
    /// Adds the action in these words.
    ///
    /// # Errors
    /// The error, with the action above it.
    fn context(self, doing: impl Into<String>) -> Result<T, RuntimeError>;

    /// As [`Context::context`]; the words are made only in case of an error.
    ///
    /// # Errors
    /// As [`Context::context`].
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

/// A [`RuntimeError::Unfit`] with this reason.
pub(crate) fn unfit(why: impl ToString) -> RuntimeError {
    RuntimeError::Unfit(why.to_string())
}
