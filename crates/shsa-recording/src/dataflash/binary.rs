//! The binary form: each message is a header (`A3 95` and the kind) and the fields of its format.
//!
//! The log has no checksums. Where no message follows a message, reading goes on at the next place at which two messages follow
//! each other, so that a wrong byte costs one message. Memory is bounded: there are 256 kinds.

use std::collections::BTreeMap;
use std::io::{self, Read, SeekFrom};
use std::ops::ControlFlow;

use shsa_core::time::{Span, Time};

use super::super::record::{Records, Slot};
use super::super::topic::{Input, Listener, Times, TopicId};
use super::super::window::Window;
use super::super::{Place, RecordingError};
use super::clock;
use super::format::{FMT, Format, HEADER, Units};
use super::{GPS, GPS_FIELDS, TIMES, said_of_times};

/// The two bytes before each message.
pub(in super::super) const MAGIC: [u8; 2] = [0xa3, 0x95];

/// The longest message: its length has 8 bits.
const LENGTH_MAX: usize = 0xff;

/// How many bytes one step of the search after damage covers.
const SEARCH_BLOCK: usize = 1 << 16;

/// The most devices of one kind that get topics of their own; further ones share a topic.
const INSTANCES_MAX: usize = 64;

/// A kind of message, with the listener's topics for it.
struct Kind {
    format: Format,
    topics: BTreeMap<Option<i64>, TopicId>,
}

/// The definitions of a log that are known so far.
struct Log {
    kinds: BTreeMap<u8, Kind>,
    units: Units,
}

/// The content of a log, in the order of the file.
enum Event<'a> {
    Message(&'a mut Kind, &'a [u8]),
    Damage(u64, String),
}

/// Reads all messages.
pub(in super::super) fn read(
    input: &mut dyn Input,
    listener: &mut dyn Listener,
) -> Result<(), RecordingError> {
    let outcome = tied(input).and_then(|(log, epoch)| {
        input.seek(SeekFrom::Start(0))?;
        if input.fill_buf()?.is_empty() {
            listener.damaged(Place::Whole, "the file is empty".into());
        }
        listener.note(Place::Whole, said_of_times(epoch.is_some()));
        report(input, log, epoch, listener)
    });
    if let Err(failure) = outcome {
        listener.damaged(Place::Whole, format!("reading stopped: {failure}"));
    }
    Ok(())
}

/// How far the epoch is from the boot, by the first GPS message with the time; and the definitions up to there.
fn tied(input: &mut dyn Input) -> io::Result<(Log, Option<Span>)> {
    let mut epoch = None;
    let log = walk(input, Log::new(), &mut |event| {
        if let Event::Message(kind, message) = event {
            epoch = kind.epoch(message);
        }
        if epoch.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })?;
    Ok((log, epoch))
}

fn report(
    input: &mut dyn Input,
    log: Log,
    epoch: Option<Span>,
    listener: &mut dyn Listener,
) -> io::Result<()> {
    let mut records = Records::default();
    // What comes before the first time is of the boot.
    let mut last = Time::default() + epoch.unwrap_or_default();
    walk(input, log, &mut |event| {
        match event {
            Event::Message(kind, message) => {
                let time = kind.time(message);
                last = time.map_or(last, |time| epoch.map_or(time, |epoch| time + epoch));
                let topic = kind.report_topic(message, listener);
                if let (Ok(slots), true) = (&kind.format.slots, listener.is_wanted(topic)) {
                    records.pass(slots, message, |body| listener.message(topic, Times::at(last), body));
                }
            }
            Event::Damage(offset, problem) => listener.damaged(Place::Offset(offset), problem),
        }
        ControlFlow::Continue(())
    })?;
    Ok(())
}

impl Kind {
    fn of(format: Format) -> Kind {
        Kind { format, topics: BTreeMap::new() }
    }

    fn whole(&self, name: &str, message: &[u8]) -> Option<i64> {
        let slot = self.format.slot(name)?;
        slot.scalar.whole(message, slot.at)
    }

    fn time(&self, message: &[u8]) -> Option<Time> {
        let times = if self.format.is_old_gps() { &[("T", 1_000_000)][..] } else { &TIMES };
        let time = |(name, step): &(&str, i64)| self.whole(name, message)?.checked_mul(*step).map(Time);
        times.iter().find_map(time)
    }

    fn epoch(&self, message: &[u8]) -> Option<Span> {
        if !GPS.contains(&&*self.format.name) {
            return None;
        }
        GPS_FIELDS.iter().find_map(|(since_boot, step, week, week_ms)| {
            let since_boot = self.whole(since_boot, message).filter(|it| *it > 0)?.checked_mul(*step)?;
            clock::epoch(Time(since_boot), self.whole(week, message)?, self.whole(week_ms, message)?)
        })
    }

    /// The listener's topic for this message.
    fn report_topic(&mut self, message: &[u8], listener: &mut dyn Listener) -> TopicId {
        let Kind { format, topics } = self;
        let slots = format.slots.as_deref().unwrap_or_default();
        let slot = format.instance.and_then(|at| slots.get(at));
        let number = slot.and_then(|slot| slot.scalar.whole(message, slot.at));
        let known = topics.len() < INSTANCES_MAX || topics.contains_key(&number);
        let number = number.filter(|_| known);
        *topics.entry(number).or_insert_with(|| format.report_topic(number, listener))
    }
}

/// Goes through a log until the visitor stops.
fn walk(input: impl Read, log: Log, visit: &mut dyn FnMut(Event<'_>) -> ControlFlow<()>) -> io::Result<Log> {
    let mut walker = Walker { window: Window::new(input), log, visit };
    while walker.step()?.is_continue() {}
    Ok(walker.log)
}

struct Walker<'a, R> {
    window: Window<R>,
    log: Log,
    visit: &'a mut dyn FnMut(Event<'_>) -> ControlFlow<()>,
}

impl<R: Read> Walker<'_, R> {
    /// The next message, or the damage in its place; `Break` at the end.
    fn step(&mut self) -> io::Result<ControlFlow<()>> {
        let ahead = self.window.ahead(LENGTH_MAX + HEADER)?;
        let Some(length) = self.log.length(ahead) else {
            return Ok(if ahead.is_empty() { ControlFlow::Break(()) } else { self.search(0, None)? });
        };
        if ahead.len() < length {
            let problem =
                format!("the log ends within a message: {} of {length} bytes are there", ahead.len());
            let offset = self.window.offset();
            let _enough = (self.visit)(Event::Damage(offset, problem));
            return Ok(ControlFlow::Break(()));
        }
        let is_followed = self.log.is_beginning(ahead.get(length..).unwrap_or_default());
        if is_followed { self.handle(length) } else { self.search(1, Some(length)) }
    }

    /// Goes to where messages follow each other again. A message of a known length that may have begun here counts as one if the
    /// damage is in the message after it.
    fn search(&mut self, mut from: usize, mut candidate: Option<usize>) -> io::Result<ControlFlow<()>> {
        let begin = self.window.offset();
        loop {
            let ahead = self.window.ahead(SEARCH_BLOCK + 2 * (LENGTH_MAX + HEADER))?;
            let searched = ahead.len().min(SEARCH_BLOCK);
            let found = self.log.way_in(ahead, from..searched);
            // Only padding may follow the last message.
            let is_last = searched == ahead.len();
            let is_sound = |length| found.map_or(is_last, |found| self.log.is_behind(length, found));
            if let Some(length) = candidate.take().filter(|length| is_sound(*length)) {
                return self.handle(length);
            }
            self.window.pass(found.unwrap_or(searched));
            if found.is_some() || searched == 0 {
                break;
            }
            from = 0;
        }
        let lost = self.window.offset() - begin;
        Ok((self.visit)(Event::Damage(begin, format!("no message begins here: {lost} bytes are lost"))))
    }

    fn handle(&mut self, length: usize) -> io::Result<ControlFlow<()>> {
        let offset = self.window.offset();
        let Some(message) = self.window.exactly(length)? else { return Ok(ControlFlow::Break(())) };
        let (number, content) =
            (message.get(2).copied().unwrap_or(0), message.get(HEADER..).unwrap_or_default());
        let mut flow = ControlFlow::Continue(());
        if let Err(problem) = self.log.define(number, content) {
            flow = (self.visit)(Event::Damage(offset, problem));
        }
        if let (Some(kind), ControlFlow::Continue(())) = (self.log.kinds.get_mut(&number), flow) {
            flow = (self.visit)(Event::Message(kind, content));
        }
        self.window.pass(length);
        Ok(flow)
    }
}

impl Log {
    fn new() -> Log {
        Log { kinds: BTreeMap::from([(FMT, Kind::of(Format::of_formats()))]), units: Units::default() }
    }

    /// The length of the message that begins here; `None` where none does.
    fn length(&self, ahead: &[u8]) -> Option<usize> {
        let kind = ahead.strip_prefix(&MAGIC)?.first()?;
        self.kinds.get(kind).map(|kind| kind.format.length)
    }

    /// Whether a message begins here, or the file ends.
    fn is_beginning(&self, ahead: &[u8]) -> bool {
        // A kind may be defined later; at the end of the file there is less than a header.
        ahead.starts_with(&MAGIC) || MAGIC.starts_with(ahead)
    }

    /// Whether the damage lies after a first message of this length, given the distance of the next sound message: then a whole
    /// message lies between them. If not, the kind of the first message is wrong, and with it the length.
    fn is_behind(&self, length: usize, distance: usize) -> bool {
        let is_length = |length: usize| self.kinds.values().any(|kind| kind.format.length == length);
        distance.checked_sub(length).is_some_and(is_length) && !is_length(distance)
    }

    /// The first of these places at which two messages follow each other.
    fn way_in(&self, ahead: &[u8], mut places: std::ops::Range<usize>) -> Option<usize> {
        places.find(|at| {
            let rest = ahead.get(*at..).unwrap_or_default();
            let next = self.length(rest).and_then(|length| rest.get(length..));
            next.is_some_and(|next| next.is_empty() || self.length(next).is_some())
        })
    }

    /// Takes in the definitions in a message.
    fn define(&mut self, kind: u8, content: &[u8]) -> Result<(), String> {
        if kind == FMT {
            return self.add(content);
        }
        match self.kinds.get(&kind).map(|kind| &*kind.format.name) {
            Some("UNIT") => {
                if let Some((letter, label)) = self.letter(kind, content, "Label") {
                    self.units.add_unit(letter, label.text(content).unwrap_or_default());
                }
            }
            Some("MULT") => {
                if let Some((letter, multiplier)) = self.letter(kind, content, "Mult") {
                    self.units.add_multiplier(letter, multiplier.number(content, 0).unwrap_or(0.0));
                }
            }
            Some("FMTU") => self.apply_units(kind, content),
            _ => {}
        }
        Ok(())
    }

    fn add(&mut self, content: &[u8]) -> Result<(), String> {
        let (kind, format) = Format::of_message(content).ok_or("a format that cannot be understood")?;
        // Logs repeat formats; a repeated one must not remove the known units.
        let is_known = self.kinds.get(&kind).is_some_and(|it| it.format.is_same(&format));
        if is_known || kind == FMT {
            return Ok(());
        }
        let problem = format.slots.as_ref().err().map(|problem| format!("format {}: {problem}", format.name));
        self.kinds.insert(kind, Kind::of(format));
        problem.map_or(Ok(()), Err)
    }

    /// The letter that a message of units explains, and the field with its meaning.
    fn letter(&self, kind: u8, content: &[u8], name: &str) -> Option<(u8, Slot)> {
        let format = &self.kinds.get(&kind)?.format;
        let id = format.slot("Id")?;
        let letter = id.scalar.whole(content, id.at)?;
        Some((u8::try_from(letter).ok()?, format.slot(name)?.clone()))
    }

    fn apply_units(&mut self, kind: u8, content: &[u8]) {
        let Some(format) = self.kinds.get(&kind).map(|kind| &kind.format) else { return };
        let text = |name: &str| format.slot(name).and_then(|slot| slot.text(content)).unwrap_or_default();
        let of = format.slot("FmtType").and_then(|slot| slot.scalar.whole(content, slot.at));
        let (units, multipliers) = (text("UnitIds").to_owned(), text("MultIds").to_owned());
        let of = of.and_then(|of| u8::try_from(of).ok());
        if let Some(described) = of.and_then(|of| self.kinds.get_mut(&of)) {
            self.units.apply(&mut described.format, units.as_bytes(), multipliers.as_bytes());
        }
    }
}
