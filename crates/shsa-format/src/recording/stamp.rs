//! Time in tables: which column holds it, in which unit, and its exact value in nanoseconds.

use shsa_core::time::{Span, Time};

const SECOND: i64 = 1_000_000_000;

/// Reads a span: a positive number and a unit (`5s`, `0.1 s`, `20 ms`), or a unit alone (`us`: one microsecond).
///
/// # Errors
/// Says what is wrong: no unit, not positive, too long for 292 years.
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

/// The units of time with their names, whose plurals are known, too.
pub const TIME_UNITS: [(&[&str], Span); 6] = [
    (&["ns", "nsec", "nanosec", "nanosecond"], Span(1)),
    (&["us", "\u{b5}s", "\u{3bc}s", "usec", "microsec", "microsecond"], Span(1_000)),
    (&["ms", "msec", "millisec", "millisecond"], Span(1_000_000)),
    (&["s", "sec", "second"], Span(SECOND)),
    (&["min", "minute"], Span(60 * SECOND)),
    (&["h", "hour"], Span(3600 * SECOND)),
];

/// A unit of time by its name.
fn time_unit(name: &str) -> Option<Span> {
    let name = name.to_ascii_lowercase();
    let name = if name.len() > 3 { name.strip_suffix('s').unwrap_or(&name) } else { &name };
    let (_, unit) = TIME_UNITS.iter().find(|(names, _)| names.contains(&name))?;
    Some(*unit)
}

/// The time that a decimal number of steps says, rounded to the nanosecond, halves away from zero.
///
/// Computed on the digits: an epoch's nanoseconds do not fit the 53 bits of a float. `None` when the text is no
/// finite decimal number, or the time does not fit.
pub(super) fn decimal(text: &str, step: Span) -> Option<Time> {
    let (number, exponent) = match text.split_once(['e', 'E']) {
        Some((number, exponent)) => (number, exponent.parse::<i32>().ok()?),
        None => (text, 0),
    };
    let digits = number.strip_prefix(['-', '+']).unwrap_or(number);
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    if whole.is_empty() && fraction.is_empty() || !fraction.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    // Further digits cannot reach a nanosecond of any step whose whole part fits 64 bits.
    let fraction = fraction.get(..fraction.len().min(18))?;
    let product = digits_of(whole, fraction)?.checked_mul(i128::from(step.0))?;
    let places = exponent.checked_sub(i32::try_from(fraction.len()).ok()?)?;
    let nanoseconds = shifted(product, places)?;
    i64::try_from(if number.starts_with('-') { -nanoseconds } else { nanoseconds }).ok().map(Time)
}

fn digits_of(whole: &str, fraction: &str) -> Option<i128> {
    whole.bytes().chain(fraction.bytes()).try_fold(0_i128, |value, byte| {
        let digit = byte.checked_sub(b'0').filter(|digit| *digit < 10)?;
        value.checked_mul(10)?.checked_add(i128::from(digit))
    })
}

/// `value * 10^places`, rounded; `None` on overflow.
fn shifted(value: i128, places: i32) -> Option<i128> {
    let power = 10_i128.checked_pow(places.unsigned_abs());
    match power {
        Some(power) if places >= 0 => value.checked_mul(power),
        Some(power) => Some(value / power + i128::from(value % power >= power / 2 && power > 1)),
        // Beyond 38 places: nothing stays nothing, everything else is too large or vanishes.
        None if value == 0 || places < 0 => Some(0),
        None => None,
    }
}

/// How a column's header reads as a time: how well its name fits (0 is best) and the unit that it names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Likeness {
    unit_is_missing: bool,
    rank: usize,
    unit: Option<Span>,
}

/// Names of time columns, the plainest first.
pub const TIME_NAMES: [&str; 14] = [
    "t",
    "time",
    "timestamp",
    "time_stamp",
    "stamp",
    "elapsed",
    "elapsed_time",
    "elapsedtime",
    "time_elapsed",
    "sim_time",
    "simtime",
    "system_time",
    "seconds",
    "%time",
];

fn likeness(header: &str) -> Option<Likeness> {
    let (name, unit) = name_and_unit(header);
    let rank = TIME_NAMES.iter().position(|known| *known == name)?;
    let unit = match name.as_str() {
        "seconds" => unit.or(Some(Span(SECOND))),
        // `rostopic echo -p` writes nanoseconds under this name.
        "%time" => unit.or(Some(Span(1))),
        _ => unit,
    };
    Some(Likeness { unit_is_missing: unit.is_none(), rank, unit })
}

/// A header's name in small letters and its unit of time, from `t [s]`, `time(millisecond)` or `time_ns`.
fn name_and_unit(header: &str) -> (String, Option<Span>) {
    let header = header.trim().to_lowercase();
    let (name, bracketed) = split_unit(&header);
    if let Some(unit) = bracketed {
        return (name.to_owned(), time_unit(unit));
    }
    // Up to seconds only: `t_min` is rather a minimum than a time in minutes.
    let suffixed = name.rsplit_once('_').and_then(|(base, suffix)| Some((base, time_unit(suffix)?)));
    match suffixed.filter(|(_, unit)| unit.0 <= SECOND) {
        Some((base, unit)) => (base.to_owned(), Some(unit)),
        None => (name.to_owned(), None),
    }
}

/// A header's name, and what stands behind it in brackets or parentheses.
pub(super) fn split_unit(header: &str) -> (&str, Option<&str>) {
    let header = header.trim();
    let pairs = [(']', '['), (')', '(')];
    let split = pairs.iter().find_map(|(close, open)| header.strip_suffix(*close)?.rsplit_once(*open));
    match split {
        Some((name, unit)) if !name.trim().is_empty() => (name.trim(), Some(unit.trim())),
        _ => (header, None),
    }
}

/// The column that looks most like the time, by its header; the first of equals.
pub(super) fn time_column(headers: &[String]) -> Option<usize> {
    let alike = headers.iter().enumerate().filter_map(|(index, header)| Some((likeness(header)?, index)));
    alike
        .min_by_key(|(likeness, index)| (likeness.unit_is_missing, likeness.rank, *index))
        .map(|(_, index)| index)
}

/// The unit of time that a header names.
pub(super) fn unit_of(header: &str) -> Option<Span> {
    likeness(header).map_or_else(|| name_and_unit(header).1, |likeness| likeness.unit)
}

/// The unit of a column that names none, from its first value: the epoch (1970) in seconds, milli-, micro- and
/// nanoseconds cannot be mistaken for each other; all that is smaller is taken as seconds.
pub(super) fn likely_unit(first: f64) -> Span {
    match first.abs() {
        size if size >= 1e17 => Span(1),
        size if size >= 1e14 => Span(1_000),
        size if size >= 1e11 => Span(1_000_000),
        _ => Span(SECOND),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimals_are_exact() {
        #[track_caller]
        fn check(text: &str, step: i64, expected: Option<i64>) {
            assert_eq!(decimal(text, Span(step)), expected.map(Time));
        }
        check("0.580034", SECOND, Some(580_034_000));
        check("-0.5", SECOND, Some(-500_000_000));
        check("1533226488.299123456", SECOND, Some(1_533_226_488_299_123_456));
        check("1533226488299123457", 1, Some(1_533_226_488_299_123_457));
        check("1.533226488299123457e18", 1, Some(1_533_226_488_299_123_457));
        check("5e-1", 1, Some(1));
        check("0.4999999999999999999999999", 1, Some(0));
        check("12e3", 5 * SECOND, Some(60_000 * SECOND));
        check(".5", 1_000_000, Some(500_000));
        check("5.", 1_000_000, Some(5_000_000));
        check("0e999999999", SECOND, Some(0));
        check("1e-999999999", SECOND, Some(0));
        check("9223372036854775807", 1, Some(i64::MAX));
        for none in [
            "9223372036854775808",
            "1e400",
            "1e99999999999",
            "nan",
            "inf",
            "",
            ".",
            "-",
            "1.5.5",
            "0x1",
            "--1",
            "1.-5",
        ] {
            check(none, 1, None);
        }
        check("1e10", SECOND, None);
    }

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

    #[test]
    fn the_time_column_is_recognised() {
        #[track_caller]
        fn check(headers: &[&str], expected: Option<(usize, Option<i64>)>) {
            let headers: Vec<String> = headers.iter().map(|header| (*header).to_owned()).collect();
            let found =
                time_column(&headers).map(|index| (index, unit_of(&headers[index]).map(|unit| unit.0)));
            assert_eq!(found, expected);
        }
        check(&["t [s]", "acc_x [m/s^2]"], Some((0, Some(SECOND))));
        check(&["time(millisecond)", "datetime(utc)"], Some((0, Some(1_000_000))));
        check(&["Exclude", "Time(s)", "StepTime(s)"], Some((1, Some(SECOND))));
        check(&["a", "time_ns"], Some((1, Some(1))));
        check(&["timestamp", "a"], Some((0, None)));
        check(&["t", "timestamp_us"], Some((1, Some(1_000))));
        check(&["%time", "field.header.seq"], Some((0, Some(1))));
        check(&["reading", "mote_id", "utc [ms]"], None);
        check(&["t_min", "t_max"], None);
        check(&["seconds", "x"], Some((0, Some(SECOND))));
        check(&[], None);
    }

    #[test]
    fn epochs_are_told_apart_by_size() {
        let units = [1.5e9, 1.5e12, 1.5e15, 1.5e18, 0.0, f64::NAN].map(|first| likely_unit(first).0);
        assert_eq!(units, [SECOND, 1_000_000, 1_000, 1, SECOND, SECOND]);
    }
}
