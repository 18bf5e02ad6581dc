//! Texts as C has them: bytes that end with a zero.

use std::ffi::{CString, c_char};
use std::ptr;

/// A text with its zero; a zero within the text becomes the replacement character.
pub(crate) fn c_text(text: &str) -> CString {
    CString::new(text.replace('\0', "\u{fffd}")).unwrap_or_default()
}

/// The address of a text; null for no text.
pub(crate) fn address(text: Option<&CString>) -> *const c_char {
    text.map_or(ptr::null(), |text| text.as_ptr())
}

/// Copies a text into a field of fixed length, cut at the border of a character, and ends it with a zero.
pub(crate) fn copy(text: &str, field: &mut [c_char]) {
    let room = field.len().saturating_sub(1);
    let kept = &text.as_bytes()[..text.floor_char_boundary(room)];
    field.fill(0);
    for (place, byte) in field.iter_mut().zip(kept) {
        *place = byte.cast_signed() as c_char;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(text: &str, expected: &[u8]) {
        let mut field = [1; 4];
        copy(text, &mut field);
        assert_eq!(field.map(|it| it as u8), expected);
    }

    #[test]
    fn texts_are_cut_between_characters() {
        check("", &[0; 4]);
        check("ab", b"ab\0\0");
        check("abcd", b"abc\0");
        check("abé", b"ab\0\0");
        copy("a", &mut []);
    }

    #[test]
    fn a_zero_does_not_end_a_text() {
        assert_eq!(c_text("a\0b").to_str(), Ok("a\u{fffd}b"));
    }
}
