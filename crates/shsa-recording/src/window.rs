//! A stream of bytes with lookahead, so that a reader gets in step again after damage without seeking.

use std::io::{self, Read};

/// How many bytes are read from the stream at once.
const BLOCK: usize = 1 << 16;

/// The next bytes of a stream. Memory: the lookahead, and one block.
pub(super) struct Window<R> {
    input: R,
    buffer: Vec<u8>,
    /// The number of passed bytes of the buffer.
    from: usize,
    /// The place of the buffer in the stream.
    begin: u64,
    is_over: bool,
}

impl<R: Read> Window<R> {
    pub(super) fn new(input: R) -> Window<R> {
        Window { input, buffer: Vec::new(), from: 0, begin: 0, is_over: false }
    }

    /// The number of passed bytes.
    pub(super) fn offset(&self) -> u64 {
        self.begin + self.from as u64
    }

    /// The next bytes, at least `length`; fewer only at the end of the stream.
    ///
    /// # Errors
    /// Those of the stream.
    #[inline]
    pub(super) fn ahead(&mut self, length: usize) -> io::Result<&[u8]> {
        if self.buffer.len() - self.from < length && !self.is_over {
            self.fill(length)?;
        }
        Ok(self.buffer.get(self.from..).unwrap_or_default())
    }

    /// Exactly the next bytes; `None` when the stream ends before.
    ///
    /// # Errors
    /// Those of the stream.
    #[inline]
    pub(super) fn exactly(&mut self, length: usize) -> io::Result<Option<&[u8]>> {
        Ok(self.ahead(length)?.get(..length))
    }

    /// Passes bytes of the lookahead.
    #[inline]
    pub(super) fn pass(&mut self, length: usize) {
        self.from = (self.from + length).min(self.buffer.len());
    }

    /// Skips bytes, up to the end of the stream.
    ///
    /// # Errors
    /// Those of the stream.
    pub(super) fn skip(&mut self, length: u64) -> io::Result<()> {
        let mut left = length;
        while left > 0 {
            let step = usize::try_from(left).unwrap_or(BLOCK).min(BLOCK);
            let there = self.ahead(step)?.len().min(step);
            if there == 0 {
                return Ok(());
            }
            self.pass(there);
            left -= there as u64;
        }
        Ok(())
    }

    fn fill(&mut self, length: usize) -> io::Result<()> {
        self.buffer.drain(..self.from);
        self.begin += self.from as u64;
        self.from = 0;
        while self.buffer.len() < length {
            let room = (length - self.buffer.len()).max(BLOCK) as u64;
            let read = self.input.by_ref().take(room).read_to_end(&mut self.buffer)?;
            if read == 0 {
                self.is_over = true;
                return Ok(());
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_ahead_is_there_until_the_end() {
        let bytes: Vec<u8> = (0..200_000_u32).map(|at| at as u8).collect();
        let mut window = Window::new(&bytes[..]);
        for step in [1, 70_000, 3, 100_000] {
            let at = window.offset() as usize;
            assert_eq!(window.exactly(step).unwrap(), bytes.get(at..at + step));
            window.pass(step);
        }
        assert_eq!(window.exactly(40_000).unwrap(), None);
        assert_eq!(window.ahead(40_000).unwrap().len(), 29_996);
        window.skip(29_000).unwrap();
        assert_eq!((window.offset(), window.ahead(1).unwrap().len()), (199_004, 996));
        window.skip(u64::MAX).unwrap();
        assert_eq!((window.offset(), window.ahead(1).unwrap().len()), (200_000, 0));
    }
}
