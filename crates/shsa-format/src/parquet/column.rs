//! A column of a row group: its values while they are collected, and its pages.

use super::thrift::{List, Struct, varint};
use crate::table::{Cell, Kind};
use std::collections::BTreeMap;

// The numbers of `Type`, `Encoding`, `PageType` and `ConvertedType` in parquet.thrift.
const INT64: i32 = 2;
const DOUBLE: i32 = 5;
const BYTE_ARRAY: i32 = 6;
const PLAIN: i32 = 0;
const RLE: i32 = 3;
const RLE_DICTIONARY: i32 = 8;
const DATA_PAGE: i32 = 0;
const DICTIONARY_PAGE: i32 = 2;
const UTF8: i32 = 0;

/// The values of a column, while a row group is collected.
#[derive(Debug)]
pub(super) struct Values {
    kind: Kind,
    /// Whether each row has a value.
    is_there: Vec<bool>,
    /// The values that are there, encoded plainly; of texts those that differ.
    plain: Vec<u8>,
    /// Which text each value is.
    numbers: Vec<u32>,
    texts: BTreeMap<String, u32>,
}

/// The pages of a column that are written.
#[derive(Debug)]
pub(super) struct Chunk {
    kind: Kind,
    values: usize,
    /// The first byte of the dictionary, if there is one, and of the values.
    dictionary_at: Option<u64>,
    data_at: u64,
    /// The length of both, bytes.
    pub(super) size: u64,
}

impl Values {
    pub(super) fn new(kind: Kind) -> Values {
        let (is_there, plain) = (Vec::new(), Vec::new());
        Values { kind, is_there, plain, numbers: Vec::new(), texts: BTreeMap::new() }
    }

    pub(super) fn push(&mut self, cell: Cell<'_>) {
        let bytes = match (self.kind, cell) {
            (Kind::Time, Cell::Time(time)) => time.0.to_le_bytes(),
            (Kind::Number, Cell::Number(number)) => number.to_le_bytes(),
            (Kind::Whole, Cell::Whole(whole)) => whole.to_le_bytes(),
            (Kind::Text, Cell::Text(text)) => return self.push_text(text),
            _ => return self.is_there.push(false),
        };
        self.is_there.push(true);
        self.plain.extend(bytes);
    }

    fn push_text(&mut self, text: &str) {
        self.is_there.push(true);
        let number = self.texts.get(text).copied().unwrap_or_else(|| {
            let number = self.texts.len() as u32;
            self.texts.insert(text.to_owned(), number);
            self.plain.extend((text.len() as u32).to_le_bytes());
            self.plain.extend(text.as_bytes());
            number
        });
        self.numbers.push(number);
    }

    /// The pages, which begin at this byte of the file; the next group begins without values.
    pub(super) fn take(&mut self, at: u64) -> (Vec<u8>, Chunk) {
        let Values { kind, is_there, plain, numbers, texts } =
            std::mem::replace(self, Values::new(self.kind));
        let levels = runs(is_there.iter().map(|is_there| u32::from(*is_there)), 1);
        let mut body = (levels.len() as u32).to_le_bytes().to_vec();
        body.extend(levels);
        let mut bytes = Vec::new();
        let has_dictionary = kind == Kind::Text;
        if has_dictionary {
            let about = Struct::default().i32(1, texts.len() as i32).i32(2, PLAIN);
            bytes = page(DICTIONARY_PAGE, 7, about, &plain);
            let bits = texts.len().next_power_of_two().ilog2().max(1);
            body.push(bits as u8);
            body.extend(runs(numbers.into_iter(), bits));
        } else {
            body.extend(plain);
        }
        let data_at = at + bytes.len() as u64;
        let encoding = if has_dictionary { RLE_DICTIONARY } else { PLAIN };
        let about = Struct::default().i32(1, is_there.len() as i32).i32(2, encoding).i32(3, RLE).i32(4, RLE);
        bytes.extend(page(DATA_PAGE, 5, about, &body));
        let dictionary_at = has_dictionary.then_some(at);
        let size = bytes.len() as u64;
        (bytes, Chunk { kind, values: is_there.len(), dictionary_at, data_at, size })
    }

    /// The structure `SchemaElement`.
    pub(super) fn schema(&self, name: &str) -> Struct {
        let optional = Struct::default().i32(1, stored(self.kind)).i32(3, 1).text(4, name);
        let empty = Struct::default;
        match self.kind {
            Kind::Text => optional.i32(6, UTF8).structure(10, empty().structure(1, empty())),
            Kind::Time => {
                let nanoseconds = empty().structure(3, empty());
                let timestamp = empty().bool(1, true).structure(2, nanoseconds);
                optional.structure(10, empty().structure(8, timestamp))
            }
            Kind::Number | Kind::Whole => optional,
        }
    }
}

impl Chunk {
    /// The structure `ColumnChunk`.
    pub(super) fn description(&self, name: &str) -> Struct {
        let encodings = match self.dictionary_at {
            Some(_) => List::of_i32(&[PLAIN, RLE, RLE_DICTIONARY]),
            None => List::of_i32(&[PLAIN, RLE]),
        };
        let about = Struct::default()
            .i32(1, stored(self.kind))
            .list(2, encodings)
            .list(3, List::of_texts(&[name]))
            .i32(4, 0)
            .i64(5, self.values as i64)
            .i64(6, self.size as i64)
            .i64(7, self.size as i64)
            .i64(9, self.data_at as i64);
        let about = match self.dictionary_at {
            Some(at) => about.i64(11, at as i64),
            None => about,
        };
        let begin = self.dictionary_at.unwrap_or(self.data_at);
        Struct::default().i64(2, begin as i64).structure(3, about)
    }
}

/// The number of the type in which values of a kind are stored.
fn stored(kind: Kind) -> i32 {
    match kind {
        Kind::Time | Kind::Whole => INT64,
        Kind::Number => DOUBLE,
        Kind::Text => BYTE_ARRAY,
    }
}

/// A page with its head; `about` is the field of the head with this number.
fn page(kind: i32, field: u8, about: Struct, body: &[u8]) -> Vec<u8> {
    let size = body.len() as i32;
    let head = Struct::default().i32(1, kind).i32(2, size).i32(3, size).structure(field, about);
    [&*head.into_bytes(), body].concat()
}

/// Small numbers as runs of equal ones: length and number of each. Numbers have at most `bits` bits.
fn runs(numbers: impl Iterator<Item = u32>, bits: u32) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut end = |(number, length): (u32, u64)| {
        bytes.extend(varint(length << 1));
        bytes.extend(number.to_le_bytes().into_iter().take(bits.div_ceil(8) as usize));
    };
    let mut run: Option<(u32, u64)> = None;
    for number in numbers {
        run = Some(match run {
            Some((same, length)) if same == number => (same, length + 1),
            Some(other) => {
                end(other);
                (number, 1)
            }
            None => (number, 1),
        });
    }
    run.into_iter().for_each(end);
    bytes
}
