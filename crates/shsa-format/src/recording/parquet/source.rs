//! The bytes of a file with the budget of what is read of it and made from it.

use super::super::topic::Input;
use super::super::unpack::{Budget, Unpacker};
use super::cells::Cells;
use std::io::{self, Read, SeekFrom};

/// What decoding one page may take at a time before that is counted, bytes.
const OF_A_PAGE: u64 = 40 << 20;

/// A file. Row groups may share their pages, pages may unpack to a thousand times their size, and a run of two bytes may be a
/// million values: what is read again, unpacked and kept is counted.
pub(super) struct Source<'i> {
    input: &'i mut dyn Input,
    pub(super) budget: Budget,
    pub(super) unpacker: Unpacker,
}

impl<'i> Source<'i> {
    /// A file of this many bytes.
    pub(super) fn new(input: &'i mut dyn Input, length: u64) -> Source<'i> {
        let mut budget = Budget::of(length);
        // There is that much in every budget.
        drop(budget.take(OF_A_PAGE));
        Source { input, budget, unpacker: Unpacker::default() }
    }

    /// The bytes of a part of the file; fewer where it ends before.
    ///
    /// # Errors
    /// Those of the file, and when the budget is spent.
    pub(super) fn bytes(&mut self, at: u64, length: u64) -> io::Result<Vec<u8>> {
        let bytes = bytes_at(self.input, at, length)?;
        self.take(bytes.len())?;
        Ok(bytes)
    }

    /// Counts so many bytes.
    ///
    /// # Errors
    /// When the budget is spent.
    pub(super) fn take(&mut self, bytes: usize) -> io::Result<()> {
        self.budget.take(bytes as u64).map_err(io::Error::other)
    }

    /// Counts the values of a page, for which the whole rest of the budget was there.
    ///
    /// # Errors
    /// The reason, when that was too little.
    pub(super) fn settle(&mut self, cells: &Cells) -> Result<(), String> {
        let left = if cells.is_full { 0 } else { cells.room() };
        self.budget.take(self.budget.left() - left)?;
        if cells.is_full { Err(self.budget.exceeded()) } else { Ok(()) }
    }
}

/// The bytes of a part of a file; fewer where it ends before.
///
/// # Errors
/// Those of the file.
pub(super) fn bytes_at(input: &mut dyn Input, at: u64, length: u64) -> io::Result<Vec<u8>> {
    input.seek(SeekFrom::Start(at))?;
    let mut bytes = Vec::new();
    Read::take(&mut *input, length).read_to_end(&mut bytes)?;
    Ok(bytes)
}
