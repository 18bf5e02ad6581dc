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
mod pages;
mod clock;

use super::files::without_packing;
use super::topic::{Body, Field, Fields, Input, Listener, Times, Topic, TopicId, Value};
use super::{Place, ReadOptions, RecordingError, stamp};
use cells::Cell;
use clock::Clock;
use description::{Column, Description, Group, Meaning};
use pages::{Entry, Pages};
use shsa_core::time::Time;
use source::{Source, bytes_at};
use std::io::{self, SeekFrom};

/// The first and the last bytes.
pub(super) const MAGIC: &[u8] = b"PAR1";

/// The longest description that is read, bytes.
const DESCRIPTION_MAX: u64 = 1 << 28;

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
    let found =
        first_rows(&mut Source::new(input, length), &description, &clock::candidates(&description, options))
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

/// The first rows that may have a time, as texts, to find it.
fn first_rows(
    source: &mut Source<'_>,
    description: &Description,
    clocks: &[usize],
) -> io::Result<Vec<Vec<String>>> {
    let Some(group) = description.groups.iter().find(|group| group.rows > 0) else { return Ok(Vec::new()) };
    let mut columns = Columns::new(description, group, |_| true);
    let mut rows = Vec::new();
    for _ in 0..group.rows.min(clock::ROWS_LOOKED_AT) {
        columns.turn(source)?;
        let is_empty = |at: &usize| matches!(columns.value(*at), Value::Missing);
        if !clocks.is_empty() && clocks.iter().all(is_empty) {
            continue;
        }
        rows.push((0..description.columns.len()).map(|at| columns.shown(at)).collect());
        if rows.len() == clock::ROWS {
            break;
        }
    }
    Ok(rows)
}

/// The columns of a row group, side by side.
struct Columns<'d> {
    pages: Vec<Option<Pages<'d>>>,
    /// The entry of each column for the current row.
    row: Vec<Entry>,
}

impl<'d> Columns<'d> {
    fn new(description: &'d Description, group: &Group, is_wanted: impl Fn(usize) -> bool) -> Columns<'d> {
        let pages = |(at, chunk): (usize, &Option<description::Chunk>)| {
            let column = description.columns.get(at).filter(|_| is_wanted(at))?;
            Some(Pages::new(column, (*chunk)?))
        };
        let pages: Vec<Option<Pages<'d>>> = group.chunks.iter().enumerate().map(pages).collect();
        Columns { row: vec![Entry::Cell(Cell::Missing); pages.len()], pages }
    }

    /// Goes to the next row; returns whether any column has an entry for it.
    fn turn(&mut self, source: &mut Source<'_>) -> io::Result<bool> {
        // A row takes a step for each column, whether that is read or not.
        source.take(self.row.len())?;
        let mut is_any = false;
        for (entry, pages) in self.row.iter_mut().zip(&mut self.pages) {
            let Some(pages) = pages else { continue };
            let next = pages.entry(source)?;
            is_any |= next.is_some();
            *entry = next.unwrap_or(Entry::Cell(Cell::Missing));
        }
        Ok(is_any)
    }

    fn value(&self, at: usize) -> Value<'_> {
        match self.row.get(at) {
            Some(Entry::List(list)) => Value::List(list),
            Some(Entry::Cell(Cell::Number(number))) => Value::Number(*number),
            Some(Entry::Cell(Cell::Whole(whole))) => Value::Whole(*whole),
            Some(Entry::Cell(Cell::Text(number))) => {
                let text = self.pages.get(at).and_then(|pages| pages.as_ref()?.text(*number));
                text.map_or(Value::Missing, Value::Text)
            }
            Some(Entry::Cell(Cell::Missing)) | None => Value::Missing,
        }
    }

    fn shown(&self, at: usize) -> String {
        match self.value(at) {
            Value::Number(number) => number.to_string(),
            Value::Whole(whole) => whole.to_string(),
            Value::Text(text) => text.to_owned(),
            Value::Missing | Value::List(_) | Value::Interval(..) => String::new(),
        }
    }

    fn report_damages(&mut self, listener: &mut dyn Listener) {
        let all: Vec<(u64, String)> =
            self.pages.iter_mut().flatten().flat_map(|it| it.damages.drain(..)).collect();
        let more = all.len().saturating_sub(DAMAGES_MAX);
        for (at, problem) in all.into_iter().take(DAMAGES_MAX) {
            listener.damaged(Place::Offset(at), problem);
        }
        if more > 0 {
            listener.damaged(Place::Whole, format!("{more} more places are damaged"));
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
            let values: Vec<Value<'_>> = (0..columns.row.len()).map(|at| columns.value(at)).collect();
            listener.message(self.topic, Times::at(time.unwrap_or(self.last)), Body::Values(&values));
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
