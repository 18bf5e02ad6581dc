//! Decoding and encoding of quoted texts.

use std::borrow::Cow;

/// The meaning of a text between quotes; a lone half of a surrogate pair becomes the replacement character.
#[must_use]
pub fn unescaped(raw: &str) -> Cow<'_, str> {
    if !raw.as_bytes().contains(&b'\\') {
        return raw.into();
    }
    let mut text = String::with_capacity(raw.len());
    let mut rest = raw;
    while let Some((before, escape)) = rest.split_once('\\') {
        text.push_str(before);
        rest = unescape(escape, &mut text);
    }
    text.push_str(rest);
    text.into()
}

/// Appends the meaning of an escape; returns the text behind it.
fn unescape<'a>(escape: &'a str, text: &mut String) -> &'a str {
    let mut rest = escape.chars();
    let simple = match rest.next() {
        Some('b') => '\u{8}',
        Some('f') => '\u{c}',
        Some('n') => '\n',
        Some('r') => '\r',
        Some('t') => '\t',
        Some('u') => return unescape_hexadecimal(rest.as_str(), text),
        Some(other) => other,
        None => return "",
    };
    text.push(simple);
    rest.as_str()
}

fn unescape_hexadecimal<'a>(digits: &'a str, text: &mut String) -> &'a str {
    let unit = |digits: &str| u16::from_str_radix(digits.get(..4).unwrap_or(""), 16).ok();
    let (first, rest) = (unit(digits).unwrap_or(0xfffd), digits.get(4..).unwrap_or(""));
    let second = rest.strip_prefix("\\u").and_then(unit).filter(|_| (0xd800..0xdc00).contains(&first));
    if let Some(Ok(character)) = second.and_then(|second| char::decode_utf16([first, second]).next()) {
        text.push(character);
        return rest.get(6..).unwrap_or("");
    }
    text.push(char::from_u32(u32::from(first)).unwrap_or(char::REPLACEMENT_CHARACTER));
    rest
}

/// Appends a text in quotes.
pub fn push_quoted(text: &str, to: &mut String) {
    to.push('"');
    for character in text.chars() {
        match character {
            '"' => to.push_str("\\\""),
            '\\' => to.push_str("\\\\"),
            '\n' => to.push_str("\\n"),
            '\0'..='\u{1f}' => to.push_str(&format!("\\u{:04x}", u32::from(character))),
            _ => to.push(character),
        }
    }
    to.push('"');
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(raw: &str, expected: &str) {
        assert_eq!(unescaped(raw), expected);
    }

    #[test]
    fn escapes_mean_characters() {
        check("plain é", "plain é");
        check(r#"a\"\/\\\b\f\n\r\tz"#, "a\"/\\\u{8}\u{c}\n\r\tz");
        check(r"\u00e4\ud83d\ude00", "\u{e4}\u{1f600}");
        check(r"\ud83d!", "\u{fffd}!");
        check(r"\ud83d\u0041", "\u{fffd}A");
    }

    #[test]
    fn what_is_quoted_means_what_it_was() {
        for text in ["", "a \"b\" \\", "\u{1}\n\t\u{1f600}"] {
            let mut quoted = String::new();
            push_quoted(text, &mut quoted);
            check(&quoted[1..quoted.len() - 1], text);
        }
    }
}
