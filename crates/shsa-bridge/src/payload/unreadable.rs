//! Why a payload could not be read.

use shsa_message::MessageError;
use thiserror::Error;

/// Why a payload, or a field of it, gives no observation: a short text with the position.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum Unreadable {
    /// The payload exceeds the reader's limit.
    #[error("{bytes} bytes, more than {limit}")]
    TooLarge {
        /// The size of the payload.
        bytes: usize,
        /// The limit.
        limit: usize,
    },
    /// The payload is empty.
    #[error("an empty payload")]
    Empty,
    /// The payload is neither text nor of a known binary form.
    #[error("byte {at} is no text (UTF-8)")]
    NoText {
        /// The position, from 0.
        at: usize,
    },
    /// The payload begins like JSON, but is not.
    #[error("no JSON: byte {at} should be {expected}")]
    NoJson {
        /// The position, from 0.
        at: usize,
        /// The expected syntax.
        expected: &'static str,
    },
    /// The payload lacks the field.
    #[error("{field} is absent")]
    Absent {
        /// The path as given, in quotes; or `the payload`.
        field: String,
    },
    /// The field has another type.
    #[error("{field} is {found}, no {wanted}")]
    Kind {
        /// The path as given, in quotes; or `the payload`.
        field: String,
        /// The found type.
        found: String,
        /// The expected type.
        wanted: &'static str,
    },
    /// A payload of a typed binary form does not fit its type, or the type is unknown.
    #[error("{0}")]
    Layout(String),
}

impl From<MessageError> for Unreadable {
    fn from(error: MessageError) -> Unreadable {
        Unreadable::Layout(error.to_string())
    }
}
