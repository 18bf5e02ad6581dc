//! The pages of a column: read from the file one after the other, decompressed, and decoded.

use super::super::unpack::{GZIP, Unpacker};
use super::bytes::Bytes;
use super::cells::{Cell, Cells, Runs};
use super::description::{Chunk, Column, Physical};
use super::encoding;
use super::head::Head;
use super::page::Page;
use super::source::{Source, Window};
use super::{lz4, snappy};
use std::borrow::Cow;
use std::io;
use std::iter::repeat_n;
use std::mem::{self, size_of};

/// The longest head of a page, bytes; it may have the smallest and the largest value.
const HEAD_MAX: u64 = 1 << 16;

/// The length of most heads, bytes.
const HEAD_USUAL: u64 = 1 << 8;

/// The largest page after decompression, bytes; writers put about one MiB into one.
const UNPACKED_MAX: usize = 1 << 24;

/// The most values of a page of lists, each of which takes [`OF_LIST`], or of differences, which are decoded one by one. Of other
/// pages equal values are kept once: the memory that they take is bounded, not their number.
const LISTED_MAX: usize = 1 << 20;

/// The most values of a page that are kept as their numbers in the dictionary, four bytes each, and not in runs of equal ones.
const NUMBERED_MAX: usize = 1 << 16;

/// What a value of a list takes besides itself, bytes: its repetition level, and its place in the list.
const OF_LIST: usize = 12;

/// The values of a column in a row group. Memory: a page and the dictionary, which are counted in the budget of the source.
pub(super) struct Pages<'d> {
    column: &'d Column,
    chunk: Chunk,
    /// The place of the next page.
    at: u64,
    /// What was read ahead.
    window: Window,
    dictionary: Vec<Cell>,
    dictionary_texts: Vec<Box<str>>,
    page: Page,
    /// The damages of pages, with their places.
    pub(super) damages: Vec<(u64, String)>,
}

impl<'d> Pages<'d> {
    /// The first page comes next; of each column so many bytes are read ahead.
    pub(super) fn new(column: &'d Column, chunk: Chunk, ahead: u64) -> Pages<'d> {
        Pages {
            column,
            chunk,
            at: chunk.begin,
            window: Window::new(ahead, chunk.end),
            dictionary: Vec::new(),
            dictionary_texts: Vec::new(),
            page: Page::default(),
            damages: Vec::new(),
        }
    }

    /// Whether a row may have several values of the column.
    pub(super) fn are_listed(&self) -> bool {
        self.column.repeated > 0
    }

    /// The number of values that are left in the page.
    pub(super) fn left(&self) -> usize {
        self.page.left()
    }

    /// Appends the next so many values, of which the page has as many.
    pub(super) fn pass(&mut self, count: usize, cells: &mut Vec<Cell>) {
        self.page.pass(count, self.column, &self.dictionary, cells);
    }

    /// Reads the list that comes next, for which `cells` are used; an empty one is a missing cell.
    ///
    /// # Errors
    /// Those of the file, and when its budget is spent.
    pub(super) fn list(
        &mut self,
        source: &mut Source<'_>,
        cells: &mut Vec<Cell>,
    ) -> io::Result<Option<Vec<f64>>> {
        self.pass(1, cells);
        while self.more(source)? && self.page.level() > 0 {
            self.pass(1, cells);
        }
        // An empty list is stored as one missing value.
        let is_empty = cells.as_slice() == [Cell::Missing];
        Ok((!is_empty).then(|| cells.iter().copied().map(number).collect()))
    }

    /// Goes to the next page with values once all of the current one have passed; returns whether there are more.
    ///
    /// # Errors
    /// Those of the file, and when its budget is spent.
    pub(super) fn more(&mut self, source: &mut Source<'_>) -> io::Result<bool> {
        while self.page.left() == 0 {
            if !self.read(source)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// The text of a value.
    pub(super) fn text(&self, number: u32) -> Option<&str> {
        let texts = self.page.texts().unwrap_or(&self.dictionary_texts);
        texts.get(number as usize).map(AsRef::as_ref)
    }

    /// Reads the next page; returns whether there is one.
    fn read(&mut self, source: &mut Source<'_>) -> io::Result<bool> {
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
        let mut window = mem::take(&mut self.window);
        let packed = window.bytes(source, content, page.packed as u64)?;
        source.take(page.unpacked + if self.column.repeated > 0 { OF_LIST * page.values } else { 0 })?;
        let taken = self.take(&page, &packed, source);
        self.window = window;
        if let Err(problem) = taken {
            let name = &self.column.name;
            self.damages.push((begin, format!("{problem}; {} values of '{name}' are missing", page.values)));
            return Ok(page.kind == 2 || self.lose(page.values));
        }
        Ok(true)
    }

    /// Replaces the values of an unreadable page by missing ones.
    fn lose(&mut self, values: usize) -> bool {
        self.page = Page::lost(values);
        true
    }

    /// The head of the page that begins here, and the place of its content; `None` where none begins.
    fn head(&mut self, source: &mut Source<'_>, begin: u64) -> io::Result<Option<(Head, u64)>> {
        for most in [HEAD_USUAL, HEAD_MAX] {
            let bytes = self.window.bytes(source, begin, most.min(self.chunk.end - begin))?;
            let mut rest = Bytes(&bytes);
            if let Some(head) = Head::read(&mut rest) {
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
        // Arrow before 3.0 compressed pages that it said it did not.
        let says_packed = head.levels.is_none_or(|(.., is_packed)| is_packed);
        let is_packed = says_packed || self.chunk.is_always_packed || head.packed != head.unpacked;
        let codec = if is_packed { self.chunk.codec } else { 0 };
        let unpacked =
            unpacked(&mut source.unpacker, codec, values, head.unpacked.saturating_sub(levels.len()))?;
        let (mut bytes, mut cells) = (Bytes(&unpacked), Cells::within(source.budget.left()));
        match head.kind {
            0 | 3 => {
                let page = self.data(head, &mut Bytes(levels), &mut bytes, &mut cells);
                source.settle(&cells)?;
                let problem = || format!("a page cannot be read (encoding {})", head.encoding);
                self.page = page.ok_or_else(problem)?;
            }
            2 => {
                let read = self.dictionary(&mut bytes, head.values, &mut cells);
                source.settle(&cells)?;
                self.dictionary = read.ok_or("the dictionary cannot be read")?;
                self.dictionary_texts = cells.texts;
            }
            _ => {}
        }
        Ok(())
    }

    /// Decodes a dictionary, whose values are looked up by their numbers.
    fn dictionary(&self, bytes: &mut Bytes<'_>, count: usize, cells: &mut Cells) -> Option<Vec<Cell>> {
        if encoding::has_width(self.column) {
            let mut list = Vec::new();
            cells.take(count.checked_mul(size_of::<Cell>())?)?;
            encoding::plain_numbers(bytes, self.column, count, &mut list)?;
            return Some(list);
        }
        encoding::plain(bytes, self.column, count, cells)?;
        cells.take(cells.runs.count * size_of::<Cell>())?;
        let runs = mem::take(&mut cells.runs);
        Some(runs.list.into_iter().flat_map(|(cell, times)| repeat_n(cell, times as usize)).collect())
    }

    /// Decodes the levels, then the present values.
    fn data(
        &self,
        head: &Head,
        levels: &mut Bytes<'_>,
        bytes: &mut Bytes<'_>,
        cells: &mut Cells,
    ) -> Option<Page> {
        let column = self.column;
        let mut level = |most: u32, length: Option<usize>| -> Option<Runs<u32>> {
            // A column without such levels may have bytes for them all the same.
            let stated = levels.take(length.unwrap_or(0))?;
            if most == 0 {
                return Some(Runs::default());
            }
            let width = (u32::BITS - most.leading_zeros()) as u8;
            let mut run = match length {
                Some(_) => Bytes(stated),
                None => {
                    let length = bytes.u32()?;
                    Bytes(bytes.take(length)?)
                }
            };
            encoding::runs(&mut run, width, head.values)
        };
        let repeats = level(column.repeated, head.levels.map(|(repeated, ..)| repeated))?;
        let defined = level(column.defined, head.levels.map(|(_, defined, _)| defined))?;
        let present = defined.list.iter().filter(|(level, _)| *level == column.defined);
        let present: usize = present.map(|(_, times)| *times as usize).sum();
        let is_whole = column.defined == 0 || present == head.values;
        let count = if is_whole { head.values } else { present };
        let is_numbered = matches!(head.encoding, 2 | 8);
        if is_numbered && is_whole && column.repeated == 0 && count <= NUMBERED_MAX {
            cells.take(count * size_of::<u32>())?;
            return encoding::numbers(bytes, self.dictionary.len(), count).map(Page::of_dictionary);
        }
        if let (0, true, 0, Some(width)) = (head.encoding, is_whole, column.repeated, encoding::width(column))
        {
            // What the page unpacks to is counted.
            return Some(Page::of_plain(bytes.take(count.checked_mul(width)?)?.to_vec(), width));
        }
        if is_whole {
            self.values(head, bytes, count, cells)?;
        } else {
            let mut values = Cells::within(cells.room());
            let read = self.values(head, bytes, count, &mut values);
            cells.is_full |= values.is_full;
            read?;
            cells.texts = mem::take(&mut values.texts);
            spread(&defined, column.defined, values.runs, cells)?;
        }
        let each = repeats.list.into_iter().flat_map(|(level, times)| repeat_n(level, times as usize));
        let texts = (!is_numbered).then(|| mem::take(&mut cells.texts));
        Some(Page::of(mem::take(&mut cells.runs), texts, each.collect()))
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

fn number(cell: Cell) -> f64 {
    match cell {
        Cell::Number(number) => number,
        Cell::Whole(whole) => whole as f64,
        Cell::Missing | Cell::Text(_) => f64::NAN,
    }
}

/// The decompressed bytes of a page.
fn unpacked<'p>(
    unpacker: &mut Unpacker,
    codec: i64,
    packed: &'p [u8],
    length: usize,
) -> Result<Cow<'p, [u8]>, String> {
    let all = |unpacked: Option<Vec<u8>>| {
        unpacked.map(Cow::Owned).ok_or_else(|| "a page cannot be unpacked".to_owned())
    };
    match codec {
        0 => Ok(Cow::Borrowed(packed)),
        // A page without a value has no bytes.
        _ if length == 0 => Ok(Cow::Borrowed(&[])),
        1 => all(snappy::unpack(packed, length)),
        2 | 6 => {
            let method = if codec == 2 { GZIP } else { "zstd" };
            let unpacked = unpacker.unpack(method, packed, length as u64);
            unpacked.problem.map_or(Ok(Cow::Owned(unpacked.bytes)), Err)
        }
        5 => all(lz4::unpack(packed, length)),
        7 => all(lz4_flex::block::decompress(packed, length).ok()),
        other => Err(format!(
            "it is packed by {}, which is not known here",
            match other {
                3 => "LZO",
                4 => "Brotli",
                _ => "an unknown method",
            }
        )),
    }
}
