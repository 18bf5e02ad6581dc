//! Tables, row by row: what a column holds, and its value in a row.

use shsa_core::time::Time;
use std::io;

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Points in time, nanoseconds since 1970 (UTC) or since the beginning of a recording.
    Time,
    /// Numbers.
    Number,
    /// Whole numbers.
    Whole,
    /// Texts.
    Text,
}

/// The value of one column in one row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cell<'a> {
    /// A point in time.
    Time(Time),
    /// A number.
    Number(f64),
    /// A whole number.
    Whole(i64),
    /// A text.
    Text(&'a str),
    /// There is none.
    Missing,
}

impl<'a> From<Option<&'a str>> for Cell<'a> {
    fn from(text: Option<&'a str>) -> Cell<'a> {
        text.map_or(Cell::Missing, Cell::Text)
    }
}

/// What takes the rows of a table.
pub trait Rows {
    /// Adds a row: a cell for each column. A cell that is left out, or is of another kind than its column, is missing.
    ///
    /// # Errors
    /// Errors of the output.
    fn row(&mut self, cells: &[Cell<'_>]) -> io::Result<()>;
}
