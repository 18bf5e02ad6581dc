//! Numbers as texts, and descriptions of what is none.

use shsa_message::json::{self, Kind, Place};

/// A number, or a word for on or off.
pub(super) fn scalar(place: Place, text: &str) -> Option<f64> {
    match place.kind {
        Kind::Number | Kind::Text => word(place.of(text)),
        Kind::True => Some(1.0),
        Kind::False => Some(0.0),
        Kind::Null | Kind::List | Kind::Object => None,
    }
}

/// A number as text, including `NaN` and infinities, or a word for on or off.
pub(super) fn word(text: &str) -> Option<f64> {
    let text = text.trim_ascii();
    let is = |words: [&str; 2]| words.iter().any(|word| word.eq_ignore_ascii_case(text));
    match text.parse() {
        Ok(number) => Some(number),
        Err(_) if is(["true", "on"]) => Some(1.0),
        Err(_) if is(["false", "off"]) => Some(0.0),
        Err(_) => None,
    }
}

/// Describes the value at a place; shortens a text.
pub(super) fn shown(place: Place, text: &str) -> String {
    let kind = match place.kind {
        Kind::Null => "null",
        Kind::False | Kind::True => "a truth value",
        Kind::Number => "a number",
        Kind::List => "a list",
        Kind::Object => "an object",
        Kind::Text => {
            let text = json::unescaped(place.of(text));
            let visible = |c: char| if c.is_control() { '\u{fffd}' } else { c };
            let mut start: String = text.chars().take(24).map(visible).collect();
            if start.len() < text.len() && text.chars().nth(24).is_some() {
                start.push_str("..");
            }
            return format!("the text '{start}'");
        }
    };
    kind.to_owned()
}
