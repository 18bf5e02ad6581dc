//! The pages of a column: read from the file one after the other, decompressed, and decoded.

use super::super::topic::Input;
use super::super::unpack::{UNPACKED_MAX, unpack};
use super::bytes::Bytes;
use super::bytes_at;
use super::description::{Chunk, Column, Physical};
use super::encoding::{self, Cell, Cells};
use super::snappy;
use super::thrift::Struct;
use miniz_oxide::inflate::decompress_to_vec_with_limit;
use std::io;

/// The longest head of a page, bytes; it may have the smallest and the largest value.
const HEAD_MAX: u64 = 1 << 16;

/// The most values of a page that are accepted; writers put some ten thousand into one.
const VALUES_MAX: usize = 1 << 21;

/// The next entry of a column.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Entry {
    Cell(Cell),
    List(Vec<f64>),
}

/// The values of a column in a row group. Memory: a page and the dictionary.
pub(super) struct Pages<'d> {
    column: &'d Column,
    chunk: Chunk,
    /// The place of the next page.
    at: u64,
    dictionary: Cells,
    page: Page,
    /// The damages of pages, with their places.
    pub(super) damages: Vec<(u64, String)>,
}

/// The values of a page.
#[derive(Default)]
struct Page {
    cells: Vec<Cell>,
    /// The texts of a page without a dictionary.
    texts: Option<Vec<Box<str>>>,
    /// The repetition level of each value, where the column is a list.
    repeats: Vec<u32>,
    /// The index of the next value.
    next: usize,
}

/// The head of a page.
struct Head {
    kind: i64,
    values: usize,
    encoding: i64,
    packed: usize,
    unpacked: usize,
    /// For pages of the second version: the lengths of the repetition and definition levels, which are not compressed, and
    /// whether the values are compressed.
    levels: Option<(usize, usize, bool)>,
}

impl<'d> Pages<'d> {
    pub(super) fn new(column: &'d Column, chunk: Chunk) -> Pages<'d> {
        let (dictionary, page) = (Cells::default(), Page::default());
        Pages { column, chunk, at: chunk.begin, dictionary, page, damages: Vec::new() }
    }

    /// The entry of the column for the next row; `None` after the last one.
    ///
    /// # Errors
    /// Those of the file.
    pub(super) fn entry(&mut self, input: &mut dyn Input) -> io::Result<Option<Entry>> {
        let Some((cell, _)) = self.next(input)? else { return Ok(None) };
        if self.column.repeated == 0 {
            return Ok(Some(Entry::Cell(cell)));
        }
        let mut list = Vec::new();
        let mut item = Some(cell);
        while let Some(cell) = item {
            list.push(number(cell));
            item = match self.peek(input)? {
                Some(level) if level > 0 => self.next(input)?.map(|(cell, _)| cell),
                _ => None,
            };
        }
        // An empty list is stored as one missing value.
        let is_empty = list.len() == 1 && cell == Cell::Missing;
        Ok(Some(if is_empty { Entry::Cell(Cell::Missing) } else { Entry::List(list) }))
    }

    /// The text of a value.
    pub(super) fn text(&self, number: u32) -> Option<&str> {
        let texts = self.page.texts.as_ref().unwrap_or(&self.dictionary.texts);
        texts.get(number as usize).map(AsRef::as_ref)
    }

    fn peek(&mut self, input: &mut dyn Input) -> io::Result<Option<u32>> {
        while self.page.next >= self.page.cells.len() {
            if !self.turn(input)? {
                return Ok(None);
            }
        }
        Ok(Some(self.page.repeats.get(self.page.next).copied().unwrap_or(0)))
    }

    fn next(&mut self, input: &mut dyn Input) -> io::Result<Option<(Cell, u32)>> {
        let Some(level) = self.peek(input)? else { return Ok(None) };
        let cell = self.page.cells.get(self.page.next).copied().unwrap_or(Cell::Missing);
        self.page.next += 1;
        Ok(Some((cell, level)))
    }

    /// Reads the next page; returns whether there is one.
    fn turn(&mut self, input: &mut dyn Input) -> io::Result<bool> {
        let begin = self.at;
        if begin >= self.chunk.end {
            return Ok(false);
        }
        let head = bytes_at(input, begin, HEAD_MAX.min(self.chunk.end - begin))?;
        let mut rest = Bytes(&head);
        let Some(page) = Struct::read(&mut rest).and_then(|page| Head::of(&page)) else {
            self.damages
                .push((begin, format!("no page begins here; the rest of '{}' is missing", self.column.name)));
            self.at = self.chunk.end;
            return Ok(false);
        };
        let content = begin + (head.len() - rest.0.len()) as u64;
        self.at = content + page.packed as u64;
        if page.packed as u64 > UNPACKED_MAX
            || page.unpacked as u64 > UNPACKED_MAX
            || page.values > VALUES_MAX
        {
            let limit = format!("{} MiB and {VALUES_MAX} values", UNPACKED_MAX >> 20);
            self.damages
                .push((begin, format!("a page of '{}' is larger than {limit}; left out", self.column.name)));
            return Ok(self.lose(page.values.min(VALUES_MAX)));
        }
        let packed = bytes_at(input, content, page.packed as u64)?;
        if let Err(problem) = self.take(&page, &packed) {
            let name = &self.column.name;
            self.damages.push((begin, format!("{problem}; {} values of '{name}' are missing", page.values)));
            return Ok(page.kind == 2 || self.lose(page.values));
        }
        Ok(true)
    }

    /// Replaces the values of an unreadable page by missing ones.
    fn lose(&mut self, values: usize) -> bool {
        self.page = Page { cells: vec![Cell::Missing; values], ..Page::default() };
        true
    }

    fn take(&mut self, head: &Head, packed: &[u8]) -> Result<(), String> {
        self.page = Page::default();
        let (levels, values) = match head.levels {
            Some((repeated, defined, _)) => {
                packed.split_at_checked(repeated + defined).ok_or("a page is too short")?
            }
            None => (&[][..], packed),
        };
        let is_packed = head.levels.is_none_or(|(.., is_packed)| is_packed);
        let codec = if is_packed { self.chunk.codec } else { 0 };
        let unpacked = unpacked(codec, values, head.unpacked.saturating_sub(levels.len()))?;
        let mut bytes = Bytes(&unpacked);
        match head.kind {
            0 | 3 => {
                let page = self.data(head, &mut Bytes(levels), &mut bytes);
                self.page =
                    page.ok_or_else(|| format!("a page cannot be read (encoding {})", head.encoding))?;
            }
            2 => {
                let mut cells = Cells::default();
                let read = encoding::plain(&mut bytes, self.column, head.values, &mut cells);
                read.ok_or("the dictionary cannot be read")?;
                self.dictionary = cells;
            }
            _ => {}
        }
        Ok(())
    }

    /// Decodes the levels, then the present values.
    fn data(&self, head: &Head, levels: &mut Bytes<'_>, bytes: &mut Bytes<'_>) -> Option<Page> {
        let column = self.column;
        let mut level = |most: u32, length: Option<usize>| -> Option<Vec<u32>> {
            if most == 0 {
                return Some(Vec::new());
            }
            let width = (u32::BITS - most.leading_zeros()) as u8;
            let mut run = match length {
                Some(length) => Bytes(levels.take(length)?),
                None => {
                    let length = bytes.u32()?;
                    Bytes(bytes.take(length)?)
                }
            };
            encoding::runs(&mut run, width, head.values)
        };
        let repeats = level(column.repeated, head.levels.map(|(repeated, ..)| repeated))?;
        let defined = level(column.defined, head.levels.map(|(_, defined, _)| defined))?;
        let is_there = |level: &&u32| **level == column.defined;
        let count = if column.defined == 0 { head.values } else { defined.iter().filter(is_there).count() };
        let page = self.values(head, bytes, count)?;
        let cells = if column.defined == 0 {
            page.cells
        } else {
            let mut values = page.cells.into_iter();
            let cell = |level: &u32| match is_there(&level) {
                true => values.next().unwrap_or(Cell::Missing),
                false => Cell::Missing,
            };
            defined.iter().map(cell).collect()
        };
        Some(Page { cells, repeats, texts: page.texts, next: 0 })
    }

    /// Decodes a page of `count` present values, with their texts where these are not in the dictionary.
    fn values(&self, head: &Head, bytes: &mut Bytes<'_>, count: usize) -> Option<Page> {
        let mut cells = Cells::default();
        match head.encoding {
            0 => encoding::plain(bytes, self.column, count, &mut cells)?,
            2 | 8 if count == 0 => {}
            2 | 8 => {
                let cells = encoding::of_dictionary(bytes, &self.dictionary.list, count)?;
                return Some(Page { cells, ..Page::default() });
            }
            3 if self.column.physical == Physical::Bool => {
                let length = bytes.u32()?;
                let bits = encoding::runs(&mut Bytes(bytes.take(length)?), 1, count)?;
                cells.list.extend(bits.into_iter().map(|bit| Cell::Whole(bit.into())));
            }
            5 => encoding::of_differences(bytes, self.column, count, &mut cells)?,
            6 | 7 => encoding::texts(bytes, self.column, count, head.encoding == 7, &mut cells)?,
            9 => encoding::split(bytes, self.column, count, &mut cells)?,
            _ => return None,
        }
        let Cells { list, texts } = cells;
        (list.len() == count).then(|| Page { cells: list, texts: Some(texts), ..Page::default() })
    }
}

impl Head {
    fn of(page: &Struct) -> Option<Head> {
        let size = |whole: Option<i64>| usize::try_from(whole?).ok();
        let kind = page.whole(1)?;
        let (about, encoding) = match kind {
            0 => (page.structure(5)?, 2),
            2 => (page.structure(7)?, 2),
            3 => (page.structure(8)?, 4),
            // A page of another kind has no values.
            _ => {
                return Some(Head {
                    kind,
                    values: 0,
                    encoding: 0,
                    packed: size(page.whole(3))?,
                    unpacked: 0,
                    levels: None,
                });
            }
        };
        let levels = match kind {
            3 => Some((size(about.whole(6))?, size(about.whole(5))?, about.bool(7).unwrap_or(true))),
            _ => None,
        };
        Some(Head {
            kind,
            values: size(about.whole(1))?,
            encoding: about.whole(encoding)?,
            packed: size(page.whole(3))?,
            unpacked: size(page.whole(2))?,
            levels,
        })
    }
}

fn number(cell: Cell) -> f64 {
    match cell {
        Cell::Number(number) => number,
        Cell::Whole(whole) => whole as f64,
        Cell::Missing | Cell::Text(_) => f64::NAN,
    }
}

/// The decompressed bytes of a page.
fn unpacked(codec: i64, packed: &[u8], length: usize) -> Result<Vec<u8>, String> {
    let all = |unpacked: Option<Vec<u8>>| unpacked.ok_or_else(|| "a page cannot be unpacked".to_owned());
    match codec {
        0 => Ok(packed.to_vec()),
        1 => all(snappy::unpack(packed, length)),
        2 => all(gzip(packed, length)),
        6 => {
            let unpacked = unpack("zstd", packed, length as u64);
            unpacked.problem.map_or(Ok(unpacked.bytes), Err)
        }
        7 => all(lz4_flex::block::decompress(packed, length).ok()),
        other => Err(format!(
            "it is packed by {}, which is not known here",
            match other {
                3 => "LZO",
                4 => "Brotli",
                5 => "LZ4 in Hadoop's way",
                _ => "an unknown method",
            }
        )),
    }
}

/// Decompresses gzip: a head, a deflate stream, and a checksum that is not compared.
fn gzip(packed: &[u8], length: usize) -> Option<Vec<u8>> {
    let mut bytes = Bytes(packed);
    let &[0x1f, 0x8b, 8, flags, ..] = bytes.take(10)? else { return None };
    if flags & 4 != 0 {
        let length = u16::from_le_bytes(*bytes.take(2)?.first_chunk()?);
        bytes.take(length.into())?;
    }
    // A name and a comment, each up to a zero.
    for flag in [8, 16] {
        while flags & flag != 0 && bytes.byte()? != 0 {}
    }
    if flags & 2 != 0 {
        bytes.take(2)?;
    }
    decompress_to_vec_with_limit(bytes.0, length).ok()
}
