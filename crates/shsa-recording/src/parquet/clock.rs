//! The times of the rows: from a column of timestamps, else from the columns' names and the first rows, as in a table of text.

use super::super::stamp::{self, Doubts};
use super::super::table::clock::{self as text, Clock as TextClock};
use super::super::table::layout::{Layout, Separator};
use super::super::{ReadOptions, names};
use super::cells::Cell;
use super::description::{Description, Meaning, Physical};
use super::{Columns, Value};
use crate::topic::Rows as _;
use shsa_core::time::{Span, Time};
use shsa_message::moment::Moment;
use shsa_message::stamp::decimal;
use shsa_message::zone::Zone;
use std::borrow::Cow;

const SECOND: Span = Span::from_millis(1_000);

/// How many rows with a time decide where it is.
pub(super) const ROWS: usize = 100;
/// In how many rows these are looked for.
pub(super) const ROWS_LOOKED_AT: u64 = 1 << 16;

/// The place of the time in the rows.
pub(super) struct Clock {
    kind: Kind,
    /// Whether the missing zone was reported.
    has_told_zone: bool,
    is_zone_missing: bool,
    doubts: Doubts,
}

enum Kind {
    /// A column of nanoseconds since 1970; whether they are in UTC.
    Moments(usize, bool),
    /// Text columns, as in a table of text.
    Text(TextClock),
}

/// A clock, and the assumptions by which it was found.
pub(super) struct Found {
    pub(super) clock: Clock,
    pub(super) notes: Vec<String>,
}

/// The names of the columns.
pub(super) fn headers(description: &Description) -> Vec<String> {
    description.columns.iter().map(|column| column.name.clone()).collect()
}

/// The columns of which one may be the time by its name or by its kind.
pub(super) fn candidates(description: &Description, options: &ReadOptions) -> Vec<usize> {
    let headers = headers(description);
    let asked = options.time_column.as_ref().and_then(|name| match names::column_of(&headers, name) {
        names::Fit::Column(at) => Some(at),
        _ => None,
    });
    let is_moment = |at: &usize| {
        description.columns.get(*at).is_some_and(|column| matches!(column.meaning, Meaning::Moment { .. }))
    };
    match asked {
        Some(at) => vec![at],
        None => (0..headers.len()).filter(is_moment).chain(stamp::time_columns(&headers)).collect(),
    }
}

/// The columns whose first cells tell where the time is; none where the names and kinds of the columns tell it alone.
pub(super) fn deciding(description: &Description, options: &ReadOptions) -> Vec<usize> {
    let headers = headers(description);
    let (candidates, may_be_apart) = (candidates(description, options), text::may_be_apart(&headers));
    let kind = |at: usize| description.columns.get(at).map(|column| (column.physical, column.meaning));
    let is_text =
        |at: usize| matches!(kind(at), Some((Physical::Bytes | Physical::Fixed(_), Meaning::Plain)));
    let is_certain = |at: usize| match kind(at) {
        Some((_, Meaning::Moment { .. })) => true,
        _ if is_text(at) => false,
        _ => options.time_scale.is_some() || headers.get(at).is_some_and(|it| stamp::unit_of(it).is_some()),
    };
    let moments = candidates.iter().filter(|at| matches!(kind(**at), Some((_, Meaning::Moment { .. }))));
    match (moments.count(), candidates.as_slice()) {
        (1, _) => Vec::new(),
        (0, [only]) if is_certain(*only) && !may_be_apart => Vec::new(),
        (0, _) => {
            let all = 0..headers.len();
            all.filter(|at| is_text(*at) || candidates.contains(at) || may_be_apart).collect()
        }
        _ => candidates,
    }
}

/// Finds the columns with the time.
///
/// # Errors
/// The columns that were looked for.
pub(super) fn find(
    description: &Description,
    rows: &[Vec<String>],
    options: &ReadOptions,
) -> Result<Found, String> {
    let headers = headers(description);
    let moments = |at: usize| match description.columns.get(at)?.meaning {
        Meaning::Moment { is_utc, .. } => Some(Kind::Moments(at, is_utc)),
        _ => None,
    };
    let has_values = |at: &usize| rows.iter().any(|row| row.get(*at).is_some_and(|cell| !cell.is_empty()));
    let found = |kind, notes| Found {
        clock: Clock { kind, has_told_zone: false, is_zone_missing: false, doubts: Doubts::default() },
        notes,
    };
    // The requested column, else the one with the name of a time, else the first column of timestamps that is not empty.
    let asked = options.time_column.as_ref().map(|name| match names::column_of(&headers, name) {
        names::Fit::Column(at) => moments(at),
        _ => None,
    });
    let all = || 0..headers.len();
    let by_itself = || {
        let named = stamp::time_columns(&headers).into_iter().filter(has_values).find_map(moments);
        named.or_else(|| all().filter(has_values).find_map(moments)).or_else(|| all().find_map(moments))
    };
    if let Some(kind) = asked.unwrap_or_else(by_itself) {
        return Ok(found(kind, Vec::new()));
    }
    let layout = Layout {
        separator: Separator::Character(','),
        units: Vec::new(),
        preamble: 0,
        headers,
        lines: 0,
        has_index: false,
        has_decimal_commas: false,
    };
    let rows: Vec<Vec<&str>> = rows.iter().map(|row| row.iter().map(String::as_str).collect()).collect();
    let text = text::find(&layout, &rows, options)?;
    let doubts = Doubts::of_days(text.clock.is_of_day());
    let mut found = found(Kind::Text(text.clock), text.notes);
    found.clock.doubts = doubts;
    Ok(found)
}

impl Clock {
    /// The columns with the parts of the time.
    pub(super) fn columns(&self) -> Vec<usize> {
        match &self.kind {
            Kind::Moments(column, _) => vec![*column],
            Kind::Text(clock) => clock.columns(),
        }
    }

    /// Whether a column is a part of the time.
    pub(super) fn reads(&self, at: usize) -> bool {
        match &self.kind {
            Kind::Moments(column, _) => *column == at,
            Kind::Text(clock) => clock.columns().contains(&at),
        }
    }

    /// Appends the times of the current rows where each of them is a number in a column; else it returns false, and appends none.
    pub(super) fn moments(&self, columns: &Columns<'_>, rows: usize, times: &mut Vec<Time>) -> bool {
        let begin = times.len();
        times.reserve(rows);
        match &self.kind {
            Kind::Moments(column, true) => {
                for cell in columns.cells(*column) {
                    let Cell::Whole(since) = cell else { break };
                    times.push(Time(*since));
                }
            }
            Kind::Text(TextClock::Number(column, step)) => {
                for cell in columns.cells(*column) {
                    let Cell::Number(number) = cell else { break };
                    let Some(time) = within(*number, *step) else { break };
                    times.push(time);
                }
            }
            Kind::Moments(..) | Kind::Text(_) => {}
        }
        let are_all = times.len() == begin + rows;
        times.truncate(if are_all { times.len() } else { begin });
        are_all
    }

    /// The time of a row; `None` where its cells have none.
    pub(super) fn moment(&mut self, columns: &Columns<'_>, row: usize, zone: &Zone) -> Option<Time> {
        match &self.kind {
            Kind::Moments(column, is_utc) => {
                let Value::Whole(since) = columns.value(row, *column) else { return None };
                if *is_utc {
                    return Some(Time(since));
                }
                self.is_zone_missing = true;
                Some(self.doubts.settle(&Moment::shown(Time(since), zone)))
            }
            Kind::Text(TextClock::Number(column, step)) => number(columns.value(row, *column), *step),
            Kind::Text(clock) => {
                let shown: Vec<(usize, Cow<'_, str>)> =
                    clock.columns().into_iter().map(|at| (at, columns.shown(row, at))).collect();
                let cell = |at: usize| shown.iter().find(|(of, _)| *of == at).map(|(_, text)| text.trim());
                let moment = clock.moment(cell, zone)?;
                self.is_zone_missing = !moment.has_zone;
                Some(self.doubts.settle(&moment))
            }
        }
    }

    /// The note that the zone was assumed; given once.
    pub(super) fn note(&mut self, zone: &Zone) -> Option<String> {
        let is_new = self.is_zone_missing && !zone.is_given && !self.has_told_zone;
        self.has_told_zone |= is_new;
        is_new.then(|| "its times name no zone and are taken for UTC; --time-zone says another".to_owned())
    }

    /// The assumptions about times that a clock showed twice, or never.
    pub(super) fn doubts(&self) -> Vec<String> {
        self.doubts.notes()
    }
}

fn number(value: Value<'_>, step: Span) -> Option<Time> {
    match value {
        Value::Whole(whole) => whole.checked_mul(step.0).map(Time),
        Value::Number(number) => within(number, step).or_else(|| decimal(&number.to_string(), step)),
        Value::Text(text) => decimal(text, step),
        Value::Missing | Value::List(_) | Value::Interval(..) => None,
    }
}

/// What the digits of a number in seconds say, without writing them, where they end by the sixth place behind the point: an epoch in
/// nanoseconds does not fit a float, but one in microseconds does.
#[inline]
fn within(number: f64, step: Span) -> Option<Time> {
    // Above, more than one number of six places may stand for the same float.
    const LARGEST: f64 = 4e9;
    let micros = number * 1e6;
    // Rounded by hand, which is quicker; what is rounded wrongly is not exact.
    let micros = (micros + 0.5_f64.copysign(micros)) as i64;
    let is_exact = step == SECOND && number.abs() < LARGEST && micros as f64 / 1e6 == number;
    is_exact.then(|| Time(micros * 1_000))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_are_what_their_digits_say() {
        for number in
            [0.0, -0.5, 1_714_564_800.123, 1_714_564_800.123_456, 1e-6, 3_999_999_999.999_999, 12.25]
        {
            let digits = decimal(&number.to_string(), SECOND);
            assert_eq!(within(number, SECOND), digits, "{number}");
        }
        for number in [1e-7, 0.123_456_7, 4e9, f64::NAN, f64::INFINITY] {
            assert_eq!(within(number, SECOND), None, "{number}");
        }
        assert_eq!(within(1.0, Span::from_millis(1)), None);
    }
}
