//! A line of a table, and where its cells are.

use super::cells::trimmed;
use super::places::Places;

/// One line of a file, or several with a quoted cell.
#[derive(Clone, Debug, Default)]
pub(super) struct Line {
    pub(super) number: u64,
    pub(super) text: String,
    pub(super) is_ended: bool,
    /// Where the cells are, if all of them are parts of the text.
    pub(super) places: Places,
    /// Whether they are; else a cell is no part of the text, or the quotes are wrong.
    pub(super) is_placed: bool,
}

impl Line {
    /// The text of a cell that has a place, without blanks around it.
    #[inline]
    pub(super) fn cell(&self, column: usize) -> Option<&str> {
        Some(trimmed(self.text.get(self.places.get(column)?.clone())?))
    }
}
