//! Writes Thrift's compact protocol, the encoding of a Parquet file's descriptions.
//!
//! Format: <https://github.com/apache/thrift/blob/master/doc/specs/thrift-compact-protocol.md>.

const TRUE: u8 = 1;
const FALSE: u8 = 2;
const I32: u8 = 5;
const I64: u8 = 6;
const BINARY: u8 = 8;
const LIST: u8 = 9;
const STRUCT: u8 = 12;

/// A text or bytes.
pub(super) struct Binary<'a>(pub(super) &'a [u8]);

/// A structure: its fields in ascending order of their numbers.
#[derive(Default)]
pub(super) struct Struct {
    bytes: Vec<u8>,
    last: u8,
}

/// The items of a list, all of one type.
pub(super) struct List {
    kind: u8,
    count: usize,
    bytes: Vec<u8>,
}

impl Struct {
    /// The whole structure with its end.
    pub(super) fn into_bytes(mut self) -> Vec<u8> {
        self.bytes.push(0);
        self.bytes
    }

    pub(super) fn bool(self, field: u8, is_so: bool) -> Struct {
        self.field(field, if is_so { TRUE } else { FALSE }, &[])
    }

    pub(super) fn i32(self, field: u8, value: i32) -> Struct {
        self.field(field, I32, &zigzag(value.into()))
    }

    pub(super) fn i64(self, field: u8, value: i64) -> Struct {
        self.field(field, I64, &zigzag(value))
    }

    pub(super) fn text(self, field: u8, text: &str) -> Struct {
        self.binary(field, Binary(text.as_bytes()))
    }

    pub(super) fn binary(self, field: u8, binary: Binary<'_>) -> Struct {
        self.field(field, BINARY, &binary.bytes())
    }

    pub(super) fn structure(self, field: u8, inner: Struct) -> Struct {
        self.field(field, STRUCT, &inner.into_bytes())
    }

    pub(super) fn list(self, field: u8, list: List) -> Struct {
        let mut bytes = match list.count {
            few @ ..15 => vec![(few as u8) << 4 | list.kind],
            many => [&[0xf0 | list.kind], &*varint(many as u64)].concat(),
        };
        bytes.extend(list.bytes);
        self.field(field, LIST, &bytes)
    }

    fn field(mut self, number: u8, kind: u8, value: &[u8]) -> Struct {
        // All structures of Parquet that are written here have fewer than 15 numbers between two fields.
        self.bytes.push((number - self.last) << 4 | kind);
        self.bytes.extend_from_slice(value);
        self.last = number;
        self
    }
}

impl List {
    pub(super) fn of_structs(items: impl Iterator<Item = Struct>) -> List {
        List::of(STRUCT, items.map(Struct::into_bytes))
    }

    pub(super) fn of_i32(items: &[i32]) -> List {
        List::of(I32, items.iter().map(|item| zigzag((*item).into())))
    }

    pub(super) fn of_texts(items: &[&str]) -> List {
        List::of(BINARY, items.iter().map(|item| Binary(item.as_bytes()).bytes()))
    }

    fn of(kind: u8, items: impl Iterator<Item = Vec<u8>>) -> List {
        let mut list = List { kind, count: 0, bytes: Vec::new() };
        for item in items {
            list.count += 1;
            list.bytes.extend(item);
        }
        list
    }
}

impl Binary<'_> {
    fn bytes(&self) -> Vec<u8> {
        [&*varint(self.0.len() as u64), self.0].concat()
    }
}

fn zigzag(value: i64) -> Vec<u8> {
    varint((value << 1 ^ value >> 63).cast_unsigned())
}

/// Seven bits a byte, the lowest first; the highest bit says that more follow.
pub(super) fn varint(mut value: u64) -> Vec<u8> {
    let mut bytes = Vec::new();
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
    bytes
}
