//! Tables in memory as Apache Arrow has them, for readers in the same process.
//!
//! `rows -> Measure -> Layout -> a piece of memory of this length -> Filler <- the same rows again`
//!
//! Format: <https://arrow.apache.org/docs/format/Columnar.html>. The caller gives the memory, so that its owner may be whoever
//! reads the table. Each column is in one piece: numbers, times and whole numbers of 8 bytes, texts as `Utf8` (as `LargeUtf8` from 2 GiB
//! on), and a bitmap of the values that are there where some are missing. All is little-endian, and begins at multiples of 64 bytes.

use crate::table::{Cell, Kind, Rows};
use std::io;
use std::ops::Range;

/// Where buffers may begin: Arrow recommends multiples of 64 bytes.
const ALIGNMENT: usize = 64;

/// The size of a number, a time and a whole number, bytes.
const WIDTH: usize = 8;

/// Counts what a table takes: it is given all rows once, before there is memory for them.
#[derive(Clone, Debug)]
pub struct Measure {
    columns: Vec<Counted>,
    rows: usize,
}

/// A column, counted.
#[derive(Clone, Debug)]
struct Counted {
    name: String,
    kind: Kind,
    missing: usize,
    /// The bytes of all texts.
    text: usize,
}

/// Where the columns of a table are in a piece of memory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    /// The number of rows.
    pub rows: usize,
    /// The columns, in their order.
    pub columns: Vec<Column>,
    /// The length of the memory, bytes.
    pub length: usize,
}

/// Where a column is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// Its name.
    pub name: String,
    /// What it holds.
    pub kind: Kind,
    /// In how many rows there is no value.
    pub missing: usize,
    /// A bit for each row, the lowest first, which is set where there is a value; empty where nothing is missing.
    pub validity: Range<usize>,
    /// Of texts: where each begins in `values`, and where the last one ends, whole numbers of `offset_width` bytes; empty
    /// otherwise.
    pub offsets: Range<usize>,
    /// 4, or 8 where all texts together are too long for that.
    pub offset_width: usize,
    /// The values; of texts their bytes.
    pub values: Range<usize>,
}

impl Measure {
    /// A table with these columns, without rows.
    #[must_use]
    pub fn new(columns: &[(&str, Kind)]) -> Measure {
        let column = |(name, kind): &(&str, Kind)| Counted {
            name: (*name).to_owned(),
            kind: *kind,
            missing: 0,
            text: 0,
        };
        Measure { columns: columns.iter().map(column).collect(), rows: 0 }
    }

    /// Where the columns are to be.
    #[must_use]
    pub fn layout(self) -> Layout {
        let Measure { columns, rows } = self;
        let mut length = 0;
        let mut place = |size: usize| {
            let begin = length;
            length = (begin + size).next_multiple_of(ALIGNMENT);
            begin..begin + size
        };
        let column = |Counted { name, kind, missing, text }: Counted| {
            let validity = place(if missing > 0 { rows.div_ceil(8) } else { 0 });
            let is_text = kind == Kind::Text;
            let offset_width = if i32::try_from(text).is_ok() { 4 } else { 8 };
            let offsets = place(if is_text { (rows + 1) * offset_width } else { 0 });
            let values = place(if is_text { text } else { rows * WIDTH });
            Column { name, kind, missing, validity, offsets, offset_width, values }
        };
        let columns = columns.into_iter().map(column).collect();
        Layout { rows, columns, length }
    }
}

impl Rows for Measure {
    fn row(&mut self, cells: &[Cell<'_>]) -> io::Result<()> {
        let cells = cells.iter().copied().chain(std::iter::repeat(Cell::Missing));
        for (column, cell) in self.columns.iter_mut().zip(cells) {
            match (column.kind, cell) {
                (Kind::Text, Cell::Text(text)) => column.text += text.len(),
                (kind, cell) if number(kind, cell).is_some() => {}
                _ => column.missing += 1,
            }
        }
        self.rows += 1;
        Ok(())
    }
}

/// The bytes of a value of a fixed width; `None` for a text, and where there is none of this kind.
fn number(kind: Kind, cell: Cell<'_>) -> Option<[u8; WIDTH]> {
    match (kind, cell) {
        (Kind::Time, Cell::Time(time)) => Some(time.0.to_le_bytes()),
        (Kind::Number, Cell::Number(number)) => Some(number.to_le_bytes()),
        (Kind::Whole, Cell::Whole(whole)) => Some(whole.to_le_bytes()),
        _ => None,
    }
}

impl Layout {
    /// Fills memory of [`Layout::length`] zeros with the rows. Those beyond the [`Layout::rows`], and what has no room,
    /// are left out.
    #[must_use]
    pub fn filler<'m>(&self, memory: &'m mut [u8]) -> Filler<'m> {
        let mut rest = memory;
        let mut at = 0;
        let mut take = |range: &Range<usize>| -> &'m mut [u8] {
            let all = std::mem::take(&mut rest);
            let (_, from) = all.split_at_mut_checked(range.start.saturating_sub(at)).unwrap_or_default();
            let (taken, after) = from.split_at_mut_checked(range.len()).unwrap_or_default();
            (rest, at) = (after, range.end);
            taken
        };
        let columns = self.columns.iter().map(|column| Filled {
            kind: column.kind,
            validity: take(&column.validity),
            offsets: take(&column.offsets),
            offset_width: column.offset_width,
            values: take(&column.values),
            text: 0,
        });
        Filler { columns: columns.collect(), next: 0, rows: self.rows }
    }
}

/// Fills a piece of memory with the rows of a table.
#[derive(Debug)]
pub struct Filler<'m> {
    columns: Vec<Filled<'m>>,
    /// The next row, and how many there are to be.
    next: usize,
    rows: usize,
}

/// A column that is being filled.
#[derive(Debug)]
struct Filled<'m> {
    kind: Kind,
    validity: &'m mut [u8],
    offsets: &'m mut [u8],
    offset_width: usize,
    values: &'m mut [u8],
    /// Where the next text begins.
    text: usize,
}

impl Filled<'_> {
    fn put(&mut self, row: usize, cell: Cell<'_>) {
        let is_there = match cell {
            Cell::Text(text) if self.kind == Kind::Text => self.put_text(text),
            cell => number(self.kind, cell).is_some_and(|bytes| put_at(self.values, row, bytes)),
        };
        let end = (self.text as u64).to_le_bytes();
        let offset = self.offsets.chunks_exact_mut(self.offset_width).nth(row + 1);
        offset.into_iter().for_each(|offset| offset.iter_mut().zip(end).for_each(|(to, from)| *to = from));
        if is_there && let Some(bits) = self.validity.get_mut(row / 8) {
            *bits |= 1 << (row % 8);
        }
    }

    fn put_text(&mut self, text: &str) -> bool {
        let end = self.text + text.len();
        let Some(place) = self.values.get_mut(self.text..end) else { return false };
        place.copy_from_slice(text.as_bytes());
        self.text = end;
        true
    }
}

/// Writes a value of a fixed width; whether there is room.
fn put_at(values: &mut [u8], at: usize, bytes: [u8; WIDTH]) -> bool {
    let place = values.as_chunks_mut().0.get_mut(at);
    place.map(|place| *place = bytes).is_some()
}

impl Rows for Filler<'_> {
    fn row(&mut self, cells: &[Cell<'_>]) -> io::Result<()> {
        let cells = cells.iter().copied().chain(std::iter::repeat(Cell::Missing));
        if self.next < self.rows {
            self.columns.iter_mut().zip(cells).for_each(|(column, cell)| column.put(self.next, cell));
            self.next += 1;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shsa_core::time::Time;

    const COLUMNS: [(&str, Kind); 3] =
        [("time", Kind::Time), ("value", Kind::Number), ("signal", Kind::Text)];

    fn rows(into: &mut impl Rows) -> io::Result<()> {
        into.row(&[Cell::Time(Time(7)), Cell::Number(1.5), Cell::Text("/gps")])?;
        into.row(&[Cell::Time(Time(-8)), Cell::Missing, Cell::Missing])?;
        into.row(&[Cell::Time(Time(9)), Cell::Number(-0.0), Cell::Text("")])?;
        // Of another kind than its column, and left out.
        into.row(&[Cell::Time(Time(10)), Cell::Whole(3)])
    }

    fn table() -> (Layout, Vec<u8>) {
        let mut measure = Measure::new(&COLUMNS);
        rows(&mut measure).unwrap();
        let layout = measure.layout();
        let mut memory = vec![0; layout.length];
        rows(&mut layout.filler(&mut memory)).unwrap();
        (layout, memory)
    }

    #[test]
    fn columns_lie_one_behind_the_other() {
        let (layout, memory) = table();
        let [time, value, signal] = &layout.columns[..] else { panic!("three columns") };
        let numbers = |range: &Range<usize>| -> Vec<i64> {
            memory[range.clone()].as_chunks().0.iter().map(|bytes| i64::from_le_bytes(*bytes)).collect()
        };
        let offsets = memory[signal.offsets.clone()].as_chunks().0;
        assert_eq!((layout.rows, time.missing, value.missing, signal.missing), (4, 0, 2, 2));
        assert_eq!(numbers(&time.values), [7, -8, 9, 10]);
        assert!(time.validity.is_empty() && time.offsets.is_empty());
        let bits = |number: f64| number.to_bits() as i64;
        assert_eq!(numbers(&value.values), [bits(1.5), 0, bits(-0.0), 0]);
        assert_eq!(memory[value.validity.clone()], [0b101]);
        assert!(offsets.iter().map(|bytes| i32::from_le_bytes(*bytes)).eq([0, 4, 4, 4, 4]));
        assert_eq!(
            (&memory[signal.values.clone()], &memory[signal.validity.clone()]),
            (&b"/gps"[..], &[0b101][..])
        );
        for column in &layout.columns {
            assert!(
                [&column.validity, &column.offsets, &column.values]
                    .iter()
                    .all(|it| it.start % ALIGNMENT == 0)
            );
        }
    }

    #[test]
    fn a_table_without_rows_has_columns() {
        let layout = Measure::new(&COLUMNS).layout();
        assert_eq!((layout.rows, layout.columns.len(), layout.columns[2].offsets.len()), (0, 3, 4));
    }

    #[test]
    fn what_has_no_room_is_left_out() {
        let (layout, whole) = table();
        let mut memory = vec![0; layout.length];
        let mut filler = layout.filler(&mut memory);
        rows(&mut filler).unwrap();
        rows(&mut filler).unwrap();
        assert_eq!(memory, whole);
        rows(&mut layout.filler(&mut [])).unwrap();
    }
}
