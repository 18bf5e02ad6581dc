//! The times of a table's rows: a number, a text, or a date whose parts are in several columns.

use super::layout::{Layout, is_number};
use crate::names::{self, Fit};
use crate::stamp;
use crate::{ReadOptions, Zone};
use shsa_core::time::{Span, Time};
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
pub(crate) enum Clock {
    /// A number in a column, with the length of one step.
    Number(usize, Span),
    /// A date and a time of day in a column.
    Text(usize, DateOrder),
    /// A date in one column, a time of day in another.
    Apart(usize, usize, DateOrder),
    /// A time of day in a column, without a date.
    OfDay(usize),
    /// A column for each part of the date and the time.
    Parts(Vec<Option<usize>>),
}

/// A clock, and the assumption by which it was found.
pub(crate) struct Found {
    pub(crate) clock: Clock,
    pub(crate) notes: Vec<String>,
}

/// The cells of some rows.
pub(crate) type Cells<'a> = [Vec<&'a str>];

/// Finds the columns with the time, from the header and the first rows.
///
/// # Errors
/// The columns that were looked for.
pub(crate) fn find(layout: &Layout, rows: &Cells<'_>, options: &ReadOptions) -> Result<Found, String> {
    if let Some(name) = &options.time_column
        && let Fit::Column(column) = names::column_of(&layout.headers, name)
    {
        return of_column(layout, rows, column, options);
    }
    if let Some(found) = apart(layout, rows, options) {
        return Ok(found);
    }
    if let Some(parts) = parts(&layout.headers) {
        return Ok(Found { clock: Clock::Parts(parts), notes: Vec::new() });
    }
    let candidates = candidates(layout, rows);
    let advances = |column: &&usize| {
        of_column(layout, rows, **column, options).is_ok_and(|found| found.clock.advances(rows))
    };
    let best = candidates.iter().find(advances).or(candidates.first());
    let Some(column) = best else {
        return Err(match &options.time_column {
            Some(name) => format!("no time column '{name}'"),
            None => "no column looks like the time".into(),
        });
    };
    of_column(layout, rows, *column, options)
}

/// The columns that may be the time: by their names, then by dates with times of day, by dates, then by the letter `t` alone.
fn candidates(layout: &Layout, rows: &Cells<'_>) -> Vec<usize> {
    let is_other = |column: &usize| layout.unit(*column).is_some_and(|unit| stamp::is_no_time(&unit));
    let named = stamp::time_columns(&layout.headers).into_iter().filter(|column| !is_other(column));
    let is_letter = |column: &usize| {
        let has_unit = layout.unit(*column).is_some();
        !has_unit && layout.headers.get(*column).is_some_and(|header| stamp::is_letter(header))
    };
    let (letters, named): (Vec<usize>, Vec<usize>) = named.partition(is_letter);
    let are_dates = |column: &usize| {
        let mut cells = rows.iter().take(3).filter_map(|row| row.get(*column)).peekable();
        cells.peek().is_some() && cells.all(|cell| !is_number(cell) && order_of(&[cell], None).is_some())
    };
    let has_clock = |column: &usize| {
        rows.iter().take(3).all(|row| row.get(*column).is_some_and(|cell| cell.contains(':')))
    };
    let unnamed = (0..layout.headers.len()).filter(|column| !named.contains(column)).filter(are_dates);
    let (moments, days): (Vec<usize>, Vec<usize>) = unnamed.partition(has_clock);
    named.iter().copied().chain(moments).chain(days).chain(letters).collect()
}

fn of_column(
    layout: &Layout,
    rows: &Cells<'_>,
    column: usize,
    options: &ReadOptions,
) -> Result<Found, String> {
    let scale = options.time_scale;
    let header = layout.headers.get(column).map_or("", String::as_str);
    let texts: Vec<&str> = rows.iter().filter_map(|row| row.get(column).copied()).collect();
    let mut filled = texts.iter().copied().filter(|text| !text.is_empty());
    let number = filled.clone().find(|text| is_number(text));
    let first = number.or_else(|| filled.next()).unwrap_or("");
    // Digits alone may be a number of microseconds: where all of them are dates and times of day, that is the likelier meaning.
    let has_unit = scale.is_some() || stamp::unit_of(header).is_some();
    let are_compact = !has_unit && texts.iter().filter(|text| !text.is_empty()).all(|text| is_compact(text));
    if first.parse::<f64>().is_err() || !first.is_empty() && are_compact {
        if let Some((order, note)) = order_of(&texts, options.date_order) {
            return Ok(Found { clock: Clock::Text(column, order), notes: note.into_iter().collect() });
        }
        if is_time_of_day(first) {
            let note =
                format!("column '{header}' has times of day without a date: they count from 1970-01-01");
            return Ok(Found { clock: Clock::OfDay(column), notes: vec![note] });
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
pub(crate) fn may_be_apart(headers: &[String]) -> bool {
    named_apart(headers).is_some()
}

/// A date and a time of day side by side.
fn apart(layout: &Layout, rows: &Cells<'_>, options: &ReadOptions) -> Option<Found> {
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
    let (order, note) =
        order_of(&texts, options.date_order).or_else(|| order_of(&dates, options.date_order))?;
    Some(Found { clock: Clock::Apart(date, clock, order), notes: note.into_iter().collect() })
}

fn parts(headers: &[String]) -> Option<Vec<Option<usize>>> {
    let column = |names: &&[&str]| headers.iter().position(|header| names.contains(&header.as_str()));
    let columns: Vec<Option<usize>> = PARTS.iter().map(column).collect();
    columns.iter().take(4).all(Option::is_some).then_some(columns)
}

/// The order of the dates in these texts: one in which the most texts are dates, and at least half of them; among several such
/// orders the given one, else the one with the shortest span.
fn order_of(texts: &[&str], given: Option<DateOrder>) -> Option<(DateOrder, Option<String>)> {
    let filled: Vec<&str> = texts.iter().copied().filter(|text| !text.is_empty()).collect();
    let fitting: Vec<((usize, i64), DateOrder)> =
        DateOrder::ALL.into_iter().filter_map(|order| Some((fit(&filled, order)?, order))).collect();
    let (least, order) = *fitting.iter().min_by_key(|(fit, _)| *fit)?;
    let is_as_good = |it: &&((usize, i64), DateOrder)| Some(it.1) == given && it.0.0 == least.0;
    if let Some((_, given)) = fitting.iter().find(is_as_good) {
        return Some((*given, None));
    }
    let is_open = fitting.iter().filter(|(fit, _)| *fit == least).count() > 1;
    let note = is_open.then(|| {
        "dates are read as day, month, year; nothing tells whether the month comes first (--date-order)"
            .to_owned()
    });
    Some((order, note))
}

/// The number of texts that are no dates in an order, and the span of the others; `None` where most are none.
fn fit(texts: &[&str], order: DateOrder) -> Option<(usize, i64)> {
    let time = |text: &&str| moment(text, order, &Zone::default()).map(|moment| moment.time.0);
    let times: Vec<i64> = texts.iter().filter_map(time).collect();
    let span = times.iter().max()?.saturating_sub(*times.iter().min()?);
    (2 * times.len() >= texts.len()).then(|| (texts.len() - times.len(), span))
}

/// The order of days and months in all dates of some texts: the one in which more of them are dates, else the one with the shorter
/// span; `None` where both fit alike.
pub(crate) fn order_of_all(texts: &[String]) -> Option<DateOrder> {
    let orders = [DateOrder::DayMonthYear, DateOrder::MonthDayYear];
    let is_date = |text: &&str| orders.iter().any(|order| moment(text, *order, &Zone::default()).is_some());
    let dates: Vec<&str> = texts.iter().map(String::as_str).filter(is_date).collect();
    let fits = orders.map(|order| fit(&dates, order));
    match fits {
        [Some(day), Some(month)] if day == month => None,
        [Some(day), Some(month)] => Some(if day < month { orders[0] } else { orders[1] }),
        [day, month] => day.map(|_| orders[0]).or(month.map(|_| orders[1])),
    }
}

/// The largest share of rows that may be before the row above, where another column behaves better: the values of what is no clock
/// go back in half of the rows.
const MOST_BACK: f64 = 0.1;

impl Clock {
    /// The time of a row, from the texts of its cells without blanks around them; `None` where they have none.
    pub(crate) fn moment<'c>(&self, cell: impl Fn(usize) -> Option<&'c str>, zone: &Zone) -> Option<Moment> {
        match self {
            Clock::Number(column, scale) => {
                decimal(cell(*column)?, *scale).map(|time| Moment { time, has_zone: true, doubt: None })
            }
            Clock::Text(column, order) => moment(cell(*column)?, *order, zone),
            Clock::OfDay(column) => moment_of("1970-01-01", cell(*column)?, DateOrder::YearMonthDay, zone),
            Clock::Apart(date, clock, order) => moment_of(cell(*date)?, cell(*clock)?, *order, zone),
            Clock::Parts(columns) => of_parts(columns, cell, zone),
        }
    }

    /// Whether the times of some rows advance, and seldom go back; of fewer than two rows nothing is known, and it is taken to.
    fn advances(&self, rows: &Cells<'_>) -> bool {
        let time = |row: &Vec<&str>| {
            let moment =
                self.moment(|at| row.get(at).copied().filter(|cell| !cell.is_empty()), &Zone::default());
            moment.map(|moment| moment.time)
        };
        let times: Vec<Time> = rows.iter().filter_map(time).collect();
        let steps = times.windows(2);
        let back = steps.clone().filter(|pair| pair[1] < pair[0]).count();
        let is_clock =
            steps.clone().any(|pair| pair[0] < pair[1]) && back as f64 <= MOST_BACK * steps.len() as f64;
        rows.len() < 2 || is_clock && 2 * times.len() >= rows.len()
    }

    /// Whether its times of day have no date.
    pub(crate) fn is_of_day(&self) -> bool {
        matches!(self, Clock::OfDay(_))
    }

    /// The text of a row in the place of its time.
    pub(super) fn text<'c>(&self, cell: impl Fn(usize) -> Option<&'c str>) -> String {
        let cells: Vec<&str> = self.columns().into_iter().filter_map(cell).collect();
        cells.join(" ").trim().chars().take(40).collect()
    }

    /// The columns with the parts of the time.
    pub(crate) fn columns(&self) -> Vec<usize> {
        match self {
            Clock::Number(column, _) | Clock::Text(column, _) | Clock::OfDay(column) => vec![*column],
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
