//! Who is told what was decided: the terminal, the bus, whoever listens over HTTP; and the last decisions, for who asks later.
//! Nobody of them can delay what is decided next.

use super::terminal::Terminal;
use super::undelivered::Undelivered;
use crate::tell;
use serde_json::{Value, json};
use shsa_bridge::{Bridge, BridgeError, Outgoing, Payload};
use shsa_core::engine::Event;
use shsa_core::knowledge::KnowledgeBase;
use shsa_core::time::Time;
use std::collections::VecDeque;
use std::io::{self, stdout};
use tokio::sync::broadcast;

/// Decisions that are kept for who asks later.
const KEPT: usize = 1_000;
/// Decisions that may wait for a slow listener; then it misses some, and is told how many.
const WAITING: usize = 256;

/// How decisions are shown on standard output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Style {
    /// For people.
    Text,
    /// One JSON object a line.
    Json,
    /// Not at all.
    Silent,
}

/// A decision in words.
#[derive(Debug)]
pub(super) struct Tale {
    time: Time,
    fields: Value,
    text: Option<String>,
}

/// Tells decisions.
#[derive(Debug)]
pub(super) struct Herald {
    topic: String,
    style: Style,
    began: Time,
    next: u64,
    kept: VecDeque<(u64, Value)>,
    listeners: broadcast::Sender<String>,
    undelivered: Undelivered,
    terminal: Option<Terminal>,
}

impl Herald {
    /// On the bus, decisions go out under `topic`; times on the terminal count from `began`.
    ///
    /// # Errors
    /// When there is no thread for the terminal.
    pub(super) fn new(topic: String, style: Style, began: Time) -> io::Result<Herald> {
        let (listeners, _) = broadcast::channel(WAITING);
        let (kept, undelivered) = (VecDeque::with_capacity(KEPT), Undelivered::default());
        let terminal = (style != Style::Silent).then(|| Terminal::new(stdout())).transpose()?;
        Ok(Herald { topic, style, began, next: 0, kept, listeners, undelivered, terminal })
    }

    /// For who wants to hear every decision from now on, as JSON.
    pub(super) fn listeners(&self) -> broadcast::Sender<String> {
        self.listeners.clone()
    }

    /// The decisions from a number on that are still kept.
    pub(super) fn since(&self, number: u64) -> Vec<Value> {
        self.kept.iter().filter(|(at, _)| *at >= number).map(|(_, event)| event.clone()).collect()
    }

    /// A decision of the engine in words, to be told when what it leads to is under way.
    pub(super) fn tale(&self, known: &KnowledgeBase, event: &Event) -> Tale {
        let text = || tell::event_text(&self.since_beginning(event.time), known, event);
        Tale {
            time: event.time,
            fields: tell::event_fields(known, event).into_iter().collect(),
            text: (self.style == Style::Text).then(text),
        }
    }

    /// Tells what has happened to the run itself: a lost connection, messages that had to make room, an order.
    pub(super) fn noted(&mut self, now: Time, kind: &str, because: &str, bridge: &mut dyn Bridge) {
        let text = (self.style == Style::Text)
            .then(|| format!("{}  {kind:<11} {because}", self.since_beginning(now)));
        self.tell(Tale { time: now, fields: json!({ "kind": kind, "because": because }), text }, bridge);
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

    fn since_beginning(&self, time: Time) -> String {
        format!("{:>9.3} s", (time - self.began).seconds())
    }

    /// Tells everyone.
    pub(super) fn tell(&mut self, tale: Tale, bridge: &mut dyn Bridge) {
        let Tale { time, fields, text } = tale;
        let stamp = bridge.inbox().clock().by_wall(time);
        let mut event = json!({ "number": self.next, "time_ns": stamp.0 });
        if let (Some(event), Value::Object(fields)) = (event.as_object_mut(), fields) {
            event.extend(fields);
        }
        let line = event.to_string();
        if let Some(terminal) = &self.terminal {
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
