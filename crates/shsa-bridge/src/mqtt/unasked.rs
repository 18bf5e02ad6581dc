//! Messages without a subscription: a kept session delivers before anybody can subscribe.

use crate::Message;
use crate::clock::Uptime;
use std::collections::{BTreeSet, VecDeque};
use std::time::Duration;

/// The number of messages that may wait for a subscription to their topics.
const MOST: usize = 16_384;
/// How long they wait, from the first connection on.
const PATIENCE: Duration = Duration::from_secs(30);

/// Messages that arrived without a subscription.
#[derive(Debug, Default)]
pub(super) struct Unasked {
    waiting: VecDeque<Message>,
    connected_first: Option<Uptime>,
    /// Topics without a subscription for which the broker was told to stop.
    unwanted: BTreeSet<String>,
}

impl Unasked {
    /// A connection was made.
    pub(super) fn connected(&mut self) {
        self.connected_first.get_or_insert_with(Uptime::now);
        self.unwanted.clear();
    }

    /// Keeps a message of a session from an earlier run, because this run may not have subscribed yet. After a while, the topic
    /// is unwanted: returns the topic to unsubscribe from.
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

    /// Takes out the messages that are wanted now.
    pub(super) fn take(&mut self, is_wanted: impl Fn(&Message) -> bool) -> VecDeque<Message> {
        let (wanted, others) = self.waiting.drain(..).partition(is_wanted);
        self.waiting = others;
        wanted
    }
}
