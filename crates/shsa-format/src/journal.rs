//! The journal: every input of a run, in order, as JSON lines; it replays to the same outputs, byte for byte.
//!
//! The first line says what it is and names the signals; then one line an input: `{"tick_ns": 5}` or
//! `{"signal": 0, "time_ns": 5, "received_ns": 6, "value": 1.5}`, where `signal` is an index into the names. Numbers
//! that JSON does not know are the texts `nan`, `inf` and `-inf`.

use serde::{Deserialize, Serialize};
use shsa_core::engine::Input;
use shsa_core::knowledge::{KnowledgeBase, SignalId};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::Time;
use std::io::{self, BufRead, Write};

/// What the first line says in its field `journal`.
const FORMAT: &str = "shsa-journal-1";

#[derive(Serialize, Deserialize)]
struct Head {
    journal: String,
    signals: Vec<String>,
}

#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum Line {
    Tick { tick_ns: i64 },
    Observation { signal: usize, time_ns: i64, received_ns: i64, value: Value },
}

#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum Value {
    Number(Number),
    Interval { lo: Number, hi: Number },
    Vector(Vec<Number>),
}

#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(untagged)]
enum Number {
    Finite(f64),
    Other(Other),
}

#[derive(Clone, Copy, Serialize, Deserialize)]
enum Other {
    #[serde(rename = "nan")]
    Nan,
    #[serde(rename = "inf")]
    Infinite,
    #[serde(rename = "-inf")]
    MinusInfinite,
}

impl From<f64> for Number {
    fn from(value: f64) -> Number {
        match value {
            value if value.is_finite() => Number::Finite(value),
            value if value.is_nan() => Number::Other(Other::Nan),
            value if value > 0.0 => Number::Other(Other::Infinite),
            _ => Number::Other(Other::MinusInfinite),
        }
    }
}

impl From<Number> for f64 {
    fn from(number: Number) -> f64 {
        match number {
            Number::Finite(value) => value,
            Number::Other(Other::Nan) => f64::NAN,
            Number::Other(Other::Infinite) => f64::INFINITY,
            Number::Other(Other::MinusInfinite) => f64::NEG_INFINITY,
        }
    }
}

impl From<&RawValue> for Value {
    fn from(value: &RawValue) -> Value {
        match value {
            &RawValue::Number(number) => Value::Number(number.into()),
            &RawValue::Interval { lo, hi } => Value::Interval { lo: lo.into(), hi: hi.into() },
            RawValue::Vector(elements) => {
                Value::Vector(elements.iter().map(|&element| element.into()).collect())
            }
        }
    }
}

impl From<Value> for RawValue {
    fn from(value: Value) -> RawValue {
        match value {
            Value::Number(number) => RawValue::Number(number.into()),
            Value::Interval { lo, hi } => RawValue::Interval { lo: lo.into(), hi: hi.into() },
            Value::Vector(elements) => RawValue::Vector(elements.into_iter().map(f64::from).collect()),
        }
    }
}

/// Writes the inputs of a run.
#[derive(Debug)]
pub struct JournalWriter<W> {
    output: W,
}

impl<W: Write> JournalWriter<W> {
    /// Begins a journal of a system with these signals.
    ///
    /// # Errors
    /// What the output says.
    pub fn new(mut output: W, knowledge: &KnowledgeBase) -> io::Result<JournalWriter<W>> {
        let signals = knowledge.signals().iter().map(|signal| signal.name.clone()).collect();
        write_line(&mut output, &Head { journal: FORMAT.to_owned(), signals })?;
        Ok(JournalWriter { output })
    }

    /// Adds an input.
    ///
    /// # Errors
    /// What the output says.
    pub fn record(&mut self, input: &Input) -> io::Result<()> {
        use shsa_core::knowledge::Id;
        let line = match input {
            Input::Tick(time) => Line::Tick { tick_ns: time.0 },
            Input::Observation(observation) => Line::Observation {
                signal: observation.signal.index(),
                time_ns: observation.stamp.0,
                received_ns: observation.received.0,
                value: Value::from(&observation.value),
            },
        };
        write_line(&mut self.output, &line)
    }

    /// Writes out what is buffered.
    ///
    /// # Errors
    /// What the output says.
    pub fn flush(&mut self) -> io::Result<()> {
        self.output.flush()
    }
}

fn write_line<W: Write>(output: &mut W, line: &impl Serialize) -> io::Result<()> {
    serde_json::to_writer(&mut *output, line)?;
    output.write_all(b"\n")
}

/// Why a journal cannot be replayed.
#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    /// The operating system refuses it.
    #[error("{0}")]
    Unreadable(#[from] io::Error),
    /// It names a signal that the model does not have.
    #[error(
        "the journal has a signal '{0}' that the model does not have; replay it with the model of its run"
    )]
    OtherModel(String),
}

/// What a journal holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Journal {
    /// The inputs, in order.
    pub inputs: Vec<Input>,
    /// Where it is damaged or cut short: line number and reason; reading ended there.
    pub damage: Option<(usize, String)>,
}

/// Whether a text begins like a journal.
#[must_use]
pub fn is_journal(first_line: &str) -> bool {
    serde_json::from_str::<Head>(first_line).is_ok_and(|head| head.journal == FORMAT)
}

/// Reads a journal for a model; a damaged one gives what comes before the damage.
///
/// # Errors
/// When it cannot be read at all, or belongs to another model.
pub fn read_journal(input: impl BufRead, knowledge: &KnowledgeBase) -> Result<Journal, JournalError> {
    let mut lines = input.lines();
    let first = lines.next().transpose()?.unwrap_or_default();
    let head: Head = match serde_json::from_str(&first) {
        Ok(head) => head,
        Err(error) => return Ok(Journal { inputs: Vec::new(), damage: Some((1, error.to_string())) }),
    };
    let find = |name: &String| knowledge.signal(name).ok_or_else(|| JournalError::OtherModel(name.clone()));
    let signals = head.signals.iter().map(find).collect::<Result<Vec<SignalId>, _>>()?;
    let mut journal = Journal::default();
    for (number, line) in lines.enumerate() {
        let input = line.map_err(|error| error.to_string()).and_then(|line| parse(&line, &signals));
        match input {
            Ok(input) => journal.inputs.push(input),
            Err(reason) => {
                journal.damage = Some((number + 2, reason));
                break;
            }
        }
    }
    Ok(journal)
}

fn parse(line: &str, signals: &[SignalId]) -> Result<Input, String> {
    match serde_json::from_str(line).map_err(|error| error.to_string())? {
        Line::Tick { tick_ns } => Ok(Input::Tick(Time(tick_ns))),
        Line::Observation { signal, time_ns, received_ns, value } => Ok(Input::Observation(Observation {
            signal: *signals.get(signal).ok_or_else(|| format!("there is no signal number {signal}"))?,
            stamp: Time(time_ns),
            received: Time(received_ns),
            value: value.into(),
        })),
    }
}
