//! What a call can end with: a code, and for texts that are wrong the place and a remedy.

use crate::words;
use shsa_core::knowledge::Severity;
use shsa_format::state::StateError;
use shsa_model::Report;
use std::ffi::c_char;

/// How a call has ended.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// It has done what it does.
    Ok = 0,
    /// There is nothing: no further output, no deadline.
    Nothing = 1,
    /// A pointer is null, an index is none of the model, or a text is not UTF-8. Nothing has changed.
    Argument = 2,
    /// The model has errors; the `shsa_error` has the first one.
    Model = 3,
    /// The text is no snapshot; the `shsa_error` says why. Nothing has changed.
    State = 4,
    /// The library has failed within the call, which is a defect of the library. The engine of the call cannot be used any more: every
    /// further call with it ends with this code, until it is freed.
    Panic = 5,
}

/// What is wrong with a text. All texts are UTF-8 and end with a zero; those that are too long are cut.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Error {
    /// The code that the call has returned.
    pub status: Status,
    /// The number of errors in the text.
    pub count: usize,
    /// The line of the first error, from 1; 0 if it is about the whole text.
    pub line: usize,
    /// The column of the first error in characters, from 1; 0 if it is about the whole text.
    pub column: usize,
    /// The first error.
    pub message: [c_char; 512],
    /// How to mend it; empty if that is not known.
    pub help: [c_char; 512],
}

impl Error {
    /// No error.
    pub(crate) fn none() -> Error {
        Error { status: Status::Ok, count: 0, line: 0, column: 0, message: [0; 512], help: [0; 512] }
    }

    /// An error about a whole text.
    pub(crate) fn whole(status: Status, message: &str) -> Error {
        Error::at(status, 0, 0).saying(message, "")
    }

    /// The first error of a model; warnings are none.
    pub(crate) fn of_model(report: &Report) -> Option<Error> {
        let mut errors = report.diagnostics.iter().filter(|it| it.severity == Severity::Error);
        let first = errors.next()?;
        let error = Error::at(Status::Model, first.line, first.column);
        let error = error.saying(&first.message, first.help.as_deref().unwrap_or_default());
        Some(Error { count: 1 + errors.count(), ..error })
    }

    /// Why a text is no snapshot.
    pub(crate) fn of_state(error: &StateError) -> Error {
        let (line, column) = match error {
            StateError::Json(json) => (json.line(), json.column()),
            _ => (0, 0),
        };
        Error::at(Status::State, line, column).saying(&error.to_string(), "")
    }

    fn at(status: Status, line: usize, column: usize) -> Error {
        Error { status, count: 1, line, column, ..Error::none() }
    }

    fn saying(mut self, message: &str, help: &str) -> Error {
        words::copy(message, &mut self.message);
        words::copy(help, &mut self.help);
        self
    }
}
