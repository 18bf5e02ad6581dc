//! SQLite databases, read only: the rows of a table, straight from the pages.
//!
//! Format: <https://www.sqlite.org/fileformat.html>. This reader is an own one instead of the library, for three reasons: a
//! damaged page costs only its rows, the content of a truncated file can be read, and memory is bounded by the longest row. Pages
//! in a write-ahead log beside the file (`-wal`) are taken from the log.

use std::collections::BTreeMap;
use std::io::{self, Read, Seek, SeekFrom};

/// The first bytes of every database.
pub(super) const MAGIC: &[u8] = b"SQLite format 3\0";
/// The page size that is assumed where the head of the file is damaged.
const PAGE_USUAL: u64 = 4_096;
/// The longest row that is read, bytes.
const ROW_MAX: u64 = 1 << 28;
/// The greatest depth of a tree of pages.
const DEPTH_MAX: usize = 24;

const INTERIOR: u8 = 5;
const LEAF: u8 = 13;

/// A value of a row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Cell<'a> {
    /// Nothing.
    Null,
    /// A whole number.
    Whole(i64),
    /// A number.
    Number(f64),
    /// A text, as its bytes.
    Text(&'a [u8]),
    /// Bytes.
    Blob(&'a [u8]),
}

/// A row, or a loss.
pub(super) enum Event<'a> {
    /// A row: its number and its values.
    Row(i64, &'a [Cell<'a>]),
    /// A loss: the place in the file, and the problem.
    Damage(u64, String),
}

/// A database; its pages are read when they are needed.
pub(super) struct Database<R> {
    input: R,
    length: u64,
    page_size: u64,
    usable: u64,
    /// For each page in the log, its place there.
    log: BTreeMap<u32, u64>,
    log_bytes: Vec<u8>,
    visited: Vec<u64>,
    /// Whether the file begins with the magic.
    pub(super) has_magic: bool,
}

impl<R: Read + Seek> Database<R> {
    /// Opens a database with the log beside it. Where the head is damaged, the usual page size is assumed.
    ///
    /// # Errors
    /// Those of the input.
    pub(super) fn open(mut input: R, log: Vec<u8>) -> io::Result<Database<R>> {
        let length = input.seek(SeekFrom::End(0))?;
        let mut head = Vec::new();
        input.seek(SeekFrom::Start(0))?;
        input.by_ref().take(100).read_to_end(&mut head)?;
        let size = match head.get(16..18).map(be) {
            Some(1) => 65_536,
            Some(size) if size.is_power_of_two() && (512..=32_768).contains(&size) => size,
            _ => PAGE_USUAL,
        };
        let reserved = head.get(20).map_or(0, |reserved| u64::from(*reserved));
        let usable = size.saturating_sub(reserved).max(480);
        let mut database = Database {
            input,
            length,
            page_size: size,
            usable,
            log: BTreeMap::new(),
            log_bytes: log,
            visited: Vec::new(),
            has_magic: head.starts_with(MAGIC),
        };
        database.read_log();
        Ok(database)
    }

    /// The number of pages.
    fn pages(&self) -> u32 {
        let stored = u32::try_from(self.length.div_ceil(self.page_size)).unwrap_or(u32::MAX);
        stored.max(self.log.keys().next_back().copied().unwrap_or(0))
    }

    /// Finds the pages of the log that belong to finished transactions.
    fn read_log(&mut self) {
        let bytes = std::mem::take(&mut self.log_bytes);
        let word = |at: usize| bytes.get(at..at + 4).map(be);
        let is_big = match word(0) {
            Some(0x377f_0683) => true,
            Some(0x377f_0682) => false,
            _ => return,
        };
        let (Some(size), Some(salts)) = (word(8), bytes.get(16..24)) else { return };
        if size != self.page_size {
            return;
        }
        let mut sum = checksum(bytes.get(..24).unwrap_or_default(), is_big, (0, 0));
        let step = 24 + size as usize;
        let mut pending = Vec::new();
        for at in (32..bytes.len()).step_by(step) {
            let Some(frame) = bytes.get(at..at + step) else { break };
            let (head, page) = frame.split_at(24);
            sum = checksum(head.get(..8).unwrap_or_default(), is_big, sum);
            sum = checksum(page, is_big, sum);
            let stated = (word(at + 16), word(at + 20));
            if head.get(8..16) != Some(salts) || stated != (Some(u64::from(sum.0)), Some(u64::from(sum.1))) {
                break;
            }
            pending.push((word(at).unwrap_or(0) as u32, at as u64 + 24));
            // The last frame of a transaction has the size of the database after it.
            if word(at + 4) != Some(0) {
                self.log.extend(pending.drain(..));
            }
        }
        self.log_bytes = bytes;
    }

    /// A page, counted from 1; shorter than the page size where the file ends.
    fn page(&mut self, number: u32) -> io::Result<Vec<u8>> {
        if let Some(at) = self.log.get(&number) {
            let from = *at as usize;
            return Ok(self.log_bytes.get(from..from + self.page_size as usize).unwrap_or_default().to_vec());
        }
        let mut bytes = Vec::with_capacity(self.page_size as usize);
        if number > 0 {
            self.input.seek(SeekFrom::Start(self.offset(number)))?;
            self.input.by_ref().take(self.page_size).read_to_end(&mut bytes)?;
        }
        Ok(bytes)
    }

    fn offset(&self, number: u32) -> u64 {
        u64::from(number.saturating_sub(1)) * self.page_size
    }

    /// Marks a page as visited; returns whether that is new.
    fn visit(&mut self, number: u32) -> bool {
        let (word, bit) = (number as usize / 64, 1_u64 << (number % 64));
        if self.visited.len() <= word {
            self.visited.resize(word + 1, 0);
        }
        self.visited.get_mut(word).is_some_and(|word| {
            let is_new = *word & bit == 0;
            *word |= bit;
            is_new
        })
    }

    /// The root pages of the tables, by their names.
    ///
    /// # Errors
    /// Those of the input.
    pub(super) fn tables(&mut self, each: &mut dyn FnMut(Event<'_>)) -> io::Result<BTreeMap<String, u32>> {
        let mut tables = BTreeMap::new();
        self.rows(1, &mut |event| match event {
            Event::Row(_, [Cell::Text(b"table"), Cell::Text(name), _, Cell::Whole(root), ..]) => {
                let name = String::from_utf8_lossy(name).into_owned();
                tables.insert(name, u32::try_from(*root).unwrap_or(0));
            }
            Event::Row(..) => {}
            damage @ Event::Damage(..) => each(damage),
        })?;
        Ok(tables)
    }

    /// Reports the rows of a table by its root page, in the order of their numbers.
    ///
    /// # Errors
    /// Those of the input.
    pub(super) fn rows(&mut self, root: u32, each: &mut dyn FnMut(Event<'_>)) -> io::Result<()> {
        // The pages still to visit, the next one last.
        let mut waiting = vec![(root, 0)];
        while let Some((number, depth)) = waiting.pop() {
            let offset = self.offset(number);
            if number == 0 || number > self.pages() || depth > DEPTH_MAX || !self.visit(number) {
                each(Event::Damage(offset, format!("page {number} cannot be part of this table")));
                continue;
            }
            let bytes = self.page(number)?;
            let page = Page { bytes: &bytes, start: if number == 1 { 100 } else { 0 } };
            match page.kind() {
                Some(LEAF) => self.leaf(&page, offset, each)?,
                Some(INTERIOR) => {
                    let children: Vec<u32> = page.children().collect();
                    waiting.extend(children.into_iter().rev().map(|child| (child, depth + 1)));
                }
                _ => each(Event::Damage(offset, format!("page {number} is no page of a table"))),
            }
        }
        Ok(())
    }

    /// Reports the rows of all pages that were not visited, of any table.
    ///
    /// # Errors
    /// Those of the input.
    pub(super) fn rest(&mut self, each: &mut dyn FnMut(Event<'_>)) -> io::Result<()> {
        for number in 1..=self.pages() {
            if !self.visit(number) {
                continue;
            }
            let bytes = self.page(number)?;
            let page = Page { bytes: &bytes, start: if number == 1 { 100 } else { 0 } };
            if page.kind() == Some(LEAF) {
                self.leaf(&page, self.offset(number), &mut |event| {
                    // Damage outside of the rows has no meaning here, as the page may be of any kind.
                    if let row @ Event::Row(..) = event {
                        each(row);
                    }
                })?;
            }
        }
        Ok(())
    }

    /// Marks all pages as not visited.
    pub(super) fn forget(&mut self) {
        self.visited.clear();
    }

    fn leaf(&mut self, page: &Page<'_>, offset: u64, each: &mut dyn FnMut(Event<'_>)) -> io::Result<()> {
        let mut lost = 0;
        for at in page.cells() {
            match self.row(page, at)? {
                Some((number, payload)) => {
                    let mut cells = Vec::new();
                    match record(&payload, &mut cells) {
                        Some(()) => each(Event::Row(number, &cells)),
                        None => lost += 1,
                    }
                }
                None => lost += 1,
            }
        }
        let missing = page.count().saturating_sub(page.cells().count());
        if lost + missing > 0 {
            let problem = format!("{} rows of this page are damaged", lost + missing);
            each(Event::Damage(offset, problem));
        }
        Ok(())
    }

    /// The number and the bytes of the row at a place in a page.
    fn row(&mut self, page: &Page<'_>, at: usize) -> io::Result<Option<(i64, Vec<u8>)>> {
        let Some((length, at)) = varint(page.bytes, at) else { return Ok(None) };
        let Some((number, at)) = varint(page.bytes, at) else { return Ok(None) };
        let length = length as u64;
        if length > ROW_MAX || length > self.length.saturating_add(self.log_bytes.len() as u64) {
            return Ok(None);
        }
        let local = self.local(length) as usize;
        let Some(own) = page.bytes.get(at..at + local) else { return Ok(None) };
        let mut bytes = own.to_vec();
        let mut next = page.bytes.get(at + local..at + local + 4).map_or(0, be) as u32;
        while (bytes.len() as u64) < length {
            let overflow = self.page(next)?;
            let wanted = (length - bytes.len() as u64).min(self.usable - 4) as usize;
            let (Some(head), Some(part)) = (overflow.get(..4), overflow.get(4..4 + wanted)) else {
                return Ok(None);
            };
            bytes.extend_from_slice(part);
            next = be(head) as u32;
        }
        Ok(Some((number, bytes)))
    }

    /// The number of bytes of a row that are in the page itself.
    fn local(&self, length: u64) -> u64 {
        let most = self.usable - 35;
        if length <= most {
            return length;
        }
        let least = (self.usable - 12) * 32 / 255 - 23;
        let fitting = least + (length - least) % (self.usable - 4);
        if fitting <= most { fitting } else { least }
    }
}

/// A page of a table.
struct Page<'a> {
    bytes: &'a [u8],
    /// The place of its head: in the first page it follows the head of the file.
    start: usize,
}

impl Page<'_> {
    fn kind(&self) -> Option<u8> {
        self.bytes.get(self.start).copied()
    }

    fn count(&self) -> usize {
        self.bytes.get(self.start + 3..self.start + 5).map_or(0, |count| be(count) as usize)
    }

    /// The places of the cells, as many as fit into the page.
    fn cells(&self) -> impl Iterator<Item = usize> {
        let head = if self.kind() == Some(INTERIOR) { 12 } else { 8 };
        let places = self.bytes.get(self.start + head..).unwrap_or_default();
        places.chunks_exact(2).take(self.count()).map(|place| be(place) as usize)
    }

    fn children(&self) -> impl Iterator<Item = u32> {
        let child = |at: usize| self.bytes.get(at..at + 4).map_or(0, be) as u32;
        self.cells().map(child).chain([child(self.start + 8)])
    }
}

/// The values of a row; `None` where its head is invalid.
fn record<'a>(bytes: &'a [u8], cells: &mut Vec<Cell<'a>>) -> Option<()> {
    let (head, mut at) = varint(bytes, 0)?;
    let head = usize::try_from(head).ok()?;
    let mut rest = bytes.get(head..)?;
    while at < head {
        let (kind, next) = varint(bytes, at)?;
        at = next;
        let length = match kind {
            0 | 8 | 9 => 0,
            1..=4 => kind,
            5 => 6,
            6 | 7 => 8,
            kind if kind >= 12 => (kind - 12) / 2,
            _ => return None,
        };
        let (own, after) = rest.split_at_checked(usize::try_from(length).ok()?)?;
        rest = after;
        cells.push(match kind {
            0 => Cell::Null,
            8 | 9 => Cell::Whole(kind - 8),
            7 => Cell::Number(f64::from_be_bytes(*own.first_chunk()?)),
            1..=6 => Cell::Whole(signed(own)),
            kind if kind % 2 == 0 => Cell::Blob(own),
            _ => Cell::Text(own),
        });
    }
    Some(())
}

/// A big-endian number of up to eight bytes.
fn be(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0, |number, byte| number << 8 | u64::from(*byte))
}

fn signed(bytes: &[u8]) -> i64 {
    let free = 64 - 8 * bytes.len().clamp(1, 8);
    (be(bytes) << free) as i64 >> free
}

/// A number of one to nine bytes, and the place after it.
fn varint(bytes: &[u8], at: usize) -> Option<(i64, usize)> {
    let mut number = 0_u64;
    for index in 0..9 {
        let byte = *bytes.get(at + index)?;
        if index == 8 {
            return Some(((number << 8 | u64::from(byte)) as i64, at + 9));
        }
        number = number << 7 | u64::from(byte & 0x7f);
        if byte < 0x80 {
            return Some((number as i64, at + index + 1));
        }
    }
    None
}

/// The checksum of a log, continued from the one before.
fn checksum(bytes: &[u8], is_big: bool, before: (u32, u32)) -> (u32, u32) {
    let (mut one, mut two) = before;
    for pair in bytes.chunks_exact(8) {
        let (first, second) = pair.split_at(4);
        let word = |bytes: &[u8]| {
            let word = be(bytes) as u32;
            if is_big { word } else { word.swap_bytes() }
        };
        one = one.wrapping_add(word(first)).wrapping_add(two);
        two = two.wrapping_add(word(second)).wrapping_add(one);
    }
    (one, two)
}
