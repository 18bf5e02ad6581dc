//! Time stamps as numbers and texts: seconds, nanoseconds, decimals and RFC 3339, read and written in the same notation.

use shsa_core::time::{Span, Time};

const SECOND: i64 = 1_000_000_000;

/// The notation of a stamp.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Notation {
    /// A whole number of steps.
    Steps(Span),
    /// A decimal number of steps.
    Decimal(Span),
    /// Text after RFC 3339.
    Rfc3339,
}

/// A number as a stamp, and its notation; `None` when the text is no number, or the time does not fit 64 bits.
///
/// With a `step` the number counts steps. Without one, a whole number counts [the step that fits its size](likely_step), and a
/// decimal one seconds.
#[must_use]
pub fn number(text: &str, step: Option<Span>) -> Option<(Time, Notation)> {
    if let Ok(whole) = text.parse::<i64>() {
        let step = step.unwrap_or_else(|| likely_step(whole.unsigned_abs()));
        return Some((Time(whole.checked_mul(step.0)?), Notation::Steps(step)));
    }
    let step = step.unwrap_or(Span(SECOND));
    decimal(text, step).map(|time| (time, Notation::Decimal(step)))
}

/// The likely step of a stamp of this size: times since 1970 in seconds, milli-, micro- and nanoseconds cannot be confused. From
/// 1e17 on the stamp counts nanoseconds, from 1e14 on micro-, from 1e11 on milliseconds (all of them since 1973), and below that
/// seconds.
#[must_use]
pub fn likely_step(size: u64) -> Span {
    match size {
        100_000_000_000_000_000.. => Span(1),
        100_000_000_000_000.. => Span(1_000),
        100_000_000_000.. => Span(1_000_000),
        _ => Span(SECOND),
    }
}

/// The time of a decimal number of steps, rounded to the nanosecond, halves away from zero.
///
/// Computed from the digits, as an epoch's nanoseconds do not fit the 53 bits of a float. `None` when the text is no finite
/// decimal number, or the time does not fit.
#[must_use]
pub fn decimal(text: &str, step: Span) -> Option<Time> {
    let (number, exponent) = match text.bytes().position(|byte| matches!(byte, b'e' | b'E')) {
        Some(at) => (text.get(..at)?, text.get(at + 1..)?.parse::<i32>().ok()?),
        None => (text, 0),
    };
    let digits = number.strip_prefix(['-', '+']).unwrap_or(number);
    let point = digits.bytes().position(|byte| byte == b'.');
    let (whole, fraction) = match point {
        Some(at) => (digits.get(..at)?, digits.get(at + 1..)?),
        None => (digits, ""),
    };
    if whole.is_empty() && fraction.is_empty() || !fraction.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    // Further digits cannot reach a nanosecond of any step whose whole part fits 64 bits.
    let fraction = fraction.get(..fraction.len().min(18))?;
    let digits = digits_of(whole, fraction)?;
    let places = exponent.checked_sub(i32::try_from(fraction.len()).ok()?)?;
    let nanoseconds = match whole_step(step, places) {
        Some(step) => digits.checked_mul(i128::from(step))?,
        None => shifted(digits.checked_mul(i128::from(step.0))?, places)?,
    };
    i64::try_from(if number.starts_with('-') { -nanoseconds } else { nanoseconds }).ok().map(Time)
}

fn digits_of(whole: &str, fraction: &str) -> Option<i128> {
    let digit = |byte: u8| byte.checked_sub(b'0').filter(|digit| *digit < 10);
    let mut digits = whole.bytes().chain(fraction.bytes());
    // The usual case: the number fits 64 bits.
    if whole.len() + fraction.len() <= 18 {
        return digits.try_fold(0, |value, byte| Some(10 * value + i64::from(digit(byte)?))).map(i128::from);
    }
    digits.try_fold(0_i128, |value, byte| value.checked_mul(10)?.checked_add(i128::from(digit(byte)?)))
}

/// `step * 10^places`, where that is a whole number for fractional places: then no division is needed.
fn whole_step(step: Span, places: i32) -> Option<i64> {
    let power = 10_i64.checked_pow(places.unsigned_abs()).filter(|_| places <= 0)?;
    (step.0 % power == 0).then_some(step.0 / power)
}

/// `value * 10^places`, rounded; `None` on overflow.
fn shifted(value: i128, places: i32) -> Option<i128> {
    let power = 10_i128.checked_pow(places.unsigned_abs());
    match power {
        Some(power) if places >= 0 => value.checked_mul(power),
        Some(power) => Some(value / power + i128::from(value % power >= power / 2 && power > 1)),
        // Beyond 38 places: zero stays zero, and any other value is too large or vanishes.
        None if value == 0 || places < 0 => Some(0),
        None => None,
    }
}

/// How many seconds a zone that is written alone, `+02:00`, is ahead of UTC.
pub(crate) fn zone_alone(text: &str) -> Option<i64> {
    split_zone(text).filter(|(clock, _)| clock.is_empty()).map(|(_, ahead)| ahead)
}

/// The time of a nanosecond of a day, in UTC; `None` for an invalid date, or a time that does not fit.
#[must_use]
pub fn civil(year: i64, month: i64, day: i64, nanoseconds_of_day: i64) -> Option<Time> {
    let is_date = (1..=12).contains(&month) && (1..=31).contains(&day) && (-9999..=9999).contains(&year);
    let seconds = is_date.then(|| days_of(year, month, day) * 86_400)?;
    seconds.checked_mul(SECOND)?.checked_add(nanoseconds_of_day).map(Time)
}

/// A text as a stamp: RFC 3339 (in UTC without a zone; a blank may replace the `T`), or a [number].
#[must_use]
pub fn text(text: &str, step: Option<Span>) -> Option<(Time, Notation)> {
    rfc3339(text.trim()).map(|time| (time, Notation::Rfc3339)).or_else(|| number(text.trim(), step))
}

fn rfc3339(text: &str) -> Option<Time> {
    let (date, rest) = (text.get(..10)?, text.get(10..)?);
    let (clock, zone) = split_zone(rest.strip_prefix(['T', 't', ' '])?)?;
    let (clock, fraction) = clock.split_once('.').unwrap_or((clock, "0"));
    let [year, month, day] = numbers(date, '-')?;
    let [hour, minute, second] = numbers(clock, ':')?;
    // A leap second is written as the 60th.
    if !(1..=12).contains(&month) || !(1..=31).contains(&day) || hour > 23 || minute > 59 || second > 60 {
        return None;
    }
    let seconds = days_of(year, month, day) * 86_400 + hour * 3600 + minute * 60 + second - zone;
    seconds.checked_mul(SECOND)?.checked_add(nanoseconds(fraction)?).map(Time)
}

/// The time of day, and how many seconds its zone is ahead of UTC.
fn split_zone(text: &str) -> Option<(&str, i64)> {
    if let Some(clock) = text.strip_suffix(['Z', 'z']) {
        return Some((clock, 0));
    }
    let Some(at) = text.rfind(['+', '-']) else { return Some((text, 0)) };
    let (clock, zone) = text.split_at(at);
    let zone_time = zone.get(1..)?;
    let [hours, minutes] = if zone_time.contains(':') {
        numbers(zone_time, ':')?
    } else {
        [numbers::<1>(zone_time.get(..2)?, ':')?[0], numbers::<1>(zone_time.get(2..)?, ':')?[0]]
    };
    let ahead = hours * 3600 + minutes * 60;
    (hours < 24 && minutes < 60).then_some((clock, if zone.starts_with('-') { -ahead } else { ahead }))
}

/// Exactly `N` numbers without signs, each of at most four digits.
fn numbers<const N: usize>(text: &str, between: char) -> Option<[i64; N]> {
    let number = |part: &str| {
        let digit = |byte: u8| byte.is_ascii_digit().then(|| i64::from(byte - b'0'));
        let digits = || part.bytes().try_fold(0, |number, byte| Some(10 * number + digit(byte)?));
        if (1..=4).contains(&part.len()) { digits() } else { None }
    };
    let (mut found, mut parts) = ([0; N], text.split(between));
    for place in &mut found {
        *place = number(parts.next()?)?;
    }
    parts.next().is_none().then_some(found)
}

/// The fractional digits as nanoseconds; digits beyond the ninth are cut off.
fn nanoseconds(digits: &str) -> Option<i64> {
    if digits.is_empty() || !digits.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    let filled = digits.bytes().chain(std::iter::repeat(b'0')).take(9);
    Some(filled.fold(0, |sum, digit| 10 * sum + i64::from(digit - b'0')))
}

/// Days from 1970-01-01 to a date of the proleptic Gregorian calendar.
///
/// Years are counted from March, so that the leap day is the last of its year.
fn days_of(year: i64, month: i64, day: i64) -> i64 {
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let of_year = (153 * month + 2) / 5 + day - 1;
    365 * year + year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400) + of_year - 719_468
}

/// The date of a number of days from 1970-01-01: year, month, day.
fn date(days: i64) -> (i64, i64, i64) {
    let from_march_0 = days + 719_468;
    let (era, of_era) = (from_march_0.div_euclid(146_097), from_march_0.rem_euclid(146_097));
    let year = (of_era - of_era / 1_460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let month = (5 * of_year + 2) / 153;
    let day = of_year - (153 * month + 2) / 5 + 1;
    let (year, month) = if month < 10 { (year, month + 3) } else { (year + 1, month - 9) };
    (year + era * 400, month, day)
}

/// A stamp in a notation, without quotes. Whole steps are rounded down.
#[must_use]
pub fn written(time: Time, notation: Notation) -> String {
    match notation {
        Notation::Steps(step) => time.0.div_euclid(step.0.max(1)).to_string(),
        Notation::Decimal(Span(SECOND)) => {
            let sign = if time.0 < 0 { "-" } else { "" };
            let nanoseconds = time.0.unsigned_abs();
            format!("{sign}{}.{:09}", nanoseconds / SECOND as u64, nanoseconds % SECOND as u64)
        }
        Notation::Decimal(step) => format!("{:?}", time.0 as f64 / step.0 as f64),
        Notation::Rfc3339 => {
            let (seconds, fraction) = (time.0.div_euclid(SECOND), time.0.rem_euclid(SECOND));
            let (year, month, day) = date(seconds.div_euclid(86_400));
            let of_day = seconds.rem_euclid(86_400);
            let (hour, minute, second) = (of_day / 3600, of_day / 60 % 60, of_day % 60);
            format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}.{fraction:09}Z")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[track_caller]
    fn check(stamp: &str, expected: i64) {
        assert_eq!(text(stamp, None).map(|(time, _)| time), Some(Time(expected)), "{stamp}");
    }

    #[test]
    fn stamps_are_known_by_their_form() {
        check("1700000000", 1_700_000_000_000_000_000);
        check("1700000000.25", 1_700_000_000_250_000_000);
        check("1700000000123", 1_700_000_000_123_000_000);
        check("1700000000123456", 1_700_000_000_123_456_000);
        check("1700000000123456789", 1_700_000_000_123_456_789);
        check("12.5", 12_500_000_000);
        check("1970-01-01T00:00:00Z", 0);
        check("2000-02-29T12:00:00.5+01:00", 951_822_000_500_000_000);
        check("2024-05-01 10:00:00", 1_714_557_600_000_000_000);
        check("2024-05-01T10:00:00-0330", 1_714_570_200_000_000_000);
        check("1969-12-31T23:59:59.999999999Z", -1);
        assert_eq!(
            number("7", Some(Span(5_000_000))),
            Some((Time(35_000_000), Notation::Steps(Span(5_000_000))))
        );
        assert_eq!(number("1.5", Some(Span(1_000_000))).map(|(time, _)| time), Some(Time(1_500_000)));
    }

    #[test]
    fn what_is_no_stamp_is_none() {
        for wrong in [
            "",
            "x",
            "2024-13-01T00:00:00Z",
            "2024-05-01",
            "2024-05-01T1:2Z",
            "nan",
            "1e300",
            "inf",
            "2024-05-01T10:00:00+",
            "2024-05-01T10:00:00.Z",
            "2024-05-01T10:00:00é",
            "9223372036854775807000",
        ] {
            assert_eq!(text(wrong, None), None, "{wrong}");
        }
        assert_eq!(number("9223372036854775807", Some(Span(2))), None);
    }

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
    fn epochs_are_told_apart_by_size() {
        let units =
            [1.5e9_f64, 1.5e12, 1.5e15, 1.5e18, 0.0, f64::NAN].map(|first| likely_step(first as u64).0);
        assert_eq!(units, [SECOND, 1_000_000, 1_000, 1, SECOND, SECOND]);
    }

    proptest! {
        #[test]
        fn what_is_written_is_read_again(nanoseconds in -62_000_000_000_000_000_i64.., kind in 0..3) {
            let form = [Notation::Rfc3339, Notation::Steps(Span(1)), Notation::Decimal(Span(SECOND))][kind as usize];
            let shown = written(Time(nanoseconds), form);
            let (read, _) = text(&shown, (kind == 1).then_some(Span(1))).unwrap();
            prop_assert_eq!(read.0, nanoseconds, "{}", shown);
        }

        #[test]
        fn any_text_is_survived(garbage in "\\PC{0,40}") {
            let _stamp = text(&garbage, None);
        }
    }
}
