//! The lines of a source: from byte offsets to lines and columns.

/// A source with the starts of its lines.
pub(crate) struct Lines<'a> {
    source: &'a str,
    starts: Vec<usize>,
}

impl<'a> Lines<'a> {
    /// Time: linear in the source.
    pub(crate) fn new(source: &'a str) -> Lines<'a> {
        let breaks = source.bytes().enumerate().filter(|&(_, byte)| byte == b'\n').map(|(at, _)| at + 1);
        Lines { source, starts: std::iter::once(0).chain(breaks).collect() }
    }

    /// The line of an offset, counted from 1. Time: logarithmic in the lines.
    pub(crate) fn number(&self, at: usize) -> usize {
        self.starts.partition_point(|&start| start <= at)
    }

    /// Where the line of an offset begins.
    pub(crate) fn start(&self, at: usize) -> usize {
        self.starts.get(self.number(at) - 1).copied().unwrap_or(0)
    }

    /// The line of an offset, without its end.
    pub(crate) fn text(&self, at: usize) -> &'a str {
        self.source.get(self.start(at)..).and_then(|rest| rest.lines().next()).unwrap_or("")
    }

    /// How many bytes there are in all.
    pub(crate) fn bytes(&self) -> usize {
        self.source.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offsets_find_their_lines() {
        let lines = Lines::new("a: 1\r\n\nbb: 2");
        assert_eq!([0, 4, 6, 7, 12, 99].map(|at| lines.number(at)), [1, 1, 2, 3, 3, 3]);
        assert_eq!((lines.text(3), lines.text(6), lines.text(9)), ("a: 1", "", "bb: 2"));
        assert_eq!(Lines::new("").number(0), 1);
    }
}
