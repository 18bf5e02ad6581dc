//! A place in a JSON text that moves on, checking the syntax (RFC 8259).

use shsa_core::knowledge::Place;

use super::tree::{MAX_DEPTH, offset};

/// How many values a text may hold.
pub(crate) const MAX_VALUES: usize = 20_000_000;
/// How many values may be kept at a time: those outside of the large sections, or one entry of these.
pub(crate) const MAX_KEPT: usize = 1_000_000;

/// Why a text is no JSON, and where.
#[derive(Debug)]
pub(crate) struct Broken {
    pub(crate) at: usize,
    pub(crate) message: String,
    pub(crate) help: Option<&'static str>,
}

impl Broken {
    /// That a value is not of the form that was tried.
    pub(crate) fn unusual() -> Broken {
        Broken { at: 0, message: String::new(), help: None }
    }
}

/// A string in the text.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quoted {
    /// With its quotes.
    pub(crate) place: Place,
    pub(crate) escaped: bool,
}

/// Reads one token after the other.
#[derive(Clone, Copy)]
pub(crate) struct Cursor<'a> {
    source: &'a str,
    at: usize,
    values: usize,
    most: usize,
}

impl<'a> Cursor<'a> {
    /// At the first token, behind blanks and the byte order mark.
    pub(crate) fn new(source: &'a str) -> Cursor<'a> {
        let marked = source.starts_with('\u{feff}');
        let mut cursor =
            Cursor { source, at: if marked { '\u{feff}'.len_utf8() } else { 0 }, values: 0, most: MAX_KEPT };
        cursor.blank();
        cursor
    }

    /// The same text at another place.
    pub(crate) fn moved_to(self, at: u32) -> Cursor<'a> {
        Cursor { at: at as usize, ..self }
    }

    pub(crate) fn place(&self) -> u32 {
        offset(self.at)
    }

    pub(crate) fn rest(&self) -> &'a str {
        self.source.get(self.at..).unwrap_or("")
    }

    pub(crate) fn peek(&self) -> Option<u8> {
        self.source.as_bytes().get(self.at).copied()
    }

    pub(crate) fn is_object(&self) -> bool {
        self.peek() == Some(b'{')
    }

    /// What stands between the quotes.
    pub(crate) fn inner(&self, quoted: Quoted) -> &'a str {
        let Place { from, to } = quoted.place;
        self.source.get(from as usize + 1..(to as usize).saturating_sub(1)).unwrap_or("")
    }

    /// Goes through an object, whose `{` comes next; each key is given with the cursor at its value.
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
            cursor.blank();
            if !cursor.take(b':') {
                return Err(cursor.broken("a `:` is missing", Some("write `\"key\": value`")));
            }
            cursor.blank();
            entry(cursor, key)
        })
    }

    /// Goes through a list, whose `[` comes next; the cursor is at each item.
    pub(crate) fn list(&mut self, item: impl FnMut(&mut Self) -> Result<(), Broken>) -> Result<(), Broken> {
        self.bracket(b'[', b']', item)
    }

    /// Goes over a value, `depth` brackets deep.
    pub(crate) fn skip(&mut self, depth: usize) -> Result<(), Broken> {
        self.values += 1;
        if self.values > self.most {
            return Err(self.too_many());
        }
        match self.peek() {
            Some(b'{' | b'[') if depth > MAX_DEPTH => {
                let message = format!("nested more than {MAX_DEPTH} levels deep");
                Err(Broken { at: self.at, message, help: None })
            }
            Some(b'{') => self.object(|cursor, _| cursor.skip(depth + 1)),
            Some(b'[') => self.list(|cursor| cursor.skip(depth + 1)),
            Some(b'"') => self.string().map(drop),
            _ => self.word().map(drop),
        }
    }

    /// Goes over an object whose entries will be read one at a time.
    pub(crate) fn skip_section(&mut self) -> Result<(), Broken> {
        let (before, outside) = (self.values, self.most);
        self.object(|cursor, _| {
            cursor.most = (cursor.values + MAX_KEPT).min(MAX_VALUES);
            cursor.skip(3)
        })?;
        self.most = (outside + self.values - before).min(MAX_VALUES);
        Ok(())
    }

    /// That nothing follows but blanks.
    pub(crate) fn end(&mut self) -> Result<(), Broken> {
        self.blank();
        match self.peek() {
            None => Ok(()),
            Some(_) => Err(self.broken("something follows behind the end", Some("a model is one object"))),
        }
    }

    /// A string, whose quote comes next.
    pub(crate) fn string(&mut self) -> Result<Quoted, Broken> {
        let from = self.at;
        self.at += 1;
        let mut escaped = false;
        loop {
            self.at += plain_length(self.source.as_bytes().get(self.at..).unwrap_or_default());
            match self.peek() {
                Some(b'"') => break,
                Some(b'\\') => {
                    escaped = true;
                    self.escape()?;
                }
                Some(_) => {
                    let help = "close the quotes in the same line, or write `\\n` or `\\t`";
                    return Err(self.broken("a control character in quotes", Some(help)));
                }
                None => {
                    self.at = from;
                    return Err(self.broken("these quotes are not closed", None));
                }
            }
        }
        self.at += 1;
        Ok(Quoted { place: Place { from: offset(from), to: self.place() }, escaped })
    }

    /// A number, `true`, `false` or `null`.
    pub(crate) fn word(&mut self) -> Result<&'a str, Broken> {
        let rest = self.rest();
        let is_part = |byte: &u8| byte.is_ascii_alphanumeric() || matches!(byte, b'+' | b'-' | b'.' | b'_');
        let length = rest.bytes().take_while(|byte| is_part(byte)).count();
        let word = rest.get(..length).unwrap_or("");
        if matches!(word, "null" | "true" | "false") || is_number(word) {
            self.at += length;
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

    /// The items between brackets, of which the first comes next.
    fn bracket(
        &mut self,
        open: u8,
        close: u8,
        mut item: impl FnMut(&mut Self) -> Result<(), Broken>,
    ) -> Result<(), Broken> {
        let from = self.at;
        if !self.take(open) {
            return Err(self.broken(&format!("a `{}` is missing", char::from(open)), None));
        }
        self.blank();
        if self.take(close) {
            return Ok(());
        }
        loop {
            item(self)?;
            self.blank();
            if self.take(close) {
                return Ok(());
            }
            if self.peek().is_none() {
                self.at = from;
                return Err(self.broken("this bracket is not closed", None));
            }
            if !self.take(b',') {
                return Err(self.broken(&format!("a `,` or `{}` is missing", char::from(close)), None));
            }
            self.blank();
        }
    }

    /// An escape, whose backslash comes next.
    fn escape(&mut self) -> Result<(), Broken> {
        let unit = |at: usize| {
            let digits = self.source.get(at..at + 6)?.strip_prefix("\\u")?;
            let hexadecimal = digits.bytes().all(|byte| byte.is_ascii_hexdigit());
            u16::from_str_radix(digits, 16).ok().filter(|_| hexadecimal)
        };
        let length = match self.source.as_bytes().get(self.at + 1) {
            Some(b'"' | b'\\' | b'/' | b'b' | b'f' | b'n' | b'r' | b't') => 2,
            Some(b'u') => match (unit(self.at), unit(self.at + 6)) {
                (Some(0xD800..=0xDBFF), Some(0xDC00..=0xDFFF)) => 12,
                (Some(0xD800..=0xDFFF), _) => {
                    let help = "a character beyond U+FFFF is written as two: `\\ud83d\\ude00`";
                    return Err(self.broken("this escape is half a character", Some(help)));
                }
                (Some(_), _) => 6,
                (None, _) => {
                    return Err(self.broken("this escape needs four digits", Some("write it like `\\u00e4`")));
                }
            },
            _ => {
                let help = "known: `\\\"`, `\\\\`, `\\/`, `\\b`, `\\f`, `\\n`, `\\r`, `\\t`, `\\u00e4`";
                return Err(self.broken("there is no such escape", Some(help)));
            }
        };
        self.at += length;
        Ok(())
    }

    fn take(&mut self, byte: u8) -> bool {
        let taken = self.peek() == Some(byte);
        self.at += usize::from(taken);
        taken
    }

    fn blank(&mut self) {
        while let Some(b' ' | b'\n' | b'\r' | b'\t') = self.peek() {
            self.at += 1;
        }
    }

    fn broken(&self, message: &str, help: Option<&'static str>) -> Broken {
        Broken { at: self.at, message: format!("this is no JSON: {message}"), help }
    }

    fn too_many(&self) -> Broken {
        let message = if self.values > MAX_VALUES {
            format!("more than {MAX_VALUES} values")
        } else {
            format!("more than {MAX_KEPT} values in one entry, or outside of the large sections")
        };
        Broken { at: self.at, message, help: Some("is this a model?") }
    }
}

/// How many bytes come before a quote, a backslash or a control character, eight at a time where there are as many.
fn plain_length(bytes: &[u8]) -> usize {
    const ONES: u64 = u64::MAX / 255;
    // Not zero when a byte of the word is zero, and only then (Mycroft's test).
    let zeros = |word: u64| word.wrapping_sub(ONES) & !word & (ONES << 7);
    let is_plain = |word: &[u8; 8]| {
        let word = u64::from_le_bytes(*word);
        let quotes = zeros(word ^ (ONES * u64::from(b'"')));
        let backslashes = zeros(word ^ (ONES * u64::from(b'\\')));
        quotes | backslashes | zeros(word & (ONES * 0xE0)) == 0
    };
    let (words, _) = bytes.as_chunks::<8>();
    let whole = 8 * words.iter().take_while(|word| is_plain(word)).count();
    let rest = bytes.get(whole..).unwrap_or_default();
    whole + rest.iter().take_while(|byte| !matches!(byte, b'"' | b'\\' | 0..0x20)).count()
}

/// A sign, digits without zeros before them, a fraction, an exponent.
fn is_number(word: &str) -> bool {
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let word = word.strip_prefix('-').unwrap_or(word);
    let (mantissa, exponent) = match word.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (mantissa, Some(exponent.strip_prefix(['+', '-']).unwrap_or(exponent))),
        None => (word, None),
    };
    let (whole, fraction) = match mantissa.split_once('.') {
        Some((whole, fraction)) => (whole, Some(fraction)),
        None => (mantissa, None),
    };
    let plain = digits(whole) && (whole == "0" || !whole.starts_with('0'));
    plain && fraction.is_none_or(digits) && exponent.is_none_or(digits)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn plain_bytes_end_where_the_first_other_one_is(bytes in prop::collection::vec(any::<u8>(), 0..40), plain in 0..40_usize) {
            let mut bytes: Vec<u8> = bytes;
            bytes.iter_mut().take(plain).for_each(|byte| *byte |= 0x80);
            let first = bytes.iter().position(|byte| matches!(byte, b'"' | b'\\' | 0..0x20));
            prop_assert_eq!(plain_length(&bytes), first.unwrap_or(bytes.len()));
        }
    }
}
