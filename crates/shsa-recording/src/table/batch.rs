//! Rows that are reported together: what each row of a column has is looked up once for all of them.

use super::line::Line;
use super::row::as_value;
use crate::topic::{Rows, Value};
use shsa_core::time::Time;
use shsa_message::number::float;
use std::vec::Drain;

/// The most rows, and the most bytes of their texts.
const ROWS_MAX: usize = 1 << 8;
const BYTES_MAX: usize = 1 << 16;

/// Rows whose cells have places, each with its time.
pub(super) struct Batch {
    lines: Vec<Line>,
    pub(super) times: Vec<Time>,
    bytes: usize,
    /// The number of columns of the table.
    columns: usize,
}

impl Batch {
    /// No rows of a table with so many columns.
    pub(super) fn new(columns: usize) -> Batch {
        Batch { lines: Vec::new(), times: Vec::new(), bytes: 0, columns }
    }

    /// Adds a row.
    pub(super) fn push(&mut self, line: Line, time: Time) {
        self.bytes += line.text.len();
        self.lines.push(line);
        self.times.push(time);
    }

    /// Whether the rows are to be reported.
    pub(super) fn is_full(&self) -> bool {
        self.lines.len() >= ROWS_MAX || self.bytes >= BYTES_MAX
    }

    /// Gives back all rows.
    pub(super) fn drain(&mut self) -> Drain<'_, Line> {
        self.times.clear();
        self.bytes = 0;
        self.lines.drain(..)
    }
}

impl Rows for Batch {
    fn count(&self) -> usize {
        self.columns
    }

    fn value(&self, row: usize, column: usize) -> Value<'_> {
        self.lines.get(row).and_then(|line| line.cell(column)).map_or(Value::Missing, as_value)
    }

    fn numbers(&self, column: usize, to: &mut Vec<Option<f64>>) {
        to.extend(self.lines.iter().map(|line| float(line.cell(column)?)));
    }
}
