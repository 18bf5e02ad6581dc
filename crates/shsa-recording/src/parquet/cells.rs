//! The values of a page: equal ones that follow each other are kept once, so that a column which rarely changes takes little.

use std::mem::size_of;

/// A value of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Cell {
    /// A missing value.
    Missing,
    Number(f64),
    Whole(i64),
    /// The text of this index among the texts of the cells.
    Text(u32),
}

/// Whether two values are the same bit for bit: zeros of different signs are not, a not-a-number is.
pub(super) trait Same: Copy {
    fn is_same(self, other: Self) -> bool;
}

impl Same for u32 {
    fn is_same(self, other: u32) -> bool {
        self == other
    }
}

impl Same for Cell {
    fn is_same(self, other: Cell) -> bool {
        match (self, other) {
            (Cell::Number(one), Cell::Number(other)) => one.to_bits() == other.to_bits(),
            (one, other) => one == other,
        }
    }
}

/// Values in their order, each with the number of times that it follows itself.
#[derive(Clone, Debug)]
pub(super) struct Runs<T> {
    pub(super) list: Vec<(T, u32)>,
    /// The number of values.
    pub(super) count: usize,
}

impl<T> Default for Runs<T> {
    fn default() -> Runs<T> {
        Runs { list: Vec::new(), count: 0 }
    }
}

impl<T: Same> Runs<T> {
    /// Adds a value so many times, at most 2^32.
    pub(super) fn push(&mut self, value: T, times: usize) {
        let Ok(more) = u32::try_from(times) else { return };
        if more == 0 {
            return;
        }
        self.count += times;
        match self.list.last_mut() {
            Some((last, times)) if last.is_same(value) => *times = times.saturating_add(more),
            _ => self.list.push((value, more)),
        }
    }
}

/// Values, and the texts among them, within a room.
#[derive(Clone, Debug)]
pub(super) struct Cells {
    pub(super) runs: Runs<Cell>,
    pub(super) texts: Vec<Box<str>>,
    /// How many bytes more they may take.
    room: u64,
    /// Whether the room was too small.
    pub(super) is_full: bool,
}

impl Cells {
    /// No values yet, for which there are so many bytes.
    pub(super) fn within(room: u64) -> Cells {
        Cells { runs: Runs::default(), texts: Vec::new(), room, is_full: false }
    }

    /// The bytes that are left.
    pub(super) fn room(&self) -> u64 {
        self.room
    }

    /// Adds a value so many times; `None` where there is no room.
    pub(super) fn push(&mut self, cell: Cell, times: usize) -> Option<()> {
        let runs = self.runs.list.len();
        self.runs.push(cell, times);
        self.take(if self.runs.list.len() > runs { size_of::<(Cell, u32)>() } else { 0 })
    }

    /// Adds a text; `None` where there is no room.
    pub(super) fn push_text(&mut self, bytes: &[u8]) -> Option<()> {
        self.take(size_of::<Box<str>>() + bytes.len())?;
        let number = u32::try_from(self.texts.len()).map_or(Cell::Missing, Cell::Text);
        self.texts.push(String::from_utf8_lossy(bytes).into());
        self.push(number, 1)
    }

    /// Takes so many bytes; `None` where there is no room.
    pub(super) fn take(&mut self, bytes: usize) -> Option<()> {
        let room = self.room.checked_sub(bytes as u64);
        self.is_full |= room.is_none();
        self.room = room?;
        Some(())
    }
}

impl Extend<Cell> for Cells {
    /// Adds values as long as there is room.
    fn extend<I: IntoIterator<Item = Cell>>(&mut self, cells: I) {
        let _room = cells.into_iter().try_for_each(|cell| self.push(cell, 1));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_values_are_kept_once() {
        let mut cells = Cells::within(3 * 24);
        for number in [f64::NAN, f64::NAN, 0.0, -0.0, -0.0] {
            assert_eq!(cells.push(Cell::Number(number), 1), Some(()));
        }
        let times: Vec<u32> = cells.runs.list.iter().map(|(_, times)| *times).collect();
        assert_eq!((times, cells.runs.count, cells.room()), (vec![2, 1, 2], 5, 0));
        assert_eq!((cells.push(Cell::Missing, 7), cells.is_full), (None, true));
    }

    #[test]
    fn texts_take_their_length() {
        let mut cells = Cells::within(100);
        assert_eq!(cells.push_text(&[b'a'; 60]), Some(()));
        assert_eq!((cells.room(), cells.is_full), (0, false));
        assert_eq!((cells.push_text(b""), cells.is_full), (None, true));
    }
}
