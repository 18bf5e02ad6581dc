//! Recordings: files turned into sessions of samples, in the order of their reception.
//!
//! A caller names the wanted signals by their sources; the first bytes and the ending of a file decide its format ([`FORMATS`]). Every
//! reader reports topics and messages in the same way, so a model works with any of the formats:
//!
//! `reader of the format (rosbag, ...) -> topics and messages -> extraction (wanted signals) -> Gathered -> clock, session ->
//! Recording`
//!
//! [`read`] reads the signals of a model from files, [`read_bytes`] from memory; [`stream`](fn@stream) delivers a long recording piece by piece. A
//! damaged file gives its readable content, with warnings.
//!
//! # Example
//!
//! ```
//! use shsa_core::observation::RawValue;
//! use shsa_recording::{ReadOptions, Wanted, read_bytes};
//! use std::path::Path;
//!
//! let table = "t [s],speed [m/s]\n0.0,13.6\n0.1,13.7\n";
//! let wanted = [Wanted::new("/wheel/speed", "log#speed")];
//! let recording = read_bytes(Path::new("log.csv"), table.as_bytes(), &wanted, &ReadOptions::default())?;
//! assert_eq!(recording.samples.len(), 2);
//! assert_eq!(recording.samples[1].value, RawValue::Number(13.7));
//! # Ok::<(), shsa_recording::RecordingError>(())
//! ```

mod clock;
mod table;
mod error;
mod near;
mod files;
mod trial;
mod cut;
mod room;
mod batch;
mod gathered;
mod jsonl;
mod line;
mod lines;
mod wanted;
mod names;
mod members;
mod json_value;
mod topic;
mod store;
mod guard;
mod fields;
mod extract;
mod extraction;
mod content;
mod inventory;
mod format;
mod rosbag;
mod utf16;
#[cfg(all(feature = "ruzstd", not(feature = "zstd")))]
mod frames;
mod unpack;
mod ros2;
pub mod mcap;
mod sqlite;
mod rosbag2;
mod window;
mod record;
mod ulog;
mod dataflash;
mod can;
mod nmea;
mod signalk;
mod influx;
mod mdf;
mod parquet;
mod session;
mod stamp;
mod stamps;
mod sorted;
mod dates;
mod zones;
mod stream;

use std::path::{Path, PathBuf};
use std::{fmt, io::Cursor};

use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};
use shsa_message::moment::DateOrder;
use shsa_message::zone::Zone;

pub use can::CAN_FRAME;
use clock::Stored;
pub use content::{FieldInfo, FileInfo, TopicInfo};
pub use cut::{Cuts, Parting, Stretch, moment};
pub use error::RecordingError;
use extract::Naming;
use extraction::Extraction;
use files::{File, Opened, files_of, open};
pub use format::{FORMATS, Format, Row};
use gathered::{Destination, Gathered};
use guard::guarded;
use inventory::Inventory;
pub use jsonl::write_jsonl;
pub use session::{Because, Session};
pub use stamp::TIME_NAMES;
pub use store::{Bytes, Files};
use stream::Surveyed;
pub use stream::{Stream, Survey, stream, survey};
use topic::{Fields, Input, Listener};
pub use wanted::Wanted;
use wanted::{Want, lone_table, understand};

/// Options about times and definitions that a file itself does not have.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ReadOptions {
    /// The column with the time in CSV files; `None`: recognised from the header.
    pub time_column: Option<String>,
    /// The length of one step of that column; `None`: from the header's unit.
    pub time_scale: Option<Span>,
    /// The order of the parts of dates, where a text fits several; `None`: from the dates of all files of a call.
    pub date_order: Option<DateOrder>,
    /// The zone of times without one.
    pub zone: Zone,
    /// Other zones of single recordings, each by the name of its file or folder.
    pub zones: Vec<(String, Zone)>,
    /// Folders with definitions of ROS 2 messages, `PACKAGE/msg/NAME.msg`, that recordings lack.
    pub messages: Vec<PathBuf>,
    /// Databases of CAN messages (DBC).
    pub dbc: Vec<PathBuf>,
    /// Where recordings and databases are.
    pub files: Files,
}

/// One value of one wanted signal.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// Index into the list of [`Wanted`].
    pub wanted: usize,
    /// The stamp of the value.
    pub time: Time,
    /// The time of reception; the stamp where the file has none.
    pub received: Time,
    /// The value.
    pub value: RawValue,
}

/// What a recording has of one wanted signal.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Found {
    /// The number of samples.
    pub samples: usize,
    /// The number of rows or messages without the value, or with one that is no number.
    pub missing: usize,
    /// The number of samples whose stamp was before that of the sample before, in the order of the file.
    pub backward: usize,
    /// Where the samples came from, `wheel_speed.csv: wheel_1 [m/s]`; empty when nothing in the recording has the signal.
    pub places: Vec<String>,
}

/// A place in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole.
    Whole,
    /// A line, counted from 1.
    Line(u64),
    /// A byte, counted from 0.
    Offset(u64),
}

/// An observation about a file that readers of the results should know, and that did not stop the reading.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// The file.
    pub file: PathBuf,
    /// The place in the file.
    pub place: Place,
    /// The problem, and how it was handled.
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

/// A recording in memory.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    /// The samples, session by session, in each session sorted by reception. Samples of the same time keep the order of the
    /// files, then of the rows, then of the request.
    pub samples: Vec<Sample>,
    /// The sessions are replayed one after the other. Two recordings of the same time, and the parts before and after the clock
    /// was set, are not mixed.
    pub sessions: Vec<Session>,
    /// One entry for each wanted signal.
    pub found: Vec<Found>,
    /// Which files form one recording, and why.
    pub joined: Vec<String>,
    /// The warnings, in the order in which they arose.
    pub warnings: Vec<Warning>,
    /// Whether a part of the recording is lost.
    pub degraded: bool,
}

impl Recording {
    /// The reception of the first sample, from which times in reports count; `None` without samples.
    #[must_use]
    pub fn first(&self) -> Option<Time> {
        self.samples.first().map(|sample| sample.received)
    }

    /// Why a damaged recording has no sample: the first loss.
    #[must_use]
    pub fn cause(&self) -> Option<String> {
        let is_found = self.found.iter().any(|found| !found.places.is_empty());
        let is_empty = self.found.iter().all(|found| found.samples == 0);
        (self.degraded && is_found && is_empty).then(|| self.warnings.first().map(ToString::to_string))?
    }

    /// Each session with its samples, at least one each.
    pub fn by_session(&self) -> impl Iterator<Item = (&Session, &[Sample])> {
        let samples = |session: &Session| self.samples.get(session.samples.clone()).unwrap_or_default();
        self.sessions.iter().map(move |session| (session, samples(session)))
    }
}

/// Reads the wanted signals from files and folders (from a folder: its files of known formats, in the order of their names).
///
/// A signal that is not in the recording is no error, as a recording may lack a topic: its [`Found`] has no places, and a warning
/// names the nearest topic or field.
///
/// # Errors
/// When a file cannot be opened, its format is unknown, a source is malformed or ambiguous, or a table has no time.
///
/// Memory grows with the wanted samples, not with the files; time with the files, and `n log n` with the samples.
pub fn read(
    paths: &[PathBuf],
    wanted: &[Wanted],
    options: &ReadOptions,
) -> Result<Recording, RecordingError> {
    let mut wants = understand(wanted)?;
    let files = files_of(paths, &options.files)?;
    let empty = Gathered::new(&wants, Destination::Kept);
    let options = dates::decided(options, &files)?;
    let gathered = read_all(&files, files.len() == 1, &mut wants, &options, empty)?;
    Ok(gathered.finish(&wants).0)
}

/// Reads files one after the other; `is_alone` where there is only one.
fn read_all(
    files: &[File],
    is_alone: bool,
    wants: &mut [Want<'_>],
    options: &ReadOptions,
    mut gathered: Gathered,
) -> Result<Gathered, RecordingError> {
    if let ([File { path, row }], true) = (files, is_alone)
        && row.naming == Naming::File
    {
        lone_table(path, wants, &mut gathered);
    }
    for File { path, row } in files {
        gathered.begin(path, files::size(path, &options.files));
        let Opened { mut input, problem } = open(path, &options.files)?;
        let options = &options.of_file(path);
        problem.into_iter().for_each(|problem| gathered.damaged(Place::Whole, problem));
        read_one(row, &mut input, wants, options, &mut gathered)?;
        if gathered.surveyed().is_some_and(Surveyed::may_be_set) {
            gathered.divide(receptions(path, row, wants, options)?);
        }
        gathered.end();
    }
    Ok(gathered)
}

/// The times of reception of all samples of a file, which is read again for them.
fn receptions(
    path: &Path,
    row: &Row,
    wants: &[Want<'_>],
    options: &ReadOptions,
) -> Result<Stored, RecordingError> {
    let unsorted = |reason| RecordingError::Unsorted { file: path.into(), reason };
    let mut gathered = Gathered::new(wants, Destination::Timed(Stored::new().map_err(unsorted)?));
    gathered.begin(path, files::size(path, &options.files));
    read_one(row, &mut open(path, &options.files)?.input, wants, options, &mut gathered)?;
    gathered.receptions().ok_or_else(|| unsorted(std::io::ErrorKind::Other.into()))
}

/// Reads one file from its bytes as [`read`] does; its name decides the format where the bytes do not.
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
    let row = files::settled(name, name, format::head(bytes), || Ok(Cursor::new(bytes)))?;
    let mut gathered = Gathered::new(&wants, Destination::Kept);
    if row.naming == Naming::File {
        lone_table(name, &mut wants, &mut gathered);
    }
    gathered.begin(name, bytes.len() as u64);
    read_one(row, &mut Cursor::new(bytes), &wants, &options.of_file(name), &mut gathered)?;
    gathered.end();
    Ok(gathered.finish(&wants).0)
}

fn read_one(
    row: &Row,
    input: &mut dyn Input,
    wants: &[Want<'_>],
    options: &ReadOptions,
    gathered: &mut Gathered,
) -> Result<(), RecordingError> {
    let mut extraction = Extraction::new(wants, gathered, row.naming);
    read_with(row.format, input, options, &mut extraction)?;
    extraction.finish()
}

/// Reports the topics and messages of a file.
fn read_with(
    format: Format,
    input: &mut dyn Input,
    options: &ReadOptions,
    listener: &mut dyn Listener,
) -> Result<(), RecordingError> {
    if matches!(input.fill_buf(), Ok([])) {
        listener.damaged(Place::Whole, "the file is empty".to_owned());
        return Ok(());
    }
    match format {
        Format::Bag => guarded(listener, |guard| rosbag::read(input, guard)),
        Format::Mcap => guarded(listener, |guard| mcap::read(input, options, guard)),
        Format::Rosbag2 => guarded(listener, |guard| rosbag2::read(input, options, guard)),
        Format::Ulog => ulog::read(input, listener),
        Format::DataFlash => dataflash::binary::read(input, listener),
        Format::DataFlashText => dataflash::text::read(input, listener),
        Format::Mavlogdump => dataflash::dump::read(input, options, listener),
        Format::Blf => can::blf::read(input, options, listener),
        Format::Asc => can::asc::read(input, options, listener),
        Format::Candump => can::candump::read(input, options, listener),
        Format::Nmea => nmea::read(input, listener),
        Format::SignalK => signalk::read(input, listener),
        Format::Influx => influx::read(input, listener),
        Format::Mdf => mdf::read(input, options, listener),
        Format::Parquet => parquet::read(input, options, listener),
        Format::JsonLines => jsonl::read(input, listener),
        Format::Csv => table::read(input, options, listener),
    }
}

/// The content of files, and their damages: topics, fields, rates, examples of values.
///
/// # Errors
/// As [`read`]. Memory grows with topics and fields.
pub fn inventory(paths: &[PathBuf], options: &ReadOptions) -> Result<Vec<FileInfo>, RecordingError> {
    let files = files_of(paths, &options.files)?;
    let options = dates::decided(options, &files)?;
    let of_file = |File { path, row }: &File| {
        let mut inventory = Inventory::new(path);
        let Opened { mut input, problem } = open(path, &options.files)?;
        problem.into_iter().for_each(|problem| inventory.damaged(Place::Whole, problem));
        read_with(row.format, &mut input, &options.of_file(path), &mut inventory)?;
        Ok(inventory.finish(row.name))
    };
    files.iter().map(of_file).collect()
}

#[cfg(test)]
mod tests;
