//! Why a recording cannot be read.

use super::format;
use shsa_message::MessageError;
use std::io;
use std::path::PathBuf;

/// Why a recording cannot be read at all.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The operating system refuses the file.
    #[error("{}: cannot be read: {reason}", file.display())]
    Unreadable {
        /// The file.
        file: PathBuf,
        /// The system's error.
        reason: io::Error,
    },
    /// Samples cannot be sorted in a temporary file.
    #[error("{}: cannot be sorted by time in the folder for temporary files: {reason}", file.display())]
    Unsorted {
        /// The file.
        file: PathBuf,
        /// The system's error.
        reason: io::Error,
    },
    /// Neither the extension nor the first bytes of the file determine the format.
    #[error("{}: not a recording that is known here; known are: {}", file.display(), format::known())]
    UnknownFormat {
        /// The file.
        file: PathBuf,
    },
    /// The ending of a file stands for formats of lines, and no line is of any of them.
    #[error("{}: no line of it can be read; tried: {}; known formats are: {}", file.display(), tried.join(", "), format::known())]
    NoLine {
        /// The file.
        file: PathBuf,
        /// The formats that were tried.
        tried: Vec<&'static str>,
    },
    /// A zone is given for a recording that is not read.
    #[error("--time-zone {name}=..: no recording has this name{hint}")]
    ZoneOfNothing {
        /// The name.
        name: String,
        /// The nearest name, and the names of the recordings.
        hint: String,
    },
    /// A folder without a single file of a known format.
    #[error("{}: no recording in this folder; looked for: {}", folder.display(), format::known())]
    EmptyFolder {
        /// The folder.
        folder: PathBuf,
    },
    /// The format is known, but its reader is not in this build.
    #[error("{}: this is a {name}, which this program was built without: build it with the feature '{feature}'", file.display())]
    SwitchedOff {
        /// The file.
        file: PathBuf,
        /// The format.
        name: &'static str,
        /// The feature with the reader.
        feature: &'static str,
    },
    /// The format is known and not read here; another program can convert it.
    #[error("{}: {what} is not read here: {how}", file.display())]
    Convert {
        /// The file.
        file: PathBuf,
        /// The format.
        what: &'static str,
        /// How to convert it.
        how: &'static str,
    },
    /// Definitions of messages cannot be read.
    #[error("{0}")]
    Definitions(MessageError),
    /// A source that fits several topics.
    #[error("{}: signal {signal}: '{topic}' means several: {}; write one of them", file.display(), choices.join(", "))]
    AmbiguousTopic {
        /// The file.
        file: PathBuf,
        /// The signal with the source.
        signal: String,
        /// The topic in the source.
        topic: String,
        /// The topics that fit.
        choices: Vec<String>,
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
    /// A source that fits several columns.
    #[error("{}: signal {signal}: '{column}' fits several columns: {}; write one in full", file.display(), columns.join(", "))]
    AmbiguousColumn {
        /// The file.
        file: PathBuf,
        /// The signal with the source.
        signal: String,
        /// The column in the source.
        column: String,
        /// The columns that fit.
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
        /// The columns that were looked for.
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
