//! Seals of records: each is the SHA-256 of the seal before it and of the record's own bytes, so that a record cannot be changed, removed,
//! inserted or moved without a new seal on all that follow.
//!
//! A sealed line is `{.., "seal": "HEX"}`; the seal is its last field, and covers all bytes before it. A first line also has the number of
//! its file and the seal `after` which it comes, so that files of one journal cannot be left out or exchanged either. A signature is a
//! record of its own; it is of the seal before it, and with that of all records before.

use sha2::{Digest, Sha256};
use std::fmt;
use std::io::{self, BufRead};

/// Precedes a seal in what is signed, so that a signature means nothing elsewhere.
const SIGNED: &[u8] = b"shsa-journal-1 ";
/// What stands before and after the digits of a seal.
const BEFORE: &[u8] = b",\"seal\":\"";
const BEHIND: &[u8] = b"\"}";
/// The digits of a seal.
const DIGITS: usize = 64;
const HEX: &[u8; 16] = b"0123456789abcdef";

/// The seal of a record.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Seal([u8; 32]);

impl Seal {
    /// The seal of a record with these bytes after a record with this seal; the bytes lack the seal and the closing brace.
    fn of(self, content: &[u8]) -> Seal {
        Seal(Sha256::new().chain_update(self.0).chain_update(content).finalize().into())
    }

    /// Reads 64 digits, lower case.
    #[must_use]
    pub fn parse(digits: &[u8]) -> Option<Seal> {
        Some(Seal(bytes(digits)?))
    }

    /// The bytes that a signature of this seal signs.
    #[must_use]
    pub fn signed(&self) -> Vec<u8> {
        [SIGNED, &self.0].concat()
    }

    /// Seals lines that come after this seal; each is a JSON object with at least one field. Returns the last seal.
    #[must_use]
    pub fn write(self, lines: &[u8], output: &mut Vec<u8>) -> Seal {
        let mut seal = self;
        output.reserve(lines.len() * 2);
        for content in lines.split_inclusive(|byte| *byte == b'\n').filter_map(|it| it.strip_suffix(b"}\n")) {
            seal = seal.of(content);
            output.extend_from_slice(content);
            output.extend_from_slice(BEFORE);
            output.extend(seal.0.iter().flat_map(|byte| digits(*byte)));
            output.extend_from_slice(BEHIND);
            output.push(b'\n');
        }
        seal
    }

    /// Seals the first line of the file of this number, which comes after a seal. Returns its seal.
    #[must_use]
    pub fn write_head(after: Option<Seal>, number: u64, head: &[u8], output: &mut Vec<u8>) -> Seal {
        let fields = after.map_or(String::new(), |seal| format!(",\"after\":\"{seal}\""));
        let open = head.strip_suffix(b"}\n").unwrap_or(head);
        let line = [open, format!(",\"file\":{number}{fields}}}\n").as_bytes()].concat();
        after.unwrap_or_default().write(&line, output)
    }

    /// Seals a signature of this seal. Returns the seal of the signature's record.
    #[must_use]
    pub fn write_signature(self, signature: &[u8; 64], output: &mut Vec<u8>) -> Seal {
        let hex: Vec<u8> = signature.iter().flat_map(|byte| digits(*byte)).collect();
        self.write(&[b"{\"signature\":\"", &*hex, b"\"}\n"].concat(), output)
    }
}

impl fmt::Display for Seal {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(out, "{byte:02x}"))
    }
}

/// The content of a line without its end, and its seal; `None` where it has no seal as they are written.
pub(super) fn opened(line: &[u8]) -> Option<(&[u8], Seal)> {
    let sealed = line.strip_suffix(BEHIND)?;
    let (front, seal) = sealed.split_at_checked(sealed.len().checked_sub(DIGITS)?)?;
    Some((front.strip_suffix(BEFORE)?, Seal::parse(seal)?))
}

/// Whether a line with this content and seal comes after a seal.
pub(super) fn follows(before: Seal, content: &[u8], seal: Seal) -> bool {
    before.of(content) == seal
}

/// Reads lower-case digits.
pub(super) fn bytes<const N: usize>(digits: &[u8]) -> Option<[u8; N]> {
    if digits.len() != 2 * N {
        return None;
    }
    let value = |digit: &u8| HEX.iter().position(|known| known == digit);
    let mut bytes = [0; N];
    for (byte, pair) in bytes.iter_mut().zip(digits.chunks_exact(2)) {
        let [high, low] = pair else { return None };
        *byte = u8::try_from(value(high)? << 4 | value(low)?).ok()?;
    }
    Some(bytes)
}

fn digits(byte: u8) -> [u8; 2] {
    [byte >> 4, byte & 15].map(|digit| HEX.get(usize::from(digit)).copied().unwrap_or(b'?'))
}

/// What a file shows of where the next one goes on: its number, and its last seal. `None`: its first line is not sealed.
///
/// # Errors
/// Errors of the input.
pub fn end(mut input: impl BufRead) -> io::Result<Option<(u64, Seal)>> {
    let (mut line, mut found) = (Vec::new(), None);
    while input.read_until(b'\n', &mut line)? > 0 {
        // A line that was cut off has no seal.
        let opened = line.strip_suffix(b"\n").and_then(opened);
        found = match (found, opened) {
            (None, Some((_, seal))) => match serde_json::from_slice::<super::line::Head>(&line) {
                Ok(super::line::Head { file: Some(number), .. }) => Some((number, seal)),
                _ => return Ok(None),
            },
            (None, None) => return Ok(None),
            (Some((number, _)), Some((_, seal))) => Some((number, seal)),
            (found, None) => found,
        };
        line.clear();
    }
    Ok(found)
}
