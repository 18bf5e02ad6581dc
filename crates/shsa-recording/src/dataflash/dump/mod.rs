//! What `mavlogdump` of pymavlink prints of a log of ArduPilot or of MAVLink telemetry, in its text and its JSON.
//!
//! `2017-09-10 10:49:22.70: IMU {TimeUS : 402644506, GyrX : -0.07}` and `{"meta": {"type": "IMU", "timestamp": ..}, "data": {..}}`
//!
//! Messages with the time since boot have it, tied to the epoch as in the log itself, or by the first line where the dump has no
//! message of GPS. All others have the time of their line. The lines of `FMT` and `FMTU` give units and the numbers of devices,
//! where the dump has them.

mod line;

use std::collections::BTreeMap;
use std::io::SeekFrom;

use shsa_core::time::{Span, Time};
use shsa_message::zone::Zone;

use super::super::lines::{self, Lines};
use super::super::record::Slot;
use super::super::stamp::Doubts;
use super::super::topic::{Body, Field, Fields, Input, Listener, Times, Topic, TopicId, Value};
use super::super::{Place, ReadOptions, RecordingError};
use super::format::{Format, Units};
use super::text::of_letter;
use super::{GPS, GPS_FIELDS, TIMES, clock, said_of_times};
use line::{At, Message, is_likely, message};

/// The most topics: kinds of messages by their senders and devices.
const TOPICS_MAX: usize = 1 << 14;

/// Whether one of the first lines is of a dump.
pub(in super::super) fn is_log(head: &[u8]) -> bool {
    let text = String::from_utf8_lossy(head);
    let mut lines = lines::of(&text);
    lines.any(|line| message(line, &Zone::default(), |_| None).is_some())
}

/// A topic, with the names of its fields so far.
struct Known {
    topic: TopicId,
    fields: Vec<String>,
}

/// A dump, as far as it is read.
struct Dump<'a> {
    zone: &'a Zone,
    formats: BTreeMap<String, (String, Format)>,
    units: Units,
    topics: BTreeMap<String, Known>,
    /// How far the epoch is from the boot.
    epoch: Option<Span>,
    /// Whether a message of GPS gives the epoch.
    is_tied: bool,
    doubts: Doubts,
    last: Time,
    /// Whether a date without a zone was used.
    is_placeless: bool,
    /// How many tags the messages have.
    tags: usize,
    too_many: u64,
}

/// Reads all messages.
pub(in super::super) fn read(
    input: &mut dyn Input,
    options: &ReadOptions,
    listener: &mut dyn Listener,
) -> Result<(), RecordingError> {
    let mut dump = Dump::tied(input, &options.zone);
    if let Err(failure) = input.seek(SeekFrom::Start(0)) {
        listener.damaged(Place::Whole, format!("reading stopped: {failure}"));
        return Ok(());
    }
    let (mut lines, mut other) = (Lines::new(input), 0_u64);
    while let Some(line) = lines.next(listener) {
        let place = Place::Line(line.number);
        match message(&line.text, dump.zone, |name| dump.columns(name)) {
            // At the end of the file, the numbers of the sender may be missing.
            Some(message) if line.is_ended || message.tags.len() == dump.tags => {
                dump.report(&message, listener);
            }
            None if !is_likely(&line.text) => other += u64::from(!line.text.trim().is_empty()),
            None if line.is_ended => {
                listener.damaged(place, "no message of mavlogdump; line left out".into())
            }
            _ => listener.damaged(place, "the file ends within this line; line left out".into()),
        }
    }
    if other > 0 {
        listener.note(Place::Whole, format!("{other} lines hold no message"));
    }
    dump.finish(listener);
    Ok(())
}

impl<'a> Dump<'a> {
    /// A dump whose times are tied to the epoch by what its lines hold; keeps the definitions up to there.
    fn tied(input: &mut dyn Input, zone: &'a Zone) -> Dump<'a> {
        let mut dump = Dump {
            zone,
            formats: BTreeMap::new(),
            units: Units::default(),
            topics: BTreeMap::new(),
            epoch: None,
            is_tied: false,
            doubts: Doubts::default(),
            last: Time::default(),
            is_placeless: false,
            tags: 0,
            too_many: 0,
        };
        let (mut lines, mut first) = (Lines::new(input), None);
        while let Some(line) = lines.read() {
            let Ok(line) = line else { continue };
            let Some(message) = message(&line.text, zone, |name| dump.columns(name)) else { continue };
            dump.define(&message);
            dump.epoch = epoch(&message);
            if dump.epoch.is_some() {
                dump.is_tied = true;
                return dump;
            }
            first = first.or_else(|| since_boot(&message).map(|since| (message.at, since)));
        }
        if let Some((at, since)) = first {
            dump.epoch = Some(dump.moment(at) - since);
        }
        dump
    }

    /// The names of the fields of a kind.
    fn columns(&self, name: &str) -> Option<Vec<&str>> {
        let slots = self.formats.get(name)?.1.slots.as_ref().ok()?;
        Some(slots.iter().map(|slot| &*slot.name).collect())
    }

    /// The time of a line.
    fn moment(&mut self, at: At) -> Time {
        match at {
            At::Epoch(time) => time,
            At::Shown(moment) => {
                self.is_placeless = true;
                self.doubts.settle(&moment)
            }
        }
    }

    /// The time of a message. In a log of ArduPilot one without a time has that of the one before.
    fn time(&mut self, message: &Message<'_>) -> Time {
        self.last = match (self.epoch, since_boot(message)) {
            (Some(epoch), Some(since)) => since + epoch,
            (Some(epoch), None) => self.last.max(Time::default() + epoch),
            (None, _) => self.moment(message.at),
        };
        self.last
    }

    fn report(&mut self, message: &Message<'_>, listener: &mut dyn Listener) {
        self.define(message);
        self.tags = message.tags.len();
        let time = self.time(message);
        let Some(choice) = self.choice(message, listener) else {
            self.too_many += 1;
            return;
        };
        let Some(known) = self.topics.get(&choice).filter(|known| listener.is_wanted(known.topic)) else {
            return;
        };
        let format = self.formats.get(&*message.name).map(|(_, format)| format);
        let mut values = Vec::with_capacity(known.fields.len());
        for (at, name) in known.fields.iter().enumerate() {
            let same = message.fields.get(at).filter(|(known, _)| known == name);
            let cell = same.or_else(|| message.fields.iter().find(|(known, _)| known == name));
            let is_text = format.and_then(|format| format.slot(name)).is_some_and(Slot::is_text);
            values.push(cell.map_or(Value::Missing, |(_, cell)| cell.value(is_text)));
        }
        listener.message(known.topic, Times::at(time), Body::Values(&values));
    }

    /// The unique name of a message's topic, which is reported again with fields that are new; `None` where there are too many.
    fn choice(&mut self, message: &Message<'_>, listener: &mut dyn Listener) -> Option<String> {
        let format = self.formats.get(&*message.name).map(|(_, format)| format);
        let device = format.and_then(|format| format.slots.as_ref().ok()?.get(format.instance?));
        let device = device.and_then(|slot| message.whole(&slot.name));
        let full = device.map_or(message.name.to_string(), |device| format!("{}[{device}]", message.name));
        let tags: Vec<(&str, &str)> = message.tags.iter().map(|(name, it)| (*name, &**it)).collect();
        let topic =
            Topic { full: &full, tags: &tags, ..Topic::new(&message.name, &message.name, Fields::Json) };
        let choice = topic.choice();
        let known = self.topics.get(&choice);
        let has = |name: &str| known.is_some_and(|known| known.fields.iter().any(|field| field == name));
        if known.is_none() && self.topics.len() == TOPICS_MAX {
            return None;
        }
        if known.is_none() || !message.fields.iter().all(|(name, _)| has(name)) {
            let mut fields = known.map(|known| known.fields.clone()).unwrap_or_default();
            let new = message.fields.iter().filter(|(name, _)| !has(name));
            fields.extend(new.map(|(name, _)| name.to_string()));
            let unit = |name: &str| Some(format?.slot(name)?.unit.clone()).filter(|unit| !unit.is_empty());
            let named = fields.iter().map(|name| Field { unit: unit(name), ..Field::new(name) });
            let topic = listener.topic(Topic { fields: Fields::named(named), ..topic });
            self.topics.insert(choice.clone(), Known { topic, fields });
        }
        Some(choice)
    }

    /// Takes in the definitions in a message.
    fn define(&mut self, message: &Message<'_>) -> Option<()> {
        match &*message.name {
            "FMT" => {
                let name = message.text("Name")?;
                let (characters, columns) = (message.text("Format")?, message.text("Columns")?);
                let length = message.whole("Length")?.try_into().ok()?;
                if self.formats.len() < TOPICS_MAX && !self.formats.contains_key(name) {
                    let format = Format::new(name, length, characters, columns);
                    self.formats.insert(name.to_owned(), (message.text("Type")?.to_owned(), format));
                }
            }
            "UNIT" => self.units.add_unit(of_letter(message.text("Id")?)?, message.text("Label")?),
            "MULT" => {
                self.units
                    .add_multiplier(of_letter(message.text("Id")?)?, message.text("Mult")?.parse().ok()?);
            }
            "FMTU" => {
                let number = message.text("FmtType")?;
                let (units, multipliers) = (message.text("UnitIds")?, message.text("MultIds")?);
                let (_, format) = self.formats.values_mut().find(|(known, _)| known == number)?;
                self.units.apply(format, units.as_bytes(), multipliers.as_bytes());
            }
            _ => {}
        }
        Some(())
    }

    fn finish(self, listener: &mut dyn Listener) {
        if self.too_many > 0 {
            let problem =
                format!("{} messages are left out: there are more than {TOPICS_MAX} topics", self.too_many);
            listener.damaged(Place::Whole, problem);
        }
        let said = match (self.is_tied, self.epoch) {
            (true, _) => Some(said_of_times(true)),
            (_, Some(_)) => {
                Some("times since boot are tied to the epoch by the first line that has one".to_owned())
            }
            _ => None,
        };
        let placeless = "its times name no zone and are taken for UTC; --time-zone says another";
        let placeless = (self.is_placeless && !self.zone.is_given).then(|| placeless.to_owned());
        let notes = said.into_iter().chain(placeless).chain(self.doubts.notes());
        notes.for_each(|said| listener.note(Place::Whole, said));
    }
}

/// The time since boot that a message of ArduPilot has.
fn since_boot(message: &Message<'_>) -> Option<Time> {
    let is_old_gps = message.name.starts_with("GPS") && message.text("T").is_some();
    let times = if is_old_gps { &[("T", 1_000_000)][..] } else { &TIMES };
    let time = |(name, step): &(&str, i64)| message.whole(name)?.checked_mul(*step).map(Time);
    times.iter().find_map(time)
}

/// How far the epoch is from the boot, by a message of GPS that has both.
fn epoch(message: &Message<'_>) -> Option<Span> {
    if !GPS.contains(&&*message.name) {
        return None;
    }
    GPS_FIELDS.iter().find_map(|(since_boot, step, week, week_ms)| {
        let since_boot = message.whole(since_boot).filter(|it| *it > 0)?.checked_mul(*step)?;
        clock::epoch(Time(since_boot), message.whole(week)?, message.whole(week_ms)?)
    })
}

#[cfg(test)]
mod tests;
