//! The cells of a row, as texts.

use super::cells::{COLUMNS_MAX, Split, trimmed};
use super::layout::{Layout, Separator, is_decimal_comma};
use super::line::Line;
use crate::topic::{Columns, Value};
use memchr::memchr;
use std::borrow::Cow;
use std::mem;

/// Writes points for decimal commas. Its memory is used again for the next row.
pub(super) struct Points {
    separator: Separator,
    /// The columns whose numbers may be written like `1,5`.
    columns: Vec<usize>,
    dotted: String,
}

/// The cells of a row.
pub(super) enum Row<'a> {
    /// They have places in the line.
    Placed(&'a Line),
    /// A quoted cell has quotes in it, and is no part of the text.
    Copied(Vec<Cow<'a, str>>),
}

impl Points {
    /// For a table of which these columns are read.
    pub(super) fn new(layout: &Layout, read: Vec<usize>) -> Points {
        let columns = if layout.has_decimal_commas { read } else { Vec::new() };
        Points { separator: layout.separator, columns, dotted: String::new() }
    }

    /// Writes a point for each decimal comma of the columns that are read, in a row whose cells have places.
    pub(super) fn write(&mut self, line: &mut Line) {
        if self.columns.is_empty() {
            return;
        }
        let (text, mut done) = (&line.text, 0);
        self.dotted.clear();
        for column in &self.columns {
            let Some(place) = line.places.get(*column) else { break };
            let cell = text.get(place.clone()).unwrap_or_default();
            if let Some(at) = memchr(b',', cell.as_bytes()).filter(|_| is_decimal_comma(cell)) {
                self.dotted.push_str(text.get(done..place.start + at).unwrap_or_default());
                self.dotted.push('.');
                done = place.start + at + 1;
            }
        }
        self.dotted.push_str(text.get(done..).unwrap_or_default());
        mem::swap(&mut line.text, &mut self.dotted);
    }

    /// The row of a text of which a cell is no part; `None` where its quotes are wrong.
    pub(super) fn copied<'a>(&self, text: &'a str) -> Option<Row<'a>> {
        let Split::Cells(mut cells) = self.separator.split(text) else { return None };
        for column in &self.columns {
            if let Some(cell) = cells.get_mut(*column).filter(|cell| is_decimal_comma(cell)) {
                *cell = cell.replacen(',', ".", 1).into();
            }
        }
        Some(Row::Copied(cells))
    }
}

impl Row<'_> {
    /// The text of a cell, without blanks around it.
    #[inline]
    pub(super) fn cell(&self, column: usize) -> Option<&str> {
        match self {
            Row::Placed(line) => line.cell(column),
            Row::Copied(cells) => cells.get(column).map(|cell| trimmed(cell)),
        }
    }

    /// Whether all its cells are blank, and there are several.
    pub(super) fn is_blank(&self) -> bool {
        self.count() > 1 && self.are_blank(0)
    }

    /// Whether the cells from this column on are blank.
    fn are_blank(&self, from: usize) -> bool {
        (from..self.count()).all(|column| self.cell(column).is_none_or(str::is_empty))
    }

    /// Whether the row has as many cells as the header, apart from blank cells at the end of either.
    pub(super) fn fits(&self, headers: &[String]) -> bool {
        self.count() <= COLUMNS_MAX
            && self.are_blank(headers.len())
            && headers.iter().skip(self.count()).all(|header| header.trim().is_empty())
    }
}

/// What a cell has.
pub(super) fn as_value(cell: &str) -> Value<'_> {
    if cell.is_empty() { Value::Missing } else { Value::Text(cell) }
}

impl Columns for Row<'_> {
    fn count(&self) -> usize {
        match self {
            Row::Placed(line) => line.places.len(),
            Row::Copied(cells) => cells.len(),
        }
    }

    fn value(&self, column: usize) -> Value<'_> {
        self.cell(column).map_or(Value::Missing, as_value)
    }
}

#[cfg(test)]
mod tests {
    use super::super::places::place;
    use super::*;

    #[track_caller]
    fn check(text: &str, read: &[usize], expected: &[&str]) {
        let layout = Layout {
            separator: Separator::Character(';'),
            headers: Vec::new(),
            units: Vec::new(),
            preamble: 0,
            lines: 0,
            has_index: false,
            has_decimal_commas: true,
        };
        let mut points = Points::new(&layout, read.to_vec());
        let mut line = Line { text: text.to_owned(), ..Line::default() };
        let row = match place(layout.separator, text, &mut line.places) {
            true => {
                points.write(&mut line);
                Row::Placed(&line)
            }
            false => points.copied(text).unwrap(),
        };
        let cells: Vec<&str> = (0..row.count()).map(|at| row.cell(at).unwrap()).collect();
        assert_eq!(cells, expected);
    }

    #[test]
    fn decimal_commas_of_the_columns_that_are_read_are_points() {
        check("1,5;2,5; -3,25 ;a,b;7,5", &[0, 2, 3], &["1.5", "2,5", "-3.25", "a,b", "7,5"]);
        check(r#""1,5";"a ""b""";2,5"#, &[0, 2], &["1.5", r#"a "b""#, "2.5"]);
    }
}
