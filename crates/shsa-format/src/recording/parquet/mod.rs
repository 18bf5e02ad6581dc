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
mod encoding;
mod source;
mod head;
mod page;
mod pages;
mod clock;

use super::files::without_packing;
use super::topic::{self, Body, Columns as _, Field, Fields, Input, Listener, Times, Topic, TopicId, Value};
use super::{Place, ReadOptions, RecordingError, stamp};
use cells::Cell;
use clock::Clock;
use description::{Column, Description, Group, Meaning};
use pages::{Entry, Pages};
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
    let mut table = Table { description: &description, topic, count: 0, last: Time(0), clock: None, options };
    let found = first_rows(&mut Source::new(input, length), &description, options)
        .map(|rows| clock::find(&description, &rows, options));
    match found {
        Err(problem) => {
            listener.damaged(Place::Whole, format!("cannot be read: {problem}"));
            return Ok(());
        }
        Ok(Ok(found)) => {
            found.notes.into_iter().for_each(|note| listener.note(Place::Whole, note));
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
        columns.turn(source)?;
        let is_empty = |at: &usize| matches!(columns.value(*at), Value::Missing);
        if !clocks.is_empty() && clocks.iter().all(is_empty) {
            continue;
        }
        rows.push((0..description.columns.len()).map(|at| columns.shown(at).into_owned()).collect());
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
    /// The entry for the current row.
    entry: Entry,
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
                let (pages, entry) = (Pages::new(column, *chunk, ahead), Entry::Cell(Cell::Missing));
                columns.read.push(Reading { pages, entry });
            }
        }
        columns
    }

    fn of(&self, at: usize) -> Option<&Reading<'d>> {
        self.read.get((*self.places.get(at)?)?)
    }

    /// Goes to the next row; returns whether any column has an entry for it.
    fn turn(&mut self, source: &mut Source<'_>) -> io::Result<bool> {
        // A row takes a step for each column, whether that is read or not.
        source.take(self.places.len())?;
        let mut is_any = false;
        for Reading { pages, entry } in &mut self.read {
            is_any |= pages.turn(source, entry)?;
        }
        Ok(is_any)
    }

    fn shown(&self, at: usize) -> Cow<'_, str> {
        match self.value(at) {
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

impl topic::Columns for Columns<'_> {
    fn count(&self) -> usize {
        self.places.len()
    }

    fn value(&self, at: usize) -> Value<'_> {
        let Some(Reading { pages, entry }) = self.of(at) else { return Value::Missing };
        match entry {
            Entry::List(list) => Value::List(list),
            Entry::Cell(Cell::Number(number)) => Value::Number(*number),
            Entry::Cell(Cell::Whole(whole)) => Value::Whole(*whole),
            Entry::Cell(Cell::Text(number)) => pages.text(*number).map_or(Value::Missing, Value::Text),
            Entry::Cell(Cell::Missing) => Value::Missing,
        }
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
        while rows < group.rows && columns.turn(source)? {
            rows += 1;
            let time = self.time(&columns, listener);
            if time.is_none() {
                undated += 1;
                if needs_time {
                    continue;
                }
                listener.undated(self.topic);
            }
            listener.message(self.topic, Times::at(time.unwrap_or(self.last)), Body::Columns(&columns));
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

    /// The time of a row; `None` where it is unknown.
    fn time(&mut self, columns: &Columns<'_>, listener: &mut dyn Listener) -> Option<Time> {
        let number = self.count;
        self.count += 1;
        let Some(clock) = &mut self.clock else { return Some(Time(number)) };
        self.last = clock.moment(columns, &self.options.zone)?;
        if let Some(note) = clock.note(&self.options.zone) {
            listener.note(Place::Whole, note);
        }
        Some(self.last)
    }
}

#[cfg(test)]
mod tests;
