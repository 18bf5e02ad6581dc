//! Tables: comma-, semicolon- or tab-separated values with one row of names.
//!
//! Own reader of the lines rather than a crate: after a stray quote, or a row of the wrong length, reading goes on
//! with the very next line, and the number of that line is known.

use std::borrow::Cow;
use std::collections::VecDeque;
use std::io::{BufRead, Read};
use std::path::Path;

use shsa_core::time::{Span, Time};
use shsa_message::path::is_text;
use shsa_message::stamp::{decimal, likely_step};

use super::cells::{COLUMNS_MAX, Split, fits, split};
use super::gathered::Gathered;
use super::line::LINE_MAX;
use super::names::{self, Fit};
use super::stamp;
use super::{Place, RawValue, ReadOptions, RecordingError, TopicInfo, Want};

/// A quoted cell may go over so many lines.
const LINES_IN_QUOTES: usize = 16;
/// The most bytes of the lines that a quoted cell holds together.
const QUOTED_MAX: usize = 1 << 20;

/// One line of a file, or several that quotes hold together.
struct Line {
    number: u64,
    text: String,
    is_ended: bool,
}

/// A table being read.
struct Table<R> {
    input: R,
    headers: Vec<String>,
    separator: char,
    lines_read: u64,
    pending: VecDeque<Line>,
    failure: Option<String>,
}

impl<R: BufRead> Table<R> {
    /// Reads the row of names; `None` when there is none.
    fn open(input: R) -> Option<Table<R>> {
        let pending = VecDeque::new();
        let mut table =
            Table { input, headers: Vec::new(), separator: ',', lines_read: 0, pending, failure: None };
        let mut header = table.line()?;
        while header.text.trim().is_empty() {
            header = table.line()?;
        }
        let text = header.text.trim_start_matches('\u{feff}');
        let count = |separator: char| text.matches(separator).count();
        table.separator = [',', ';', '\t'].into_iter().rev().max_by_key(|c| count(*c)).unwrap_or(',');
        let cells = split(text, table.separator).cells().unwrap_or_default();
        table.headers = cells.iter().map(|cell| cell.trim().to_owned()).collect();
        Some(table)
    }

    /// The next line of the file; bytes that are no UTF-8 are replaced.
    fn line(&mut self) -> Option<Line> {
        if let Some(line) = self.pending.pop_front() {
            return Some(line);
        }
        let mut bytes = Vec::new();
        match self.input.by_ref().take(LINE_MAX).read_until(b'\n', &mut bytes) {
            Err(failure) => self.failure = Some(failure.to_string()),
            Ok(length) if length as u64 == LINE_MAX => {
                self.failure = Some(format!("a line is longer than {} MiB", LINE_MAX >> 20));
            }
            Ok(_) if bytes.is_empty() => {}
            Ok(_) => {
                self.lines_read += 1;
                let is_ended = bytes.ends_with(b"\n");
                let text = String::from_utf8_lossy(&bytes).trim_end_matches(['\n', '\r']).to_owned();
                return Some(Line { number: self.lines_read, text, is_ended });
            }
        }
        None
    }

    /// The next row that is not blank. Lines are joined only where that makes a whole row.
    fn row(&mut self) -> Option<Line> {
        let mut first = self.line()?;
        while first.text.trim().is_empty() {
            first = self.line()?;
        }
        let is_open = |text: &str| text.contains('"') && matches!(split(text, self.separator), Split::Open);
        if first.text.len() > QUOTED_MAX || !is_open(&first.text) {
            return Some(first);
        }
        let mut joined = first.text.clone();
        let mut taken: Vec<Line> = Vec::new();
        while taken.len() < LINES_IN_QUOTES {
            let Some(next) = self.line() else { break };
            joined.push('\n');
            joined.push_str(&next.text);
            let (is_ended, may_close) = (next.is_ended, next.text.contains('"'));
            taken.push(next);
            if joined.len() > QUOTED_MAX {
                break;
            }
            if !may_close {
                continue;
            }
            match split(&joined, self.separator) {
                Split::Cells(cells) if fits(&cells, &self.headers) => {
                    return Some(Line { number: first.number, text: joined, is_ended });
                }
                Split::Cells(_) | Split::Broken => break,
                Split::Open => {}
            }
        }
        for line in taken.into_iter().rev() {
            self.pending.push_front(line);
        }
        Some(first)
    }
}

/// Where the rows have their time.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Clock {
    /// `None`: the number of the row.
    column: Option<usize>,
    /// `None`: decided by the first row.
    scale: Option<Span>,
}

/// Where in a row a signal has its value, and which cells must have which value.
#[derive(PartialEq, Eq)]
struct Cells<'a> {
    value: usize,
    filters: Vec<(usize, &'a str)>,
}

/// One wanted signal's way through a row.
struct Column<'a> {
    want: &'a Want<'a>,
    cells: Cells<'a>,
    clock: usize,
    empty: usize,
    not_numbers: usize,
    first_odd: Option<(u64, String)>,
}

/// Reads the signals that ask for this table.
pub(super) fn read(
    input: impl BufRead,
    wants: &[Want<'_>],
    options: &ReadOptions,
    gathered: &mut Gathered,
) -> Result<(), RecordingError> {
    let file = gathered.file().to_path_buf();
    let asked: Vec<&Want<'_>> = wants.iter().filter(|want| want.source.is_of_file(&file)).collect();
    if asked.is_empty() {
        gathered.know(&stem(&file));
        return Ok(());
    }
    let Some(table) = Table::open(input) else {
        gathered.damaged(Place::Whole, "holds nothing, not even a row of names");
        return Ok(());
    };
    gathered.know(&stem(&file));
    expect_names(&table.headers, &file)?;
    let mut clocks = Vec::new();
    let mut columns = Vec::new();
    for want in asked {
        let Some(cells) = locate(want, &table.headers, gathered)? else { continue };
        let clock = clock_of(want, &table.headers, options, &file)?;
        let known = clocks.iter().position(|known| *known == clock);
        let clock = known.unwrap_or_else(|| {
            clocks.push(clock);
            clocks.len() - 1
        });
        gathered.found_in(want.index, table.headers.get(cells.value).map_or("", String::as_str));
        columns.push(Column { want, cells, clock, empty: 0, not_numbers: 0, first_odd: None });
    }
    if !columns.is_empty() {
        Rows { clocks, columns, count: 0 }.read(table, gathered);
    }
    Ok(())
}

fn stem(file: &Path) -> String {
    file.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

fn expect_names(headers: &[String], file: &Path) -> Result<(), RecordingError> {
    let is_number = |header: &String| header.is_empty() || header.parse::<f64>().is_ok();
    if headers.iter().all(is_number) {
        return Err(RecordingError::NoHeader { file: file.into() });
    }
    if headers.len() > COLUMNS_MAX {
        return Err(RecordingError::TooWide { file: file.into(), most: COLUMNS_MAX });
    }
    Ok(())
}

/// The columns of a signal's value and of its filters; `None`, with a warning, when the table lacks one.
fn locate<'a>(
    want: &'a Want<'_>,
    headers: &[String],
    gathered: &mut Gathered,
) -> Result<Option<Cells<'a>>, RecordingError> {
    let Some(value) = column_of(want, &want.source.field, headers, gathered)? else { return Ok(None) };
    let mut filters = Vec::new();
    for (name, value) in &want.source.filters {
        let Some(column) = column_of(want, name, headers, gathered)? else { return Ok(None) };
        filters.push((column, value.as_str()));
    }
    Ok(Some(Cells { value, filters }))
}

fn column_of(
    want: &Want<'_>,
    name: &str,
    headers: &[String],
    gathered: &mut Gathered,
) -> Result<Option<usize>, RecordingError> {
    let is_any = want.source.file.is_none();
    let fit = match names::column_of(headers, name) {
        Fit::Nothing if is_any => names::column_of(headers, names::bare(name)),
        fit => fit,
    };
    match fit {
        Fit::Column(column) => Ok(Some(column)),
        Fit::Several(columns) => Err(RecordingError::AmbiguousColumn {
            file: gathered.file().into(),
            signal: want.signal.into(),
            column: name.into(),
            columns: columns.iter().filter_map(|column| headers.get(*column).cloned()).collect(),
        }),
        Fit::Nothing if is_any => {
            headers.iter().for_each(|header| gathered.know(header));
            Ok(None)
        }
        Fit::Nothing => {
            let hint = names::hint(name, headers.iter().map(String::as_str));
            gathered.absent(want, &format!("no column '{name}'{hint}"));
            Ok(None)
        }
    }
}

/// The source's own time column, else the one of the command line, else the one that looks like it.
fn clock_of(
    want: &Want<'_>,
    headers: &[String],
    options: &ReadOptions,
    file: &Path,
) -> Result<Clock, RecordingError> {
    let no_time =
        |problem: String| RecordingError::NoTime { file: file.into(), problem, columns: headers.to_vec() };
    if let Some(time) = &want.source.time {
        return named_clock(headers, &time.path, time.step)
            .ok_or_else(|| no_time(format!("signal {}: no time column '{}'", want.signal, time.path)));
    }
    let asked = options.time_column.as_deref();
    let by_option = asked.and_then(|name| named_clock(headers, name, options.time_scale));
    by_option.or_else(|| found_clock(headers, options.time_scale)).ok_or_else(|| {
        no_time(match asked {
            Some(name) => format!("no time column '{name}'"),
            None => "no column looks like the time".into(),
        })
    })
}

fn named_clock(headers: &[String], name: &str, scale: Option<Span>) -> Option<Clock> {
    match names::column_of(headers, name) {
        Fit::Column(column) => {
            let scale = scale.or_else(|| stamp::unit_of(headers.get(column)?));
            Some(Clock { column: Some(column), scale })
        }
        Fit::Nothing if name == "row" => Some(Clock { column: None, scale }),
        _ => None,
    }
}

fn found_clock(headers: &[String], scale: Option<Span>) -> Option<Clock> {
    let column = stamp::time_column(headers)?;
    let scale = scale.or_else(|| stamp::unit_of(headers.get(column)?));
    Some(Clock { column: Some(column), scale })
}

/// The rows of a table on their way to samples.
struct Rows<'a> {
    clocks: Vec<Clock>,
    columns: Vec<Column<'a>>,
    count: u64,
}

impl Rows<'_> {
    fn read<R: BufRead>(mut self, mut table: Table<R>, gathered: &mut Gathered) {
        while let Some(line) = table.row() {
            let cells = split(&line.text, table.separator).cells();
            match cells.filter(|cells| fits(cells, &table.headers)) {
                Some(cells) => self.row(&line, &cells, &table.headers, gathered),
                None => {
                    let problem = match line.is_ended {
                        true => format!("the row has not {} cells as the header", table.headers.len()),
                        false => "the file ends within this row".into(),
                    };
                    gathered.damaged(Place::Line(line.number), format!("{problem}; row left out"));
                }
            }
            self.count += 1;
        }
        if let Some(failure) = table.failure {
            gathered.damaged(Place::Line(table.lines_read), format!("reading stopped here: {failure}"));
        }
        self.sum_up(&table.headers, gathered);
    }

    /// Delivers the wanted cells of one row.
    fn row(&mut self, line: &Line, cells: &[Cow<'_, str>], headers: &[String], gathered: &mut Gathered) {
        let times = self.times(cells, headers, gathered);
        let mut without_time = None;
        for column in &mut self.columns {
            let cell = |index: usize| cells.get(index).map_or("", |cell| cell.trim());
            if !column.cells.filters.iter().all(|(index, value)| is_text(cell(*index), value)) {
                continue;
            }
            let Some(time) = times.get(column.clock).copied().flatten() else {
                without_time = Some(column.clock);
                continue;
            };
            match cell(column.cells.value).parse::<f64>() {
                Ok(value) => gathered.sample(column.want.index, time, time, RawValue::Number(value)),
                Err(_) => {
                    gathered.missing(column.want.index);
                    column.odd(line.number, cell(column.cells.value));
                }
            }
        }
        if let Some(clock) = without_time {
            let index = self.clocks.get(clock).and_then(|clock| clock.column).unwrap_or(0);
            let cell = cells.get(index).map_or("", |cell| cell.trim());
            let problem = format!("'{}' is no time; row left out", shortened(cell));
            gathered.damaged(Place::Line(line.number), problem);
        }
    }

    /// The row's time by each clock.
    fn times(
        &mut self,
        cells: &[Cow<'_, str>],
        headers: &[String],
        gathered: &mut Gathered,
    ) -> Vec<Option<Time>> {
        let count = self.count.to_string();
        let time_of = |clock: &mut Clock| {
            let text = clock.column.map_or(Some(count.as_str()), |column| Some(cells.get(column)?.trim()))?;
            let scale = match clock.scale {
                Some(scale) => scale,
                None => *clock.scale.insert(assumed(text, clock.column, headers, gathered)?),
            };
            decimal(text, scale)
        };
        self.clocks.iter_mut().map(time_of).collect()
    }

    fn sum_up(&self, headers: &[String], gathered: &mut Gathered) {
        let mut told = Vec::new();
        for column in &self.columns {
            if column.empty + column.not_numbers == 0 || told.contains(&&column.cells) {
                continue;
            }
            told.push(&column.cells);
            let header = headers.get(column.cells.value).map_or("", String::as_str);
            gathered.warn(Place::Whole, column.oddities(header));
        }
    }
}

impl Column<'_> {
    /// Counts a cell that is no number.
    fn odd(&mut self, line: u64, cell: &str) {
        if cell.is_empty() {
            self.empty += 1;
        } else {
            self.not_numbers += 1;
            self.first_odd.get_or_insert_with(|| (line, shortened(cell)));
        }
    }

    fn oddities(&self, header: &str) -> String {
        let example = self.first_odd.as_ref();
        let example =
            example.map_or(String::new(), |(line, cell)| format!(" (the first, '{cell}', in line {line})"));
        format!(
            "column '{header}': {} cells are empty and {} are no numbers{example}; taken as missing",
            self.empty, self.not_numbers
        )
    }
}

/// The unit of a clock that names none, from its first number, said in a warning.
fn assumed(text: &str, column: Option<usize>, headers: &[String], gathered: &mut Gathered) -> Option<Span> {
    let first = text.parse::<f64>().ok()?;
    let scale = if column.is_none() { Span::from_seconds(1.0) } else { likely_unit(first) };
    let name = column.and_then(|column| headers.get(column)).map_or("row", String::as_str);
    gathered.warn(
        Place::Whole,
        format!(
            "column '{name}' names no unit of time; one step is taken as {} s (to say it: @{name}*SPAN)",
            scale.seconds()
        ),
    );
    Some(scale)
}

/// The unit of a column that names none, from its first value.
fn likely_unit(first: f64) -> Span {
    likely_step(first.abs() as u64)
}

fn shortened(cell: &str) -> String {
    cell.chars().take(40).collect()
}

/// A table is one topic with its columns.
pub(super) fn topics(input: impl BufRead, file: &Path) -> Result<Vec<TopicInfo>, RecordingError> {
    let Some(mut table) = Table::open(input) else { return Ok(Vec::new()) };
    expect_names(&table.headers, file)?;
    let clock = found_clock(&table.headers, None);
    let (mut count, mut range) = (0, None);
    while let Some(line) = table.row() {
        count += 1;
        let Some(Clock { column: Some(column), scale }) = &clock else { continue };
        let cells = split(&line.text, table.separator).cells().unwrap_or_default();
        let Some(cell) = cells.get(*column) else { continue };
        let scale = scale.unwrap_or_else(|| likely_unit(cell.trim().parse().unwrap_or(0.0)));
        let Some(time) = decimal(cell.trim(), scale) else { continue };
        let (from, to) = range.unwrap_or((time, time));
        range = Some((from.min(time), to.max(time)));
    }
    let rate_hz = range.and_then(|(from, to)| super::mean_rate(count, from, to));
    Ok(vec![TopicInfo { name: stem(file), kind: table.headers.join(", "), count, rate_hz }])
}
