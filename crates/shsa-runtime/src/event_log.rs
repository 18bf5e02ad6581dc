//! Who is told what was decided: the terminal, the bus, whoever listens over HTTP; and the last decisions, for who asks later.
//! Nobody of them can delay what is decided next.

use super::terminal::Terminal;
use super::undelivered::Undelivered;
use serde_json::{Value, json};
use shsa_bridge::{Bridge, BridgeError, Clock, Outgoing, Payload};
use shsa_core::engine::Event;
use shsa_core::knowledge::KnowledgeBase;
use shsa_core::time::{Span, Time};
use shsa_format::event;
use std::collections::VecDeque;
use std::io::{self, Write};
use tokio::sync::broadcast;

/// Decisions that are kept for who asks later.
const KEPT: usize = 1_000;
/// Decisions that may wait for a slow listener; then it misses some, and is told how many.
const WAITING: usize = 256;

/// What has happened, on its way to a line of text.
#[derive(Clone, Copy, Debug)]
pub enum Decision<'a> {
    /// The engine has decided something.
    Decided {
        /// Since the run began.
        after: Span,
        /// When, by the wall clock.
        at: Time,
        /// What the event's ids belong to.
        knowledge: &'a KnowledgeBase,
        /// What was decided, and why.
        event: &'a Event,
    },
    /// Something has happened to the run itself: a lost connection, messages that had to make room, an order.
    Noted {
        /// Since the run began.
        after: Span,
        /// When, by the wall clock.
        at: Time,
        /// In a word.
        kind: &'a str,
        /// What, and why.
        because: &'a str,
    },
}

/// Makes the line of a decision.
type Words = Box<dyn Fn(&Decision<'_>) -> String + Send>;
/// Whether a decision is written.
type Choice = Box<dyn Fn(&Decision<'_>) -> bool + Send>;

/// Where decisions are written, one a line. A thread of its own writes them, so that who reads slowly delays nobody; what finds no
/// room is left out, counted and told.
pub struct Printer {
    output: Box<dyn Write + Send>,
    /// `None`: as JSON.
    words: Option<Words>,
    /// `None`: all are.
    choice: Option<Choice>,
}

impl Printer {
    /// Each as a JSON object, as it goes out on the bus.
    pub fn json(output: impl Write + Send + 'static) -> Printer {
        Printer { output: Box::new(output), words: None, choice: None }
    }

    /// Each in the words that `words` makes of it.
    pub fn text(
        output: impl Write + Send + 'static,
        words: impl Fn(&Decision<'_>) -> String + Send + 'static,
    ) -> Printer {
        Printer { output: Box::new(output), words: Some(Box::new(words)), choice: None }
    }

    /// Only those that are chosen; all others go out elsewhere as before.
    #[must_use]
    pub fn only(self, choice: impl Fn(&Decision<'_>) -> bool + Send + 'static) -> Printer {
        Printer { choice: Some(Box::new(choice)), ..self }
    }
}

/// A decision in words.
#[derive(Debug)]
pub(super) struct Entry {
    time: Time,
    fields: Value,
    text: Option<String>,
    /// Whether the terminal gets it.
    is_printed: bool,
}

/// Tells decisions.
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
    /// On the bus, decisions go out under `topic`; times of printed lines count from now.
    ///
    /// # Errors
    /// When there is no thread for the terminal.
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

    /// For who wants to hear every decision from now on, as JSON.
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

    /// A decision of the engine in words, to be told when what it leads to is under way.
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

    /// Tells what has happened to the run itself: a lost connection, messages that had to make room, an order.
    pub(super) fn noted(&mut self, now: Time, kind: &str, because: &str, bridge: &mut dyn Bridge) {
        let at = self.clock.by_wall(now);
        let decision = Decision::Noted { after: now - self.began, at, kind, because };
        let entry = self.written(now, json!({ "kind": kind, "because": because }), &decision);
        self.tell(entry, bridge);
    }

    /// The bus has not taken a message of this name: counted, and told where that is worth it.
    pub(super) fn undelivered(&mut self, name: &str, error: &BridgeError, bridge: &mut dyn Bridge) {
        let now = bridge.inbox().clock().now();
        if let Some(told) = self.undelivered.count(name, error, now) {
            self.noted(now, "undelivered", &told, bridge);
        }
    }

    /// What is to be told of the terminal itself.
    pub(super) fn troubles(&mut self, now: Time) -> Option<String> {
        self.terminal.as_mut().and_then(|terminal| terminal.news(now))
    }

    /// How many lines the terminal has not taken.
    pub(super) fn unwritten(&self) -> u64 {
        self.terminal.as_ref().map_or(0, Terminal::lost)
    }

    /// What the bus has not taken so far.
    pub(super) fn not_taken(&self) -> &Undelivered {
        &self.undelivered
    }

    /// Tells everyone.
    pub(super) fn tell(&mut self, entry: Entry, bridge: &mut dyn Bridge) {
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
        // Nobody may be listening.
        let _ = self.listeners.send(line);
        if self.kept.len() == KEPT {
            self.kept.pop_front();
        }
        self.kept.push_back((self.next, event));
        self.next += 1;
        // The decision stands whether or not the bus can be told now. What is told of that may not be sent either: then it is
        // one of many, which is not told.
        if let Err(error) = sent {
            let name = self.topic.clone();
            self.undelivered(&name, &error, bridge);
        }
    }
}
