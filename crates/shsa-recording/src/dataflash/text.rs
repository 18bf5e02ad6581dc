//! The text form: each message is a line, `IMU, 402644506, 0.0189, ..`, as ground stations write it. Numbers are
//! already scaled.

use std::collections::BTreeMap;
use std::io::SeekFrom;

use shsa_core::time::{Span, Time};

use super::super::lines::Lines;
use super::super::record::Slot;
use super::super::topic::{Body, Input, Listener, Times, TopicId, Value};
use super::super::{Place, RecordingError};
use super::clock;
use super::format::{Format, Units};
use super::{GPS, GPS_FIELDS, TIMES, said_of_times};

/// The most kinds of messages: the binary form has no room for more.
const KINDS_MAX: usize = 256;

/// The most devices of one kind that get topics of their own; further ones share a topic.
const INSTANCES_MAX: usize = 64;

/// Whether a text begins as these logs do: with the definition of a format, after a few lines of greeting at most.
pub(in super::super) fn is_log(head: &[u8]) -> bool {
    head.split(|byte| matches!(byte, b'\n' | b'\r')).any(|line| line.starts_with(b"FMT, 128, 89, FMT"))
}

/// A kind of message, with the listener's topics for it.
struct Kind {
    format: Format,
    number: u8,
    topics: BTreeMap<Option<i64>, TopicId>,
}

/// The definitions of a log that are known so far.
#[derive(Default)]
struct Log {
    kinds: BTreeMap<String, Kind>,
    units: Units,
}

/// Reads all messages.
pub(in super::super) fn read(
    input: &mut dyn Input,
    listener: &mut dyn Listener,
) -> Result<(), RecordingError> {
    let mut log = Log::default();
    let epoch = log.tied(input);
    if let Err(failure) = input.seek(SeekFrom::Start(0)) {
        listener.damaged(Place::Whole, format!("reading stopped: {failure}"));
        return Ok(());
    }
    listener.note(Place::Whole, said_of_times(epoch.is_some()));
    let mut lines = Lines::new(input);
    // What comes before the first time is of the boot.
    let mut last = Time::default() + epoch.unwrap_or_default();
    let mut other = 0_u64;
    while let Some(line) = lines.next(listener) {
        let time = log.report(&line.text, last, epoch, listener);
        match time {
            Ok(Some(time)) => last = time,
            Ok(None) => other += u64::from(!line.text.trim().is_empty()),
            Err(_) if !line.is_ended => {
                listener.damaged(
                    Place::Line(line.number),
                    "the file ends within this line; line left out".into(),
                );
            }
            Err(problem) => listener.damaged(Place::Line(line.number), format!("{problem}; line left out")),
        }
    }
    if other > 0 {
        listener.note(Place::Whole, format!("{other} lines are no messages of a kind that is defined"));
    }
    Ok(())
}

/// The cells of a message of this format; a text in the last field may have commas.
fn cells<'a>(slots: &[Slot], rest: &'a str) -> Result<Vec<&'a str>, String> {
    let is_text_last = slots.last().is_some_and(Slot::is_text);
    let cells: Vec<&str> = match is_text_last {
        true => rest.splitn(slots.len(), ',').map(str::trim).collect(),
        false => rest.split(',').take(slots.len() + 1).map(str::trim).collect(),
    };
    if cells.len() != slots.len() {
        return Err(format!("the message has not {} values as its format", slots.len()));
    }
    Ok(cells)
}

impl Log {
    /// How far the epoch is from the boot, by the first GPS message with the time; keeps the definitions up to there.
    fn tied(&mut self, input: &mut dyn Input) -> Option<Span> {
        let mut lines = Lines::new(input);
        while let Some(line) = lines.read() {
            let Ok(line) = line else { continue };
            let Some((name, rest)) = line.text.split_once(',') else { continue };
            self.define(name.trim(), rest);
            if !GPS.contains(&name.trim()) {
                continue;
            }
            let kind = self.kinds.get(name.trim());
            let epoch =
                kind.and_then(|kind| kind.epoch(&cells(kind.format.slots.as_deref().ok()?, rest).ok()?));
            if epoch.is_some() {
                return epoch;
            }
        }
        None
    }

    /// Reports a line's message; `None` for a line without one. Returns the message's time, or the one before where it has none.
    fn report(
        &mut self,
        line: &str,
        last: Time,
        epoch: Option<Span>,
        listener: &mut dyn Listener,
    ) -> Result<Option<Time>, String> {
        let Some((name, rest)) = line.split_once(',') else { return Ok(None) };
        let name = name.trim();
        self.define(name, rest);
        let Some(kind) = self.kinds.get_mut(name) else { return Ok(None) };
        let slots = kind.format.slots.clone()?;
        let cells = cells(&slots, rest)?;
        let time = kind.time(&cells).map_or(last, |time| epoch.map_or(time, |epoch| time + epoch));
        let topic = kind.report_topic(&cells, listener);
        if listener.is_wanted(topic) {
            let values: Vec<Value<'_>> =
                slots.iter().zip(cells).map(|(slot, cell)| value(slot, cell)).collect();
            listener.message(topic, Times::at(time), Body::Values(&values));
        }
        Ok(Some(time))
    }

    /// Takes in the definitions in a message.
    fn define(&mut self, name: &str, rest: &str) {
        let cells: Vec<&str> = rest.splitn(5, ',').map(str::trim).collect();
        match (name, cells.as_slice()) {
            ("FMT", [number, length, name, characters, columns]) => {
                let (Ok(number), Ok(length)) = (number.parse(), length.parse()) else { return };
                if self.kinds.len() < KINDS_MAX && !self.kinds.contains_key(*name) {
                    let format = Format::new(name, length, characters, columns);
                    self.kinds.insert((*name).to_owned(), Kind { format, number, topics: BTreeMap::new() });
                }
            }
            ("UNIT", [_, letter, label]) => {
                if let Some(letter) = of_letter(letter) {
                    self.units.add_unit(letter, label);
                }
            }
            ("MULT", [_, letter, multiplier]) => {
                if let (Some(letter), Ok(multiplier)) = (of_letter(letter), multiplier.parse()) {
                    self.units.add_multiplier(letter, multiplier);
                }
            }
            ("FMTU", [_, number, units, multipliers]) => {
                let described = self.kinds.values_mut().find(|kind| number.parse() == Ok(kind.number));
                if let Some(described) = described {
                    self.units.apply(&mut described.format, units.as_bytes(), multipliers.as_bytes());
                }
            }
            _ => {}
        }
    }
}

/// A letter, written as such or by its number.
pub(super) fn of_letter(text: &str) -> Option<u8> {
    match text.as_bytes() {
        [letter] if !letter.is_ascii_digit() => Some(*letter),
        _ => text.parse().ok(),
    }
}

fn value<'a>(slot: &Slot, cell: &'a str) -> Value<'a> {
    if slot.is_text() {
        return Value::Text(cell);
    }
    let whole = cell.parse().ok().map(Value::Whole);
    whole.or_else(|| cell.parse().ok().map(Value::Number)).unwrap_or(Value::Text(cell))
}

impl Kind {
    fn whole(&self, name: &str, cells: &[&str]) -> Option<i64> {
        let slots = self.format.slots.as_ref().ok()?;
        let at = slots.iter().position(|slot| slot.name == name)?;
        cells.get(at)?.parse().ok()
    }

    fn time(&self, cells: &[&str]) -> Option<Time> {
        let times = if self.format.is_old_gps() { &[("T", 1_000_000)][..] } else { &TIMES };
        let time = |(name, step): &(&str, i64)| self.whole(name, cells)?.checked_mul(*step).map(Time);
        times.iter().find_map(time)
    }

    fn epoch(&self, cells: &[&str]) -> Option<Span> {
        GPS_FIELDS.iter().find_map(|(since_boot, step, week, week_ms)| {
            let since_boot = self.whole(since_boot, cells).filter(|it| *it > 0)?.checked_mul(*step)?;
            clock::epoch(Time(since_boot), self.whole(week, cells)?, self.whole(week_ms, cells)?)
        })
    }

    /// The listener's topic for this message.
    fn report_topic(&mut self, cells: &[&str], listener: &mut dyn Listener) -> TopicId {
        let Kind { format, topics, .. } = self;
        let number = format.instance.and_then(|at| cells.get(at)?.parse::<i64>().ok());
        let known = topics.len() < INSTANCES_MAX || topics.contains_key(&number);
        let number = number.filter(|_| known);
        *topics.entry(number).or_insert_with(|| format.report_topic(number, listener))
    }
}
