//! The bytes of a file with the budget of what is read of it and made from it.

use super::super::topic::Input;
use super::super::unpack::{Budget, Unpacker};
use super::cells::Cells;
use std::borrow::Cow;
use std::io::{self, Read, SeekFrom};

/// What decoding one page may take at a time before that is counted, bytes.
const OF_A_PAGE: u64 = 40 << 20;

/// How many bytes are read at once without a look at how many there are.
pub(super) const AT_ONCE: u64 = 1 << 16;

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

/// A part of a file that is read at once, as the pages in it may be small.
#[derive(Default)]
pub(super) struct Window {
    begin: u64,
    bytes: Vec<u8>,
    /// How many bytes are read at once, and up to where.
    ahead: u64,
    end: u64,
}

impl Window {
    /// Reads so many bytes at once, up to the end of a column.
    pub(super) fn new(ahead: u64, end: u64) -> Window {
        Window { begin: 0, bytes: Vec::new(), ahead, end }
    }

    /// The bytes of a part of the file; fewer where the file ends before.
    ///
    /// # Errors
    /// As [`Source::bytes`].
    pub(super) fn bytes(
        &mut self,
        source: &mut Source<'_>,
        at: u64,
        length: u64,
    ) -> io::Result<Cow<'_, [u8]>> {
        if self.within(at, length).is_none() {
            let ahead = self.ahead.min(self.end.saturating_sub(at));
            if length > ahead {
                return source.bytes(at, length).map(Cow::Owned);
            }
            (self.begin, self.bytes) = (at, source.bytes(at, ahead)?);
        }
        let short = || self.bytes.as_slice();
        Ok(Cow::Borrowed(self.within(at, length).unwrap_or_else(short)))
    }

    fn within(&self, at: u64, length: u64) -> Option<&[u8]> {
        let from = usize::try_from(at.checked_sub(self.begin)?).ok()?;
        self.bytes.get(from..from.checked_add(usize::try_from(length).ok()?)?)
    }
}

/// The bytes of a part of a file; fewer where it ends before.
///
/// # Errors
/// Those of the file.
pub(super) fn bytes_at(input: &mut dyn Input, at: u64, length: u64) -> io::Result<Vec<u8>> {
    input.seek(SeekFrom::Start(at))?;
    // The buffer grows with the bytes that are there, whatever the length says.
    let mut bytes = Vec::with_capacity(usize::try_from(length.min(AT_ONCE)).unwrap_or(0));
    Read::take(&mut *input, length).read_to_end(&mut bytes)?;
    Ok(bytes)
}
