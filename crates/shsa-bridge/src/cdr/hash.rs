//! The hash of a type's description, which is part of the type's name on the wire.
//!
//! REP 2016 (<https://github.com/ros-infrastructure/rep/pull/381>) and `type_description_interfaces`: SHA-256 over a JSON text of
//! the type and all types that it refers to.

use sha2::{Digest, Sha256};
use shsa_message::ros::{Count, Kind, Member, Primitive, Types, full_name};
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// The hash of a type, as `RIHS01_` and 64 hexadecimal digits. `None` when the type or a type that it refers to is unknown, or
/// has a field that ROS 2 lacks.
#[must_use]
pub fn type_hash(message_type: &str, types: &Types) -> Option<String> {
    let root = full_name(message_type);
    let mut described = BTreeMap::new();
    describe(&root, types, &mut described)?;
    let own = described.remove(root.as_ref())?;
    let others: Vec<String> = described.into_values().collect();
    let text =
        format!(r#"{{"type_description": {own}, "referenced_type_descriptions": [{}]}}"#, others.join(", "));
    let mut hash = "RIHS01_".to_owned();
    for byte in Sha256::digest(text) {
        let _cannot_fail = write!(hash, "{byte:02x}");
    }
    Some(hash)
}

/// Describes a type and all types that it refers to, each once.
fn describe(name: &str, types: &Types, described: &mut BTreeMap<String, String>) -> Option<()> {
    if described.contains_key(name) {
        return Some(());
    }
    let members = types.members(name).ok()?;
    let nothing = Member {
        name: "structure_needs_at_least_one_member".into(),
        kind: Kind::Primitive(Primitive::U8),
        count: Count::One,
    };
    let shown = if members.is_empty() { std::slice::from_ref(&nothing) } else { members };
    let fields: Vec<String> = shown.iter().map(field).collect::<Option<_>>()?;
    let description = format!(r#"{{"type_name": "{name}", "fields": [{}]}}"#, fields.join(", "));
    described.insert(name.to_owned(), description);
    for member in members {
        if let Kind::Message(inner) = &member.kind {
            describe(inner, types, described)?;
        }
    }
    Some(())
}

fn field(member: &Member) -> Option<String> {
    let (base, string_capacity, nested) = match &member.kind {
        Kind::Message(name) => (1, 0, name.as_ref()),
        Kind::Primitive(primitive) => (number_of(*primitive)?, 0, ""),
        Kind::Text(None) => (17, 0, ""),
        Kind::WideText => (18, 0, ""),
        Kind::Text(Some(bound)) => (21, *bound, ""),
    };
    let (increment, capacity) = match member.count {
        Count::One => (0, 0),
        Count::Fixed(count) => (48, count),
        Count::Free(Some(bound)) => (96, bound as usize),
        Count::Free(None) => (144, 0),
    };
    Some(format!(
        r#"{{"name": "{}", "type": {{"type_id": {}, "capacity": {capacity}, "string_capacity": {string_capacity}, "nested_type_name": "{nested}"}}}}"#,
        member.name,
        base + increment
    ))
}

/// The number of a type in `type_description_interfaces/msg/FieldType`.
fn number_of(primitive: Primitive) -> Option<u32> {
    Some(match primitive {
        Primitive::I8 => 2,
        Primitive::U8 => 3,
        Primitive::I16 => 4,
        Primitive::U16 => 5,
        Primitive::I32 => 6,
        Primitive::U32 => 7,
        Primitive::I64 => 8,
        Primitive::U64 => 9,
        Primitive::F32 => 10,
        Primitive::F64 => 11,
        Primitive::Bool => 15,
        Primitive::Byte => 16,
        Primitive::Time | Primitive::Duration => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_of_a_known_type() {
        let hash = type_hash("std_msgs/msg/String", &Types::standard()).unwrap();
        assert_eq!(hash, "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18");
        let mut types = Types::default();
        types.add("a/B", "Absent x");
        assert_eq!(type_hash("a/B", &types), None);
        types.add("a/C", "C again");
        assert!(type_hash("a/C", &types).is_some());
    }
}
