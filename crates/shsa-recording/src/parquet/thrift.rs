//! Thrift's compact protocol, the encoding of a Parquet file's descriptions: numbers, texts, lists and structures.
//!
//! Format: <https://github.com/apache/thrift/blob/master/doc/specs/thrift-compact-protocol.md>.

use super::bytes::Bytes;

/// The deepest nesting of structures.
const DEPTH_MAX: usize = 24;

/// The value of a field or of a list item.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Item<'a> {
    Bool(bool),
    Whole(i64),
    Double(f64),
    Binary(&'a [u8]),
    List(Vec<Item<'a>>),
    Struct(Struct<'a>),
}

/// Fields by their numbers, in the order of the file, which is ascending.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Struct<'a>(Vec<(i64, Item<'a>)>);

impl<'a> Struct<'a> {
    /// Reads a structure; `None` where the bytes are none. Memory: a few times that of the bytes.
    pub(super) fn read(bytes: &mut Bytes<'a>) -> Option<Struct<'a>> {
        structure(bytes, 0)
    }

    fn item(&self, field: i64) -> Option<&Item<'a>> {
        self.0.iter().find(|(number, _)| *number == field).map(|(_, item)| item)
    }

    pub(super) fn whole(&self, field: i64) -> Option<i64> {
        match self.item(field)? {
            Item::Whole(whole) => Some(*whole),
            _ => None,
        }
    }

    pub(super) fn bool(&self, field: i64) -> Option<bool> {
        match self.item(field)? {
            Item::Bool(is_so) => Some(*is_so),
            _ => None,
        }
    }

    pub(super) fn text(&self, field: i64) -> Option<String> {
        match self.item(field)? {
            Item::Binary(bytes) => Some(String::from_utf8_lossy(bytes).into_owned()),
            _ => None,
        }
    }

    pub(super) fn structure(&self, field: i64) -> Option<&Struct<'a>> {
        match self.item(field)? {
            Item::Struct(inner) => Some(inner),
            _ => None,
        }
    }

    /// The structures in a list; none where there is no such list.
    pub(super) fn structures(&self, field: i64) -> impl Iterator<Item = &Struct<'a>> {
        let list = match self.item(field) {
            Some(Item::List(items)) => items.as_slice(),
            _ => &[],
        };
        list.iter().filter_map(|item| match item {
            Item::Struct(inner) => Some(inner),
            _ => None,
        })
    }
}

fn structure<'a>(bytes: &mut Bytes<'a>, depth: usize) -> Option<Struct<'a>> {
    if depth > DEPTH_MAX {
        return None;
    }
    let (mut fields, mut number) = (Vec::new(), 0_i64);
    loop {
        let head = bytes.byte()?;
        if head == 0 {
            return Some(Struct(fields));
        }
        number = match i64::from(head >> 4) {
            0 => bytes.zigzag()?,
            step => number.checked_add(step)?,
        };
        let item = match head & 0x0f {
            1 => Item::Bool(true),
            2 => Item::Bool(false),
            kind => item(bytes, kind, depth + 1)?,
        };
        fields.push((number, item));
    }
}

fn item<'a>(bytes: &mut Bytes<'a>, kind: u8, depth: usize) -> Option<Item<'a>> {
    Some(match kind {
        // In a list a boolean is a byte.
        1 | 2 => Item::Bool(bytes.byte()? == 1),
        3 => Item::Whole(i64::from(bytes.byte()?.cast_signed())),
        4..=6 => Item::Whole(bytes.zigzag()?),
        7 => Item::Double(f64::from_le_bytes(*bytes.take(8)?.first_chunk()?)),
        8 => {
            let length = usize::try_from(bytes.varint()?).ok()?;
            Item::Binary(bytes.take(length)?)
        }
        9 | 10 => {
            let head = bytes.byte()?;
            let count = match head >> 4 {
                15 => bytes.varint()?,
                few => u64::from(few),
            };
            let mut items = Vec::new();
            for _ in 0..count {
                items.push(item(bytes, head & 0x0f, depth)?);
            }
            Item::List(items)
        }
        12 => Item::Struct(structure(bytes, depth)?),
        _ => return None,
    })
}

/// Passes over a structure, of which nothing is kept: its whole numbers and truths and those of the structures directly in it go to
/// `see`, each with the field of the structure that it is in, 0 for the outer one, and its own field. `None` where the bytes are no
/// structure.
pub(super) fn pass(bytes: &mut Bytes<'_>, see: &mut dyn FnMut(i64, i64, i64)) -> Option<()> {
    pass_fields(bytes, 0, 0, see)
}

fn pass_fields(
    bytes: &mut Bytes<'_>,
    within: i64,
    depth: usize,
    see: &mut dyn FnMut(i64, i64, i64),
) -> Option<()> {
    if depth > DEPTH_MAX {
        return None;
    }
    let mut number = 0_i64;
    loop {
        let head = bytes.byte()?;
        if head == 0 {
            return Some(());
        }
        number = match i64::from(head >> 4) {
            0 => bytes.zigzag()?,
            step => number.checked_add(step)?,
        };
        let value = match head & 0x0f {
            kind @ (1 | 2) => Some(i64::from(kind == 1)),
            3 => Some(i64::from(bytes.byte()?.cast_signed())),
            4..=6 => Some(bytes.zigzag()?),
            12 if depth == 0 => {
                pass_fields(bytes, number, 1, see)?;
                None
            }
            kind => {
                pass_item(bytes, kind, depth + 1)?;
                None
            }
        };
        if let Some(value) = value.filter(|_| depth <= 1) {
            see(within, number, value);
        }
    }
}

/// Passes over an item as [`item`] reads it.
fn pass_item(bytes: &mut Bytes<'_>, kind: u8, depth: usize) -> Option<()> {
    match kind {
        1..=3 => drop(bytes.byte()?),
        4..=6 => drop(bytes.zigzag()?),
        7 => drop(bytes.take(8)?),
        8 => {
            let length = usize::try_from(bytes.varint()?).ok()?;
            bytes.take(length)?;
        }
        9 | 10 => {
            let head = bytes.byte()?;
            let count = match head >> 4 {
                15 => bytes.varint()?,
                few => u64::from(few),
            };
            (0..count).try_for_each(|_| pass_item(bytes, head & 0x0f, depth))?;
        }
        12 => pass_fields(bytes, 0, depth, &mut |_, _, _| {})?,
        _ => return None,
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn what_is_passed_over_is_what_is_read(
            bytes in prop::collection::vec(prop_oneof![any::<u8>(), 0x10_u8..0x20, Just(0x1c), Just(0)], 0..40),
        ) {
            let (mut one, mut other) = (Bytes(&bytes), Bytes(&bytes));
            let mut seen = Vec::new();
            let passed = pass(&mut one, &mut |within, field, value| seen.push((within, field, value)));
            let read = Struct::read(&mut other);
            prop_assert_eq!(passed.is_some(), read.is_some());
            let Some(read) = read else { return Ok(()) };
            prop_assert_eq!(one.0, other.0);
            let mut expected = Vec::new();
            let mut expect = |within: i64, fields: &Struct<'_>| {
                for (field, item) in &fields.0 {
                    match item {
                        Item::Bool(is_so) => expected.push((within, *field, i64::from(*is_so))),
                        Item::Whole(whole) => expected.push((within, *field, *whole)),
                        _ => {}
                    }
                }
            };
            for (field, item) in &read.0 {
                match item {
                    Item::Struct(inner) => expect(*field, inner),
                    other => expect(0, &Struct(vec![(*field, other.clone())])),
                }
            }
            prop_assert_eq!(seen, expected);
        }
    }
}
