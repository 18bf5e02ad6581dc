//! Dates and times of day as people write them in tables: `2018-04-08 10:31:37.097`, `08/04/2018`, `10.31.37`, `10:31 PM`.

use crate::stamp::civil;
use crate::zone::{Doubt, Zone};
use shsa_core::time::Time;
use std::str::FromStr;

const SECOND: i64 = 1_000_000_000;
const HOUR: i64 = 3_600 * SECOND;

const MONTHS: [&str; 12] = [
    "January",
    "February",
    "March",
    "April",
    "May",
    "June",
    "July",
    "August",
    "September",
    "October",
    "November",
    "December",
];

/// The order of a date's parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DateOrder {
    /// `2018-04-08`, `2018/4/8`, `20180408`.
    YearMonthDay,
    /// `08/04/2018`, `8.4.2018`, `8-Apr-2018`.
    DayMonthYear,
    /// `04/08/2018`.
    MonthDayYear,
}

impl DateOrder {
    /// All orders.
    pub const ALL: [DateOrder; 3] =
        [DateOrder::YearMonthDay, DateOrder::DayMonthYear, DateOrder::MonthDayYear];
}

impl FromStr for DateOrder {
    type Err = String;

    fn from_str(text: &str) -> Result<DateOrder, String> {
        match text {
            "ymd" => Ok(DateOrder::YearMonthDay),
            "dmy" => Ok(DateOrder::DayMonthYear),
            "mdy" => Ok(DateOrder::MonthDayYear),
            _ => Err("write dmy, mdy or ymd".to_owned()),
        }
    }
}

/// A moment, and whether its text gives a zone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Moment {
    /// The time in UTC.
    pub time: Time,
    /// Whether the text gives a zone; otherwise the caller's zone was used.
    pub has_zone: bool,
    /// Why the time of a local clock does not determine the moment.
    pub doubt: Option<Doubt>,
}

impl Moment {
    /// What the clock of a place showed, as if it were UTC.
    #[must_use]
    pub fn shown(shown: Time, zone: &Zone) -> Moment {
        let (time, doubt) = zone.utc(shown);
        Moment { time, has_zone: false, doubt }
    }
}

/// A date and a time of day, with or without a zone; a date or a month alone is its first moment. `None` for other texts.
#[must_use]
pub fn moment(text: &str, order: DateOrder, zone: &Zone) -> Option<Moment> {
    let text = text.trim();
    if let (Some(usual), DateOrder::YearMonthDay) = (usual(text, zone), order) {
        return Some(usual);
    }
    written(text, order, zone)
}

/// A moment in the form of most recordings, `2018-04-08 10:31:37.097`, whose parts have fixed places; with a zone, `Z` or `+02:00`,
/// or without. `None` for other forms.
fn usual(text: &str, zone: &Zone) -> Option<Moment> {
    let (head, rest) = text.as_bytes().split_first_chunk::<19>()?;
    let &[y, e, a, r, b'-', m, o, b'-', d, t, b' ' | b'T', h, u, b':', i, n, b':', s, c] = head else {
        return None;
    };
    let [century, year, month, day] = [pair([y, e])?, pair([a, r])?, pair([m, o])?, pair([d, t])?];
    let [hour, minute, second] = [pair([h, u])?, pair([i, n])?, pair([s, c])?];
    let year = 100 * century + year;
    let is_date = (1..=12).contains(&month) && (1..=days_in(year, month)).contains(&day);
    if !is_date || hour > 23 || minute > 59 || second > 60 {
        return None;
    }
    let fraction =
        rest.strip_prefix(b".").map_or(0, |rest| rest.iter().take_while(|it| it.is_ascii_digit()).count());
    let (fraction, rest) = match fraction {
        0 => (0, rest),
        digits => (fraction_of(text.get(20..20 + digits)?)?, rest.get(1 + digits..)?),
    };
    let of_day = hour * HOUR + (minute * 60 + second) * SECOND + fraction;
    let ahead = match rest {
        [] => return Some(Moment::shown(civil(year, month, day, of_day)?, zone)),
        b"Z" => 0,
        &[sign @ (b'+' | b'-'), h, u, b':', i, n] => {
            let [hours, minutes] = [pair([h, u])?, pair([i, n])?];
            let ahead = (hours < 24 && minutes < 60).then_some(hours * HOUR + minutes * 60 * SECOND)?;
            if sign == b'-' { -ahead } else { ahead }
        }
        _ => return None,
    };
    Some(Moment { time: civil(year, month, day, of_day - ahead)?, has_zone: true, doubt: None })
}

/// A number of two digits.
fn pair([ten, one]: [u8; 2]) -> Option<i64> {
    let is_number = ten.is_ascii_digit() && one.is_ascii_digit();
    is_number.then(|| 10 * i64::from(ten - b'0') + i64::from(one - b'0'))
}

/// A moment in any form.
fn written(text: &str, order: DateOrder, zone: &Zone) -> Option<Moment> {
    if let (Some((date, clock)), DateOrder::YearMonthDay) = (compact(text), order) {
        return joined(date, of_day(&clock)?, order, zone);
    }
    // The `t` of October stands behind a letter.
    let is_between = |pair: &[u8]| matches!(pair, [b'0'..=b'9', b'T' | b't' | b' ' | b'_']);
    let at = text.as_bytes().windows(2).position(is_between).map_or(text.len(), |digit| digit + 1);
    let (date, rest) = text.split_at_checked(at)?;
    let of_day = match rest.get(1..).map(str::trim) {
        None | Some("") => OfDay { nanoseconds: 0, ahead: None },
        Some(clock) => of_day(clock)?,
    };
    joined(date, of_day, order, zone)
}

/// Whether a text is a date and a time of day in digits alone: `20180408103137`, with seconds, and a fraction if any.
#[must_use]
pub fn is_compact(text: &str) -> bool {
    let digits = text.bytes().take_while(u8::is_ascii_digit).count();
    digits == 14 && moment(text, DateOrder::YearMonthDay, &Zone::default()).is_some()
}

/// The date, and the time of day with colons, of the basic format of ISO 8601: `20180408T103137Z`, `20180408103137.5`.
fn compact(text: &str) -> Option<(&str, String)> {
    let digits = |text: &str| text.bytes().take_while(u8::is_ascii_digit).count();
    let (date, rest) = text.split_at_checked(8).filter(|(date, _)| digits(date) == 8)?;
    let clock = rest.strip_prefix(['T', 't', ' ', '_']).unwrap_or(rest);
    let (hour, rest) = clock.split_at_checked(2)?;
    match digits(clock) {
        4 => Some((date, format!("{hour}:{rest}"))),
        6 => rest.split_at_checked(2).map(|(minute, rest)| (date, format!("{hour}:{minute}:{rest}"))),
        _ => None,
    }
}

/// A moment whose date and time of day are in separate texts.
#[must_use]
pub fn moment_of(date: &str, clock: &str, order: DateOrder, zone: &Zone) -> Option<Moment> {
    joined(date.trim(), of_day(clock.trim())?, order, zone)
}

/// Whether a text is a date in any order.
#[must_use]
pub fn is_date(text: &str) -> bool {
    DateOrder::ALL.iter().any(|order| date(text.trim(), *order).is_some())
}

/// Whether a text is a time of day.
#[must_use]
pub fn is_time_of_day(text: &str) -> bool {
    of_day(text.trim()).is_some()
}

struct OfDay {
    nanoseconds: i64,
    /// How far the zone is ahead of UTC, nanoseconds.
    ahead: Option<i64>,
}

fn joined(text: &str, of_day: OfDay, order: DateOrder, zone: &Zone) -> Option<Moment> {
    let [year, month, day] = date(text, order)?;
    let shown = civil(year, month, day, of_day.nanoseconds.checked_sub(of_day.ahead.unwrap_or(0))?)?;
    Some(match of_day.ahead {
        Some(_) => Moment { time: shown, has_zone: true, doubt: None },
        None => Moment::shown(shown, zone),
    })
}

/// Year, month and day.
fn date(text: &str, order: DateOrder) -> Option<[i64; 3]> {
    let (first, second, third) = match text.bytes().find(|byte| !byte.is_ascii_digit()) {
        Some(between @ (b'-' | b'/' | b'.')) => {
            let (first, rest) = cut(text, |byte| byte == between)?;
            // A month alone is its first day; two numbers with a point are one.
            let is_month = order == DateOrder::YearMonthDay && first.len() == 4 && between != b'.';
            let (second, third) = match cut(rest, |byte| byte == between) {
                None if is_month => (rest, "1"),
                parts => parts?,
            };
            (first, second, third)
        }
        None if text.len() == 8 && order == DateOrder::YearMonthDay => {
            (text.get(..4)?, text.get(4..6)?, text.get(6..)?)
        }
        _ => return None,
    };
    let (year, month, day) = match order {
        DateOrder::YearMonthDay => (first, second, third),
        DateOrder::DayMonthYear => (third, second, first),
        DateOrder::MonthDayYear => (third, first, second),
    };
    let [month, day] = [number(month, 2).or_else(|| named_month(month))?, number(day, 2)?];
    let year = match year.len() {
        4 => number(year, 4)?,
        // Two digits are a year of the hundred years that POSIX assigns.
        2 if order != DateOrder::YearMonthDay => match number(year, 2)? {
            year @ 69.. => 1900 + year,
            year => 2000 + year,
        },
        _ => return None,
    };
    let is_day = (1..=12).contains(&month) && (1..=days_in(year, month)).contains(&day);
    is_day.then_some([year, month, day])
}

/// The number of days of a month.
fn days_in(year: i64, month: i64) -> i64 {
    let is_leap_year = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
    match month {
        2 if is_leap_year => 29,
        2 => 28,
        4 | 6 | 9 | 11 => 30,
        _ => 31,
    }
}

/// The texts before and behind the first of these bytes, which are of ASCII.
fn cut(text: &str, is_between: impl Fn(u8) -> bool) -> Option<(&str, &str)> {
    let at = text.bytes().position(is_between)?;
    Some((text.get(..at)?, text.get(at + 1..)?))
}

/// The number of a month from its name in English, or the first three letters of it.
fn named_month(text: &str) -> Option<i64> {
    let is_it =
        |name: &str| [Some(name), name.get(..3)].iter().flatten().any(|it| it.eq_ignore_ascii_case(text));
    (1..).zip(MONTHS).find(|(_, name)| is_it(name)).map(|(number, _)| number)
}

/// A number of digits only, at most `most` of them.
fn number(text: &str, most: usize) -> Option<i64> {
    let digit = |byte: u8| byte.is_ascii_digit().then(|| i64::from(byte - b'0'));
    let is_number = (1..=most).contains(&text.len());
    text.bytes().try_fold(0, |number, byte| Some(10 * number + digit(byte)?)).filter(|_| is_number)
}

fn of_day(text: &str) -> Option<OfDay> {
    let (text, half) = split_half(text);
    let (clock, ahead) = match half {
        Some(_) => (text, None),
        None => split_zone(text)?,
    };
    let clock = clock.trim_end();
    let points = || clock.bytes().filter(|byte| *byte == b'.').count();
    let between = match clock.bytes().find(|byte| !byte.is_ascii_digit())? {
        b'.' if points() != 2 => return None,
        between @ (b':' | b'.') => between,
        _ => return None,
    };
    let (hour, rest) = cut(clock, |byte| byte == between)?;
    let (minute, seconds) = cut(rest, |byte| byte == between).unwrap_or((rest, "0"));
    let (second, fraction) = cut(seconds, |byte| matches!(byte, b'.' | b',')).unwrap_or((seconds, "0"));
    let [mut hour, minute, second] = [number(hour, 2)?, number(minute, 2)?, number(second, 2)?];
    let fraction = fraction_of(fraction)?;
    if let Some(is_afternoon) = half {
        let is_hour = (1..=12).contains(&hour);
        hour = is_hour.then_some(hour % 12 + if is_afternoon { 12 } else { 0 })?;
    }
    // A leap second is written as the 60th, the end of a day as 24:00.
    let is_time =
        hour < 24 && minute < 60 && second <= 60 || (hour, minute, second, fraction) == (24, 0, 0, 0);
    let nanoseconds = hour * HOUR + minute * 60 * SECOND + second * SECOND + fraction;
    is_time.then_some(OfDay { nanoseconds, ahead })
}

/// Splits `10:31 PM` into the time and whether it is after noon.
fn split_half(text: &str) -> (&str, Option<bool>) {
    let halves = [("am", false), ("pm", true)];
    let ends = |half: &str| {
        let at = text.len().checked_sub(half.len())?;
        let (clock, end) = text.split_at_checked(at)?;
        end.eq_ignore_ascii_case(half).then_some(clock.trim_end())
    };
    halves
        .into_iter()
        .find_map(|(half, is_afternoon)| Some((ends(half)?, Some(is_afternoon))))
        .unwrap_or((text, None))
}

/// A time of day, and how far its zone is ahead of UTC, nanoseconds; `None` for an invalid zone.
fn split_zone(text: &str) -> Option<(&str, Option<i64>)> {
    for utc in ["Z", "z", "UTC", "GMT"] {
        if let Some(clock) = text.strip_suffix(utc) {
            return Some((clock, Some(0)));
        }
    }
    let sign = text.bytes().rposition(|byte| matches!(byte, b'+' | b'-'));
    let Some(at) = sign else { return Some((text, None)) };
    let (clock, zone) = text.split_at(at);
    let mut digits = [0; 4];
    let mut count = 0;
    for byte in zone.bytes().skip(1).filter(|byte| *byte != b':') {
        *digits.get_mut(count)? = byte.is_ascii_digit().then(|| i64::from(byte - b'0'))?;
        count += 1;
    }
    let [ten, one, ten_minutes, one_minute] = digits;
    let (hours, minutes) = (10 * ten + one, 10 * ten_minutes + one_minute);
    if !matches!(count, 2 | 4) {
        return None;
    }
    let ahead = hours * HOUR + minutes * 60 * SECOND;
    (hours < 24 && minutes < 60).then_some((clock, Some(if zone.starts_with('-') { -ahead } else { ahead })))
}

/// The fractional digits as nanoseconds; digits beyond the ninth are cut off.
fn fraction_of(digits: &str) -> Option<i64> {
    let is_fraction = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
    let filled = digits.bytes().chain(std::iter::repeat(b'0')).take(9);
    is_fraction.then(|| filled.fold(0, |sum, digit| 10 * sum + i64::from(digit - b'0')))
}

#[cfg(test)]
mod tests;
