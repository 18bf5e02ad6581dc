//! Whether a message fits its type: the fields that the type has are of its wire types, and the last one ends with the message.
//! Fields that the type does not have are allowed, as in the format.

use super::kind::Kind;
use super::{DEPTH_MAX, Member, Types};
use crate::wire::{BYTES, Fields, Wire};

impl Types {
    /// Whether a message is one of this type, with all messages in it. `O(message)` times the fields of a type.
    #[must_use]
    pub fn fits(&self, name: &str, message: &[u8]) -> bool {
        self.fits_within(name, message, 0)
    }

    fn fits_within(&self, name: &str, message: &[u8], depth: usize) -> bool {
        let members = self.members(name).unwrap_or_default();
        let mut rest = Fields::of(message);
        while !rest.is_at_end() {
            let Some(tag) = rest.varint() else { return false };
            let (number, wire_type) = (tag >> 3, tag & 7);
            let Some(content) = rest.content(wire_type).filter(|_| number > 0) else { return false };
            let member = members.iter().find(|member| member.number == number);
            if member.is_some_and(|member| !self.is_of(member, wire_type, content, depth)) {
                return false;
            }
        }
        true
    }

    /// Whether a value is one of this field.
    fn is_of(&self, member: &Member, wire_type: u64, content: Wire<'_>, depth: usize) -> bool {
        let is_one = member.kind.wire_type() == wire_type;
        match (&member.kind, content) {
            (Kind::Message(inner), Wire::Bytes(bytes)) => {
                depth >= DEPTH_MAX || self.fits_within(inner, bytes, depth + 1)
            }
            (Kind::Text | Kind::Bytes | Kind::Message(_), _) => is_one,
            (kind, Wire::Bytes(_)) if wire_type == BYTES => {
                member.is_list && kind.each([content].into_iter(), &mut |_| {}).is_some()
            }
            _ => is_one,
        }
    }
}
