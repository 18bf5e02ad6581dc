//! The cells of a row of a table.

use memchr::memchr;
use std::borrow::Cow;

/// The most columns of a table.
pub(super) const COLUMNS_MAX: usize = 1 << 14;

/// The result of splitting a row.
pub(super) enum Split<'a> {
    /// Its cells; of more than [`COLUMNS_MAX`], one more than that.
    Cells(Vec<Cow<'a, str>>),
    /// A quote is not closed.
    Open,
    /// A quote is closed within a cell: further text does not repair that.
    Broken,
}

impl<'a> Split<'a> {
    /// The cells of a row that could be split.
    pub(super) fn cells(self) -> Option<Vec<Cow<'a, str>>> {
        match self {
            Split::Cells(cells) => Some(cells),
            Split::Open | Split::Broken => None,
        }
    }
}

/// Splits a row. Complexity: O(its bytes), and memory for at most [`COLUMNS_MAX`] cells.
pub(super) fn split(text: &str, separator: char) -> Split<'_> {
    if !has_quotes(text) {
        return Split::Cells(plain(text, separator).take(COLUMNS_MAX + 1).map(Cow::Borrowed).collect());
    }
    let mut cells = Vec::new();
    match each(text, separator, |cell| cells.push(cell)) {
        Ok(()) => Split::Cells(cells),
        Err(problem) => problem,
    }
}

/// Whether a quote of a row is not closed.
pub(super) fn is_open(text: &str, separator: char) -> bool {
    has_quotes(text) && matches!(each(text, separator, drop), Err(Split::Open))
}

fn has_quotes(text: &str) -> bool {
    memchr(b'"', text.as_bytes()).is_some()
}

/// Passes on each cell of a row with quotes; of more than [`COLUMNS_MAX`], one more than that.
fn each<'a>(text: &'a str, separator: char, mut pass: impl FnMut(Cow<'a, str>)) -> Result<(), Split<'a>> {
    let mut rest = text;
    for _ in 0..=COLUMNS_MAX {
        let (cell, after) = match rest.trim_start_matches(' ').strip_prefix('"') {
            Some(quoted) => unquoted(quoted, separator)?,
            None => {
                let (cell, after) = rest.split_at(end_of(rest, separator).unwrap_or(rest.len()));
                (Cow::Borrowed(cell), after)
            }
        };
        pass(cell);
        match after.strip_prefix(separator) {
            Some(next) => rest = next,
            None => break,
        }
    }
    Ok(())
}

/// Where the first cell ends, if not with the row. Cells are short: a look at each byte is quicker than a search.
fn end_of(text: &str, separator: char) -> Option<usize> {
    text.bytes().position(|byte| char::from(byte) == separator)
}

/// The cells of a row without quotes.
fn plain(text: &str, separator: char) -> impl Iterator<Item = &str> {
    let mut rest = Some(text);
    std::iter::from_fn(move || {
        let text = rest?;
        let cut = end_of(text, separator).and_then(|at| Some((text.get(..at)?, text.get(at + 1..)?)));
        rest = cut.map(|(_, after)| after);
        Some(cut.map_or(text, |(cell, _)| cell))
    })
}

/// A text without blanks around it: as [`str::trim`], but quick for what has none, as most cells.
#[inline]
pub(super) fn trimmed(text: &str) -> &str {
    match text.as_bytes() {
        [first, .., last] if first.is_ascii_graphic() && last.is_ascii_graphic() => text,
        _ => text.trim(),
    }
}

/// A cell after its opening quote, and the rest after its closing quote; a doubled quote stands for one.
fn unquoted(text: &str, separator: char) -> Result<(Cow<'_, str>, &str), Split<'_>> {
    let mut cell = Cow::Borrowed("");
    let mut rest = text;
    loop {
        let (part, after) = rest.split_once('"').ok_or(Split::Open)?;
        cell += part;
        match after.strip_prefix('"') {
            Some(next) => {
                cell += "\"";
                rest = next;
            }
            None => {
                let after = after.trim_start_matches(' ');
                let is_at_end = after.is_empty() || after.starts_with(separator);
                return if is_at_end { Ok((cell, after)) } else { Err(Split::Broken) };
            }
        }
    }
}
