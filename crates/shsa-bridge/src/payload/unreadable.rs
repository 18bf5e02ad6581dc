//! Why a payload could not be read.

use shsa_message::MessageError;
use thiserror::Error;

/// Why a payload, or a field of it, gives no observation: short, and with the place.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum Unreadable {
    /// More bytes than the reader's limit.
    #[error("{bytes} bytes, more than {limit}")]
    TooLarge {
        /// As many came.
        bytes: usize,
        /// So many are read.
        limit: usize,
    },
    /// It has no content at all.
    #[error("an empty payload")]
    Empty,
    /// It is neither text nor of a known binary form.
    #[error("byte {at} is no text (UTF-8)")]
    NoText {
        /// Counted from 0.
        at: usize,
    },
    /// It begins like JSON and is none.
    #[error("no JSON: byte {at} should be {expected}")]
    NoJson {
        /// Counted from 0.
        at: usize,
        /// What would have been right there.
        expected: &'static str,
    },
    /// The payload has no such field.
    #[error("{field} is absent")]
    Absent {
        /// The path as it was asked for, in quotes; or `the payload`.
        field: String,
    },
    /// The field is there, and is not what it should be.
    #[error("{field} is {found}, no {wanted}")]
    Kind {
        /// The path as it was asked for, in quotes; or `the payload`.
        field: String,
        /// What it is.
        found: String,
        /// What it should be.
        wanted: &'static str,
    },
    /// A payload of a typed binary form breaks its type's layout, or the type is unknown.
    #[error("{0}")]
    Layout(String),
}

impl From<MessageError> for Unreadable {
    fn from(error: MessageError) -> Unreadable {
        Unreadable::Layout(error.to_string())
    }
}
