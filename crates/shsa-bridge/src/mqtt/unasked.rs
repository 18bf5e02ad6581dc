//! Messages that nobody has asked for: a kept session delivers before anybody can say what is wanted.

use crate::Message;
use crate::clock::Uptime;
use std::collections::{BTreeSet, VecDeque};
use std::time::Duration;

/// Messages that may wait for somebody to subscribe to their topics.
const MOST: usize = 16_384;
/// As long do they wait, from the first connection on.
const PATIENCE: Duration = Duration::from_secs(30);

/// What has come that nobody has asked for.
#[derive(Debug, Default)]
pub(super) struct Unasked {
    waiting: VecDeque<Message>,
    connected_first: Option<Uptime>,
    /// Names that come though nobody wants them, and that the broker has been told so.
    unwanted: BTreeSet<String>,
}

impl Unasked {
    /// The connection stands.
    pub(super) fn connected(&mut self) {
        self.connected_first.get_or_insert_with(Uptime::now);
        self.unwanted.clear();
    }

    /// The broker has kept the session of an earlier run. Perhaps this one has not yet come to subscribing; later, it does
    /// not want the topic any more: gives the topic that the broker is to be told of.
    pub(super) fn keep(&mut self, message: Message) -> Option<String> {
        if self.connected_first.is_some_and(|first| first.elapsed() < PATIENCE) {
            if self.waiting.len() == MOST {
                self.waiting.pop_front();
            }
            self.waiting.push_back(message);
            return None;
        }
        self.waiting = VecDeque::new();
        self.unwanted.insert(message.topic.to_string()).then(|| message.topic.to_string())
    }

    /// Takes out what somebody asks for now.
    pub(super) fn take(&mut self, is_wanted: impl Fn(&Message) -> bool) -> VecDeque<Message> {
        let (wanted, others) = self.waiting.drain(..).partition(is_wanted);
        self.waiting = others;
        wanted
    }
}
