//! Apache Parquet: a table whose columns are stored separately, compressed, in row groups; the description is at the end.
//!
//! `description (columns, row groups) -> pages of each column, side by side -> rows -> clock (times) -> messages of one topic`
//!
//! Format: <https://parquet.apache.org/docs/file-format/>. Each column is read a page at a time, so that memory does not grow
//! with the file, and within the budget of the file ([`Source`]). Only the values of a damaged page are lost. A file without its description cannot be read.

mod bytes;
mod thrift;
mod description;
mod cells;
mod snappy;
mod lz4;
mod encoding;
mod source;
mod head;
mod page;
mod pages;
mod clock;

use super::files::without_packing;
use super::topic::{
    self, Body, Field, Fields, Input, Listener, Row, Rows as _, Times, Topic, TopicId, Value,
};
use super::{Place, ReadOptions, RecordingError, stamp};
use cells::Cell;
use clock::Clock;
use description::{Column, Description, Group, Meaning};
use pages::Pages;
use shsa_core::time::Time;
use source::{AT_ONCE, Source, bytes_at};
use std::borrow::Cow;
use std::io::{self, SeekFrom};

/// The first and the last bytes.
pub(super) const MAGIC: &[u8] = b"PAR1";

/// The longest description that is read, bytes.
const DESCRIPTION_MAX: u64 = 1 << 28;

/// What may be read ahead of all columns together, bytes.
const AHEAD: u64 = 1 << 22;

/// The most rows that are taken at once, and the most cells of them together.
const ROWS_MAX: usize = 1 << 10;
const CELLS_MAX: usize = 1 << 16;

/// The most damages of a row group that are reported.
const DAMAGES_MAX: usize = 20;

/// Reports the rows of a table.
pub(super) fn read(
    input: &mut dyn Input,
    options: &ReadOptions,
    listener: &mut dyn Listener,
) -> Result<(), RecordingError> {
    let (description, length) = match described(input) {
        Ok(found) => found,
        Err((place, problem)) => {
            listener.damaged(place, problem);
            return Ok(());
        }
    };
    let file = listener.file().to_path_buf();
    let name = without_packing(&file).file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let headers = clock::headers(&description);
    let fields = Fields::named(description.columns.iter().map(field));
    let topic = listener.topic(Topic::new(&name, &headers.join(", "), fields));
    if !listener.is_wanted(topic) {
        return Ok(());
    }
    let mut table = Table {
        description: &description,
        topic,
        count: 0,
        last: Time(0),
        clock: None,
        options,
        times: Vec::new(),
        undated: Vec::new(),
    };
    let found = first_rows(&mut Source::new(input, length), &description, options)
        .map(|rows| clock::find(&description, &rows, options));
    match found {
        Err(problem) => {
            listener.damaged(Place::Whole, format!("cannot be read: {problem}"));
            return Ok(());
        }
        Ok(Ok(found)) => {
            found.notes.into_iter().for_each(|note| listener.note(Place::Whole, note));
            listener.clock(topic, &found.clock.columns());
            table.clock = Some(found.clock);
        }
        Ok(Err(problem)) if listener.needs_time(topic) => {
            return Err(RecordingError::NoTime { file, problem, columns: headers });
        }
        Ok(Err(problem)) => listener.untimed(topic, problem),
    }
    let mut source = Source::new(input, length);
    for group in &description.groups {
        if let Err(problem) = table.group(group, &mut source, listener) {
            listener.damaged(Place::Whole, format!("cannot be read on: {problem}"));
            break;
        }
    }
    let doubts = table.clock.map(|clock| clock.doubts()).unwrap_or_default();
    doubts.into_iter().for_each(|note| listener.note(Place::Whole, note));
    Ok(())
}

fn field(column: &Column) -> Field {
    let unit = match column.meaning {
        Meaning::Moment { .. } => Some("ns".to_owned()),
        _ => stamp::split_unit(&column.name).1.map(str::to_owned),
    };
    Field { name: column.name.clone(), unit }
}

/// The description at the end of a file and the length of the file, or the problem with it and its place.
fn described(input: &mut dyn Input) -> Result<(Description, u64), (Place, String)> {
    let failed = |problem: io::Error| (Place::Whole, problem.to_string());
    let length = input.seek(SeekFrom::End(0)).map_err(failed)?;
    let begin = length.saturating_sub(8);
    let tail = bytes_at(input, begin, 8).map_err(failed)?;
    let lost = "the description of its columns, which stands at the end, is missing: nothing can be read";
    let Some((size, MAGIC)) = tail.split_first_chunk::<4>() else {
        return Err((Place::Offset(length), lost.into()));
    };
    let size = u64::from(u32::from_le_bytes(*size));
    let at = begin.checked_sub(size).filter(|_| size <= DESCRIPTION_MAX);
    let at = at.ok_or_else(|| (Place::Offset(begin), lost.to_owned()))?;
    let described = bytes_at(input, at, size).map_err(failed)?;
    let unknown =
        || (Place::Offset(at), "the description of its columns cannot be read: nothing can be read".into());
    Ok((Description::read(&described).ok_or_else(unknown)?, length))
}

/// The first rows that may have a time, as texts, to find it; none where the description tells it.
fn first_rows(
    source: &mut Source<'_>,
    description: &Description,
    options: &ReadOptions,
) -> io::Result<Vec<Vec<String>>> {
    let deciding = clock::deciding(description, options);
    let group = description.groups.iter().find(|group| group.rows > 0 && !deciding.is_empty());
    let Some(group) = group else { return Ok(Vec::new()) };
    let clocks = clock::candidates(description, options);
    let mut columns = Columns::new(description, group, |at| deciding.contains(&at));
    let mut rows = Vec::new();
    for _ in 0..group.rows.min(clock::ROWS_LOOKED_AT) {
        columns.turn(source, 1)?;
        let is_empty = |at: &usize| matches!(columns.value(0, *at), Value::Missing);
        if !clocks.is_empty() && clocks.iter().all(is_empty) {
            continue;
        }
        rows.push((0..description.columns.len()).map(|at| columns.shown(0, at).into_owned()).collect());
        if rows.len() == clock::ROWS {
            break;
        }
    }
    Ok(rows)
}

/// The columns of a row group, side by side.
struct Columns<'d> {
    /// Those that are read.
    read: Vec<Reading<'d>>,
    /// For each column, its place among those that are read.
    places: Vec<Option<usize>>,
}

/// A column that is read.
struct Reading<'d> {
    pages: Pages<'d>,
    /// What the current rows have.
    cells: Vec<Cell>,
    /// The list that the current row has.
    list: Option<Vec<f64>>,
}

impl<'d> Columns<'d> {
    fn new(description: &'d Description, group: &Group, is_wanted: impl Fn(usize) -> bool) -> Columns<'d> {
        let wanted: Vec<bool> = (0..group.chunks.len()).map(is_wanted).collect();
        let count = wanted.iter().filter(|is_wanted| **is_wanted).count() as u64;
        let ahead = (AHEAD / count.max(1)).min(AT_ONCE);
        let mut columns = Columns { read: Vec::new(), places: vec![None; wanted.len()] };
        for (at, chunk) in group.chunks.iter().enumerate().filter(|(at, _)| wanted.get(*at) == Some(&true)) {
            if let (Some(column), Some(chunk), Some(place)) =
                (description.columns.get(at), chunk, columns.places.get_mut(at))
            {
                *place = Some(columns.read.len());
                let pages = Pages::new(column, *chunk, ahead);
                columns.read.push(Reading { pages, cells: Vec::new(), list: None });
            }
        }
        columns
    }

    fn of(&self, at: usize) -> Option<&Reading<'d>> {
        self.read.get((*self.places.get(at)?)?)
    }

    /// What the current rows have in a column without lists.
    fn cells(&self, at: usize) -> &[Cell] {
        self.of(at).filter(|reading| reading.list.is_none()).map_or(&[], |reading| &reading.cells)
    }

    /// Goes to the next rows, at most so many, up to the end of a page of any column; returns how many there are. A row in which a
    /// column has a list comes alone.
    fn turn(&mut self, source: &mut Source<'_>, most: usize) -> io::Result<usize> {
        // A row takes a step for each column, whether that is read or not.
        let steps = self.places.len();
        source.take(steps)?;
        let (mut most, mut are_any) = (most.min(CELLS_MAX / self.read.len().max(1)), false);
        for Reading { pages, .. } in &mut self.read {
            if pages.more(source)? {
                are_any = true;
                most = most.min(if pages.are_listed() { 1 } else { pages.left() });
            }
        }
        if !are_any {
            most = 1;
        }
        let affordable = source.budget.left() / steps.max(1) as u64;
        let more = most.saturating_sub(1).min(usize::try_from(affordable).unwrap_or(usize::MAX));
        source.take(more * steps)?;
        for reading in &mut self.read {
            reading.turn(source, more + 1)?;
        }
        Ok(if are_any { more + 1 } else { 0 })
    }

    fn shown(&self, row: usize, at: usize) -> Cow<'_, str> {
        match self.value(row, at) {
            Value::Number(number) => number.to_string().into(),
            Value::Whole(whole) => whole.to_string().into(),
            Value::Text(text) => text.into(),
            Value::Missing | Value::List(_) | Value::Interval(..) => "".into(),
        }
    }

    fn report_damages(&mut self, listener: &mut dyn Listener) {
        let all: Vec<(u64, String)> =
            self.read.iter_mut().flat_map(|it| it.pages.damages.drain(..)).collect();
        let more = all.len().saturating_sub(DAMAGES_MAX);
        for (at, problem) in all.into_iter().take(DAMAGES_MAX) {
            listener.damaged(Place::Offset(at), problem);
        }
        if more > 0 {
            listener.damaged(Place::Whole, format!("{more} more places are damaged"));
        }
    }
}

impl Reading<'_> {
    /// Goes to the next so many rows; after the last value they have none.
    fn turn(&mut self, source: &mut Source<'_>, count: usize) -> io::Result<()> {
        self.cells.clear();
        self.list = None;
        match self.pages.left() {
            0 => self.cells.resize(count, Cell::Missing),
            _ if self.pages.are_listed() => self.list = self.pages.list(source, &mut self.cells)?,
            _ => self.pages.pass(count, &mut self.cells),
        }
        Ok(())
    }
}

impl topic::Rows for Columns<'_> {
    fn count(&self) -> usize {
        self.places.len()
    }

    fn value(&self, row: usize, at: usize) -> Value<'_> {
        let Some(Reading { pages, cells, list }) = self.of(at) else { return Value::Missing };
        match (list, cells.get(row)) {
            (Some(list), _) => Value::List(list),
            (None, Some(Cell::Number(number))) => Value::Number(*number),
            (None, Some(Cell::Whole(whole))) => Value::Whole(*whole),
            (None, Some(Cell::Text(number))) => pages.text(*number).map_or(Value::Missing, Value::Text),
            (None, Some(Cell::Missing) | None) => Value::Missing,
        }
    }

    fn numbers(&self, at: usize, to: &mut Vec<Option<f64>>) {
        to.extend(self.cells(at).iter().map(|cell| match cell {
            Cell::Number(number) => Some(*number),
            Cell::Whole(whole) => Some(*whole as f64),
            Cell::Text(_) | Cell::Missing => None,
        }));
    }
}

/// A table whose rows are reported.
struct Table<'a> {
    description: &'a Description,
    topic: TopicId,
    count: i64,
    /// The time of the latest row that has one.
    last: Time,
    clock: Option<Clock>,
    options: &'a ReadOptions,
    /// The times of the current rows; those without one have that of the row above.
    times: Vec<Time>,
    /// The current rows without a time, in their order.
    undated: Vec<usize>,
}

impl Table<'_> {
    /// Reports a row group.
    fn group(
        &mut self,
        group: &Group,
        source: &mut Source<'_>,
        listener: &mut dyn Listener,
    ) -> io::Result<()> {
        let is_read = |at: usize| {
            listener.is_field_wanted(self.topic, at)
                || self.clock.as_ref().is_some_and(|clock| clock.reads(at))
        };
        let needs_time = listener.needs_time(self.topic);
        let mut columns = Columns::new(self.description, group, is_read);
        let (mut rows, mut undated) = (0, 0_u64);
        while rows < group.rows {
            let most = usize::try_from(group.rows - rows).unwrap_or(usize::MAX).min(ROWS_MAX);
            let count = columns.turn(source, most)?;
            if count == 0 {
                break;
            }
            rows += count as u64;
            self.date(&columns, count, listener);
            undated += self.undated.len() as u64;
            self.report(&columns, needs_time, listener);
        }
        columns.report_damages(listener);
        match undated {
            0 => (),
            _ if needs_time => {
                listener.damaged(Place::Whole, format!("{undated} rows have no time; left out"));
            }
            _ => listener.has_undated(Place::Whole, format!("{undated} rows have no time")),
        }
        if rows < group.rows {
            listener.damaged(Place::Whole, format!("{} rows are missing", group.rows - rows));
        }
        Ok(())
    }

    /// Finds the times of the current rows.
    fn date(&mut self, columns: &Columns<'_>, count: usize, listener: &mut dyn Listener) {
        self.times.clear();
        self.undated.clear();
        let Some(clock) = &mut self.clock else {
            self.times.extend((self.count..).take(count).map(Time));
            self.count += count as i64;
            return;
        };
        if clock.moments(columns, count, &mut self.times) {
            self.last = self.times.last().copied().unwrap_or(self.last);
            return;
        }
        for row in 0..count {
            match clock.moment(columns, row, &self.options.zone) {
                Some(time) => {
                    self.last = time;
                    if let Some(note) = clock.note(&self.options.zone) {
                        listener.note(Place::Whole, note);
                    }
                }
                None => self.undated.push(row),
            }
            self.times.push(self.last);
        }
    }

    /// Reports the current rows: all of them, or those that have a time.
    fn report(&self, columns: &Columns<'_>, needs_time: bool, listener: &mut dyn Listener) {
        if self.undated.is_empty() {
            return listener.rows(self.topic, &self.times, columns);
        }
        let mut undated = self.undated.iter().copied().peekable();
        for (at, time) in self.times.iter().enumerate() {
            let is_undated = undated.next_if_eq(&at).is_some();
            if is_undated && needs_time {
                continue;
            }
            if is_undated {
                listener.undated(self.topic);
            }
            let row = Row { rows: columns, at };
            listener.message(self.topic, Times::at(*time), Body::Columns(&row));
        }
    }
}

#[cfg(test)]
mod tests;
