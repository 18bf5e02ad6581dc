//! The lines of a source: from byte offsets to lines and columns.

use std::cell::OnceCell;

/// The number of bytes between two marks.
const BLOCK: usize = 4096;

/// A source in which lines are found. The first question reads the source once and keeps small marks. Each answer takes constant
/// time, however long the lines are.
pub struct Lines<'a> {
    source: &'a str,
    marks: OnceCell<Vec<Mark>>,
}

/// The counts before a block of bytes.
#[derive(Clone, Copy, Default)]
struct Mark {
    /// The number of line feeds.
    breaks: usize,
    /// The start of the line in which the block begins.
    start: usize,
    /// The number of characters of that line before the block.
    characters: usize,
}

impl Mark {
    /// The mark after these bytes, which begin at `at`.
    fn behind(self, at: usize, bytes: &[u8]) -> Mark {
        let breaks = self.breaks + bytes.iter().filter(|&&byte| byte == b'\n').count();
        let (start, characters) = match bytes.iter().rposition(|&byte| byte == b'\n') {
            Some(last) => (at + last + 1, characters(bytes.get(last + 1..).unwrap_or_default())),
            None => (self.start, self.characters + characters(bytes)),
        };
        Mark { breaks, start, characters }
    }
}

impl<'a> Lines<'a> {
    /// The lines of a source, which is read at the first question.
    #[must_use]
    pub fn new(source: &'a str) -> Lines<'a> {
        Lines { source, marks: OnceCell::new() }
    }

    /// The line of an offset, counted from 1.
    #[must_use]
    pub fn number(&self, at: usize) -> usize {
        self.mark(at).breaks + 1
    }

    /// The character of an offset in its line, counted from 1.
    pub(crate) fn column(&self, at: usize) -> usize {
        self.mark(at).characters + 1
    }

    /// The line of an offset without its end: from at most `before` bytes before the offset to about `after` bytes behind it,
    /// with the offset of its begin.
    pub(crate) fn part(&self, at: usize, before: usize, after: usize) -> (usize, &'a str) {
        let at = at.min(self.source.len());
        let start = boundary(self.source, self.mark(at).start.max(at.saturating_sub(before)));
        let part = self.source.get(start..boundary(self.source, at.saturating_add(after))).unwrap_or("");
        (start, part.split('\n').next().unwrap_or("").trim_end_matches('\r'))
    }

    /// The length in bytes.
    pub(crate) fn bytes(&self) -> usize {
        self.source.len()
    }

    fn mark(&self, at: usize) -> Mark {
        let at = at.min(self.source.len());
        let block = at / BLOCK;
        let mark = self.marks().get(block).copied().unwrap_or_default();
        mark.behind(block * BLOCK, self.source.as_bytes().get(block * BLOCK..at).unwrap_or_default())
    }

    fn marks(&self) -> &[Mark] {
        self.marks.get_or_init(|| {
            let mut marks = vec![Mark::default()];
            let mut mark = Mark::default();
            for (block, bytes) in self.source.as_bytes().chunks(BLOCK).enumerate() {
                mark = mark.behind(block * BLOCK, bytes);
                marks.push(mark);
            }
            marks
        })
    }
}

/// The number of characters that begin in these bytes.
fn characters(bytes: &[u8]) -> usize {
    bytes.iter().filter(|&&byte| byte & 0xC0 != 0x80).count()
}

/// The nearest start of a character at or before an offset.
pub(crate) fn boundary(text: &str, at: usize) -> usize {
    text.floor_char_boundary(at)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn offsets_find_their_lines() {
        let lines = Lines::new("a: 1\r\n\nbb: 2");
        assert_eq!([0, 4, 6, 7, 12, 99].map(|at| lines.number(at)), [1, 1, 2, 3, 3, 3]);
        assert_eq!([0, 3, 6, 9, 99].map(|at| lines.column(at)), [1, 4, 1, 3, 6]);
        let text = |at| lines.part(at, 99, 99).1;
        assert_eq!((text(3), text(6), text(9)), ("a: 1", "", "bb: 2"));
        assert_eq!(lines.part(10, 2, 1), (8, "b: "));
        assert_eq!(Lines::new("").number(0), 1);
    }

    proptest! {
        #[test]
        fn long_sources_are_as_short_ones(pieces in prop::collection::vec(("[äb\n]{0,9}", 0..2000_usize), 0..9), at in 0..20_000_usize) {
            let source: String = pieces.into_iter().map(|(text, blanks)| text + &" ".repeat(blanks)).collect();
            let at = boundary(&source, at.min(source.len()));
            let line = source[..at].rsplit('\n').next().unwrap();
            let lines = Lines::new(&source);
            let expected = (source[..at].matches('\n').count() + 1, line.chars().count() + 1);
            prop_assert_eq!((lines.number(at), lines.column(at)), expected);
        }
    }
}
