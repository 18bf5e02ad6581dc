//! Time stamps within payloads: seconds, nanoseconds, ROS pairs and RFC 3339 texts, read and written in the same form.

use shsa_core::time::{Span, Time};

const SECOND: i64 = 1_000_000_000;

/// How a stamp is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    /// A whole number of steps.
    Steps(Span),
    /// A decimal number of steps.
    Decimal(Span),
    /// Text after RFC 3339.
    Rfc3339,
}

/// A number as a stamp, and how it is written.
///
/// With a `step` it counts steps. Without one a whole number from 1e17 on counts nanoseconds, from 1e14 on micro-, from
/// 1e11 on milliseconds (all of them since 1973), and everything else seconds.
pub(super) fn number(text: &str, step: Option<Span>) -> Option<(Time, Form)> {
    if let Ok(whole) = text.parse::<i64>() {
        let step = step.unwrap_or_else(|| likely_step(whole));
        return Some((Time(whole.checked_mul(step.0)?), Form::Steps(step)));
    }
    let step = step.unwrap_or(Span(SECOND));
    if let Some(time) = decimal_seconds(text).filter(|_| step == Span(SECOND)) {
        return Some((time, Form::Decimal(step)));
    }
    let nanoseconds = text.parse::<f64>().ok()? * step.0 as f64;
    (nanoseconds.abs() < i64::MAX as f64).then(|| (Time(nanoseconds.round() as i64), Form::Decimal(step)))
}

/// Seconds with digits behind the point, to the nanosecond: the 53 bits of a float do not hold an epoch's.
fn decimal_seconds(text: &str) -> Option<Time> {
    let (whole, fraction) = text.split_once('.')?;
    let (seconds, part) = (whole.parse::<i64>().ok()?.checked_mul(SECOND)?, nanoseconds(fraction)?);
    let time = if whole.starts_with('-') { seconds.checked_sub(part) } else { seconds.checked_add(part) };
    time.map(Time)
}

fn likely_step(whole: i64) -> Span {
    match whole.unsigned_abs() {
        100_000_000_000_000_000.. => Span(1),
        100_000_000_000_000.. => Span(1_000),
        100_000_000_000.. => Span(1_000_000),
        _ => Span(SECOND),
    }
}

/// A text as a stamp: RFC 3339 (without a zone it is UTC; a blank may stand for the `T`), or a number.
pub(super) fn text(text: &str, step: Option<Span>) -> Option<(Time, Form)> {
    rfc3339(text.trim()).map(|time| (time, Form::Rfc3339)).or_else(|| number(text.trim(), step))
}

fn rfc3339(text: &str) -> Option<Time> {
    let (date, rest) = (text.get(..10)?, text.get(10..)?);
    let (clock, zone) = split_zone(rest.strip_prefix(['T', 't', ' '])?)?;
    let (clock, fraction) = clock.split_once('.').unwrap_or((clock, "0"));
    let [year, month, day] = numbers(date, '-')?;
    let [hour, minute, second] = numbers(clock, ':')?;
    // A leap second is told as the 60th.
    if !(1..=12).contains(&month) || !(1..=31).contains(&day) || hour > 23 || minute > 59 || second > 60 {
        return None;
    }
    let seconds = days(year, month, day) * 86_400 + hour * 3600 + minute * 60 + second - zone;
    seconds.checked_mul(SECOND)?.checked_add(nanoseconds(fraction)?).map(Time)
}

/// The time of the day, and how many seconds its zone is ahead of UTC.
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
        let digits = (1..=4).contains(&part.len()) && part.bytes().all(|byte| byte.is_ascii_digit());
        part.parse().ok().filter(|_| digits)
    };
    let found: Option<Vec<i64>> = text.split(between).map(number).collect();
    found?.try_into().ok()
}

/// The digits behind the point, as nanoseconds; those beyond the ninth are cut off.
fn nanoseconds(digits: &str) -> Option<i64> {
    if digits.is_empty() || !digits.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    format!("{digits:0<9}").get(..9)?.parse().ok()
}

/// Days from 1970-01-01 to a date of the proleptic Gregorian calendar.
///
/// Years are counted from March, so that the leap day is the last of its year.
fn days(year: i64, month: i64, day: i64) -> i64 {
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let of_year = (153 * month + 2) / 5 + day - 1;
    365 * year + year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400) + of_year - 719_468
}

/// The date that is so many days from 1970-01-01: year, month, day.
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

/// A stamp in a form, without quotes. Whole steps are rounded down.
pub(super) fn written(time: Time, form: Form) -> String {
    match form {
        Form::Steps(step) => time.0.div_euclid(step.0.max(1)).to_string(),
        Form::Decimal(Span(SECOND)) => {
            let sign = if time.0 < 0 { "-" } else { "" };
            let nanoseconds = time.0.unsigned_abs();
            format!("{sign}{}.{:09}", nanoseconds / SECOND as u64, nanoseconds % SECOND as u64)
        }
        Form::Decimal(step) => format!("{:?}", time.0 as f64 / step.0 as f64),
        Form::Rfc3339 => {
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
            Some((Time(35_000_000), Form::Steps(Span(5_000_000))))
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

    proptest! {
        #[test]
        fn what_is_written_is_read_again(nanoseconds in -62_000_000_000_000_000_i64.., kind in 0..3) {
            let form = [Form::Rfc3339, Form::Steps(Span(1)), Form::Decimal(Span(SECOND))][kind as usize];
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
