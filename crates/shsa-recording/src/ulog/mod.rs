//! ULog, the logs of PX4: messages of fixed fields after definitions of their formats, in one file.
//!
//! Format: <https://docs.px4.io/main/en/dev_log/ulog_file_format.html>. After damage, reading goes on at the next place where
//! messages follow each other whose lengths fit their formats. So no index is needed, and a wrong byte costs one message. Times
//! count from the boot; the first GNSS fix with a time relates them to the epoch. Memory is bounded by the longest message and by
//! the limits of the definitions.

mod definition;
mod message;

use std::collections::BTreeMap;
use std::io::{self, Read, SeekFrom};
use std::ops::ControlFlow;
use std::rc::Rc;

use shsa_core::time::{Span, Time};

use super::record::{Records, Slot, array};
use super::topic::{Fields, Input, Listener, Times, Topic, TopicId};
use super::window::Window;
use super::{Place, RecordingError};
use definition::{Formats, Layout, is_name};
use message::{CHAIN_BYTES, HEADER, Reading};

/// The first bytes of every log; the version follows.
pub(super) const MAGIC: &[u8] = b"ULog\x01\x12\x35";

/// The header: the magic, the version, the time of the start.
const FILE_HEADER: usize = 16;

/// How many bytes one step of the search after damage covers.
const SEARCH_BLOCK: usize = 1 << 16;

/// The most fields of all formats, as formats are kept.
const SLOTS_MAX: usize = 1 << 17;

/// A GNSS clock below this value has no time yet: 2000-01-01, in microseconds.
const CLOCK_MIN_US: i64 = 946_684_800_000_000;

/// A topic's messages, subscribed by a message of kind `A`.
struct Subscription {
    topic: String,
    instance: u8,
    layout: Rc<Layout>,
    /// The place of the microseconds since boot.
    timestamp: Option<usize>,
    /// The listener's topic, once there is a message.
    topic_id: Option<TopicId>,
}

/// The state of the log so far.
#[derive(Default)]
struct Log {
    formats: Formats,
    layouts: BTreeMap<String, Rc<Layout>>,
    slots: usize,
    subscriptions: BTreeMap<u16, Subscription>,
    /// Where appended parts begin, as after a crash; the message before each may be incomplete.
    appended: Vec<u64>,
}

/// The content of a log, in the order of the file.
enum Event<'a> {
    /// A message of a topic.
    Data(&'a mut Subscription, &'a [u8]),
    /// The logger was too slow for this many milliseconds.
    Dropout(u64, u16),
    /// A part is lost here.
    Damage(u64, String),
}

/// Reads all topics.
pub(super) fn read(input: &mut dyn Input, listener: &mut dyn Listener) -> Result<(), RecordingError> {
    let outcome = tied(input).and_then(|epoch| {
        input.seek(SeekFrom::Start(0))?;
        report(input, epoch, listener)
    });
    if let Err(failure) = outcome {
        listener.damaged(Place::Whole, format!("reading stopped: {failure}"));
    }
    Ok(())
}

/// How far the epoch is from the boot, by the first fix with a time.
fn tied(input: &mut dyn Input) -> io::Result<Option<Span>> {
    let mut epoch = None;
    walk(input, &mut |event| {
        if let Event::Data(subscription, message) = event {
            epoch = subscription.epoch(message);
        }
        if epoch.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })?;
    Ok(epoch)
}

fn report(input: &mut dyn Input, epoch: Option<Span>, listener: &mut dyn Listener) -> io::Result<()> {
    let mut records = Records::default();
    let (mut dropouts, mut dropped_ms, mut first_at) = (0_u64, 0_u64, 0);
    let mut last = Time::default();
    walk(input, &mut |event| {
        match event {
            Event::Data(subscription, message) => {
                let time = subscription.time(message);
                last = time.map_or(last, |time| epoch.map_or(time, |epoch| time + epoch));
                let topic = subscription.report_topic(listener);
                if listener.is_wanted(topic) {
                    let slots = &subscription.layout.slots;
                    records.pass(slots, message, |body| listener.message(topic, Times::at(last), body));
                }
            }
            Event::Dropout(offset, length_ms) => {
                first_at = if dropouts == 0 { offset } else { first_at };
                dropouts += 1;
                dropped_ms += u64::from(length_ms);
            }
            Event::Damage(offset, problem) => listener.damaged(Place::Offset(offset), problem),
        }
        ControlFlow::Continue(())
    })?;
    if dropouts > 0 {
        let what =
            format!("the logger left messages out here: {dropouts} times in all, {dropped_ms} ms together");
        listener.note(Place::Offset(first_at), what);
    }
    let what = match epoch {
        Some(_) => "times since boot are tied to the epoch by the first fix of GNSS that tells the time",
        None => "times count from the boot: no fix of GNSS tells the time",
    };
    listener.note(Place::Whole, what.to_owned());
    Ok(())
}

impl Subscription {
    fn time(&self, message: &[u8]) -> Option<Time> {
        let us = u64::from_le_bytes(array(message, self.timestamp?)?);
        i64::try_from(us).ok()?.checked_mul(1_000).map(Time)
    }

    /// The listener's topic.
    fn report_topic(&mut self, listener: &mut dyn Listener) -> TopicId {
        let Subscription { topic, instance, layout, topic_id, .. } = self;
        *topic_id.get_or_insert_with(|| {
            let fields = Fields::named(layout.slots.iter().map(Slot::field));
            let full = format!("{topic}[{instance}]");
            listener.topic(Topic { full: &full, ..Topic::new(topic, topic, fields) })
        })
    }

    /// How far the epoch is from the boot, if this is a GNSS fix with a time.
    fn epoch(&self, message: &[u8]) -> Option<Span> {
        let clock = self.layout.slot("time_utc_usec")?;
        let fix = self.layout.slot("fix_type").and_then(|slot| slot.scalar.whole(message, slot.at));
        let clock_us = clock.scalar.whole(message, clock.at).filter(|us| *us > CLOCK_MIN_US)?;
        let since_boot = self.time(message)?;
        // 2 is a two-dimensional fix.
        (fix.is_none_or(|fix| fix >= 2)).then_some(Time(clock_us.checked_mul(1_000)?) - since_boot)
    }
}

/// Goes through a log until the visitor stops.
fn walk(input: &mut dyn Input, visit: &mut dyn FnMut(Event<'_>) -> ControlFlow<()>) -> io::Result<()> {
    let mut walker = Walker { window: Window::new(input), log: Log::default(), visit, lost: BTreeMap::new() };
    let head = walker.window.ahead(FILE_HEADER)?;
    if head.len() < FILE_HEADER {
        let problem = format!("the log ends within its header of {FILE_HEADER} bytes");
        let _enough = (walker.visit)(Event::Damage(head.len() as u64, problem));
        return Ok(());
    }
    walker.window.pass(FILE_HEADER);
    while walker.step()?.is_continue() {}
    walker.say_lost();
    Ok(())
}

struct Walker<'a, R> {
    window: Window<R>,
    log: Log,
    visit: &'a mut dyn FnMut(Event<'_>) -> ControlFlow<()>,
    /// Messages of topics whose definition is lost: the place of the first, and the number.
    lost: BTreeMap<u16, (u64, u64)>,
}

impl<R: Read> Walker<'_, R> {
    /// The next message, or the damage in its place; `Break` at the end.
    fn step(&mut self) -> io::Result<ControlFlow<()>> {
        let offset = self.window.offset();
        let head = self.window.ahead(HEADER)?;
        if head.is_empty() {
            return Ok(ControlFlow::Break(()));
        }
        let length = HEADER + usize::from(array(head, 0).map_or(0, u16::from_le_bytes));
        if let Some(end) = self.log.appended.iter().find(|at| (offset..offset + length as u64).contains(at)) {
            // The appended part begins within this message.
            let cut = *end - offset;
            self.log.appended.retain(|at| *at > offset + cut);
            self.window.skip(cut)?;
            return Ok(ControlFlow::Continue(()));
        }
        match self.log.reading(self.window.ahead(length)?) {
            Reading::Sound(length) => self.handle(length),
            Reading::Doubtful(length) => self.doubt(length),
            Reading::Cut => self.end(length),
            Reading::Wrong => self.search("no message begins here"),
        }
    }

    /// Ends within this message, unless its length is wrong and others follow.
    fn end(&mut self, length: usize) -> io::Result<ControlFlow<()>> {
        let offset = self.window.offset();
        let ahead = self.window.ahead(length)?;
        let there = ahead.len();
        if self.log.way_in(ahead.get(1..).unwrap_or_default(), there).is_some() {
            return self.search("no message begins here");
        }
        let problem = format!("the log ends within a message: {there} of {length} bytes are there");
        let _enough = (self.visit)(Event::Damage(offset, problem));
        Ok(ControlFlow::Break(()))
    }

    /// Skips a message of unknown content where the one after it is known.
    fn doubt(&mut self, length: usize) -> io::Result<ControlFlow<()>> {
        let ahead = self.window.ahead(length + CHAIN_BYTES)?;
        if !self.log.leads_to_way(ahead.get(length..).unwrap_or_default()) {
            return self.search("no message begins here");
        }
        let id =
            (ahead.get(2) == Some(&b'D')).then(|| array(ahead, HEADER).map(u16::from_le_bytes)).flatten();
        if let Some(id) = id {
            self.lost.entry(id).or_insert((self.window.offset(), 0)).1 += 1;
        }
        self.window.pass(length);
        Ok(ControlFlow::Continue(()))
    }

    /// Goes to where messages follow each other again.
    fn search(&mut self, problem: &str) -> io::Result<ControlFlow<()>> {
        let begin = self.window.offset();
        self.window.pass(1);
        loop {
            let ahead = self.window.ahead(SEARCH_BLOCK + CHAIN_BYTES)?;
            let searched = ahead.len().min(SEARCH_BLOCK);
            let found = self.log.way_in(ahead, searched);
            let is_end = searched == ahead.len();
            self.window.pass(found.unwrap_or(searched));
            if found.is_some() || is_end {
                break;
            }
        }
        let lost = self.window.offset() - begin;
        Ok((self.visit)(Event::Damage(begin, format!("{problem}: {lost} bytes are lost"))))
    }

    fn handle(&mut self, length: usize) -> io::Result<ControlFlow<()>> {
        let offset = self.window.offset();
        let Some(message) = self.window.exactly(length)? else { return Ok(ControlFlow::Break(())) };
        let (kind, content) = (message.get(2), message.get(HEADER..).unwrap_or_default());
        let flow = match (kind, content) {
            (Some(b'D'), [low, high, data @ ..]) => {
                let subscription = self.log.subscriptions.get_mut(&u16::from_le_bytes([*low, *high]));
                subscription.map_or(ControlFlow::Continue(()), |it| (self.visit)(Event::Data(it, data)))
            }
            (Some(b'O'), _) => {
                let length_ms = array(content, 0).map_or(0, u16::from_le_bytes);
                (self.visit)(Event::Dropout(offset, length_ms))
            }
            (Some(kind), _) => match self.log.define(*kind, content, offset) {
                Ok(()) => ControlFlow::Continue(()),
                Err(problem) => (self.visit)(Event::Damage(offset, problem)),
            },
            (None, _) => ControlFlow::Break(()),
        };
        self.window.pass(length);
        Ok(flow)
    }

    fn say_lost(&mut self) {
        for (id, (first, count)) in std::mem::take(&mut self.lost) {
            let problem =
                format!("{count} messages of number {id} from here on have no topic: its definition is lost");
            let _enough = (self.visit)(Event::Damage(first, problem));
        }
    }
}

impl Log {
    /// Takes in the definitions in a message.
    fn define(&mut self, kind: u8, content: &[u8], offset: u64) -> Result<(), String> {
        match kind {
            b'F' => {
                let text = std::str::from_utf8(content).unwrap_or_default();
                self.formats.add(text).ok_or_else(|| "a format that cannot be understood".to_owned())
            }
            b'A' => self.subscribe(content),
            b'B' if offset == FILE_HEADER as u64 => self.flags(content),
            // Infos, parameters, texts of the log, and the end of a subscription.
            _ => Ok(()),
        }
    }

    fn subscribe(&mut self, content: &[u8]) -> Result<(), String> {
        let [instance, low, high, name @ ..] = content else { return Ok(()) };
        let topic = std::str::from_utf8(name).ok().filter(|name| is_name(name));
        let topic = topic.ok_or("a topic with a name that none can have")?;
        let layout = self.layout(topic).map_err(|problem| format!("topic {topic}: {problem}"))?;
        let timestamp = layout.slot("timestamp").map(|slot| slot.at);
        let subscription =
            Subscription { topic: topic.to_owned(), instance: *instance, layout, timestamp, topic_id: None };
        self.subscriptions.insert(u16::from_le_bytes([*low, *high]), subscription);
        Ok(())
    }

    fn layout(&mut self, format: &str) -> Result<Rc<Layout>, String> {
        if let Some(layout) = self.layouts.get(format) {
            return Ok(layout.clone());
        }
        let layout = Rc::new(self.formats.layout(format)?);
        self.slots += layout.slots.len();
        if self.slots > SLOTS_MAX {
            return Err(format!("all formats together have more than {SLOTS_MAX} fields"));
        }
        self.layouts.insert(format.to_owned(), layout.clone());
        Ok(layout)
    }

    /// 8 bytes of features that may be ignored, 8 of those that may not, and three offsets.
    fn flags(&mut self, content: &[u8]) -> Result<(), String> {
        let features = array(content, 8).map_or(0, u64::from_le_bytes);
        let offsets = [16, 24, 32].map(|at| array(content, at).map_or(0, u64::from_le_bytes));
        if features & 1 == 1 {
            self.appended = offsets.into_iter().filter(|at| *at > 0).collect();
        }
        match features & !1 {
            0 => Ok(()),
            unknown => Err(format!("the log needs features that are not known here ({unknown:#x})")),
        }
    }
}

#[cfg(test)]
mod tests;
