//! The journal: every input of a run, in order, as JSON lines; it replays to the same outputs, byte for byte.
//!
//! The first line has the version and names the signals; then one line for each input: `{"tick_ns": 5}` or `{"signal": 0,
//! "time_ns": 5, "received_ns": 6, "value": 1.5}`, where `signal` is an index into the names. Numbers that JSON does not know are
//! the texts `nan`, `inf` and `-inf`. What an operator has ordered is a line `{"order_ns": 5, "given": {"order": "forbid",
//! "signal": "/a"}}`, and what a run goes on from after a restart is `{"restore_ns": 5, "known": {"state": "shsa-state-1", ..}}`.
//! Where the model was changed, a line `{"reload_ns": 5, "file": "a.yaml", "text": "..", "signals": [..]}` holds the text that
//! changed it, and the names that count from there on. What a process says that computes a need's source (`need` counts them in
//! the model) is one of `{"report_ns": 5, "need": 0, "ready": 1}`, `{"report_ns": 5, "need": 0, "gone": true}` and `{"report_ns":
//! 5, "need": 0, "answer": 7, "from_ns": 3, "to_ns": 4, "value": {"lo": 1, "hi": 2}}`, without the three last where there is no
//! value.
//!
//! A journal may be [sealed](seal): then each line ends with a field `seal`, the first one has the number of its `file` as well, and the
//! seal `after` which it comes. Two more lines are in sealed journals only: who has given an order, `{"ordered_ns": 5, "by": "10.0.0.7",
//! "done": "forbid /a"}`, and a signature of all that comes before, `{"signature": ".."}`.

mod line;
pub mod seal;
pub mod examination;

pub(crate) use line::Number;

use crate::drive::{Era, Given};
use crate::order::OrderForm;
use crate::state::StateForm;
use line::{Head, Line, Value};
use serde::Serialize;
use shsa_core::engine::Input;
use shsa_core::knowledge::{Id, KnowledgeBase, SignalId};
use shsa_core::time::Time;
use shsa_model::live::{Live, Written};
use shsa_recording::mcap;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Write};
use std::path::Path;

/// The first line is no longer, bytes.
const HEAD_MAX: u64 = 1 << 20;

/// The value of the field `journal` in the first line.
const FORMAT: &str = "shsa-journal-1";

/// The profile of files of MCAP that hold a journal, and the topic whose messages are its lines.
pub const PROFILE: &str = "shsa";
/// The topic of the journal in such a file.
pub const TOPIC: &str = "/shsa/journal";

/// Writes the inputs of a run.
#[derive(Debug)]
pub struct JournalWriter<W> {
    output: W,
}

impl<W: Write> JournalWriter<W> {
    /// Begins the journal of a system with the signals of `knowledge`.
    ///
    /// # Errors
    /// Errors of the output.
    pub fn new(mut output: W, knowledge: &KnowledgeBase) -> io::Result<JournalWriter<W>> {
        let signals = names(knowledge);
        write_line(&mut output, &Head { journal: FORMAT.to_owned(), signals, file: None, after: None })?;
        Ok(JournalWriter { output })
    }

    /// Adds an input.
    ///
    /// # Errors
    /// Errors of the output.
    pub fn record(&mut self, given: Given<'_>) -> io::Result<()> {
        let line = match given {
            Given::Era(era) => {
                let (file, text) = era.change.clone().unwrap_or_default();
                Line::Reload { reload_ns: era.from.0, file, text, signals: names(&era.knowledge) }
            }
            Given::Input(Input::Tick(time)) => Line::Tick { tick_ns: time.0 },
            Given::Input(Input::Order { time, order }) => {
                Line::Order { order_ns: time.0, given: OrderForm::from(order) }
            }
            Given::Input(Input::Restore { time, snapshot }) => {
                Line::Restore { restore_ns: time.0, known: Box::new(StateForm::from(&**snapshot)) }
            }
            Given::Input(Input::Report { time, need, report }) => {
                Line::Report { report_ns: time.0, need: need.index(), report_form: report.into() }
            }
            Given::Input(Input::Observation(observation)) => Line::Observation {
                signal: observation.signal.index(),
                time_ns: observation.stamp.0,
                received_ns: observation.received.0,
                value: Value::from(&observation.value),
            },
        };
        write_line(&mut self.output, &line)
    }

    /// Adds who has given an order that was carried out, and what was done; for sealed journals.
    ///
    /// # Errors
    /// Errors of the output.
    pub fn ordered(&mut self, time: Time, by: &str, done: &str) -> io::Result<()> {
        let (by, done) = (by.to_owned(), done.to_owned());
        write_line(&mut self.output, &Line::Ordered { ordered_ns: time.0, by, done })
    }

    /// The output.
    pub fn output_mut(&mut self) -> &mut W {
        &mut self.output
    }

    /// Ends the journal and returns its output.
    pub fn into_output(self) -> W {
        self.output
    }

    /// Writes out what is buffered.
    ///
    /// # Errors
    /// Errors of the output.
    pub fn flush(&mut self) -> io::Result<()> {
        self.output.flush()
    }
}

fn write_line<W: Write>(output: &mut W, line: &impl Serialize) -> io::Result<()> {
    serde_json::to_writer(&mut *output, line)?;
    output.write_all(b"\n")
}

fn names(knowledge: &KnowledgeBase) -> Vec<String> {
    knowledge.signals().iter().map(|signal| signal.name.clone()).collect()
}

/// Why a journal cannot be replayed.
#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    /// The operating system cannot read it.
    #[error("{0}")]
    Unreadable(#[from] io::Error),
    /// The journal names a signal that the model does not have.
    #[error(
        "the journal has a signal '{0}' that the model does not have; replay it with the model of its run"
    )]
    OtherModel(String),
    /// A change of the model in the journal does not fit the model.
    #[error("the model cannot be changed as in the journal's run; replay it with the model of its run\n{0}")]
    OtherChange(String),
}

/// The content of a journal.
#[derive(Clone, Debug, Default)]
pub struct Journal {
    /// The inputs in order, by the knowledge bases of the run.
    pub eras: Vec<Era>,
    /// The damage at which reading ended: line number and reason.
    pub damage: Option<(usize, String)>,
}

/// Whether a text begins like a journal.
#[must_use]
pub fn is_journal(first_line: &str) -> bool {
    serde_json::from_str::<Head>(first_line).is_ok_and(|head| head.journal == FORMAT)
}

/// Whether a file is a journal, or a record of a run that holds one.
#[must_use]
pub fn is_journal_file(path: &Path) -> bool {
    let mut line = String::new();
    path.is_file()
        && (mcap::has_profile(path, PROFILE)
            || File::open(path).is_ok_and(|file| {
                let limited = io::Read::take(file, HEAD_MAX);
                BufReader::new(limited).read_line(&mut line).is_ok() && is_journal(&line)
            }))
}

/// Reads a journal from a file, as [`read_journal`] does, or from the record of a run.
///
/// # Errors
/// When the file cannot be read at all, or belongs to another model.
pub fn read_file(path: &Path, live: Live) -> Result<Journal, JournalError> {
    if !mcap::has_profile(path, PROFILE) {
        return read_journal(BufReader::new(File::open(path)?), live);
    }
    let (lines, damage) = mcap::lines(path, TOPIC).map_err(io::Error::other)?;
    let mut journal = read_journal(&*lines, live)?;
    if let Some(problem) = damage {
        let count = lines.iter().filter(|byte| **byte == b'\n').count();
        journal.damage = Some((count + 1, problem));
    }
    Ok(journal)
}

/// Reads a journal for the model with which its run began; a damaged journal gives the inputs before the damage.
///
/// # Errors
/// When the journal cannot be read at all, or belongs to another model.
pub fn read_journal(input: impl BufRead, mut live: Live) -> Result<Journal, JournalError> {
    let mut lines = input.lines();
    let first = lines.next().transpose()?.unwrap_or_default();
    let mut era = Era::only(live.knowledge().clone(), Vec::new());
    let mut journal = Journal::default();
    let mut signals = match serde_json::from_str::<Head>(&first) {
        Ok(head) => found(&head.signals, &era.knowledge)?,
        Err(error) => return Ok(Journal { eras: vec![era], damage: Some((1, error.to_string())) }),
    };
    for (number, line) in lines.enumerate() {
        let line = line.map_err(|error| error.to_string());
        let line = line.and_then(|line| serde_json::from_str(&line).map_err(|error| error.to_string()));
        let damage = match line {
            Ok(Line::Reload { reload_ns, file, text, signals: names }) => {
                let written = Written { name: &file, text: &text };
                live.change(written).map_err(|report| JournalError::OtherChange(report.render(false)))?;
                signals = found(&names, live.knowledge())?;
                let next = Era {
                    from: Time(reload_ns),
                    knowledge: live.knowledge().clone(),
                    change: Some((file, text)),
                    inputs: Vec::new(),
                };
                journal.eras.push(std::mem::replace(&mut era, next));
                None
            }
            Ok(line) => match line.input(&signals) {
                Ok(input) => {
                    era.inputs.extend(input);
                    None
                }
                Err(reason) => Some(reason),
            },
            Err(reason) => Some(reason),
        };
        if let Some(reason) = damage {
            journal.damage = Some((number + 2, reason));
            break;
        }
    }
    journal.eras.push(era);
    Ok(journal)
}

/// The signals with these names.
fn found(names: &[String], knowledge: &KnowledgeBase) -> Result<Vec<SignalId>, JournalError> {
    let find = |name: &String| knowledge.signal(name).ok_or_else(|| JournalError::OtherModel(name.clone()));
    names.iter().map(find).collect()
}
