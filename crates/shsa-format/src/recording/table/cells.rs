//! The cells of a row of a table.

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
    if !text.contains('"') {
        return Split::Cells(plain(text, separator).take(COLUMNS_MAX + 1).map(Cow::Borrowed).collect());
    }
    let mut cells = Vec::new();
    let mut rest = text;
    loop {
        let (cell, after) = match rest.trim_start_matches(' ').strip_prefix('"') {
            Some(quoted) => match unquoted(quoted, separator) {
                Ok(unquoted) => unquoted,
                Err(problem) => return problem,
            },
            None => {
                let end = rest.find(separator).unwrap_or(rest.len());
                let (cell, after) = rest.split_at(end);
                (Cow::Borrowed(cell), after)
            }
        };
        cells.push(cell);
        match after.strip_prefix(separator) {
            Some(next) if cells.len() <= COLUMNS_MAX => rest = next,
            _ => return Split::Cells(cells),
        }
    }
}

/// The cells of a row without quotes. Cells are short: a look at each byte is quicker than a search for the separator.
fn plain(text: &str, separator: char) -> impl Iterator<Item = &str> {
    let mut rest = Some(text);
    std::iter::from_fn(move || {
        let text = rest?;
        let is_separator = |byte: u8| char::from(byte) == separator;
        let cut =
            text.bytes().position(is_separator).and_then(|at| Some((text.get(..at)?, text.get(at + 1..)?)));
        rest = cut.map(|(_, after)| after);
        Some(cut.map_or(text, |(cell, _)| cell))
    })
}

/// A text without blanks around it: as [`str::trim`], but quick for what has none, as most cells.
pub(super) fn trimmed(text: &str) -> &str {
    match text.as_bytes() {
        [first, .., last] if first.is_ascii_graphic() && last.is_ascii_graphic() => text,
        _ => text.trim(),
    }
}

/// A cell after its opening quote, and the rest after its closing quote; a doubled quote stands for one.
fn unquoted(text: &str, separator: char) -> Result<(Cow<'_, str>, &str), Split<'_>> {
    let mut cell = String::new();
    let mut rest = text;
    loop {
        let (part, after) = rest.split_once('"').ok_or(Split::Open)?;
        cell.push_str(part);
        match after.strip_prefix('"') {
            Some(next) => {
                cell.push('"');
                rest = next;
            }
            None => {
                let after = after.trim_start_matches(' ');
                let is_at_end = after.is_empty() || after.starts_with(separator);
                return if is_at_end { Ok((Cow::Owned(cell), after)) } else { Err(Split::Broken) };
            }
        }
    }
}

/// Whether a row has as many cells as the header, apart from blank cells at the end of either.
pub(super) fn fits(cells: &[Cow<'_, str>], headers: &[String]) -> bool {
    let is_blank = |text: &str| text.trim().is_empty();
    cells.len() <= COLUMNS_MAX
        && cells.iter().skip(headers.len()).all(|cell| is_blank(cell))
        && headers.iter().skip(cells.len()).all(|header| is_blank(header))
}
