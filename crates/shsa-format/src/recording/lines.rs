//! A text of lines, each of bounded length; damaged lines are skipped.

use super::Place;
use super::line::LINE_MAX;
use super::topic::Listener;
use std::borrow::Cow;
use std::io::{self, BufRead, Read};
use std::str;

/// One line.
pub(super) struct Line<'a> {
    /// The number of the line, from 1.
    pub(super) number: u64,
    /// The text without its end and without a byte order mark; what is no UTF-8 is Latin-1, in which some programs write units.
    pub(super) text: Cow<'a, str>,
    /// Whether the line is terminated: if not, the file ends within it.
    pub(super) is_ended: bool,
}

/// The lines of an input.
pub(super) struct Lines<R> {
    input: R,
    bytes: Vec<u8>,
    number: u64,
    is_over: bool,
}

impl<R: BufRead> Lines<R> {
    /// Begins with the first line.
    pub(super) fn new(input: R) -> Lines<R> {
        Lines { input, bytes: Vec::new(), number: 0, is_over: false }
    }

    /// The next line; a damaged line is reported and skipped.
    #[allow(dead_code, reason = "readers of formats of lines go on with it")]
    pub(super) fn next(&mut self, listener: &mut dyn Listener) -> Option<Line<'_>> {
        while let Err((number, problem)) = self.fetch()? {
            listener.damaged(Place::Line(number), problem);
        }
        Some(self.line())
    }

    /// The next line, or the problem with it; `None` at the end.
    pub(super) fn read(&mut self) -> Option<Result<Line<'_>, (u64, String)>> {
        Some(match self.fetch()? {
            Ok(()) => Ok(self.line()),
            Err(problem) => Err(problem),
        })
    }

    fn line(&self) -> Line<'_> {
        let bytes = self.bytes.strip_suffix(b"\n").unwrap_or(&self.bytes);
        let is_ended = bytes.len() < self.bytes.len();
        let bytes = bytes.strip_suffix(b"\r").unwrap_or(bytes);
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let latin = |_| bytes.iter().map(|byte| char::from(*byte)).collect::<String>().into();
        let text = str::from_utf8(bytes).map_or_else(latin, Cow::Borrowed);
        Line { number: self.number, text, is_ended }
    }

    fn fetch(&mut self) -> Option<Result<(), (u64, String)>> {
        if self.is_over {
            return None;
        }
        self.number += 1;
        self.bytes.clear();
        match self.input.by_ref().take(LINE_MAX).read_until(b'\n', &mut self.bytes) {
            Ok(0) => None,
            Ok(length) if length as u64 == LINE_MAX && !self.bytes.ends_with(b"\n") => {
                // The begun line is useless and does not stay in memory while the rest is skipped.
                self.bytes = Vec::new();
                let most = LINE_MAX >> 20;
                let problem = match skip_line(&mut self.input) {
                    Ok(()) => format!("the line is longer than {most} MiB; line left out"),
                    Err(failure) => self.stopped(&failure),
                };
                Some(Err((self.number, problem)))
            }
            Ok(_) => Some(Ok(())),
            Err(failure) => Some(Err((self.number, self.stopped(&failure)))),
        }
    }

    fn stopped(&mut self, failure: &io::Error) -> String {
        self.is_over = true;
        format!("reading stopped here: {failure}")
    }
}

/// Skips to the end of a line.
fn skip_line(input: &mut impl BufRead) -> io::Result<()> {
    loop {
        let waiting = input.fill_buf()?;
        let end = waiting.iter().position(|byte| *byte == b'\n');
        let passed = end.map_or(waiting.len(), |end| end + 1);
        let is_over = end.is_some() || waiting.is_empty();
        input.consume(passed);
        if is_over {
            return Ok(());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(bytes: &[u8], expected: &[&str]) {
        let mut lines = Lines::new(bytes);
        let mut found = Vec::new();
        while let Some(line) = lines.read() {
            found.push(match line {
                Ok(line) => {
                    format!("{}: {}{}", line.number, line.text, if line.is_ended { "" } else { "..." })
                }
                Err((number, problem)) => format!("{number}! {problem}"),
            });
        }
        assert_eq!(found, expected);
    }

    #[test]
    fn lines_have_numbers_and_ends() {
        check(b"\xef\xbb\xbfa\r\n\nb", &["1: a", "2: ", "3: b..."]);
        check(b"T [\xb0C]\n", &["1: T [\u{b0}C]"]);
        check(b"", &[]);
        let long = [vec![b'x'; 17 << 20], b"\nb\n".to_vec()].concat();
        check(&long, &["1! the line is longer than 16 MiB; line left out", "2: b"]);
    }
}
