//! Deltas over several lines, as programs write them for people: lines are joined until all brackets are closed.

use super::super::lines::Line;
use shsa_message::json::Broken;

/// The most bytes of a delta over several lines.
const JOINED_MAX: usize = 1 << 18;

/// A line, or several joined ones.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Text {
    /// The number of the first line.
    pub(super) number: u64,
    pub(super) text: String,
    /// Whether the last line is terminated.
    pub(super) is_ended: bool,
}

impl Text {
    /// A line; `None` for a blank one.
    pub(super) fn of(line: Line<'_>) -> Option<Text> {
        let Line { number, text, is_ended } = line;
        (!text.trim().is_empty()).then(|| Text { number, text: text.into_owned(), is_ended })
    }
}

/// Takes deltas.
pub(super) trait Deltas {
    /// Reads a delta.
    ///
    /// # Errors
    /// Where the text is no JSON.
    fn read(&mut self, text: &Text) -> Result<(), Broken>;
    /// A line is no delta.
    fn lose(&mut self, line: &Text, broken: Broken);
}

/// Lines whose brackets are still open.
#[derive(Default)]
pub(super) struct Joined {
    held: Vec<Text>,
    length: usize,
    open: i64,
}

impl Joined {
    /// Takes a line: the lines that are complete with it are read.
    pub(super) fn take(&mut self, line: Text, deltas: &mut dyn Deltas) {
        if self.held.is_empty() {
            let Err(broken) = deltas.read(&line) else { return };
            match opened(&line.text).filter(|open| *open > 0 && line.is_ended) {
                Some(open) => self.hold(line, open),
                None => deltas.lose(&line, broken),
            }
            return;
        }
        let open = opened(&line.text).map(|open| self.open + open);
        self.hold(line, open.unwrap_or(0));
        match open {
            Some(open) if open > 0 && self.length <= JOINED_MAX => {}
            Some(0) => self.end(deltas),
            _ => self.let_go(deltas),
        }
    }

    fn hold(&mut self, line: Text, open: i64) {
        self.length += line.text.len();
        self.open = open;
        self.held.push(line);
    }

    /// Reads the held lines as one; one by one where they are none.
    fn end(&mut self, deltas: &mut dyn Deltas) {
        let texts: Vec<&str> = self.held.iter().map(|line| line.text.as_str()).collect();
        let number = self.held.first().map_or(0, |line| line.number);
        let joined = Text { number, text: texts.join("\n"), is_ended: true };
        match deltas.read(&joined) {
            Ok(()) => *self = Joined::default(),
            Err(_) => self.let_go(deltas),
        }
    }

    /// Reads the held lines one by one: they are no delta together.
    pub(super) fn let_go(&mut self, deltas: &mut dyn Deltas) {
        for line in std::mem::take(self).held {
            if let Err(broken) = deltas.read(&line) {
                deltas.lose(&line, broken);
            }
        }
    }
}

/// How many more brackets a line opens than it closes; `None` where a quote is left open, which no JSON has at the end of a line.
fn opened(line: &str) -> Option<i64> {
    let (mut open, mut is_quoted, mut is_escaped) = (0, false, false);
    for byte in line.bytes() {
        match byte {
            _ if is_escaped => is_escaped = false,
            b'\\' if is_quoted => is_escaped = true,
            b'"' => is_quoted = !is_quoted,
            b'{' | b'[' if !is_quoted => open += 1,
            b'}' | b']' if !is_quoted => open -= 1,
            _ => {}
        }
    }
    (!is_quoted).then_some(open)
}

#[cfg(test)]
mod tests {
    use super::super::delta::Delta;
    use super::*;

    #[derive(Default)]
    struct Seen {
        found: Vec<String>,
        lost: Vec<u64>,
    }

    impl Deltas for Seen {
        fn read(&mut self, text: &Text) -> Result<(), Broken> {
            Delta::default().read(&text.text)?;
            self.found.push(text.text.replace('\n', " "));
            Ok(())
        }

        fn lose(&mut self, line: &Text, _broken: Broken) {
            self.lost.push(line.number);
        }
    }

    #[track_caller]
    fn check(lines: &[&str], expected: &[&str], lost: &[u64]) {
        let (mut joined, mut seen) = (Joined::default(), Seen::default());
        for (number, line) in (1..).zip(lines) {
            joined.take(Text { number, text: (*line).into(), is_ended: true }, &mut seen);
        }
        joined.let_go(&mut seen);
        assert_eq!(
            (seen.found, seen.lost),
            (expected.iter().map(|it| (*it).to_owned()).collect(), lost.to_vec())
        );
    }

    #[test]
    fn lines_are_joined_until_all_brackets_are_closed() {
        check(
            &["{\"a\":1}", "{", "\"a\": [", "1 ]", "}", "{}"],
            &["{\"a\":1}", "{ \"a\": [ 1 ] }", "{}"],
            &[],
        );
        // A line that is cut costs itself.
        check(&["{\"a\":[", "{\"b\":1}", "{\"c\":2}"], &["{\"b\":1}", "{\"c\":2}"], &[1]);
        check(&["{\"a\":\"x", "{\"b\":1}"], &["{\"b\":1}"], &[1]);
        check(&["{\"a\":[", "]]}", "{}"], &["{}"], &[1, 2]);
    }
}
