//! The tokens of JSON (RFC 8259): a scanner that steps over blanks, quoted texts and numbers.

/// A moving place in a text.
#[derive(Clone, Copy, Debug)]
pub struct Scanner<'a> {
    /// The whole text.
    pub text: &'a str,
    /// The next byte.
    pub at: usize,
}

/// The error at the place of a scanner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flaw {
    /// A control character within quotes.
    Control,
    /// The text ends before the closing quote.
    Unclosed,
    /// The letter of an escape is missing; its backslash is at this byte.
    Escape(usize),
    /// A hexadecimal digit of an escape is missing; its backslash is at this byte.
    HexDigit(usize),
    /// A digit of a number is missing.
    Digit,
}

impl<'a> Scanner<'a> {
    /// A scanner at the start of a text.
    #[must_use]
    pub fn new(text: &'a str) -> Scanner<'a> {
        Scanner { text, at: 0 }
    }

    /// The next byte; `None` at the end.
    #[must_use]
    #[inline]
    pub fn peek(&self) -> Option<u8> {
        self.text.as_bytes().get(self.at).copied()
    }

    /// Steps over a byte if it comes next; returns whether it did.
    #[inline]
    pub fn eat(&mut self, byte: u8) -> bool {
        let is_there = self.peek() == Some(byte);
        self.at += usize::from(is_there);
        is_there
    }

    /// Steps over blanks.
    #[inline]
    pub fn blanks(&mut self) {
        while let Some(b' ' | b'\n' | b'\r' | b'\t') = self.peek() {
            self.at += 1;
        }
    }

    /// Steps over a text whose opening quote comes next; returns whether it has escapes.
    ///
    /// # Errors
    /// The error where the scanner has stopped.
    #[inline]
    pub fn quoted(&mut self) -> Result<bool, Flaw> {
        self.at += 1;
        let mut has_escapes = false;
        loop {
            self.at += plain_length(self.text.as_bytes().get(self.at..).unwrap_or_default());
            match self.peek() {
                Some(b'"') => break,
                Some(b'\\') => {
                    has_escapes = true;
                    self.escape()?;
                }
                Some(_) => return Err(Flaw::Control),
                None => return Err(Flaw::Unclosed),
            }
        }
        self.at += 1;
        Ok(has_escapes)
    }

    fn escape(&mut self) -> Result<(), Flaw> {
        let from = self.at;
        self.at += 1;
        let digits = match self.peek() {
            Some(b'"' | b'\\' | b'/' | b'b' | b'f' | b'n' | b'r' | b't') => 0,
            Some(b'u') => 4,
            _ => return Err(Flaw::Escape(from)),
        };
        self.at += 1;
        for _ in 0..digits {
            if !self.peek().is_some_and(|byte| byte.is_ascii_hexdigit()) {
                return Err(Flaw::HexDigit(from));
            }
            self.at += 1;
        }
        Ok(())
    }

    /// Steps over a number: a sign, digits without leading zeros, a fraction, an exponent.
    ///
    /// # Errors
    /// [`Flaw::Digit`] where a digit is missing.
    #[inline]
    pub fn number(&mut self) -> Result<(), Flaw> {
        let bytes = self.text.as_bytes();
        let digits = self.at + usize::from(bytes.get(self.at) == Some(&b'-'));
        if let Some(length) = bytes.get(digits..).and_then(|rest| short_number(rest.first_chunk()?)) {
            self.at = digits + length;
            return Ok(());
        }
        self.at = digits;
        self.long_number()
    }

    /// Steps over a number without its sign.
    fn long_number(&mut self) -> Result<(), Flaw> {
        if !self.eat(b'0') {
            self.digits()?;
        }
        if self.eat(b'.') {
            self.digits()?;
        }
        if self.eat(b'e') || self.eat(b'E') {
            let _sign = self.eat(b'+') || self.eat(b'-');
            self.digits()?;
        }
        Ok(())
    }

    fn digits(&mut self) -> Result<(), Flaw> {
        let from = self.at;
        while self.peek().is_some_and(|byte| byte.is_ascii_digit()) {
            self.at += 1;
        }
        if self.at == from { Err(Flaw::Digit) } else { Ok(()) }
    }
}

/// The length of a number without a sign and an exponent that ends within eight bytes; `None` for all others. Without a branch for
/// each byte, as nothing foretells where a number has its point and its end.
#[inline]
fn short_number(bytes: &[u8; 8]) -> Option<usize> {
    const ONES: u64 = u64::MAX / 255;
    const HIGH: u64 = ONES << 7;
    let word = u64::from_le_bytes(*bytes);
    // The highest bit of each byte that is a digit, and of each that is a point.
    let (digit, point) = (word ^ (ONES * u64::from(b'0')), word ^ (ONES * u64::from(b'.')));
    let digits = !(((digit & !HIGH) + ONES * (0x80 - 10)) | digit) & HIGH;
    let points = !(((point & !HIGH) + !HIGH) | point) & HIGH;
    let behind = !(digits | points) & HIGH;
    let bit = behind.trailing_zeros();
    // Those of the number, whose last byte has its highest bit eight bits before that of the byte behind it.
    let number = (1_u64 << (bit & 63)) - 1;
    let (digits, points) = (digits & number, points & number);
    let last = 1_u64 << (bit.wrapping_sub(8) & 63);
    let is_simple = digits & 0x80 != 0 && digits & last != 0 && points & points.wrapping_sub(1) == 0;
    // A zero comes first only alone, or before the point.
    let has_no_zero = word as u8 != b'0' || bit == 15 || points & 0x8000 != 0;
    let has_exponent = matches!((word >> (bit & 56)) as u8, b'e' | b'E');
    (behind != 0 && is_simple && has_no_zero && !has_exponent).then_some(bit as usize / 8)
}

/// The number of bytes before a quote, a backslash or a control character, eight at a time where possible.
#[inline]
fn plain_length(bytes: &[u8]) -> usize {
    const ONES: u64 = u64::MAX / 255;
    // The lowest set bit belongs to the first byte that is zero (Mycroft's test).
    let zeros = |word: u64| word.wrapping_sub(ONES) & !word & (ONES << 7);
    let (words, rest) = bytes.as_chunks::<8>();
    for (index, word) in words.iter().enumerate() {
        let word = u64::from_le_bytes(*word);
        let quotes = zeros(word ^ (ONES * u64::from(b'"')));
        let backslashes = zeros(word ^ (ONES * u64::from(b'\\')));
        let others = quotes | backslashes | zeros(word & (ONES * 0xE0));
        if others != 0 {
            return 8 * index + others.trailing_zeros() as usize / 8;
        }
    }
    8 * words.len() + rest.iter().take_while(|byte| !matches!(byte, b'"' | b'\\' | 0..0x20)).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn short_numbers_are_read_as_long_ones_are(text in "-?(0|[1-9][0-9]{0,2})?[.]?[0-9]{0,4}[-+.eE0-9]{0,2}[eE+ ,x\u{e9}][ ,]{8}") {
            let digits = usize::from(text.starts_with('-'));
            let short = short_number(text.as_bytes()[digits..].first_chunk().unwrap());
            let mut scanner = Scanner { text: &text, at: digits };
            let is_long = scanner.long_number().is_ok();
            let ends_simply = !text[digits..scanner.at].contains(['e', 'E']) && scanner.at < digits + 8;
            // Another digit, point or exponent behind it makes it wrong in any case.
            let ends = !text[scanner.at..].starts_with(|it: char| it.is_ascii_digit() || ".eE".contains(it));
            prop_assert_eq!(short, (is_long && ends_simply && ends).then_some(scanner.at - digits));
        }

        #[test]
        fn plain_bytes_end_where_the_first_other_one_is(bytes in prop::collection::vec(any::<u8>(), 0..40), plain in 0..40_usize) {
            let mut bytes: Vec<u8> = bytes;
            bytes.iter_mut().take(plain).for_each(|byte| *byte |= 0x80);
            let first = bytes.iter().position(|byte| matches!(byte, b'"' | b'\\' | 0..0x20));
            prop_assert_eq!(plain_length(&bytes), first.unwrap_or(bytes.len()));
        }
    }
}
