//! Tables of text: a row of names, then a row for each moment.
//!
//! `lines -> layout (separator, names, units) -> rows -> clock (times) -> batch -> rows of one topic, the file's name`

mod cells;
pub(super) mod clock;
pub(super) mod layout;
mod places;
mod line;
mod row;
mod rows;
mod batch;

use super::files::without_packing;
use super::stamp::Doubts;
use super::topic::{Body, Field, Fields, Input, Listener, Times, Topic, TopicId};
use super::{Place, ReadOptions, RecordingError};
use batch::Batch;
use cells::COLUMNS_MAX;
use clock::Clock;
use layout::Layout;
use line::Line;
use row::{Points, Row};
use rows::Rows;
use shsa_core::time::Time;
use std::borrow::Cow;
use std::io::{Read as _, SeekFrom};
use std::path::Path;

/// How many rows decide where the time is.
const ROWS: usize = 100;

/// Reports the rows of a table.
pub(super) fn read(
    input: &mut dyn Input,
    options: &ReadOptions,
    listener: &mut dyn Listener,
) -> Result<(), RecordingError> {
    let file = listener.file().to_path_buf();
    let mut rows = Rows::new(input);
    let Some(layout) = Layout::of(rows.head()) else {
        listener.damaged(Place::Whole, "holds nothing, not even a row of names".into());
        return Ok(());
    };
    expect_names(&layout, &file)?;
    let clock = clock::find(&layout, &first_rows(rows.head(), &layout), options);
    rows.skip(layout.lines);
    let name = without_packing(&file).file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let kind = layout.headers.join(", ");
    let field = |(at, name): (usize, &String)| Field { name: name.clone(), unit: layout.unit(at) };
    let fields = Fields::named(layout.headers.iter().enumerate().map(field));
    let topic = listener.topic(Topic::new(&name, &kind, fields));
    if !listener.is_wanted(topic) {
        return Ok(());
    }
    let clock = match clock {
        Ok(found) => {
            found.notes.into_iter().for_each(|note| listener.note(Place::Whole, note));
            listener.clock(topic, &found.clock.columns());
            Some(found.clock)
        }
        Err(problem) if listener.needs_time(topic) => {
            return Err(match lacks_names(&layout) {
                true => RecordingError::NoHeader { file },
                false => RecordingError::NoTime { file, problem, columns: layout.headers },
            });
        }
        Err(problem) => {
            listener.untimed(topic, problem);
            None
        }
    };
    note_layout(&layout, listener);
    let doubts = Doubts::of_days(clock.as_ref().is_some_and(Clock::is_of_day));
    let mut table = Table {
        batch: Batch::new(layout.headers.len()),
        layout,
        clock,
        options,
        listener,
        topic,
        count: 0,
        last: Time(0),
        has_told_zone: false,
        doubts,
    };
    let is_read = |at: usize| {
        table.listener.is_field_wanted(topic, at)
            || table.clock.as_ref().is_some_and(|clock| clock.columns().contains(&at))
    };
    let read = (0..table.layout.headers.len()).filter(|at| is_read(*at)).collect();
    let mut points = Points::new(&table.layout, read);
    loop {
        let row = rows.row(&table.layout);
        if row.is_none() || !rows.damages.is_empty() || table.batch.is_full() {
            rows.reuse(table.report());
        }
        rows.damages.drain(..).for_each(|(line, problem)| table.listener.damaged(Place::Line(line), problem));
        let Some(row) = row else { break };
        table.take(row, &mut points);
    }
    table.doubts.notes().into_iter().for_each(|note| table.listener.note(Place::Whole, note));
    Ok(())
}

/// Notes what of a table is neither a name nor a value.
fn note_layout(layout: &Layout, listener: &mut dyn Listener) {
    if layout.preamble > 0 {
        listener.note(Place::Whole, format!("the lines before the names are left out: {}", layout.preamble));
    }
    if layout.has_index {
        let note = "rows have one cell more than the header: the first cell is the number of the row";
        listener.note(Place::Whole, note.into());
    }
}

/// How many bytes at the end of a table are looked at for dates.
const TAIL: u64 = 1 << 16;

/// The texts of dates in the first and the last rows of a table; none where it has no times as text.
pub(super) fn dates(input: &mut dyn Input, options: &ReadOptions) -> Vec<String> {
    let mut rows = Rows::new(&mut *input);
    let Some(layout) = Layout::of(rows.head()) else { return Vec::new() };
    let cells = first_rows(rows.head(), &layout);
    let column = match clock::find(&layout, &cells, options).map(|found| found.clock) {
        Ok(Clock::Text(column, _) | Clock::Apart(column, ..)) => column,
        _ => return Vec::new(),
    };
    let mut texts: Vec<String> =
        cells.iter().filter_map(|row| Some((*row.get(column)?).to_owned())).collect();
    drop(rows);
    texts.extend(tail(input).lines().skip(1).filter_map(|line| {
        let cells = layout.separator.split(line).cells()?;
        cells.get(column).map(|cell| cell.trim().to_owned())
    }));
    texts
}

/// The end of a table as text, from within a line; empty where it cannot be read.
fn tail(input: &mut dyn Input) -> String {
    let mut bytes = Vec::new();
    let end = input.seek(SeekFrom::End(0)).unwrap_or(0);
    let read = input.seek(SeekFrom::Start(end.saturating_sub(TAIL)));
    let read = read.and_then(|_| input.take(TAIL).read_to_end(&mut bytes));
    read.map_or(String::new(), |_| String::from_utf8_lossy(&bytes).into_owned())
}

fn expect_names(layout: &Layout, file: &Path) -> Result<(), RecordingError> {
    let is_no_name = |header: &String| header.parse::<f64>().is_ok() || header.starts_with("column ");
    if layout.headers.iter().all(is_no_name) {
        return Err(RecordingError::NoHeader { file: file.into() });
    }
    if layout.headers.len() > COLUMNS_MAX {
        return Err(RecordingError::TooWide { file: file.into(), most: COLUMNS_MAX });
    }
    Ok(())
}

/// Whether most names of a table without a time are numbers: a row in the place of the names.
fn lacks_names(layout: &Layout) -> bool {
    2 * layout.headers.iter().filter(|header| layout::is_number(header)).count() > layout.headers.len()
}

/// The cells of the first rows.
fn first_rows<'a>(head: &'a [Line], layout: &Layout) -> Vec<Vec<&'a str>> {
    let lines = head.iter().skip(layout.lines).filter(|line| !layout::is_comment(&line.text));
    let cells = |line: &'a Line| -> Option<Vec<&'a str>> {
        let cells = layout.separator.split(&line.text).cells()?;
        let borrowed = |cell: Cow<'a, str>| match cell {
            Cow::Borrowed(text) => text.trim(),
            // A quoted cell: the text between its quotes, where it can be borrowed.
            Cow::Owned(text) => {
                line.text.find(&text).and_then(|at| line.text.get(at..at + text.len())).unwrap_or("").trim()
            }
        };
        Some(cells.into_iter().map(borrowed).collect())
    };
    let is_filled = |cells: &Vec<&str>| cells.iter().any(|cell| !cell.is_empty());
    lines.filter_map(cells).filter(is_filled).take(ROWS).collect()
}

/// A table whose rows are reported.
struct Table<'a, 'l> {
    layout: Layout,
    clock: Option<Clock>,
    options: &'a ReadOptions,
    listener: &'l mut dyn Listener,
    topic: TopicId,
    /// Rows that are not reported yet.
    batch: Batch,
    count: i64,
    /// The time of the latest row that has one.
    last: Time,
    has_told_zone: bool,
    doubts: Doubts,
}

impl Table<'_, '_> {
    /// Reports the rows of the batch, and gives them back.
    fn report(&mut self) -> impl Iterator<Item = Line> {
        self.listener.rows(self.topic, &self.batch.times, &self.batch);
        self.batch.drain()
    }

    /// Reports what a part of the file has that is no row of the batch, behind those that are.
    fn aside(&mut self) -> &mut dyn Listener {
        drop(self.report());
        self.listener
    }

    fn take(&mut self, mut line: Line, points: &mut Points) {
        if line.is_placed {
            points.write(&mut line);
        }
        let row = match line.is_placed {
            true => Some(Row::Placed(&line)),
            false => points.copied(&line.text),
        };
        let Some(row) = row.filter(|row| row.fits(&self.layout.headers)) else {
            let problem = match line.is_ended {
                true => format!("the row has not {} cells as the header", self.layout.headers.len()),
                false => "the file ends within this row".into(),
            };
            return self.aside().damaged(Place::Line(line.number), format!("{problem}; row left out"));
        };
        if row.is_blank() {
            return;
        }
        match self.time(&row) {
            Some(time) if line.is_placed => {
                drop(row);
                self.batch.push(line, time);
            }
            Some(time) => {
                let topic = self.topic;
                self.aside().message(topic, Times::at(time), Body::Columns(&row));
            }
            None => self.undated(&row, line.number),
        }
    }

    /// The time of a row; `None` where it is unknown.
    fn time(&mut self, row: &Row<'_>) -> Option<Time> {
        let number = self.count;
        self.count += 1;
        let Some(clock) = &self.clock else { return Some(Time(number)) };
        let moment = clock.moment(|at| row.cell(at), &self.options.zone)?;
        if !moment.has_zone && !self.options.zone.is_given && !self.has_told_zone {
            self.has_told_zone = true;
            let note = "its times name no zone and are taken for UTC; --time-zone says another";
            self.listener.note(Place::Whole, note.into());
        }
        self.last = self.doubts.settle(&moment);
        Some(self.last)
    }

    /// Reports a row without a time.
    fn undated(&mut self, row: &Row<'_>, line: u64) {
        let text = self.clock.as_ref().map(|clock| clock.text(|at| row.cell(at))).unwrap_or_default();
        let (topic, times, needs_time) =
            (self.topic, Times::at(self.last), self.listener.needs_time(self.topic));
        let listener = self.aside();
        if needs_time {
            return listener.damaged(Place::Line(line), format!("'{text}' is no time; row left out"));
        }
        listener.has_undated(Place::Line(line), format!("'{text}' is no time"));
        listener.undated(topic);
        listener.message(topic, times, Body::Columns(row));
    }
}
