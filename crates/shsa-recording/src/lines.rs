//! A text of lines, each of bounded length; damaged lines are skipped. A line ends by `\n`, `\r\n` or `\r`.

use super::Place;
use super::line::LINE_MAX;
use super::topic::Listener;
use memchr::memchr2;
use std::borrow::Cow;
use std::io::{self, BufRead, ErrorKind};
use std::mem;
use std::str;

/// The first lines of a text that are not blank, trimmed.
#[allow(dead_code, reason = "readers of formats of lines recognise them by it")]
pub(super) fn of(text: &str) -> impl Iterator<Item = &str> {
    text.split(['\n', '\r']).map(str::trim).filter(|line| !line.is_empty())
}

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
    /// Whether the last line ended by `\r`: a `\n` that follows belongs to it. It is awaited with the next line, as a line of a live
    /// input is complete without it.
    is_after_return: bool,
    is_over: bool,
}

impl<R: BufRead> Lines<R> {
    /// Begins with the first line.
    pub(super) fn new(input: R) -> Lines<R> {
        Lines { input, bytes: Vec::new(), number: 0, is_after_return: false, is_over: false }
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
        let is_ended = self.is_ended();
        let bytes = &self.bytes[..self.bytes.len() - usize::from(is_ended)];
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
        match self.fill() {
            Ok(()) if self.bytes.is_empty() => None,
            Ok(()) if self.bytes.len() == LINE_MAX && !self.is_ended() => {
                // The begun line is useless and does not stay in memory while the rest is skipped.
                self.bytes = Vec::new();
                let most = LINE_MAX >> 20;
                let problem = match self.skip() {
                    Ok(()) => format!("the line is longer than {most} MiB; line left out"),
                    Err(failure) => self.stopped(&failure),
                };
                Some(Err((self.number, problem)))
            }
            Ok(()) => Some(Ok(())),
            Err(failure) => Some(Err((self.number, self.stopped(&failure)))),
        }
    }

    fn is_ended(&self) -> bool {
        self.bytes.ends_with(b"\n") || self.bytes.ends_with(b"\r")
    }

    /// Takes what waits, up to the end of the line and at most `most` bytes. Returns whether the line may go on.
    fn take(&mut self, most: usize, is_kept: bool) -> io::Result<bool> {
        let waiting = match self.input.fill_buf() {
            Err(failure) if failure.kind() == ErrorKind::Interrupted => return Ok(true),
            waiting => waiting?,
        };
        if mem::take(&mut self.is_after_return) && waiting.first() == Some(&b'\n') {
            self.input.consume(1);
            return Ok(true);
        }
        let waiting = &waiting[..waiting.len().min(most)];
        let end = memchr2(b'\n', b'\r', waiting);
        let length = end.map_or(waiting.len(), |end| end + 1);
        self.is_after_return = end.is_some_and(|end| waiting[end] == b'\r');
        if is_kept {
            self.bytes.extend_from_slice(&waiting[..length]);
        }
        self.input.consume(length);
        Ok(end.is_none() && length > 0)
    }

    fn fill(&mut self) -> io::Result<()> {
        while self.take(LINE_MAX - self.bytes.len(), true)? {}
        Ok(())
    }

    fn skip(&mut self) -> io::Result<()> {
        while self.take(usize::MAX, false)? {}
        Ok(())
    }

    fn stopped(&mut self, failure: &io::Error) -> String {
        self.is_over = true;
        format!("reading stopped here: {failure}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{BufReader, Read};

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
    fn a_line_of_a_live_input_does_not_wait_for_the_next() {
        // An end of two bytes that come apart.
        let parts: [&[u8]; 3] = [b"a\r", b"\nb", b"\r"];
        let mut lines = Lines::new(BufReader::new(parts[0].chain(parts[1]).chain(parts[2])));
        let mut next = || lines.read().map(|line| line.map(|line| line.text.into_owned()));
        assert_eq!([next(), next(), next()], [Some(Ok("a".into())), Some(Ok("b".into())), None]);
    }

    #[test]
    fn lines_have_numbers_and_ends() {
        check(b"\xef\xbb\xbfa\r\n\nb", &["1: a", "2: ", "3: b..."]);
        check(b"a\rb\r\rc", &["1: a", "2: b", "3: ", "4: c..."]);
        check(b"T [\xb0C]\n", &["1: T [\u{b0}C]"]);
        check(b"", &[]);
        let long = [vec![b'x'; 17 << 20], b"\nb\n".to_vec()].concat();
        check(&long, &["1! the line is longer than 16 MiB; line left out", "2: b"]);
    }
}
