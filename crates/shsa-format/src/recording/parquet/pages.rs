//! The pages of a column: read from the file one after the other, decompressed, and decoded.

use super::super::unpack::{GZIP, Unpacker};
use super::bytes::Bytes;
use super::cells::{Cell, Cells, Runs};
use super::description::{Chunk, Column, Physical};
use super::encoding;
use super::snappy;
use super::source::Source;
use super::thrift::Struct;
use std::io;
use std::iter::repeat_n;
use std::mem::size_of;

/// The longest head of a page, bytes; it may have the smallest and the largest value.
const HEAD_MAX: u64 = 1 << 16;

/// The length of most heads, bytes.
const HEAD_USUAL: u64 = 1 << 8;

/// The largest page after decompression, bytes; writers put about one MiB into one.
const UNPACKED_MAX: usize = 1 << 24;

/// The most values of a page of lists, each of which takes [`OF_LIST`], or of differences, which are decoded one by one. Of other
/// pages equal values are kept once: the memory that they take is bounded, not their number.
const LISTED_MAX: usize = 1 << 20;

/// What a value of a list takes besides itself, bytes: its repetition level, and its place in the list.
const OF_LIST: usize = 12;

/// The next entry of a column.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Entry {
    Cell(Cell),
    List(Vec<f64>),
}

/// The values of a column in a row group. Memory: a page and the dictionary, which are counted in the budget of the source.
pub(super) struct Pages<'d> {
    column: &'d Column,
    chunk: Chunk,
    /// The place of the next page.
    at: u64,
    dictionary: Vec<Cell>,
    dictionary_texts: Vec<Box<str>>,
    page: Page,
    /// The damages of pages, with their places.
    pub(super) damages: Vec<(u64, String)>,
}

/// The values of a page.
#[derive(Default)]
struct Page {
    cells: Runs<Cell>,
    /// The run of the next value, and how many values of that run have passed.
    run: usize,
    passed: u32,
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
        Pages {
            column,
            chunk,
            at: chunk.begin,
            dictionary: Vec::new(),
            dictionary_texts: Vec::new(),
            page: Page::default(),
            damages: Vec::new(),
        }
    }

    /// The entry of the column for the next row; `None` after the last one.
    ///
    /// # Errors
    /// Those of the file, and when its budget is spent.
    pub(super) fn entry(&mut self, source: &mut Source<'_>) -> io::Result<Option<Entry>> {
        let Some((cell, _)) = self.next(source)? else { return Ok(None) };
        if self.column.repeated == 0 {
            return Ok(Some(Entry::Cell(cell)));
        }
        let mut list = Vec::new();
        let mut item = Some(cell);
        while let Some(cell) = item {
            list.push(number(cell));
            item = match self.peek(source)? {
                Some(level) if level > 0 => self.next(source)?.map(|(cell, _)| cell),
                _ => None,
            };
        }
        // An empty list is stored as one missing value.
        let is_empty = list.len() == 1 && cell == Cell::Missing;
        Ok(Some(if is_empty { Entry::Cell(Cell::Missing) } else { Entry::List(list) }))
    }

    /// The text of a value.
    pub(super) fn text(&self, number: u32) -> Option<&str> {
        let texts = self.page.texts.as_ref().unwrap_or(&self.dictionary_texts);
        texts.get(number as usize).map(AsRef::as_ref)
    }

    fn peek(&mut self, source: &mut Source<'_>) -> io::Result<Option<u32>> {
        while self.page.next >= self.page.cells.count {
            if !self.turn(source)? {
                return Ok(None);
            }
        }
        Ok(Some(self.page.repeats.get(self.page.next).copied().unwrap_or(0)))
    }

    fn next(&mut self, source: &mut Source<'_>) -> io::Result<Option<(Cell, u32)>> {
        let Some(level) = self.peek(source)? else { return Ok(None) };
        let page = &mut self.page;
        let (cell, times) = page.cells.list.get(page.run).copied().unwrap_or((Cell::Missing, 1));
        page.next += 1;
        page.passed += 1;
        if page.passed >= times {
            (page.run, page.passed) = (page.run + 1, 0);
        }
        Ok(Some((cell, level)))
    }

    /// Reads the next page; returns whether there is one.
    fn turn(&mut self, source: &mut Source<'_>) -> io::Result<bool> {
        let begin = self.at;
        if begin >= self.chunk.end {
            return Ok(false);
        }
        let Some((page, content)) = self.head(source, begin)? else {
            self.damages
                .push((begin, format!("no page begins here; the rest of '{}' is missing", self.column.name)));
            self.at = self.chunk.end;
            return Ok(false);
        };
        self.at = content.saturating_add(page.packed as u64);
        let is_listed = self.column.repeated > 0 || matches!(page.encoding, 5..=7);
        let is_long = is_listed && page.values > LISTED_MAX;
        if page.packed > UNPACKED_MAX || page.unpacked > UNPACKED_MAX || is_long {
            let limit = format!("{} MiB, or {LISTED_MAX} values of lists or differences", UNPACKED_MAX >> 20);
            self.damages
                .push((begin, format!("a page of '{}' is larger than {limit}; left out", self.column.name)));
            return Ok(self.lose(page.values));
        }
        let packed = source.bytes(content, page.packed as u64)?;
        source.take(page.unpacked + if self.column.repeated > 0 { OF_LIST * page.values } else { 0 })?;
        if let Err(problem) = self.take(&page, &packed, source) {
            let name = &self.column.name;
            self.damages.push((begin, format!("{problem}; {} values of '{name}' are missing", page.values)));
            return Ok(page.kind == 2 || self.lose(page.values));
        }
        Ok(true)
    }

    /// Replaces the values of an unreadable page by missing ones.
    fn lose(&mut self, values: usize) -> bool {
        self.page = Page::default();
        self.page.cells.push(Cell::Missing, values);
        true
    }

    /// The head of the page that begins here, and the place of its content; `None` where none begins.
    fn head(&self, source: &mut Source<'_>, begin: u64) -> io::Result<Option<(Head, u64)>> {
        for most in [HEAD_USUAL, HEAD_MAX] {
            let bytes = source.bytes(begin, most.min(self.chunk.end - begin))?;
            let mut rest = Bytes(&bytes);
            if let Some(head) = Struct::read(&mut rest).and_then(|page| Head::of(&page)) {
                return Ok(Some((head, begin + (bytes.len() - rest.0.len()) as u64)));
            }
        }
        Ok(None)
    }

    /// Decodes a page, and counts what it takes.
    fn take(&mut self, head: &Head, packed: &[u8], source: &mut Source<'_>) -> Result<(), String> {
        self.page = Page::default();
        let (levels, values) = match head.levels {
            Some((repeated, defined, _)) => {
                packed.split_at_checked(repeated.saturating_add(defined)).ok_or("a page is too short")?
            }
            None => (&[][..], packed),
        };
        let is_packed = head.levels.is_none_or(|(.., is_packed)| is_packed);
        let codec = if is_packed { self.chunk.codec } else { 0 };
        let unpacked =
            unpacked(&mut source.unpacker, codec, values, head.unpacked.saturating_sub(levels.len()))?;
        let (mut bytes, mut cells) = (Bytes(&unpacked), Cells::within(source.budget.left()));
        let read = match head.kind {
            0 | 3 => self.data(head, &mut Bytes(levels), &mut bytes, &mut cells),
            2 => encoding::plain(&mut bytes, self.column, head.values, &mut cells),
            _ => return Ok(()),
        };
        source.settle(&cells)?;
        match (head.kind, read) {
            (2, None) => return Err("the dictionary cannot be read".to_owned()),
            (_, None) => return Err(format!("a page cannot be read (encoding {})", head.encoding)),
            (2, Some(())) => self.keep_dictionary(cells, source)?,
            (_, Some(())) => self.page.keep(cells, head.encoding),
        }
        Ok(())
    }

    /// Keeps a dictionary, whose values are looked up by their numbers.
    fn keep_dictionary(&mut self, cells: Cells, source: &mut Source<'_>) -> Result<(), String> {
        source.budget.take((cells.runs.count * size_of::<Cell>()) as u64)?;
        let each = cells.runs.list.into_iter().flat_map(|(cell, times)| repeat_n(cell, times as usize));
        self.dictionary = each.collect();
        self.dictionary_texts = cells.texts;
        Ok(())
    }

    /// Decodes the levels, then the present values.
    fn data(
        &mut self,
        head: &Head,
        levels: &mut Bytes<'_>,
        bytes: &mut Bytes<'_>,
        cells: &mut Cells,
    ) -> Option<()> {
        let column = self.column;
        let mut level = |most: u32, length: Option<usize>| -> Option<Runs<u32>> {
            if most == 0 {
                return Some(Runs::default());
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
        self.page.repeats =
            repeats.list.into_iter().flat_map(|(level, times)| repeat_n(level, times as usize)).collect();
        if column.defined == 0 {
            return self.values(head, bytes, head.values, cells);
        }
        let present = defined.list.iter().filter(|(level, _)| *level == column.defined);
        let count = present.map(|(_, times)| *times as usize).sum();
        let mut values = Cells::within(cells.room());
        let read = self.values(head, bytes, count, &mut values);
        cells.is_full |= values.is_full;
        read?;
        cells.texts = std::mem::take(&mut values.texts);
        spread(&defined, column.defined, values.runs, cells)
    }

    /// Decodes `count` present values, with their texts where these are not in the dictionary.
    fn values(&self, head: &Head, bytes: &mut Bytes<'_>, count: usize, cells: &mut Cells) -> Option<()> {
        match head.encoding {
            0 => encoding::plain(bytes, self.column, count, cells)?,
            2 | 8 if count == 0 => {}
            2 | 8 => encoding::of_dictionary(bytes, &self.dictionary, count, cells)?,
            3 if self.column.physical == Physical::Bool => {
                let length = bytes.u32()?;
                let bits = encoding::runs(&mut Bytes(bytes.take(length)?), 1, count)?;
                let mut each = bits.list.into_iter();
                each.try_for_each(|(bit, times)| cells.push(Cell::Whole(bit.into()), times as usize))?;
            }
            5 => encoding::of_differences(bytes, self.column, count, cells)?,
            6 | 7 => encoding::texts(bytes, self.column, count, head.encoding == 7, cells)?,
            9 => encoding::split(bytes, self.column, count, cells)?,
            _ => return None,
        }
        (cells.runs.count == count).then_some(())
    }
}

/// Spreads the present values over the places at which the definition level is `most`; the other places have no value.
fn spread(defined: &Runs<u32>, most: u32, values: Runs<Cell>, cells: &mut Cells) -> Option<()> {
    let mut values = values.list.into_iter();
    let mut value = values.next();
    for (level, times) in &defined.list {
        let mut left = *times;
        while let Some((cell, there)) = value.filter(|_| *level == most && left > 0) {
            let taken = there.min(left);
            cells.push(cell, taken as usize)?;
            left -= taken;
            value = if there > taken { Some((cell, there - taken)) } else { values.next() };
        }
        cells.push(Cell::Missing, left as usize)?;
    }
    Some(())
}

impl Page {
    /// Keeps the values of a page, from its first one on.
    fn keep(&mut self, cells: Cells, encoding: i64) {
        // The texts of values in the dictionary are there.
        self.texts = (!matches!(encoding, 2 | 8)).then_some(cells.texts);
        self.cells = cells.runs;
        self.cells.list.shrink_to_fit();
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
fn unpacked(unpacker: &mut Unpacker, codec: i64, packed: &[u8], length: usize) -> Result<Vec<u8>, String> {
    let all = |unpacked: Option<Vec<u8>>| unpacked.ok_or_else(|| "a page cannot be unpacked".to_owned());
    match codec {
        0 => Ok(packed.to_vec()),
        1 => all(snappy::unpack(packed, length)),
        2 | 6 => {
            let method = if codec == 2 { GZIP } else { "zstd" };
            let unpacked = unpacker.unpack(method, packed, length as u64);
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
