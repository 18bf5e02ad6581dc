//! The times of a table's rows: a number, a text, or a date whose parts are in several columns.

use super::layout::{Layout, is_number};
use crate::recording::names::{self, Fit};
use crate::recording::stamp;
use crate::recording::{ReadOptions, Zone};
use shsa_core::time::Span;
use shsa_message::moment::{DateOrder, Moment, is_compact, is_date, is_time_of_day, moment, moment_of};
use shsa_message::stamp::{civil, decimal, likely_step};

const SECOND: i64 = 1_000_000_000;

/// The names of the parts of a date and a time, from the year to the second; case matters.
const PARTS: [&[&str]; 6] = [
    &["YY", "YYYY", "year", "Year"],
    &["MM", "month", "Month"],
    &["DD", "day", "Day"],
    &["hh", "HH", "hour", "Hour"],
    &["mm", "minute", "Minute"],
    &["ss", "second", "Second"],
];

/// The place of the time in the rows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::recording) enum Clock {
    /// A number in a column, with the length of one step.
    Number(usize, Span),
    /// A date and a time of day in a column.
    Text(usize, DateOrder),
    /// A date in one column, a time of day in another.
    Apart(usize, usize, DateOrder),
    /// A column for each part of the date and the time.
    Parts(Vec<Option<usize>>),
}

/// A clock, and the assumption by which it was found.
pub(in crate::recording) struct Found {
    pub(in crate::recording) clock: Clock,
    pub(in crate::recording) notes: Vec<String>,
}

/// The cells of some rows.
pub(in crate::recording) type Cells<'a> = [Vec<&'a str>];

/// Finds the columns with the time, from the header and the first rows.
///
/// # Errors
/// The columns that were looked for.
pub(in crate::recording) fn find(
    layout: &Layout,
    rows: &Cells<'_>,
    options: &ReadOptions,
) -> Result<Found, String> {
    let scale = options.time_scale;
    if let Some(name) = &options.time_column
        && let Fit::Column(column) = names::column_of(&layout.headers, name)
    {
        return of_column(layout, rows, column, scale);
    }
    if let Some(found) = apart(layout, rows) {
        return Ok(found);
    }
    if let Some(parts) = parts(&layout.headers) {
        return Ok(Found { clock: Clock::Parts(parts), notes: Vec::new() });
    }
    if let Some(column) = stamp::time_column(&layout.headers) {
        return of_column(layout, rows, column, scale);
    }
    let is_moment = |column: &usize| {
        let mut cells = rows.iter().take(3).filter_map(|row| row.get(*column)).peekable();
        cells.peek().is_some() && cells.all(|cell| cell.contains(':') && order_of(&[cell]).is_some())
    };
    let Some(column) = (0..layout.headers.len()).find(is_moment) else {
        return Err(match &options.time_column {
            Some(name) => format!("no time column '{name}'"),
            None => "no column looks like the time".into(),
        });
    };
    of_column(layout, rows, column, scale)
}

fn of_column(layout: &Layout, rows: &Cells<'_>, column: usize, scale: Option<Span>) -> Result<Found, String> {
    let header = layout.headers.get(column).map_or("", String::as_str);
    let texts: Vec<&str> = rows.iter().filter_map(|row| row.get(column).copied()).collect();
    let mut filled = texts.iter().copied().filter(|text| !text.is_empty());
    let number = filled.clone().find(|text| is_number(text));
    let first = number.or_else(|| filled.next()).unwrap_or("");
    // Digits alone may be a number of microseconds: where all of them are dates and times of day, that is the likelier meaning.
    let has_unit = scale.is_some() || stamp::unit_of(header).is_some();
    let are_compact = !has_unit && texts.iter().filter(|text| !text.is_empty()).all(|text| is_compact(text));
    if first.parse::<f64>().is_err() || !first.is_empty() && are_compact {
        if let Some((order, note)) = order_of(&texts) {
            return Ok(Found { clock: Clock::Text(column, order), notes: note.into_iter().collect() });
        }
        if is_time_of_day(first) {
            return Err(format!("column '{header}' holds times of day without a date ('{first}')"));
        }
        if !first.is_empty() && number.is_none() {
            return Err(format!(
                "column '{header}' holds neither numbers nor dates in a known form ('{first}')"
            ));
        }
    }
    let stated = scale.or_else(|| stamp::unit_of(header)).or_else(|| {
        let unit = layout.units.get(column)?.as_deref()?;
        shsa_message::span::time_unit(unit)
    });
    let mut notes = Vec::new();
    let scale = stated.unwrap_or_else(|| {
        let step = likely_step(first.parse::<f64>().unwrap_or(0.0).abs() as u64);
        if !first.is_empty() {
            notes.push(format!(
                "column '{header}' names no unit of time; one step is taken as {} s (to say it: @{header}*SPAN)",
                step.seconds()
            ));
        }
        step
    });
    Ok(Found { clock: Clock::Number(column, scale), notes })
}

/// The columns whose names are those of a date and of a time of day.
fn named_apart(headers: &[String]) -> Option<(usize, usize)> {
    let named = |names: &[&str]| {
        headers.iter().position(|header| {
            let name = stamp::split_unit(header).0.to_lowercase();
            names.contains(&name.as_str())
        })
    };
    Some((named(&["date", "datum", "day"])?, named(&["time", "uhrzeit", "zeit", "clock", "hour"])?))
}

/// Whether columns with these names may be a date and a time of day side by side.
pub(in crate::recording) fn may_be_apart(headers: &[String]) -> bool {
    named_apart(headers).is_some()
}

/// A date and a time of day side by side.
fn apart(layout: &Layout, rows: &Cells<'_>) -> Option<Found> {
    let row = rows.iter().find(|row| row.iter().any(|cell| !cell.is_empty()))?;
    let (date, clock) = named_apart(&layout.headers)?;
    let is = |column: usize, is: fn(&str) -> bool| row.get(column).is_some_and(|cell| is(cell));
    if !is(date, is_date) || !is(clock, is_time_of_day) {
        return None;
    }
    let texts: Vec<String> = rows
        .iter()
        .filter_map(|row| Some(format!("{} {}", row.get(date)?, row.get(clock)?)))
        .filter(|text| !text.trim().is_empty())
        .collect();
    let texts: Vec<&str> = texts.iter().map(String::as_str).collect();
    // Times of day with dots are parsed with their dates only.
    let dates: Vec<&str> = texts.iter().filter_map(|text| Some(text.split_once(' ')?.0)).collect();
    let (order, note) = order_of(&texts).or_else(|| order_of(&dates))?;
    Some(Found { clock: Clock::Apart(date, clock, order), notes: note.into_iter().collect() })
}

fn parts(headers: &[String]) -> Option<Vec<Option<usize>>> {
    let column = |names: &&[&str]| headers.iter().position(|header| names.contains(&header.as_str()));
    let columns: Vec<Option<usize>> = PARTS.iter().map(column).collect();
    columns.iter().take(4).all(Option::is_some).then_some(columns)
}

/// The order of the dates in these texts: one in which the most texts are dates, and at least half of them; among several such
/// orders the one with the shortest span.
fn order_of(texts: &[&str]) -> Option<(DateOrder, Option<String>)> {
    let filled: Vec<&str> = texts.iter().copied().filter(|text| !text.is_empty()).collect();
    // The number of texts that are no dates, and the span of the others.
    let span = |order: DateOrder| -> Option<(usize, i64)> {
        let time = |text: &&str| moment(text, order, &Zone::default()).map(|moment| moment.time.0);
        let times: Vec<i64> = filled.iter().filter_map(time).collect();
        let span = times.iter().max()?.saturating_sub(*times.iter().min()?);
        (2 * times.len() >= filled.len()).then(|| (filled.len() - times.len(), span))
    };
    let fitting: Vec<((usize, i64), DateOrder)> =
        DateOrder::ALL.into_iter().filter_map(|order| Some((span(order)?, order))).collect();
    let (least, order) = *fitting.iter().min_by_key(|(span, _)| *span)?;
    let is_open = fitting.iter().filter(|(span, _)| *span == least).count() > 1;
    let note = is_open.then(|| {
        "dates are read as day, month, year; nothing tells whether the month comes first".to_owned()
    });
    Some((order, note))
}

impl Clock {
    /// The time of a row, from the texts of its cells without blanks around them; `None` where they have none.
    pub(in crate::recording) fn moment<'c>(
        &self,
        cell: impl Fn(usize) -> Option<&'c str>,
        zone: &Zone,
    ) -> Option<Moment> {
        match self {
            Clock::Number(column, scale) => {
                decimal(cell(*column)?, *scale).map(|time| Moment { time, has_zone: true, doubt: None })
            }
            Clock::Text(column, order) => moment(cell(*column)?, *order, zone),
            Clock::Apart(date, clock, order) => moment_of(cell(*date)?, cell(*clock)?, *order, zone),
            Clock::Parts(columns) => of_parts(columns, cell, zone),
        }
    }

    /// The text of a row in the place of its time.
    pub(super) fn text<'c>(&self, cell: impl Fn(usize) -> Option<&'c str>) -> String {
        let cells: Vec<&str> = self.columns().into_iter().filter_map(cell).collect();
        cells.join(" ").trim().chars().take(40).collect()
    }

    /// The columns with the parts of the time.
    pub(in crate::recording) fn columns(&self) -> Vec<usize> {
        match self {
            Clock::Number(column, _) | Clock::Text(column, _) => vec![*column],
            Clock::Apart(date, clock, _) => vec![*date, *clock],
            Clock::Parts(columns) => columns.iter().flatten().copied().collect(),
        }
    }
}

/// The whole number of a part of a date or a time.
fn part(text: &str) -> Option<i64> {
    let digit = |byte: u8| byte.is_ascii_digit().then(|| i64::from(byte - b'0'));
    let digits = || text.bytes().try_fold(0, |number, byte| Some(10 * number + digit(byte)?));
    let short = if (1..=4).contains(&text.len()) { digits() } else { None };
    short.or_else(|| decimal(text, Span(SECOND)).map(|time| time.seconds() as i64))
}

fn of_parts<'c>(
    columns: &[Option<usize>],
    cell: impl Fn(usize) -> Option<&'c str>,
    zone: &Zone,
) -> Option<Moment> {
    let mut numbers = [0; 6];
    for (number, column) in numbers.iter_mut().zip(columns) {
        if let Some(column) = column {
            *number = part(cell(*column)?)?;
        }
    }
    let [year, month, day, hour, minute, second] = numbers;
    let year = if year < 69 {
        2000 + year
    } else if year < 100 {
        1900 + year
    } else {
        year
    };
    let is_time = (0..24).contains(&hour) && (0..60).contains(&minute) && (0..=60).contains(&second);
    let of_day = (hour * 3_600 + minute * 60 + second) * SECOND;
    civil(year, month, day, of_day).filter(|_| is_time).map(|shown| Moment::shown(shown, zone))
}
