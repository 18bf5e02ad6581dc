//! Observations as JSON lines: `{"signal": "/a", "time_ns": 5, "received_ns": 5, "value": 1.775}`.
//!
//! `value` is a number, a list of numbers, or `{"lo": .., "hi": ..}`. JSON has no word for not-a-number and the infinities: they
//! are `null`, "inf" and "-inf". `received_ns` is optional.

use std::collections::BTreeMap;
use std::io::{self, BufRead, Write};

use serde_json::json;
use shsa_core::time::Time;

use super::line::{self, Cell};
use super::lines::Lines;
use super::topic::{Body, Field, Fields, Input, Listener, Times, Topic, TopicId, Value};
use super::{Place, RawValue, RecordingError, Sample};

/// One observation of a line.
struct Observation {
    signal: String,
    time: Time,
    received: Time,
    value: RawValue,
}

/// Reports the signals and their values.
pub(super) fn read(input: &mut dyn Input, listener: &mut dyn Listener) -> Result<(), RecordingError> {
    let mut topics: BTreeMap<String, TopicId> = BTreeMap::new();
    lines(input, |line| match line {
        Line::Observation(seen) => {
            let topic = topics.get(&seen.signal).copied().unwrap_or_else(|| {
                let fields = Fields::named([Field::new("value")]);
                let topic = listener.topic(Topic::new(&seen.signal, kind(&seen.value), fields));
                topics.insert(seen.signal.clone(), topic);
                topic
            });
            let value = match &seen.value {
                RawValue::Number(value) => Value::Number(*value),
                RawValue::Interval { lo, hi } => Value::Interval(*lo, *hi),
                RawValue::Vector(items) => Value::List(items),
            };
            let times = Times { received: seen.received, published: None, stamp: Some(seen.time) };
            listener.message(topic, times, Body::Values(&[value]));
        }
        Line::Damaged(number, problem) => listener.damaged(Place::Line(number), problem),
    });
    Ok(())
}

fn kind(value: &RawValue) -> &'static str {
    match value {
        RawValue::Number(_) => "number",
        RawValue::Interval { .. } => "interval",
        RawValue::Vector(_) => "list",
    }
}

enum Line {
    Observation(Observation),
    Damaged(u64, String),
}

/// Hands over the lines without the blank ones.
fn lines(input: impl BufRead, mut each: impl FnMut(Line)) {
    let mut lines = Lines::new(input);
    while let Some(line) = lines.read() {
        let line = match line {
            Ok(line) if line.text.trim_ascii().is_empty() => continue,
            Ok(line) => line,
            Err((number, problem)) => {
                each(Line::Damaged(number, problem));
                continue;
            }
        };
        let fields = serde_json::from_str::<line::Fields>(&line.text).map_err(|error| match error.is_eof() {
            true if !line.is_ended => "the file ends within this line".into(),
            _ if error.is_data() => error.to_string(),
            _ => format!("no JSON at column {}: {error}", error.column()),
        });
        each(match fields.and_then(observation) {
            Ok(seen) => Line::Observation(seen),
            Err(problem) => Line::Damaged(line.number, format!("{problem}; line left out")),
        });
    }
}

fn observation(fields: line::Fields) -> Result<Observation, String> {
    let line::Fields::Object { signal, time, received, value } = fields else {
        return Err("the line is no JSON object".into());
    };
    let Some(Cell::Text(signal)) = signal else { return Err("\"signal\" is missing or no text".into()) };
    let time = nanoseconds(time, "time_ns")?.ok_or("\"time_ns\" is missing")?;
    let received = nanoseconds(received, "received_ns")?.unwrap_or(time);
    let value = value.ok_or("\"value\" is missing")?;
    let value = recorded(value).ok_or("\"value\" is no number, list of numbers, or {\"lo\", \"hi\"}")?;
    Ok(Observation { signal, time, received, value })
}

fn nanoseconds(cell: Option<Cell>, key: &str) -> Result<Option<Time>, String> {
    let whole = match cell {
        None | Some(Cell::Null) => return Ok(None),
        Some(Cell::Whole(whole)) => Some(whole),
        Some(Cell::Number(number)) => (number.abs() < 9.2e18).then(|| number.round() as i64),
        Some(_) => None,
    };
    whole.map(|time| Some(Time(time))).ok_or_else(|| format!("\"{key}\" is no 64-bit number"))
}

fn recorded(cell: Cell) -> Option<RawValue> {
    match cell {
        Cell::List(items) => items.map(RawValue::Vector),
        Cell::Bounds { lo, hi } => Some(RawValue::Interval { lo: lo?, hi: hi? }),
        other => other.number().map(RawValue::Number),
    }
}

/// Writes samples as JSON lines, so that [`super::read`] returns the same samples; `name` returns the name of a wanted signal by
/// its index.
///
/// # Errors
/// Those of the writer.
pub fn write_jsonl<'a>(
    mut output: impl Write,
    samples: impl IntoIterator<Item = &'a Sample>,
    name: impl Fn(usize) -> &'a str,
) -> io::Result<()> {
    for Sample { wanted, time, received, value } in samples {
        let line = json!({
            "signal": name(*wanted), "time_ns": time.0, "received_ns": received.0, "value": written(value),
        });
        writeln!(output, "{line}")?;
    }
    Ok(())
}

fn written(value: &RawValue) -> serde_json::Value {
    let number = |number: f64| match number {
        number if number.is_infinite() => json!(if number > 0.0 { "inf" } else { "-inf" }),
        // Not-a-number becomes null.
        number => json!(number),
    };
    match value {
        RawValue::Number(value) => number(*value),
        RawValue::Interval { lo, hi } => json!({ "lo": number(*lo), "hi": number(*hi) }),
        RawValue::Vector(items) => items.iter().map(|item| number(*item)).collect(),
    }
}
