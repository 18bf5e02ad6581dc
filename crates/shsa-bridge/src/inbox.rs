//! What has arrived and not yet been read: bounded, the newest wins, losses are counted.

use crate::Message;
use std::collections::VecDeque;

/// A bounded queue of messages in the order of arrival.
#[derive(Debug)]
pub struct Inbox {
    waiting: VecDeque<Message>,
    capacity: usize,
    dropped: u64,
}

impl Inbox {
    /// For at most `capacity` messages; at least one.
    #[must_use]
    pub fn new(capacity: usize) -> Inbox {
        Inbox { waiting: VecDeque::new(), capacity: capacity.max(1), dropped: 0 }
    }

    /// Appends a message; when the queue is full, the oldest makes room and is counted as dropped.
    pub fn push(&mut self, message: Message) {
        if self.waiting.len() == self.capacity {
            self.waiting.pop_front();
            self.dropped += 1;
        }
        self.waiting.push_back(message);
    }

    /// Takes the oldest message; `None` when none waits.
    pub fn pop(&mut self) -> Option<Message> {
        self.waiting.pop_front()
    }

    /// How many messages had to make room for newer ones.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        self.dropped
    }
}
