//! Observations as JSON lines: `{"signal": "/a", "time_ns": 5, "received_ns": 5, "value": 1.775}`.
//!
//! `value` is a number, a list of numbers, or `{"lo": .., "hi": ..}`; `null` in a number's place is not-a-number (JSON
//! has no word for it), the texts "inf" and "-inf" are the infinities. `received_ns` may be left out.

use std::collections::BTreeMap;
use std::io::{self, BufRead, Read, Write};

use serde_json::{Value, json};
use shsa_core::time::Time;

use super::gathered::Gathered;
use super::line::{Cell, Fields, LINE_MAX};
use super::{Place, RawValue, Sample, TopicInfo, Want, names};

/// One observation as a line holds it.
struct Observation {
    signal: String,
    time: Time,
    received: Time,
    value: RawValue,
}

/// Reads the signals that are wanted, by their names or by their whole source texts.
pub(super) fn read(input: impl BufRead, wants: &[Want<'_>], gathered: &mut Gathered) {
    lines(input, |line| match line {
        Line::Observation(seen) => deliver(&seen, wants, gathered),
        Line::Damaged(number, problem) => gathered.damaged(Place::Line(number), problem),
    });
}

fn deliver(seen: &Observation, wants: &[Want<'_>], gathered: &mut Gathered) {
    let mut is_wanted = false;
    for want in wants.iter().filter(|want| asks_for(want, &seen.signal)) {
        is_wanted = true;
        gathered.found_in(want.index, &seen.signal);
        gathered.sample(want.index, seen.time, seen.received, seen.value.clone());
    }
    if !is_wanted {
        gathered.know(&seen.signal);
    }
}

fn asks_for(want: &Want<'_>, signal: &str) -> bool {
    names::bare(want.signal) == names::bare(signal) || want.text == signal
}

enum Line {
    Observation(Observation),
    Damaged(u64, String),
}

/// Hands over line by line; blank lines are none.
fn lines(mut input: impl BufRead, mut each: impl FnMut(Line)) {
    let mut bytes = Vec::new();
    for number in 1.. {
        bytes.clear();
        match input.by_ref().take(LINE_MAX).read_until(b'\n', &mut bytes) {
            Ok(0) => return,
            Ok(length) if length as u64 == LINE_MAX && !bytes.ends_with(b"\n") => {
                // What is of no use is not kept while the rest of it goes by.
                bytes = Vec::new();
                let most = LINE_MAX >> 20;
                each(Line::Damaged(number, format!("the line is longer than {most} MiB; line left out")));
                if let Err(failure) = skip_line(&mut input) {
                    return each(Line::Damaged(number, format!("reading stopped here: {failure}")));
                }
                continue;
            }
            Ok(_) => {}
            Err(failure) => return each(Line::Damaged(number, format!("reading stopped here: {failure}"))),
        }
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes);
        if bytes.trim_ascii().is_empty() {
            continue;
        }
        let fields = serde_json::from_slice::<Fields>(bytes).map_err(|error| match error.is_eof() {
            true if !bytes.ends_with(b"\n") => "the file ends within this line".into(),
            _ if error.is_data() => error.to_string(),
            _ => format!("no JSON at column {}: {error}", error.column()),
        });
        each(match fields.and_then(observation) {
            Ok(seen) => Line::Observation(seen),
            Err(problem) => Line::Damaged(number, format!("{problem}; line left out")),
        });
    }
}

/// Goes to the end of a line.
fn skip_line(input: &mut impl BufRead) -> io::Result<()> {
    loop {
        let waiting = input.fill_buf()?;
        let end = waiting.iter().position(|byte| *byte == b'\n');
        let passed = end.map_or(waiting.len(), |end| end + 1);
        let is_over = end.is_some() || waiting.is_empty();
        input.consume(passed);
        if is_over {
            return Ok(());
        }
    }
}

fn observation(fields: Fields) -> Result<Observation, String> {
    let Fields::Object { signal, time, received, value } = fields else {
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

/// Every signal of the file.
pub(super) fn topics(input: impl BufRead) -> Vec<TopicInfo> {
    let mut seen: BTreeMap<String, (&str, usize, Time, Time)> = BTreeMap::new();
    lines(input, |line| {
        let Line::Observation(Observation { signal, received, value, .. }) = line else { return };
        let kind = match value {
            RawValue::Number(_) => "number",
            RawValue::Interval { .. } => "interval",
            RawValue::Vector(_) => "list",
        };
        let (_, count, from, to) = seen.entry(signal).or_insert((kind, 0, received, received));
        *count += 1;
        *from = received.min(*from);
        *to = received.max(*to);
    });
    let info = |(name, (kind, count, from, to)): (String, (&str, usize, Time, Time))| TopicInfo {
        name,
        kind: kind.to_owned(),
        count,
        rate_hz: super::mean_rate(count, from, to),
    };
    seen.into_iter().map(info).collect()
}

/// Writes samples as JSON lines, so that [`super::read`] gives the same samples again; `name` gives the name of a
/// wanted signal by its index.
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

fn written(value: &RawValue) -> Value {
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
