//! The time in tables: its column and its unit.

use shsa_core::time::{Span, Time};
use shsa_core::unit::{Dimension, Unit};
use shsa_message::moment::Moment;
use shsa_message::span::time_unit;
use shsa_message::zone::{Doubt, Zone};

const SECOND: i64 = 1_000_000_000;

/// How well the name of a header fits a time (0 is best), and the unit in the header.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct TimeHeader {
    unit_is_missing: bool,
    rank: usize,
    unit: Option<Span>,
}

/// Names of time columns, the plainest first; a `t` may be a temperature.
pub const TIME_NAMES: [&str; 21] = [
    "time",
    "timestamp",
    "time_stamp",
    "__time",
    "_time",
    "datetime",
    "date_time",
    "ts",
    "stamp",
    "unix_time",
    "unixtime",
    "elapsed",
    "elapsed_time",
    "elapsedtime",
    "time_elapsed",
    "sim_time",
    "simtime",
    "system_time",
    "seconds",
    "%time",
    "t",
];

fn time_header(header: &str) -> Option<TimeHeader> {
    if split_unit(header).1.is_some_and(is_no_time) {
        return None;
    }
    let (name, unit) = name_and_unit(header);
    let rank = TIME_NAMES.iter().position(|known| *known == name)?;
    let unit = match name.as_str() {
        "seconds" => unit.or(Some(Span(SECOND))),
        // `rostopic echo -p` writes nanoseconds under this name.
        "%time" => unit.or(Some(Span(1))),
        _ => unit,
    };
    Some(TimeHeader { unit_is_missing: unit.is_none(), rank, unit })
}

/// The name of a header in small letters, and its unit of time, from `t [s]`, `time(millisecond)` or `time_ns`.
fn name_and_unit(header: &str) -> (String, Option<Span>) {
    let header = header.trim().to_lowercase();
    let (name, bracketed) = split_unit(&header);
    if let Some(unit) = bracketed {
        return (name.to_owned(), time_unit(unit));
    }
    // Suffixes up to seconds only: `t_min` is rather a minimum than a time in minutes.
    let suffixed = name.rsplit_once('_').and_then(|(base, suffix)| Some((base, time_unit(suffix)?)));
    match suffixed.filter(|(_, unit)| unit.0 <= SECOND) {
        Some((base, unit)) => (base.to_owned(), Some(unit)),
        None => (name.to_owned(), None),
    }
}

/// The name of a header, and its unit in brackets or parentheses.
pub(super) fn split_unit(header: &str) -> (&str, Option<&str>) {
    let header = header.trim();
    let pairs = [(']', '['), (')', '(')];
    let split = pairs.iter().find_map(|(close, open)| header.strip_suffix(*close)?.rsplit_once(*open));
    match split {
        Some((name, unit)) if !name.trim().is_empty() => (name.trim(), Some(unit.trim())),
        _ => (header, None),
    }
}

/// The moment of a local date without a zone, and the note about the assumed zone.
pub(super) fn of_place(shown: Time, zone: &Zone) -> (Time, Option<String>) {
    let (time, doubt) = zone.utc(shown);
    let said = match doubt {
        _ if !zone.is_given => "the date has no zone and is taken as UTC (to say another: --time-zone)",
        Some(Doubt::Twice(_)) => "the clock was put back and showed the date twice; the first time is taken",
        Some(Doubt::Never) => {
            "the clock was put forward and never showed the date; it is taken as before that"
        }
        None => return (time, None),
    };
    (time, Some(said.to_owned()))
}

/// The times of rows that a local clock showed twice, or never.
#[derive(Default)]
pub(super) struct Doubts {
    last: Time,
    /// How many days have passed since the first row, where the times are those of a day.
    days: Option<i64>,
    twice: usize,
    never: usize,
}

const DAY: i64 = 86_400 * SECOND;

impl Doubts {
    /// Of rows with a time of day alone, where that is so: a row belongs to the day on which it is nearest to the row above.
    pub(super) fn of_days(is_so: bool) -> Doubts {
        Doubts { days: is_so.then_some(0), ..Doubts::default() }
    }

    /// A time of day on its day.
    fn on_its_day(&mut self, time: Time) -> Time {
        let Some(days) = &mut self.days else { return time };
        let off = self.last.0.saturating_sub(time.0.saturating_add(*days * DAY));
        *days += i64::from(off > DAY / 2) - i64::from(off < -DAY / 2 && *days > 0);
        Time(time.0.saturating_add(*days * DAY))
    }

    /// The moment of a row. A time that the clock showed twice means the second moment where the first would be before the row
    /// above.
    pub(super) fn settle(&mut self, moment: &Moment) -> Time {
        let time = match moment.doubt {
            Some(Doubt::Twice(second)) => {
                self.twice += 1;
                if moment.time < self.last { second } else { moment.time }
            }
            Some(Doubt::Never) => {
                self.never += 1;
                moment.time
            }
            None => self.on_its_day(moment.time),
        };
        self.last = time;
        time
    }

    /// The notes about the assumptions.
    pub(super) fn notes(&self) -> Vec<String> {
        let twice = "rows were written in an hour that the clock showed twice, as it was put back; \
                     they are taken for the first, and for the second once they go back";
        let never = "rows have times that the clock never showed, as it was put forward; they are taken as before that";
        let counted = [(self.twice, twice), (self.never, never)];
        counted
            .iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, what)| format!("{count} {what}"))
            .collect()
    }
}

/// Whether a unit measures something else than time, such as `degC`.
pub(super) fn is_no_time(unit: &str) -> bool {
    time_unit(&unit.to_lowercase()).is_none()
        && Unit::parse(unit).is_ok_and(|it| it.dimension != Dimension::TIME)
}

/// The columns whose headers fit a time, the best first, then the first of equals.
pub(super) fn time_columns(headers: &[String]) -> Vec<usize> {
    let mut times: Vec<(TimeHeader, usize)> = headers
        .iter()
        .enumerate()
        .filter_map(|(index, header)| Some((time_header(header)?, index)))
        .collect();
    times.sort_by_key(|(time, index)| (time.unit_is_missing, time.rank, *index));
    times.into_iter().map(|(_, index)| index).collect()
}

/// Whether a header is the letter `t` alone, which is as likely a temperature.
pub(super) fn is_letter(header: &str) -> bool {
    time_header(header).is_some_and(|time| time.unit_is_missing) && name_and_unit(header).0 == "t"
}

/// The unit of time in a header.
pub(super) fn unit_of(header: &str) -> Option<Span> {
    time_header(header).map_or_else(|| name_and_unit(header).1, |time| time.unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_column_is_recognised() {
        #[track_caller]
        fn check(headers: &[&str], expected: Option<(usize, Option<i64>)>) {
            let headers: Vec<String> = headers.iter().map(|header| (*header).to_owned()).collect();
            let found = time_columns(&headers).first().copied();
            let found = found.map(|index| (index, unit_of(&headers[index]).map(|unit| unit.0)));
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
        check(&["T", "ts", "time"], Some((2, None)));
        check(&["T [degC]", "t (K)", "RH"], None);
        check(&["t [s]", "time"], Some((0, Some(SECOND))));
        check(&["seconds", "x"], Some((0, Some(SECOND))));
        check(&[], None);
    }
}
