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
