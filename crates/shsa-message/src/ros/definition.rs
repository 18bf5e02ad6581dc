//! The fields of a message type, as the lines of its definition say.
//!
//! Languages: ROS 1, <http://wiki.ros.org/msg>; ROS 2, <https://docs.ros.org/en/rolling/Concepts/Basic/About-Interfaces.html>.

use super::types::full_name;
use std::sync::Arc;

/// A number on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Primitive {
    /// `bool`: a byte that is 0 or 1.
    Bool,
    /// `byte` of ROS 2: without a sign.
    Byte,
    /// `int8`, and `byte` of ROS 1.
    I8,
    /// `uint8` and `char`.
    U8,
    /// `int16`.
    I16,
    /// `uint16`.
    U16,
    /// `int32`.
    I32,
    /// `uint32`.
    U32,
    /// `int64`.
    I64,
    /// `uint64`.
    U64,
    /// `float32`.
    F32,
    /// `float64`.
    F64,
    /// A point in time of ROS 1: seconds and nanoseconds without signs. ROS 2's is a message.
    Time,
    /// A duration of ROS 1: seconds and nanoseconds with signs. ROS 2's is a message.
    Duration,
}

/// What a field holds, or each element of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A number.
    Primitive(Primitive),
    /// At most so many bytes, where it is bounded.
    Text(Option<u32>),
    /// A text of wide characters; no message of ROS's own has one, and nothing behind one is read.
    WideText,
    /// Of this type, by its full name.
    Message(Arc<str>),
}

/// How many values a field holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Count {
    /// It is no list.
    One,
    /// Always so many.
    Fixed(usize),
    /// Said on the wire; at most so many, where it is bounded.
    Free(Option<u32>),
}

/// A field of a message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Member {
    /// Its name.
    pub name: String,
    /// What it holds, or each element of it.
    pub kind: Kind,
    /// How many elements.
    pub count: Count,
}

/// The language of a definition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Language {
    Ros1,
    Ros2,
}

impl Language {
    /// A field of a definition's line; `None` for comments, constants, blank lines. `owner`: the type that is defined.
    pub(super) fn member(self, line: &str, owner: &str) -> Option<Member> {
        let line = line.split('#').next()?.trim();
        let (kind, rest) = line.split_once(char::is_whitespace)?;
        let mut rest = rest.split_whitespace();
        let name = rest.next()?;
        // A constant, or a line between two definitions.
        let is_no_field = |word: &str| word.starts_with('=');
        if is_no_field(kind) || name.contains('=') || rest.next().is_some_and(is_no_field) {
            return None;
        }
        let (kind, count) = split_count(kind)?;
        Some(Member { name: name.to_owned(), kind: self.kind(kind, owner)?, count })
    }

    fn kind(self, kind: &str, owner: &str) -> Option<Kind> {
        let (kind, bound) = match kind.split_once("<=") {
            Some((kind, bound)) => (kind, Some(bound.parse().ok()?)),
            None => (kind, None),
        };
        let package = owner.split('/').next()?;
        if let Some(primitive) = self.primitive(kind) {
            return Some(Kind::Primitive(primitive));
        }
        Some(match (kind, self) {
            ("string", _) => Kind::Text(bound),
            ("wstring", Language::Ros2) => Kind::WideText,
            ("time", _) => Kind::Message("builtin_interfaces/msg/Time".into()),
            ("duration", _) => Kind::Message("builtin_interfaces/msg/Duration".into()),
            ("Header", Language::Ros1) => Kind::Message("std_msgs/Header".into()),
            ("Header", Language::Ros2) => Kind::Message("std_msgs/msg/Header".into()),
            (full, Language::Ros1) if full.contains('/') => Kind::Message(full.into()),
            (full, Language::Ros2) if full.contains('/') => Kind::Message(full_name(full).into()),
            (near, Language::Ros1) => Kind::Message(format!("{package}/{near}").into()),
            (near, Language::Ros2) => Kind::Message(format!("{package}/msg/{near}").into()),
        })
    }

    fn primitive(self, name: &str) -> Option<Primitive> {
        Some(match (name, self) {
            ("bool", _) => Primitive::Bool,
            ("byte", Language::Ros1) => Primitive::I8,
            ("byte", Language::Ros2) => Primitive::Byte,
            ("time", Language::Ros1) => Primitive::Time,
            ("duration", Language::Ros1) => Primitive::Duration,
            ("int8", _) => Primitive::I8,
            ("uint8" | "char", _) => Primitive::U8,
            ("int16", _) => Primitive::I16,
            ("uint16", _) => Primitive::U16,
            ("int32", _) => Primitive::I32,
            ("uint32", _) => Primitive::U32,
            ("int64", _) => Primitive::I64,
            ("uint64", _) => Primitive::U64,
            ("float32", _) => Primitive::F32,
            ("float64", _) => Primitive::F64,
            _ => return None,
        })
    }
}

/// A type without `[]`, `[3]` or `[<=3]` behind it, and what they say.
fn split_count(kind: &str) -> Option<(&str, Count)> {
    Some(match kind.strip_suffix(']').and_then(|open| open.rsplit_once('[')) {
        None => (kind, Count::One),
        Some((kind, "")) => (kind, Count::Free(None)),
        Some((kind, size)) => match size.strip_prefix("<=") {
            Some(bound) => (kind, Count::Free(Some(bound.parse().ok()?))),
            None => (kind, Count::Fixed(size.parse().ok()?)),
        },
    })
}

impl Primitive {
    /// Its size, bytes: in CDR its alignment, too.
    #[must_use]
    pub fn size(self) -> usize {
        match self {
            Primitive::Bool | Primitive::Byte | Primitive::I8 | Primitive::U8 => 1,
            Primitive::I16 | Primitive::U16 => 2,
            Primitive::I32 | Primitive::U32 | Primitive::F32 => 4,
            Primitive::I64 | Primitive::U64 | Primitive::F64 | Primitive::Time | Primitive::Duration => 8,
        }
    }
}
