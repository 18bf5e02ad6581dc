//! Text in UTF-16, as spreadsheets write it, read as UTF-8.

use std::char::{DecodeUtf16, REPLACEMENT_CHARACTER, decode_utf16};
use std::io::{self, Read};

/// The bytes in UTF-8 of a text in UTF-16. What is no character becomes the replacement character.
pub(super) struct Utf16<R: Read> {
    characters: DecodeUtf16<Units<R>>,
    /// Bytes that are decoded and not yet read.
    waiting: Vec<u8>,
}

impl<R: Read> Utf16<R> {
    /// `is_little`: the low byte of each unit is the first one.
    pub(super) fn new(input: R, is_little: bool) -> Utf16<R> {
        Utf16 { characters: decode_utf16(Units { input, is_little }), waiting: Vec::new() }
    }
}

/// The units of a text, up to its end or an error of the input.
struct Units<R> {
    input: R,
    is_little: bool,
}

impl<R: Read> Iterator for Units<R> {
    type Item = u16;

    fn next(&mut self) -> Option<u16> {
        let mut unit = [0; 2];
        self.input.read_exact(&mut unit).ok()?;
        Some(if self.is_little { u16::from_le_bytes(unit) } else { u16::from_be_bytes(unit) })
    }
}

impl<R: Read> Read for Utf16<R> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        while self.waiting.len() < bytes.len()
            && let Some(character) = self.characters.next()
        {
            let character = character.unwrap_or(REPLACEMENT_CHARACTER);
            self.waiting.extend(character.encode_utf8(&mut [0; 4]).bytes());
        }
        let length = self.waiting.len().min(bytes.len());
        for (byte, decoded) in bytes.iter_mut().zip(self.waiting.drain(..length)) {
            *byte = decoded;
        }
        Ok(length)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn characters_of_one_and_of_two_units_are_decoded() {
        let text = "a;\u{b0}C \u{1f6a2}\n";
        for is_little in [true, false] {
            let bytes = |unit: u16| if is_little { unit.to_le_bytes() } else { unit.to_be_bytes() };
            let packed: Vec<u8> = text.encode_utf16().flat_map(bytes).chain([7]).collect();
            let mut decoded = String::new();
            Utf16::new(&*packed, is_little).read_to_string(&mut decoded).unwrap();
            assert_eq!(decoded, text);
        }
    }
}
