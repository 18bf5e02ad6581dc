//! A cursor that moves through a JSON text and checks the syntax (RFC 8259).

use shsa_core::knowledge::Place;
use shsa_message::json::{Flaw, Scanner};

use super::tree::{MAX_DEPTH, offset};

/// The most values of a text.
pub(crate) const MAX_VALUES: usize = 20_000_000;
/// The most values in memory at a time: those outside of the large sections, or one entry of these.
pub(crate) const MAX_KEPT: usize = 1_000_000;

/// Why and where a text is no JSON.
#[derive(Debug)]
pub(crate) struct Broken {
    pub(crate) at: usize,
    pub(crate) message: String,
    pub(crate) help: Option<&'static str>,
}

impl Broken {
    /// The error for a value that does not have the expected form.
    pub(crate) fn unusual() -> Broken {
        Broken { at: 0, message: String::new(), help: None }
    }
}

/// A string in the text.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quoted {
    /// The place, quotes included.
    pub(crate) place: Place,
    pub(crate) escaped: bool,
}

/// Reads token by token.
#[derive(Clone, Copy)]
pub(crate) struct Cursor<'a> {
    scanner: Scanner<'a>,
    values: usize,
    most: usize,
}

impl<'a> Cursor<'a> {
    /// A cursor at the first token, after blanks and the byte order mark.
    pub(crate) fn new(source: &'a str) -> Cursor<'a> {
        let mut scanner = Scanner::new(source);
        scanner.at = if source.starts_with('\u{feff}') { '\u{feff}'.len_utf8() } else { 0 };
        scanner.blanks();
        Cursor { scanner, values: 0, most: MAX_KEPT }
    }

    /// A cursor at another place of the same text.
    pub(crate) fn moved_to(self, at: u32) -> Cursor<'a> {
        Cursor { scanner: Scanner { at: at as usize, ..self.scanner }, ..self }
    }

    pub(crate) fn place(&self) -> u32 {
        offset(self.scanner.at)
    }

    pub(crate) fn rest(&self) -> &'a str {
        self.scanner.text.get(self.scanner.at..).unwrap_or("")
    }

    pub(crate) fn peek(&self) -> Option<u8> {
        self.scanner.peek()
    }

    pub(crate) fn is_object(&self) -> bool {
        self.peek() == Some(b'{')
    }

    /// The text between the quotes.
    pub(crate) fn inner(&self, quoted: Quoted) -> &'a str {
        let Place { from, to } = quoted.place;
        self.scanner.text.get(from as usize + 1..(to as usize).saturating_sub(1)).unwrap_or("")
    }

    /// Reads an object that begins here with `{`; `each` gets each key, with the cursor at its value.
    pub(crate) fn object(
        &mut self,
        mut entry: impl FnMut(&mut Self, Quoted) -> Result<(), Broken>,
    ) -> Result<(), Broken> {
        self.bracket(b'{', b'}', |cursor| {
            if cursor.peek() != Some(b'"') {
                let closed = cursor.peek() == Some(b'}');
                let help = if closed { "take the comma before it away" } else { "write `\"key\": value`" };
                return Err(cursor.broken("a key in quotes is missing", Some(help)));
            }
            let key = cursor.string()?;
            cursor.scanner.blanks();
            if !cursor.scanner.eat(b':') {
                return Err(cursor.broken("a `:` is missing", Some("write `\"key\": value`")));
            }
            cursor.scanner.blanks();
            entry(cursor, key)
        })
    }

    /// Reads a list that begins here with `[`, with the cursor at each item.
    pub(crate) fn list(&mut self, item: impl FnMut(&mut Self) -> Result<(), Broken>) -> Result<(), Broken> {
        self.bracket(b'[', b']', item)
    }

    /// Skips a value, `depth` brackets deep.
    pub(crate) fn skip(&mut self, depth: usize) -> Result<(), Broken> {
        self.values += 1;
        if self.values > self.most {
            return Err(self.too_many());
        }
        match self.peek() {
            Some(b'{' | b'[') if depth > MAX_DEPTH => {
                let message = format!("nested more than {MAX_DEPTH} levels deep");
                Err(Broken { at: self.scanner.at, message, help: None })
            }
            Some(b'{') => self.object(|cursor, _| cursor.skip(depth + 1)),
            Some(b'[') => self.list(|cursor| cursor.skip(depth + 1)),
            Some(b'"') => self.string().map(drop),
            _ => self.word().map(drop),
        }
    }

    /// Skips an object whose entries will be read one at a time.
    pub(crate) fn skip_section(&mut self) -> Result<(), Broken> {
        let (before, outside) = (self.values, self.most);
        self.object(|cursor, _| {
            cursor.most = (cursor.values + MAX_KEPT).min(MAX_VALUES);
            cursor.skip(3)
        })?;
        self.most = (outside + self.values - before).min(MAX_VALUES);
        Ok(())
    }

    /// Checks that only blanks follow.
    pub(crate) fn end(&mut self) -> Result<(), Broken> {
        self.scanner.blanks();
        match self.peek() {
            None => Ok(()),
            Some(_) => Err(self.broken("something follows behind the end", Some("a model is one object"))),
        }
    }

    /// Reads a string, which begins here with its quote.
    pub(crate) fn string(&mut self) -> Result<Quoted, Broken> {
        let from = self.scanner.at;
        let escaped = match self.scanner.quoted() {
            Ok(escaped) => escaped,
            Err(flaw) => return Err(self.flawed(from, flaw)),
        };
        let quoted = Quoted { place: Place { from: offset(from), to: self.place() }, escaped };
        let half = if escaped { half_character(self.inner(quoted)) } else { None };
        match half {
            None => Ok(quoted),
            Some(at) => {
                self.scanner.at = from + 1 + at;
                let help = "a character beyond U+FFFF is written as two: `\\ud83d\\ude00`";
                Err(self.broken("this escape is half a character", Some(help)))
            }
        }
    }

    /// The error in a string that begins at `from`.
    fn flawed(&mut self, from: usize, flaw: Flaw) -> Broken {
        let (at, message, help) = match flaw {
            Flaw::Unclosed => (from, "these quotes are not closed", None),
            Flaw::Escape(at) => {
                let help = "known: `\\\"`, `\\\\`, `\\/`, `\\b`, `\\f`, `\\n`, `\\r`, `\\t`, `\\u00e4`";
                (at, "there is no such escape", Some(help))
            }
            Flaw::HexDigit(at) => (at, "this escape needs four digits", Some("write it like `\\u00e4`")),
            Flaw::Control | Flaw::Digit => {
                let help = "close the quotes in the same line, or write `\\n` or `\\t`";
                (self.scanner.at, "a control character in quotes", Some(help))
            }
        };
        self.scanner.at = at;
        self.broken(message, help)
    }

    /// Reads a number, `true`, `false` or `null`.
    pub(crate) fn word(&mut self) -> Result<&'a str, Broken> {
        let rest = self.rest();
        let is_part = |byte: &u8| byte.is_ascii_alphanumeric() || matches!(byte, b'+' | b'-' | b'.' | b'_');
        let length = rest.bytes().take_while(|byte| is_part(byte)).count();
        let word = rest.get(..length).unwrap_or("");
        if matches!(word, "null" | "true" | "false") || is_number(word) {
            self.scanner.at += length;
            return Ok(word);
        }
        let (message, help) = match word.bytes().next() {
            None if rest.is_empty() => ("the text ends too early", None),
            None if rest.starts_with([']', '}']) => {
                ("a value is missing", Some("take the comma before it away"))
            }
            None => ("a value is missing", None),
            Some(b'0'..=b'9' | b'-' | b'+' | b'.') => ("this is no number", Some("write it like `-1.5e-3`")),
            Some(_) => ("words stand in quotes", None),
        };
        Err(self.broken(message, help))
    }

    /// Reads the items between brackets, from the first one on.
    fn bracket(
        &mut self,
        open: u8,
        close: u8,
        mut item: impl FnMut(&mut Self) -> Result<(), Broken>,
    ) -> Result<(), Broken> {
        let from = self.scanner.at;
        if !self.scanner.eat(open) {
            return Err(self.broken(&format!("a `{}` is missing", char::from(open)), None));
        }
        self.scanner.blanks();
        if self.scanner.eat(close) {
            return Ok(());
        }
        loop {
            item(self)?;
            self.scanner.blanks();
            if self.scanner.eat(close) {
                return Ok(());
            }
            if self.peek().is_none() {
                self.scanner.at = from;
                return Err(self.broken("this bracket is not closed", None));
            }
            if !self.scanner.eat(b',') {
                return Err(self.broken(&format!("a `,` or `{}` is missing", char::from(close)), None));
            }
            self.scanner.blanks();
        }
    }

    fn broken(&self, message: &str, help: Option<&'static str>) -> Broken {
        Broken { at: self.scanner.at, message: format!("this is no JSON: {message}"), help }
    }

    fn too_many(&self) -> Broken {
        let message = if self.values > MAX_VALUES {
            format!("more than {MAX_VALUES} values")
        } else {
            format!("more than {MAX_KEPT} values in one entry, or outside of the large sections")
        };
        Broken { at: self.scanner.at, message, help: Some("is this a model?") }
    }
}

/// Whether a word as a whole is a number.
fn is_number(word: &str) -> bool {
    let mut scanner = Scanner::new(word);
    scanner.number().is_ok() && scanner.at == word.len()
}

/// The first escape that is half a character: one of a surrogate pair without the other.
fn half_character(inner: &str) -> Option<usize> {
    let unit = |at: usize| u16::from_str_radix(inner.get(at..at + 6)?.strip_prefix("\\u")?, 16).ok();
    let mut at = 0;
    while let Some(before) = inner.get(at..)?.find('\\') {
        at += before;
        at += match (unit(at), unit(at + 6)) {
            (Some(0xD800..=0xDBFF), Some(0xDC00..=0xDFFF)) => 12,
            (Some(0xD800..=0xDFFF), _) => return Some(at),
            (Some(_), _) => 6,
            (None, _) => 2,
        };
    }
    None
}
