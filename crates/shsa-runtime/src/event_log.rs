//! Passes decisions to the terminal, the bus and the listeners over HTTP, and keeps the last ones for later requests. No receiver
//! can delay the next decision.

use super::terminal::Terminal;
use super::undelivered::Undelivered;
use serde_json::{Value, json};
use shsa_bridge::{Bridge, BridgeError, Clock, Outgoing, Payload};
use shsa_core::engine::Event;
use shsa_core::knowledge::KnowledgeBase;
use shsa_core::time::{Span, Time};
use shsa_format::event;
use shsa_format::text::printable;
use std::collections::VecDeque;
use std::io::{self, Write};
use tokio::sync::broadcast;

/// The number of decisions kept for later requests.
const KEPT: usize = 1_000;
/// The number of decisions that may wait for a slow listener. Further ones replace the oldest, and the listener receives the number
/// of decisions that it has missed.
const WAITING: usize = 256;

/// A decision of the engine, or an event of the run, to be written as a line.
#[derive(Clone, Copy, Debug)]
pub enum Decision<'a> {
    /// The engine has decided something.
    Decided {
        /// Time since the run began.
        after: Span,
        /// The wall-clock time.
        at: Time,
        /// The knowledge base of the event's ids.
        knowledge: &'a KnowledgeBase,
        /// The decision and its reason.
        event: &'a Event,
    },
    /// An event of the run itself: a lost connection, dropped messages, an order.
    Noted {
        /// Time since the run began.
        after: Span,
        /// The wall-clock time.
        at: Time,
        /// The kind of the event.
        kind: &'a str,
        /// The event and its reason.
        because: &'a str,
    },
}

/// Makes the line for a decision.
type Words = Box<dyn Fn(&Decision<'_>) -> String + Send>;
/// Whether a decision is written.
type Choice = Box<dyn Fn(&Decision<'_>) -> bool + Send>;

/// Writes decisions, one a line. A thread of its own writes the lines, so a slow reader delays nobody. Lines that find no room
/// are dropped, counted and reported.
pub struct Printer {
    output: Box<dyn Write + Send>,
    /// `None`: as JSON.
    words: Option<Words>,
    /// `None`: every decision is written.
    choice: Option<Choice>,
}

impl Printer {
    /// Writes each decision as a JSON object, as published on the bus.
    pub fn json(output: impl Write + Send + 'static) -> Printer {
        Printer { output: Box::new(output), words: None, choice: None }
    }

    /// Writes each decision in the text that `words` makes of it.
    pub fn text(
        output: impl Write + Send + 'static,
        words: impl Fn(&Decision<'_>) -> String + Send + 'static,
    ) -> Printer {
        Printer { output: Box::new(output), words: Some(Box::new(words)), choice: None }
    }

    /// Writes only the chosen decisions; the bus and other receivers still get all.
    #[must_use]
    pub fn only(self, choice: impl Fn(&Decision<'_>) -> bool + Send + 'static) -> Printer {
        Printer { choice: Some(Box::new(choice)), ..self }
    }
}

/// A decision, prepared for its receivers.
#[derive(Debug)]
pub(super) struct Entry {
    time: Time,
    fields: Value,
    text: Option<String>,
    /// Whether the printer gets the line.
    is_printed: bool,
}

/// Passes decisions to all receivers.
pub(super) struct EventLog {
    topic: String,
    words: Option<Words>,
    choice: Option<Choice>,
    clock: Clock,
    began: Time,
    next: u64,
    kept: VecDeque<(u64, Value)>,
    listeners: broadcast::Sender<String>,
    undelivered: Undelivered,
    terminal: Option<Terminal>,
}

impl EventLog {
    /// A log that publishes under `topic`; times of printed lines count from now.
    ///
    /// # Errors
    /// When no thread for the terminal can be started.
    pub(super) fn new(topic: String, printer: Option<Printer>, clock: Clock) -> io::Result<EventLog> {
        let (listeners, _) = broadcast::channel(WAITING);
        let (kept, undelivered) = (VecDeque::with_capacity(KEPT), Undelivered::default());
        let (output, words, choice) = match printer {
            Some(Printer { output, words, choice }) => (Some(output), words, choice),
            None => (None, None, None),
        };
        let (terminal, began) = (output.map(Terminal::new).transpose()?, clock.now());
        Ok(EventLog { topic, words, choice, clock, began, next: 0, kept, listeners, undelivered, terminal })
    }

    /// The sender from which listeners get every later decision as JSON.
    pub(super) fn listeners(&self) -> broadcast::WeakSender<String> {
        self.listeners.downgrade()
    }

    /// The number of the next decision.
    pub(super) fn next(&self) -> u64 {
        self.next
    }

    /// The decisions from a number on that are still kept.
    pub(super) fn since(&self, number: u64) -> Vec<Value> {
        self.kept.iter().filter(|(at, _)| *at >= number).map(|(_, event)| event.clone()).collect()
    }

    /// The entry of a decision, to be reported after its consequences are under way.
    pub(super) fn entry(&self, known: &KnowledgeBase, event: &Event) -> Entry {
        let after = event.time - self.began;
        let at = self.clock.by_wall(event.time);
        let decision = Decision::Decided { after, at, knowledge: known, event };
        self.written(event.time, event::fields(known, event).into_iter().collect(), &decision)
    }

    fn written(&self, time: Time, fields: Value, decision: &Decision<'_>) -> Entry {
        let is_printed =
            self.terminal.is_some() && self.choice.as_ref().is_none_or(|choice| choice(decision));
        let words = self.words.as_ref().filter(|_| is_printed);
        Entry { time, fields, text: words.map(|words| words(decision)), is_printed }
    }

    /// Tells an event of the run itself: a lost connection, dropped messages, an order.
    pub(super) fn noted(&mut self, now: Time, kind: &str, because: &str, bridge: &mut dyn Bridge) {
        let at = self.clock.by_wall(now);
        // It may tell names from the bus.
        let because = &*printable(because);
        let decision = Decision::Noted { after: now - self.began, at, kind, because };
        let entry = self.written(now, json!({ "kind": kind, "because": because }), &decision);
        self.publish(entry, bridge);
    }

    /// Counts a message of this name that the bus has not taken; reports when the count has grown enough.
    pub(super) fn undelivered(&mut self, name: &str, error: &BridgeError, bridge: &mut dyn Bridge) {
        let now = bridge.inbox().clock().now();
        if let Some(described) = self.undelivered.count(name, error, now) {
            self.noted(now, "undelivered", &described, bridge);
        }
    }

    /// A note about dropped lines of the terminal, if there is news.
    pub(super) fn troubles(&mut self, now: Time) -> Option<String> {
        self.terminal.as_mut().and_then(|terminal| terminal.news(now))
    }

    /// The number of lines that the terminal has not taken.
    pub(super) fn unwritten(&self) -> u64 {
        self.terminal.as_ref().map_or(0, Terminal::lost)
    }

    /// The messages that the bus has not taken so far.
    pub(super) fn not_taken(&self) -> &Undelivered {
        &self.undelivered
    }

    /// Passes an entry to all receivers.
    pub(super) fn publish(&mut self, entry: Entry, bridge: &mut dyn Bridge) {
        let Entry { time, fields, text, is_printed } = entry;
        let stamp = bridge.inbox().clock().by_wall(time);
        let mut event = json!({ "number": self.next, "time_ns": stamp.0 });
        if let (Some(event), Value::Object(fields)) = (event.as_object_mut(), fields) {
            event.extend(fields);
        }
        let line = event.to_string();
        if let Some(terminal) = self.terminal.as_ref().filter(|_| is_printed) {
            terminal.write(text.unwrap_or_else(|| line.clone()));
        }
        let payload = Payload::Bytes(line.clone().into());
        let sent = bridge.publish(Outgoing::new(&self.topic, stamp, payload));
        // The error says only that nobody listens.
        let _ = self.listeners.send(line);
        if self.kept.len() == KEPT {
            self.kept.pop_front();
        }
        self.kept.push_back((self.next, event));
        self.next += 1;
        // The decision stands even if the bus cannot take it now. The note about this failure may fail, too; that second failure
        // is counted, not reported.
        if let Err(error) = sent {
            let name = self.topic.clone();
            self.undelivered(&name, &error, bridge);
        }
    }
}
