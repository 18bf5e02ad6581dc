//! Recordings: files of the past turned into sessions of samples, in the order of their reception.
//!
//! `source text -> Source -> reader of the format (csv, jsonl, rosbag) -> Gathered -> clock, session -> Recording`
//!
//! A model names signals and where each is found (see [`Source`] for the grammar); [`read`] looks into the files
//! for exactly these. A file that is cut short or damaged gives what it holds, with warnings that say where.

mod cells;
mod clock;
mod csv;
mod cut;
mod gathered;
mod jsonl;
mod line;
mod names;
mod ros_topics;
mod rosbag;
mod session;
mod stamp;
mod stream;

use std::fmt;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Cursor, Read, Seek};
use std::path::{Path, PathBuf};

use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};
use shsa_message::source::Source;

pub use cut::{Cuts, Stretch};
use gathered::{Destination, Gathered};
pub use jsonl::write_jsonl;
pub use session::{Because, Session};
pub use stamp::TIME_NAMES;
pub use stream::{Stream, Survey, stream, survey};

/// What a model asks for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wanted {
    /// The signal's name on the bus.
    pub signal: String,
    /// Where it is found, in the grammar of [`Source`]; empty: under the signal's own name.
    pub source: String,
}

impl Wanted {
    /// A signal and its source.
    #[must_use]
    pub fn new(signal: impl Into<String>, source: impl Into<String>) -> Wanted {
        Wanted { signal: signal.into(), source: source.into() }
    }
}

/// What the command line says about time where a file itself does not.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ReadOptions {
    /// The column that holds the time in CSV files; `None`: recognised from its header.
    pub time_column: Option<String>,
    /// How long one step of that column is; `None`: from the header's unit.
    pub time_scale: Option<Span>,
}

/// One value of one wanted signal.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// Index into the list of [`Wanted`].
    pub wanted: usize,
    /// The moment that the value was stamped with.
    pub time: Time,
    /// The moment of its reception; the stamp again where the file does not say.
    pub received: Time,
    /// The value.
    pub value: RawValue,
}

/// What was found of one wanted signal.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Found {
    /// Samples delivered.
    pub samples: usize,
    /// Rows or messages in which its value was absent or was no number.
    pub missing: usize,
    /// Samples whose stamp was before the stamp of the sample before, in the order of the file.
    pub backward: usize,
    /// Where it came from, `wheel_speed.csv: wheel_1 [m/s]`; empty when nothing in the recording has it.
    pub places: Vec<String>,
}

/// Where in a file something was noticed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    Whole,
    /// A line, counted from 1.
    Line(u64),
    /// A byte, counted from 0.
    Offset(u64),
}

/// Something that a reader of the results should know, and that did not stop the reading.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// The file.
    pub file: PathBuf,
    /// Where in it.
    pub place: Place,
    /// What is the matter, and what was done about it.
    pub message: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        match self.place {
            Place::Whole => write!(f, ": {}", self.message),
            Place::Line(line) => write!(f, ":{line}: {}", self.message),
            Place::Offset(offset) => write!(f, ": at byte {offset}: {}", self.message),
        }
    }
}

/// A recording, read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    /// Session by session; in each sorted by reception; ties keep the order of the files, then of the rows, then in which they
    /// were asked for.
    pub samples: Vec<Sample>,
    /// Recordings that are given together are replayed one after the other: two of one time, and what came before and after the
    /// clock was set, are not mixed.
    pub sessions: Vec<Session>,
    /// One entry for each wanted signal.
    pub found: Vec<Found>,
    /// In the order in which they were noticed.
    pub warnings: Vec<Warning>,
    /// A file was cut short or damaged: not all that was recorded is here.
    pub degraded: bool,
}

impl Recording {
    /// The reception of the first sample, from which times in reports count; `None` without samples.
    #[must_use]
    pub fn first(&self) -> Option<Time> {
        self.samples.first().map(|sample| sample.received)
    }

    /// Every session with its samples, of which there is at least one.
    pub fn by_session(&self) -> impl Iterator<Item = (&Session, &[Sample])> {
        let samples = |session: &Session| self.samples.get(session.samples.clone()).unwrap_or_default();
        self.sessions.iter().map(move |session| (session, samples(session)))
    }
}

/// One topic, table or signal of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct TopicInfo {
    /// The topic; for a table the file's name without extension.
    pub name: String,
    /// The message type; for a table its columns; for JSON lines the kind of its first value.
    pub kind: String,
    /// Messages, rows or lines.
    pub count: usize,
    /// Mean rate by reception; `None` for fewer than two or where time does not pass.
    pub rate_hz: Option<f64>,
}

/// Why a recording cannot be read at all.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The operating system refuses the file.
    #[error("{}: cannot be read: {reason}", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// What the system said.
        reason: io::Error,
    },
    /// Neither its extension nor its first bytes tell the format.
    #[error(
        "{}: not a recording that is known here: CSV (.csv, .tsv, .txt), JSON lines (.jsonl, .ndjson, .json), \
         ROS 1 bags of version 2.0 (.bag)",
        file.display()
    )]
    UnknownFormat {
        /// The file.
        file: PathBuf,
    },
    /// A folder without a single file of a known format.
    #[error("{}: no recording in this folder; looked for .csv .tsv .txt .jsonl .ndjson .json .bag", folder.display())]
    EmptyFolder {
        /// The folder.
        folder: PathBuf,
    },
    /// A source text that does not follow the grammar.
    #[error("signal {signal}: source '{text}': {problem}")]
    Source {
        /// The signal.
        signal: String,
        /// The source text.
        text: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A table with too many columns.
    #[error("{}: a table of more than {most} columns cannot be read: take out those that are not needed", file.display())]
    TooWide {
        /// The file.
        file: PathBuf,
        /// The most that can be read.
        most: usize,
    },
    /// More than one column fits.
    #[error("{}: signal {signal}: '{column}' fits several columns: {}; write one in full", file.display(), columns.join(", "))]
    AmbiguousColumn {
        /// The file.
        file: PathBuf,
        /// The signal that asks.
        signal: String,
        /// The column's name as asked for.
        column: String,
        /// The columns that it fits.
        columns: Vec<String>,
    },
    /// A table has no column that looks like the time.
    #[error(
        "{}: {problem}; columns: {}; say which holds the time, with --time-column NAME --time-unit 5s, \
         or in the model as source: file#column@NAME*5s (@row*5s counts the rows)",
        file.display(),
        columns.join(", ")
    )]
    NoTime {
        /// The file.
        file: PathBuf,
        /// What was looked for.
        problem: String,
        /// The table's columns.
        columns: Vec<String>,
    },
    /// A table without a row of names.
    #[error("{}: the first line holds numbers where the names of the columns belong; add a line such as 't [s],speed [m/s]'", file.display())]
    NoHeader {
        /// The file.
        file: PathBuf,
    },
}

/// One wanted signal with its source understood.
struct Want<'a> {
    index: usize,
    signal: &'a str,
    text: &'a str,
    source: Source,
}

/// Reads what is wanted from files and folders (of a folder: its files of known formats, in the order of their names).
///
/// A signal that nothing in the recording has is no error, since a recording may lack a topic: its [`Found`] has no
/// places, and a warning names the nearest thing there is.
///
/// # Errors
/// When a file cannot be opened, its format is unknown, a source is malformed or ambiguous, or a table has no time.
///
/// Memory grows with the samples wanted, not with the files; time with the files, and `n log n` with the samples.
pub fn read(
    paths: &[PathBuf],
    wanted: &[Wanted],
    options: &ReadOptions,
) -> Result<Recording, RecordingError> {
    let mut wants = understand(wanted)?;
    let files = files_of(paths)?;
    let gathered = read_all(&files, files.len() == 1, &mut wants, options, Destination::Kept)?;
    Ok(gathered.finish(&wants).0)
}

/// Reads files one after the other; `is_alone` when there is only one in all.
fn read_all(
    files: &[(PathBuf, Format)],
    is_alone: bool,
    wants: &mut [Want<'_>],
    options: &ReadOptions,
    destination: Destination,
) -> Result<Gathered, RecordingError> {
    let mut gathered = Gathered::new(wants.iter().map(|want| want.source.changed), destination);
    if let ([(file, Format::Csv)], true) = (files, is_alone) {
        lone_table(file, wants, &mut gathered);
    }
    for (file, format) in files {
        gathered.begin(file);
        read_one(*format, open(file)?, wants, options, &mut gathered)?;
    }
    Ok(gathered)
}

/// As [`read`], of one file whose bytes are at hand; its name says the format where the bytes do not.
///
/// # Errors
/// As [`read`].
pub fn read_bytes(
    name: &Path,
    bytes: &[u8],
    wanted: &[Wanted],
    options: &ReadOptions,
) -> Result<Recording, RecordingError> {
    let mut wants = understand(wanted)?;
    let format = format_of(name, bytes).ok_or_else(|| RecordingError::UnknownFormat { file: name.into() })?;
    let mut gathered = Gathered::new(wants.iter().map(|want| want.source.changed), Destination::Kept);
    if format == Format::Csv {
        lone_table(name, &mut wants, &mut gathered);
    }
    gathered.begin(name);
    read_one(format, Cursor::new(bytes), &wants, options, &mut gathered)?;
    Ok(gathered.finish(&wants).0)
}

fn read_one(
    format: Format,
    input: impl BufRead + Seek,
    wants: &[Want<'_>],
    options: &ReadOptions,
    gathered: &mut Gathered,
) -> Result<(), RecordingError> {
    match format {
        Format::Csv => csv::read(input, wants, options, gathered)?,
        Format::JsonLines => jsonl::read(input, wants, gathered),
        Format::Bag => ros_topics::read(input, wants, gathered),
    }
    gathered.end();
    Ok(())
}

/// What is in one file.
///
/// # Errors
/// As [`read`].
pub fn topics(file: &Path) -> Result<Vec<TopicInfo>, RecordingError> {
    match format_of_file(file)? {
        Format::Csv => csv::topics(open(file)?, file),
        Format::JsonLines => Ok(jsonl::topics(open(file)?)),
        Format::Bag => ros_topics::topics(open(file)?, file),
    }
}

fn understand(wanted: &[Wanted]) -> Result<Vec<Want<'_>>, RecordingError> {
    let understood = wanted.iter().enumerate().map(|(index, Wanted { signal, source: text })| {
        let written = if text.trim().is_empty() { signal } else { text };
        let source = written.parse().map_err(|problem| RecordingError::Source {
            signal: signal.clone(),
            text: text.clone(),
            problem,
        })?;
        Ok(Want { index, signal, text, source })
    });
    understood.collect()
}

/// One table alone, under a name that no source knows, is the table that was meant: a copy, a part, a download.
fn lone_table(file: &Path, wants: &mut [Want<'_>], gathered: &mut Gathered) {
    let named = |want: &Want<'_>| want.source.file.is_some();
    if !wants.iter().any(named) || wants.iter().any(|want| named(want) && want.source.is_of_file(file)) {
        return;
    }
    gathered.begin(file);
    gathered
        .warn(Place::Whole, "no source names this file; as it is the only one, it is read for all of them");
    for want in wants {
        want.source.file = None;
    }
}

/// How recordings are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Tables of text.
    Csv,
    /// An observation a line.
    JsonLines,
    /// Bags of ROS 1, version 2.0.
    Bag,
}

impl Format {
    /// All, with the endings of their files.
    pub const ALL: [(Format, &[&str]); 3] = [
        (Format::Csv, &["csv", "tsv", "txt"]),
        (Format::JsonLines, &["jsonl", "ndjson", "json"]),
        (Format::Bag, &["bag"]),
    ];
}

fn format_by_extension(file: &Path) -> Option<Format> {
    let extension = file.extension()?.to_str()?.to_ascii_lowercase();
    let found = Format::ALL.into_iter().find(|(_, endings)| endings.contains(&extension.as_str()));
    found.map(|(format, _)| format)
}

/// The first bytes decide where they can, else the extension; `None` when neither does.
fn format_of(name: &Path, head: &[u8]) -> Option<Format> {
    let first = head.iter().copied().find(|byte| !byte.is_ascii_whitespace());
    let is_bag = head.starts_with(b"#ROSBAG V2.0");
    match format_by_extension(name) {
        _ if is_bag => Some(Format::Bag),
        // Cut within its first line, or something else.
        Some(Format::Bag) => rosbag::MAGIC.starts_with(head).then_some(Format::Bag),
        None => (first == Some(b'{')).then_some(Format::JsonLines),
        known => known,
    }
}

fn format_of_file(file: &Path) -> Result<Format, RecordingError> {
    let mut head = Vec::new();
    open(file)?.take(64).read_to_end(&mut head).map_err(|reason| unreadable(file, reason))?;
    format_of(file, &head).ok_or_else(|| RecordingError::UnknownFormat { file: file.into() })
}

fn files_of(paths: &[PathBuf]) -> Result<Vec<(PathBuf, Format)>, RecordingError> {
    let mut files = Vec::new();
    for path in paths {
        let found = if path.is_dir() { files_in(path)? } else { vec![path.clone()] };
        for file in found {
            let format = format_of_file(&file)?;
            files.push((file, format));
        }
    }
    Ok(files)
}

fn files_in(folder: &Path) -> Result<Vec<PathBuf>, RecordingError> {
    let entries = folder.read_dir().and_then(Iterator::collect::<io::Result<Vec<_>>>);
    let entries = entries.map_err(|reason| unreadable(folder, reason))?;
    let paths = entries.into_iter().map(|entry| entry.path());
    let mut files: Vec<_> =
        paths.filter(|path| path.is_file() && format_by_extension(path).is_some()).collect();
    files.sort();
    if files.is_empty() {
        return Err(RecordingError::EmptyFolder { folder: folder.into() });
    }
    Ok(files)
}

fn open(file: &Path) -> Result<BufReader<File>, RecordingError> {
    File::open(file).map(BufReader::new).map_err(|reason| unreadable(file, reason))
}

fn unreadable(file: &Path, reason: io::Error) -> RecordingError {
    RecordingError::Unreadable { file: file.into(), reason }
}

/// Samples a second when the first and the last of them are at these times.
fn mean_rate(count: usize, first: Time, last: Time) -> Option<f64> {
    let span = (last - first).seconds();
    (count > 1 && span > 0.0).then(|| (count - 1) as f64 / span)
}

#[cfg(test)]
mod tests;
