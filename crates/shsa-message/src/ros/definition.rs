//! The fields of a message type, parsed from the lines of its definition.
//!
//! Languages: ROS 1, <http://wiki.ros.org/msg>; ROS 2, <https://docs.ros.org/en/rolling/Concepts/Basic/About-Interfaces.html>.

use super::types::full_name;
use std::sync::Arc;

/// A number type on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Primitive {
    /// `bool`: a byte that is 0 or 1.
    Bool,
    /// `byte` of ROS 2: unsigned.
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
    /// A point in time of ROS 1: unsigned seconds and nanoseconds. ROS 2 has a message instead.
    Time,
    /// A duration of ROS 1: signed seconds and nanoseconds. ROS 2 has a message instead.
    Duration,
}

/// The kind of a field, or of its elements.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A number.
    Primitive(Primitive),
    /// A text; with the largest number of bytes where it is bounded.
    Text(Option<u32>),
    /// A text of wide characters; no standard message has one, and no field behind one can be read.
    WideText,
    /// A message of the type of this full name.
    Message(Arc<str>),
}

/// The number of values in a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Count {
    /// A single value, no list.
    One,
    /// A list of fixed length.
    Fixed(usize),
    /// A list whose length is on the wire; with the largest length where it is bounded.
    Free(Option<u32>),
}

/// A field of a message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Member {
    /// The name.
    pub name: String,
    /// The kind of the field, or of its elements.
    pub kind: Kind,
    /// The number of elements.
    pub count: Count,
}

/// The language of a definition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Language {
    Ros1,
    Ros2,
}

impl Language {
    /// The field of a definition's line; `None` for comments, constants, blank lines. `owner` is the defined type.
    pub(super) fn member(self, line: &str, owner: &str) -> Option<Member> {
        let line = line.trim_ascii_start();
        // Most lines are comments.
        if line.starts_with('#') {
            return None;
        }
        let mut words = line.split('#').next()?.split_ascii_whitespace();
        let (kind, name) = (words.next()?, words.next()?);
        // A constant, or a line between two definitions.
        let is_no_field = |word: &str| word.starts_with('=');
        if is_no_field(kind) || name.contains('=') || words.next().is_some_and(is_no_field) {
            return None;
        }
        let (kind, count) = split_count(kind);
        Some(Member { name: name.to_owned(), kind: self.kind(kind, owner), count })
    }

    /// The kind of a field. What makes no sense is a type that nothing defines: a field that was left out would move all behind it.
    fn kind(self, kind: &str, owner: &str) -> Kind {
        let (kind, bound) = split_bound(kind).map_or((kind, None), |(kind, bound)| (kind, Some(bound)));
        if let Some(primitive) = self.primitive(kind) {
            return Kind::Primitive(primitive);
        }
        let package = owner.split('/').next().unwrap_or_default();
        match (kind, self) {
            ("string", _) => Kind::Text(bound),
            ("wstring", Language::Ros2) => Kind::WideText,
            ("time", _) => Kind::Message("builtin_interfaces/msg/Time".into()),
            ("duration", _) => Kind::Message("builtin_interfaces/msg/Duration".into()),
            ("Header", Language::Ros1) => Kind::Message("std_msgs/Header".into()),
            ("Header", Language::Ros2) => Kind::Message("std_msgs/msg/Header".into()),
            (full, Language::Ros1) if full.contains('/') => Kind::Message(full.into()),
            (full, Language::Ros2) if full.contains('/') => Kind::Message(full_name(full).into()),
            (near, Language::Ros1) => Kind::Message([package, "/", near].concat().into()),
            (near, Language::Ros2) => Kind::Message([package, "/msg/", near].concat().into()),
        }
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

/// Splits a type into its name and the bound from `<=10`; `None` where it has none.
fn split_bound(kind: &str) -> Option<(&str, u32)> {
    let (kind, bound) = kind.split_once('<')?;
    Some((kind, bound.strip_prefix('=')?.parse().ok()?))
}

/// Splits a type into its name and the count from `[]`, `[3]` or `[<=3]`; of others the count is a part of the name.
fn split_count(kind: &str) -> (&str, Count) {
    let list = kind.strip_suffix(']').and_then(|open| {
        let (kind, size) = open.rsplit_once('[')?;
        let count = match (size, size.strip_prefix("<=")) {
            ("", _) => Count::Free(None),
            (_, Some(bound)) => Count::Free(Some(bound.parse().ok()?)),
            (size, None) => Count::Fixed(size.parse().ok()?),
        };
        Some((kind, count))
    });
    list.unwrap_or((kind, Count::One))
}

impl Primitive {
    /// The size in bytes, which is also the alignment in CDR.
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
