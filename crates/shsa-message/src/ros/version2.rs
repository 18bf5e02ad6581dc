//! Version 2 of the encoding of ROS 2 (OMG DDS-XTypes 1.3, 7.4.3): its messages, written anew in version 1.
//!
//! Numbers are aligned to four bytes at most. Lists of anything but numbers begin with their size; so do the messages of an
//! appendable or mutable type, and in those of a mutable type each member has a header with its number. The first bytes of a
//! message tell this of the message itself, and nothing tells it of the messages within: only one of the three ways fits.

use super::definition::{Count, Kind, Member};
use super::types::Types;

/// The most fields of a message beyond its bytes: lists of no elements take none.
const WORK_MAX: usize = 100_000;
/// The deepest nesting of types.
const DEPTH_MAX: usize = 64;
/// The most bytes behind the last field, which make the whole a multiple of four.
const PADDING_MAX: usize = 3;
/// The largest alignment.
const ALIGN_MAX: usize = 4;

/// How a type may change (OMG DDS-XTypes 1.3, 7.2.2.4.5).
#[derive(Clone, Copy, PartialEq, Eq)]
enum Change {
    Final,
    Appendable,
    Mutable,
}

/// The kind of a message's own type and whether numbers have their highest byte first, by the header; `None` for a message that
/// is not of version 2.
fn kind(message: &[u8]) -> Option<(Change, bool)> {
    let [0, number, ..] = message else { return None };
    let change = match number {
        6 | 7 => Change::Final,
        8 | 9 => Change::Appendable,
        10 | 11 => Change::Mutable,
        _ => return None,
    };
    Some((change, number % 2 == 0))
}

/// Whether the header of a message is one of version 2.
#[must_use]
pub fn is_version_2(message: &[u8]) -> bool {
    message.len() >= 4 && kind(message).is_some()
}

/// Writes a message of version 2 with its header as one of version 1, in the same order of bytes. Returns `false` where it does not
/// fit its definition, or fits in several ways with different values. `O(message)`.
pub fn recode(types: &Types, message_type: &str, message: &[u8], to: &mut Vec<u8>) -> bool {
    let mut readings = readings(types, message_type, message);
    let one = readings.pop().filter(|_| readings.is_empty());
    let is_read = one.is_some();
    *to = one.unwrap_or_default();
    is_read
}

/// The different messages of version 1 that a message may stand for.
fn readings(types: &Types, message_type: &str, message: &[u8]) -> Vec<Vec<u8>> {
    let mut readings = Vec::new();
    let (Some((change, is_big_endian)), Some(bytes)) = (kind(message), message.get(4..)) else {
        return readings;
    };
    for within in [Change::Final, Change::Appendable, Change::Mutable] {
        let (out, work_left) =
            (vec![0, u8::from(!is_big_endian), 0, 0], bytes.len().saturating_add(WORK_MAX));
        let mut walk = Walk { types, bytes, is_big_endian, within, at: 0, out, work_left };
        let is_read = walk.message(message_type, change, 0).is_some();
        if is_read && bytes.len() - walk.at <= PADDING_MAX && !readings.contains(&walk.out) {
            readings.push(walk.out);
        }
    }
    readings
}

/// A way through a message.
struct Walk<'a> {
    types: &'a Types,
    bytes: &'a [u8],
    is_big_endian: bool,
    /// The kind of the types within the message's own.
    within: Change,
    at: usize,
    out: Vec<u8>,
    work_left: usize,
}

impl<'a> Walk<'a> {
    fn message(&mut self, name: &str, change: Change, depth: usize) -> Option<()> {
        if depth > DEPTH_MAX {
            return None;
        }
        let members = self.types.members(name).ok()?;
        match change {
            Change::Final => self.members(members, depth),
            Change::Appendable => self.sized(|walk| walk.members(members, depth)),
            Change::Mutable => self.sized(|walk| walk.numbered(members, depth)),
        }
    }

    fn members(&mut self, members: &[Member], depth: usize) -> Option<()> {
        // A type without fields has a byte, which the last one may lack.
        if members.is_empty() {
            let length = usize::from(self.at < self.bytes.len());
            return self.copy(1, length);
        }
        members.iter().try_for_each(|member| self.member(member, depth))
    }

    /// What fills the size that is given ahead of it.
    fn sized(&mut self, read: impl FnOnce(&mut Self) -> Option<()>) -> Option<()> {
        let size = self.number()?;
        let end = self.at.checked_add(size).filter(|end| *end <= self.bytes.len())?;
        let whole = self.bytes;
        self.bytes = whole.get(..end)?;
        read(self)?;
        self.bytes = whole;
        (self.at == end).then_some(())
    }

    /// Members with their numbers, in any order: all of them, each once.
    fn numbered(&mut self, members: &[Member], depth: usize) -> Option<()> {
        let whole = self.bytes;
        let mut places = vec![None; members.len()];
        while self.at < whole.len() {
            let head = self.number()?;
            let number = head & 0x0fff_ffff;
            let next = self.at;
            let (from, size) = match head >> 28 & 7 {
                code @ 0..=3 => (next, 1 << code),
                4 => (next + 4, self.number()?),
                // The number that is the size is a part of the member, too.
                code => (next, self.number()?.checked_mul([1, 4, 8][code - 5])?.checked_add(4)?),
            };
            let end = from.checked_add(size).filter(|end| *end <= whole.len())?;
            if places.get_mut(number)?.replace(from..end).is_some() {
                return None;
            }
            self.at = end;
        }
        let end = self.at;
        for (member, place) in members.iter().zip(places) {
            let place = place?;
            (self.at, self.bytes) = (place.start, whole.get(..place.end)?);
            self.member(member, depth)?;
            if self.at != place.end {
                return None;
            }
        }
        (self.at, self.bytes) = (end, whole);
        Some(())
    }

    fn member(&mut self, member: &Member, depth: usize) -> Option<()> {
        self.work_left = self.work_left.checked_sub(1)?;
        let size = match &member.kind {
            Kind::Primitive(primitive) => Some(primitive.size()),
            _ => None,
        };
        match (member.count, size) {
            (Count::Fixed(0), _) => Some(()),
            (Count::One, Some(size)) => self.numbers(size, 1),
            (Count::Fixed(count), Some(size)) => self.numbers(size, count),
            (Count::Free(_), Some(size)) => {
                let count = self.count()?;
                if count == 0 { Some(()) } else { self.numbers(size, count) }
            }
            (Count::One, None) => self.value(&member.kind, depth),
            (Count::Fixed(count), None) => self.sized(|walk| walk.values(&member.kind, count, depth)),
            (Count::Free(_), None) => self.sized(|walk| {
                let count = walk.count()?;
                walk.values(&member.kind, count, depth)
            }),
        }
    }

    fn values(&mut self, kind: &Kind, count: usize, depth: usize) -> Option<()> {
        (0..count).try_for_each(|_| {
            self.work_left = self.work_left.checked_sub(1)?;
            self.value(kind, depth)
        })
    }

    fn value(&mut self, kind: &Kind, depth: usize) -> Option<()> {
        match kind {
            Kind::Primitive(primitive) => self.numbers(primitive.size(), 1),
            Kind::Text(_) => self.text(),
            Kind::Message(name) => self.message(name, self.within, depth + 1),
            Kind::WideText => None,
        }
    }

    /// A text with its closing zero and no other one. Some writers leave out that of an empty text.
    fn text(&mut self) -> Option<()> {
        let length = self.count()?;
        let text = self.bytes.get(self.at..self.at.checked_add(length)?)?;
        let is_text = text.is_empty() || text.iter().position(|byte| *byte == 0) == Some(length - 1);
        if is_text { self.copy(1, length) } else { None }
    }

    fn numbers(&mut self, size: usize, count: usize) -> Option<()> {
        self.at = self.at.checked_next_multiple_of(size.min(ALIGN_MAX))?;
        self.copy(size, size.checked_mul(count)?)
    }

    /// A count, which is written, too.
    fn count(&mut self) -> Option<usize> {
        let from = self.at.checked_next_multiple_of(4)?;
        let count = self.number()?;
        self.at = from;
        self.copy(4, 4)?;
        Some(count)
    }

    /// Writes the next bytes, from a multiple of `align` on.
    fn copy(&mut self, align: usize, length: usize) -> Option<()> {
        let end = self.at.checked_add(length)?;
        let bytes = self.bytes.get(self.at..end)?;
        let body = (self.out.len() - 4).checked_next_multiple_of(align)?;
        self.out.resize(body + 4, 0);
        self.out.extend_from_slice(bytes);
        self.at = end;
        Some(())
    }

    /// A number of four bytes.
    fn number(&mut self) -> Option<usize> {
        let from = self.at.checked_next_multiple_of(4)?;
        let bytes = *self.bytes.get(from..)?.first_chunk()?;
        self.at = from + 4;
        let number = if self.is_big_endian { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) };
        Some(number as usize)
    }
}

#[cfg(test)]
mod tests;
