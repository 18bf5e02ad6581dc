//! Where the cells of a row are in its text: found eight bytes at a time, without copying a cell.

use super::cells::COLUMNS_MAX;
use super::layout::Separator;
use memchr::memchr;
use std::ops::Range;

/// The places of cells, in bytes.
pub(super) type Places = Vec<Range<usize>>;

/// A byte eight times over, and its lowest and its highest bits.
const ONES: u64 = u64::MAX / 255;
const HIGH: u64 = ONES << 7;
const LOW: u64 = !HIGH;

/// The highest bit of each byte that is this one.
fn equal(word: u64, byte: u8) -> u64 {
    let other = word ^ (ONES * u64::from(byte));
    !(((other & LOW) + LOW) | other) & HIGH
}

/// Finds the cells of a row; returns false where its quotes are wrong, or where a cell is not a part of the text. Of more than
/// [`COLUMNS_MAX`] cells, at least one more than that is found. Complexity: O(bytes).
pub(super) fn place(separator: Separator, text: &str, places: &mut Places) -> bool {
    places.clear();
    match separator {
        Separator::Blanks => place_words(text, places),
        Separator::Character(separator) => match u8::try_from(separator) {
            Ok(separator) if memchr(b'"', text.as_bytes()).is_none() => {
                place_plain(text.as_bytes(), separator, places);
                true
            }
            Ok(separator) => place_quoted(text.as_bytes(), separator, places).is_some(),
            Err(_) => false,
        },
    }
}

/// Finds the cells of a row without quotes.
fn place_plain(bytes: &[u8], separator: u8, places: &mut Places) {
    let (words, rest) = bytes.as_chunks();
    let mut begin = 0;
    let mut end_at = |at: usize| {
        places.push(begin..at);
        begin = at + 1;
        places.len() <= COLUMNS_MAX
    };
    for (index, word) in words.iter().enumerate() {
        let mut found = equal(u64::from_le_bytes(*word), separator);
        while found != 0 {
            if !end_at(8 * index + found.trailing_zeros() as usize / 8) {
                return;
            }
            found &= found - 1;
        }
    }
    let begin_of_rest = bytes.len() - rest.len();
    for (at, _) in rest.iter().enumerate().filter(|(_, byte)| **byte == separator) {
        if !end_at(begin_of_rest + at) {
            return;
        }
    }
    end_at(bytes.len());
}

/// Finds the cells of a row with quotes; `None` where a quote is doubled or wrong.
fn place_quoted(bytes: &[u8], separator: u8, places: &mut Places) -> Option<()> {
    let blanks = |from: usize| bytes.iter().skip(from).take_while(|byte| **byte == b' ').count();
    let mut at = 0;
    while places.len() <= COLUMNS_MAX {
        let begin = at + blanks(at);
        let end = match bytes.get(begin) {
            Some(b'"') => {
                let end = begin + 1 + bytes.get(begin + 1..)?.iter().position(|byte| *byte == b'"')?;
                places.push(begin + 1..end);
                end + 1 + blanks(end + 1)
            }
            _ => {
                let rest = bytes.get(at..)?;
                let end = at + rest.iter().position(|byte| *byte == separator).unwrap_or(rest.len());
                places.push(at..end);
                end
            }
        };
        match bytes.get(end) {
            None => break,
            Some(byte) if *byte == separator => at = end + 1,
            Some(_) => return None,
        }
    }
    Some(())
}

/// Finds the words of a row of ASCII; of another text it returns false.
fn place_words(text: &str, places: &mut Places) -> bool {
    if !text.is_ascii() {
        return false;
    }
    // Where a word has begun that has not ended; before the text there is a blank.
    let mut begun = None;
    for (index, part) in text.as_bytes().chunks(64).enumerate() {
        let at = |bits: u64| 64 * index + bits.trailing_zeros() as usize;
        let blank = blanks(part);
        let before = blank << 1 | u64::from(begun.is_none());
        let (mut begins, mut ends) = (before & !blank, blank & !before);
        if let Some(begin) = begun.filter(|_| ends != 0) {
            places.push(begin..at(ends));
            ends &= ends - 1;
            begun = None;
        }
        while ends != 0 {
            places.push(at(begins)..at(ends));
            (begins, ends) = (begins & (begins - 1), ends & (ends - 1));
        }
        begun = begun.or_else(|| (begins != 0).then(|| at(begins)));
        if places.len() > COLUMNS_MAX {
            return true;
        }
    }
    places.extend(begun.map(|begin| begin..text.len()));
    true
}

/// Which of up to 64 bytes of ASCII are blanks, the first in the lowest bit; those behind the last are.
fn blanks(part: &[u8]) -> u64 {
    let mut bytes = [b' '; 64];
    bytes.iter_mut().zip(part).for_each(|(byte, own)| *byte = *own);
    let (mut blank, mut others) = (0, 0);
    for (index, word) in bytes.as_chunks().0.iter().enumerate() {
        let word = u64::from_le_bytes(*word);
        let up_to_space = !(word + ONES * (0x7f - 0x20)) & HIGH;
        others |= up_to_space ^ equal(word, b' ');
        // Each product of a bit of `up_to_space` and one of the factor is another power of two: bit 8 i comes to 56 + i.
        blank |= (up_to_space >> 7).wrapping_mul(0x0102_0408_1020_4080) >> 56 << (8 * index);
    }
    if others == 0 {
        return blank;
    }
    bytes.iter().rev().fold(0, |blank, byte| blank << 1 | u64::from(byte.is_ascii_whitespace()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The cells where they are parts of the text.
    fn placed(separator: Separator, text: &str) -> Option<Vec<&str>> {
        let mut places = Places::new();
        place(separator, text, &mut places).then(|| places.into_iter().map(|at| &text[at]).collect())
    }

    proptest! {
        #[test]
        fn places_are_what_splitting_gives(text in "[ab1;\" \u{e9}]{0,40}", words in "[ab1 \t\x0b\x0c\u{e9}]{0,40}", ascii in "[ab1 \t]{0,200}") {
            let separator = Separator::Character(';');
            let expected = separator.split(&text).cells();
            match placed(separator, &text) {
                Some(cells) => prop_assert_eq!(cells, expected.unwrap()),
                None => prop_assert!(text.contains('"')),
            }
            for text in [&words, &ascii] {
                let expected: Vec<&str> = text.split_ascii_whitespace().collect();
                prop_assert_eq!(placed(Separator::Blanks, text), text.is_ascii().then_some(expected));
            }
        }

        #[test]
        fn equal_bytes_are_found(bytes in any::<[u8; 8]>(), byte in any::<u8>()) {
            let found = equal(u64::from_le_bytes(bytes), byte).to_le_bytes();
            prop_assert_eq!(found.map(|bit| bit == 0x80), bytes.map(|it| it == byte));
        }
    }
}
