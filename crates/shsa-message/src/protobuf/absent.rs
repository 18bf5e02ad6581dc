//! What a field has that is not on the wire: zero, a default, or no value.
//!
//! Presence: <https://protobuf.dev/programming-guides/field_presence>. In proto2, in members of a `oneof` and in `optional` ones of
//! proto3 a field that is not there is missing; in all others of proto3 it is zero.

use super::{Member, Types, number_of, text};
use crate::wire::{Fields, Wire};

/// The presence of the fields of a file or a type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Presence {
    /// A field is there or not.
    Explicit,
    /// A field that is not there is zero.
    Implicit,
}

/// What a field has that is not on the wire.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Absent {
    Zero,
    Missing,
    /// The default of proto2: a number, a text, or a name of an enumeration.
    Default(String),
}

impl Presence {
    /// By the syntax or the features of a file: proto2, which has no name of its own, proto3, or an edition.
    pub(super) fn of_file(file: &[u8]) -> Presence {
        let by_syntax = match text(file, 12).as_deref() {
            Some("proto3") => Presence::Implicit,
            _ => Presence::Explicit,
        };
        by_syntax.with_features(file, 8, 50)
    }

    /// By the features of a type.
    pub(super) fn of_message(self, message: &[u8]) -> Presence {
        self.with_features(message, 7, 12)
    }

    /// By the features in the options of a descriptor, if it has any; these are fields of these numbers.
    fn with_features(self, descriptor: &[u8], options: u64, features: u64) -> Presence {
        let features = part(descriptor, options).and_then(|options| part(options, features));
        match features.and_then(|features| number_of(features, 1)) {
            Some(2) => Presence::Implicit,
            Some(_) => Presence::Explicit,
            None => self,
        }
    }
}

impl Absent {
    /// By the descriptor of a field, in a type of this presence.
    pub(super) fn of(field: &[u8], presence: Presence) -> Absent {
        let is_in_oneof = number_of(field, 9).is_some();
        match (presence.with_features(field, 8, 21), text(field, 7)) {
            _ if is_in_oneof => Absent::Missing,
            (Presence::Implicit, _) => Absent::Zero,
            (Presence::Explicit, Some(default)) => Absent::Default(default),
            (Presence::Explicit, None) => Absent::Missing,
        }
    }

    /// The number that stands for it.
    pub(super) fn number(&self) -> Option<f64> {
        match self {
            Absent::Zero => Some(0.0),
            Absent::Missing => None,
            Absent::Default(text) => match text.as_str() {
                "true" => Some(1.0),
                "false" => Some(0.0),
                number => number.parse().ok(),
            },
        }
    }

    /// The text that stands for it.
    pub(super) fn text(&self) -> Option<String> {
        match self {
            Absent::Zero => Some(String::new()),
            Absent::Missing => None,
            Absent::Default(text) => Some(text.clone()),
        }
    }
}

impl Types {
    /// A field whose default is a number, also where the definition has its name.
    pub(super) fn resolved(&self, member: &Member) -> Member {
        let mut member = member.clone();
        if let (Absent::Default(name), Some(enumeration)) = (&member.absent, &member.enumeration) {
            let number = self.enumerations.get(enumeration).and_then(|values| values.get(name));
            member.absent = number.map_or(Absent::Missing, |number| Absent::Default(number.to_string()));
        }
        member
    }
}

/// The bytes in a field of a message.
fn part(message: &[u8], asked: u64) -> Option<&[u8]> {
    Fields::of(message).filter(|(number, _)| *number == asked).find_map(|(_, value)| match value {
        Wire::Bytes(bytes) => Some(bytes),
        Wire::Number(_) => None,
    })
}
