//! Spans of time as people write them: `5s`, `0.1 s`, `20 ms`.

use crate::stamp::decimal;
use shsa_core::time::{Span, Time};

const SECOND: i64 = 1_000_000_000;

/// Parses a span: a positive number and a unit (`5s`, `0.1 s`, `20 ms`), or a unit alone (`us`: one microsecond).
///
/// # Errors
/// The problem: no unit, not positive, or longer than 292 years.
pub fn parse_span(text: &str) -> Result<Span, String> {
    let text = text.trim();
    let digits = text.find(|c: char| c.is_alphabetic()).unwrap_or(text.len());
    let (number, unit) = text.split_at(digits);
    let unit = time_unit(unit.trim())
        .ok_or_else(|| format!("'{text}' has no unit of time; write it like 5s, 20 ms, us"))?;
    let number = if number.trim().is_empty() { "1" } else { number.trim() };
    match decimal(number, unit) {
        Some(Time(span)) if span > 0 => Ok(Span(span)),
        _ => Err(format!("'{text}' is no positive span of time")),
    }
}

/// The units of time with their names; plurals are accepted, too.
pub const TIME_UNITS: [(&[&str], Span); 6] = [
    (&["ns", "nsec", "nanosec", "nanosecond"], Span(1)),
    (&["us", "\u{b5}s", "\u{3bc}s", "usec", "microsec", "microsecond"], Span(1_000)),
    (&["ms", "msec", "millisec", "millisecond"], Span(1_000_000)),
    (&["s", "sec", "second"], Span(SECOND)),
    (&["min", "minute"], Span(60 * SECOND)),
    (&["h", "hour"], Span(3600 * SECOND)),
];

/// A unit of time by its name, in upper or lower case; `None` for any other word.
#[must_use]
pub fn time_unit(name: &str) -> Option<Span> {
    let name = name.to_ascii_lowercase();
    let name = if name.len() > 3 { name.strip_suffix('s').unwrap_or(&name) } else { &name };
    let (_, unit) = TIME_UNITS.iter().find(|(names, _)| names.contains(&name))?;
    Some(*unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_are_read() {
        #[track_caller]
        fn check(text: &str, expected: Option<i64>) {
            assert_eq!(parse_span(text).ok(), expected.map(Span));
        }
        check("5s", Some(5 * SECOND));
        check(" 0.1 s ", Some(SECOND / 10));
        check("ms", Some(1_000_000));
        check("2 minutes", Some(120 * SECOND));
        for none in ["5", "", "-1s", "0 ms", "1e30 s", "5 parsec", "5 s s"] {
            check(none, None);
        }
    }
}
