//! Errors of paths, definitions and messages.

use shsa_core::unit::nearest;
use std::path::PathBuf;
use thiserror::Error;

/// Why a field cannot be found, or why bytes are no message.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum MessageError {
    /// The path has a condition `[=left]`.
    #[error("a condition names no field; write it like [name=left]")]
    NamelessCondition,
    /// The path has more steps than allowed.
    #[error("a path has {steps} steps, more than {most}")]
    LongPath {
        /// The number of steps.
        steps: usize,
        /// The largest allowed number.
        most: usize,
    },
    /// The path is like `a..b`.
    #[error("`{path}` names nothing between two dots")]
    Nameless {
        /// The whole path.
        path: String,
    },
    /// The path is like `a[b]`.
    #[error(
        "`[{index}` in `{path}` is no index, write it like {name}[0]; or begin with a slash, then brackets belong to the name"
    )]
    NoIndex {
        /// The text in the brackets, or behind them.
        index: String,
        /// The name before the brackets.
        name: String,
        /// The whole path.
        path: String,
    },
    /// The path is like `a[].b[].c`.
    #[error("`{path}` asks for lists in a list, and a value is one list; name an element, as in a[0]")]
    ListOfLists {
        /// The path.
        path: String,
    },
    /// The path names no field.
    #[error("names no field")]
    NoField,
    /// There is no message type of this name.
    #[error("the message type {name} is not known{}", meant(.near.as_deref()))]
    UnknownType {
        /// The type.
        name: String,
        /// The known type with the nearest name.
        near: Option<String>,
    },
    /// A message type has no field of this name.
    #[error("no field '{name}' in {owner}{}", meant_field(.name, .known))]
    UnknownField {
        /// The field.
        name: String,
        /// The type.
        owner: String,
        /// The fields of the type.
        known: Vec<String>,
    },
    /// An element is requested of a field that is no list.
    #[error("{0} is no list")]
    NoList(String),
    /// A part is requested of a list as a whole.
    #[error("'{0}' is a list; say which element, {0}[0], or take all of them, {0}[]")]
    List(String),
    /// A part is requested of a field that is no message.
    #[error("'{0}' has no parts")]
    NoParts(String),
    /// The field is a message.
    #[error("'{field}' is a {message_type}; name one of its fields: {}", .parts.join(", "))]
    IsMessage {
        /// The field.
        field: String,
        /// Its type.
        message_type: String,
        /// The type's fields.
        parts: Vec<String>,
    },
    /// The definition is larger than the limit.
    #[error("its message type is too large")]
    TooLarge,
    /// The definition nests deeper than the limit, or contains itself.
    #[error("its message type nests too deep")]
    TooDeep,
    /// The field is a text of two or four bytes a character.
    #[error("a text of wide characters cannot be read")]
    WideText,
    /// A text of wide characters is before the field.
    #[error("a text of wide characters before it cannot be skipped")]
    WideTextBefore,
    /// The definition is one of an action.
    #[error("the messages of the action {0} cannot be read")]
    Action(String),
    /// A folder or file of definitions cannot be read.
    #[error("{}: {reason}", .path.display())]
    Folder {
        /// The folder or file.
        path: PathBuf,
        /// The system's error message.
        reason: String,
    },
    /// This many bytes are too few for a CDR message.
    #[error("{0} bytes are no CDR message")]
    NoCdr(usize),
    /// The message begins with the number of another encoding.
    #[error("an encapsulation 0x{0:04x}{name} is no plain CDR (0x0000 or 0x0001)", name = encoding(*.0))]
    NoPlainCdr(u16),
}

/// What the number of an encapsulation stands for (OMG DDS-XTypes 1.3, 7.6.3.1.2).
fn encoding(number: u16) -> &'static str {
    match number {
        2 | 3 => " (a parameter list)",
        6..=11 => " (XCDR version 2)",
        _ => "",
    }
}

fn meant(near: Option<&str>) -> String {
    near.map_or_else(String::new, |near| format!("; is it {near}?"))
}

fn meant_field(name: &str, known: &[String]) -> String {
    match nearest(name, known.iter().map(String::as_str)) {
        Some(near) => meant(Some(near)),
        None => format!(" (there is: {})", known.join(", ")),
    }
}
