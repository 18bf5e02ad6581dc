//! Publications that may not have arrived: while connected some of each topic, else the newest.

use super::options::Delivery;
use crate::Provenance;
use crate::backlog::Backlog;
use crate::clock::Uptime;
use bytes::Bytes;
use shsa_core::time::Time;
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

/// A message to be published.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Publication {
    pub(super) topic: Arc<str>,
    pub(super) payload: Bytes,
    pub(super) retain: bool,
    pub(super) stamp: Time,
    /// Shared by messages with the same provenance.
    pub(super) provenance: Option<Arc<Provenance>>,
    /// The topic at which an answer is expected.
    pub(super) answers: Option<Arc<str>>,
    /// In an answer: the correlation data of the asker.
    pub(super) correlation: Option<Bytes>,
    /// After this time the message is useless; `None`: never.
    pub(super) until: Option<Uptime>,
    /// The delivery that a profile demands for a message of its own, which has no properties beside the payload.
    pub(super) profiled: Option<Delivery>,
}

impl Publication {
    /// Whether its time has passed.
    pub(super) fn is_over(&self, now: Uptime) -> bool {
        self.until.is_some_and(|until| until <= now)
    }

    /// A message without provenance that is not retained and expects no answer.
    pub(super) fn new(topic: Arc<str>, payload: Bytes, stamp: Time) -> Publication {
        Publication {
            topic,
            payload,
            retain: false,
            stamp,
            provenance: None,
            answers: None,
            correlation: None,
            until: None,
            profiled: None,
        }
    }
}

/// A queue for each topic. The topics take turns, so that a flood of one delays another by one message.
#[derive(Debug)]
pub(super) struct Outbox {
    /// The topics with waiting messages, in their turn.
    turns: VecDeque<Arc<str>>,
    waiting: BTreeMap<Arc<str>, Backlog<Publication>>,
    /// The newest sent message of each topic, in case the connection breaks before it has arrived.
    handed_over: BTreeMap<Arc<str>, Publication>,
    topics_max: usize,
}

impl Outbox {
    pub(super) fn new(topics_max: usize) -> Outbox {
        Outbox { turns: VecDeque::new(), waiting: BTreeMap::new(), handed_over: BTreeMap::new(), topics_max }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.turns.is_empty()
    }

    /// Keeps a message until it can be sent, with at most `depth` of its topic; returns a message that was dropped for it: an
    /// older one, or one of another topic.
    pub(super) fn keep(&mut self, publication: Publication, depth: usize) -> Option<Publication> {
        let topic = publication.topic.clone();
        if let Some(queue) = self.waiting.get_mut(&topic) {
            let dropped = if queue.len() >= depth { queue.pop_front() } else { None };
            queue.push_back(publication);
            return dropped;
        }
        let mut queue = Backlog::new();
        queue.push_back(publication);
        self.waiting.insert(topic.clone(), queue);
        self.turns.push_back(topic);
        if self.turns.len() <= self.topics_max {
            return None;
        }
        let mut queue = self.turns.pop_front().and_then(|oldest| self.waiting.remove(&oldest))?;
        std::iter::from_fn(|| queue.pop_front()).last()
    }

    /// Drops all but the newest message of each topic.
    pub(super) fn keep_newest(&mut self) {
        for queue in self.waiting.values_mut() {
            while queue.len() > 1 {
                queue.pop_front();
            }
        }
    }

    /// The message whose turn it is; drops messages whose time has passed.
    pub(super) fn next(&mut self, now: Uptime) -> Option<&Publication> {
        while self.front().is_some_and(|publication| publication.is_over(now)) {
            self.remove();
        }
        self.front()
    }

    fn front(&self) -> Option<&Publication> {
        self.turns.front().and_then(|topic| self.waiting.get(topic)?.front())
    }

    /// The message whose turn it is was sent.
    pub(super) fn take(&mut self) {
        self.remove().into_iter().for_each(|publication| self.remember(publication));
    }

    /// Removes the message whose turn it is; the next topic has its turn.
    fn remove(&mut self) -> Option<Publication> {
        let topic = self.turns.pop_front()?;
        let queue = self.waiting.get_mut(&topic)?;
        let taken = queue.pop_front();
        if queue.is_empty() {
            self.waiting.remove(&topic);
        } else {
            self.turns.push_back(topic);
        }
        taken
    }

    /// Remembers a sent message.
    pub(super) fn remember(&mut self, publication: Publication) {
        if self.handed_over.len() < self.topics_max || self.handed_over.contains_key(&publication.topic) {
            self.handed_over.insert(publication.topic.clone(), publication);
        }
    }

    /// Sent messages of this topic may not have arrived: the newest one is to be sent again.
    pub(super) fn again(&mut self, topic: &str) {
        if !self.waiting.contains_key(topic)
            && let Some(publication) = self.handed_over.remove(topic)
        {
            let _other = self.keep(publication, 1);
        }
    }

    /// Sent messages of this topic are not sent again.
    pub(super) fn forget(&mut self, topic: &str) {
        self.handed_over.remove(topic);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn publication(topic: &str, payload: &'static str) -> Publication {
        Publication::new(topic.into(), Bytes::from_static(payload.as_bytes()), Time(0))
    }

    fn keep(outbox: &mut Outbox, depth: usize, all: &[(&str, &'static str)]) {
        all.iter().for_each(|(topic, payload)| drop(outbox.keep(publication(topic, payload), depth)));
    }

    fn drain(outbox: &mut Outbox) -> String {
        let mut sent = Vec::new();
        while let Some(Publication { topic, payload, .. }) = outbox.next(Uptime::now()) {
            sent.push(format!("{topic}={}", String::from_utf8_lossy(payload)));
            outbox.take();
        }
        sent.join(" ")
    }

    #[test]
    fn topics_take_turns() {
        let mut outbox = Outbox::new(8);
        keep(&mut outbox, 8, &[("a", "1"), ("a", "2"), ("a", "3"), ("b", "4")]);
        assert_eq!(drain(&mut outbox), "a=1 b=4 a=2 a=3");
        assert!(outbox.is_empty());
    }

    #[test]
    fn without_a_connection_the_newest_of_each_topic_waits() {
        let mut outbox = Outbox::new(8);
        keep(&mut outbox, 8, &[("a", "1"), ("b", "2"), ("a", "3")]);
        outbox.keep_newest();
        assert_eq!(outbox.keep(publication("b", "4"), 1), Some(publication("b", "2")));
        assert_eq!(drain(&mut outbox), "a=3 b=4");
    }

    #[test]
    fn too_many_topics_push_the_oldest_out() {
        let mut outbox = Outbox::new(2);
        let pushed = ["a", "b", "c"].map(|topic| outbox.keep(publication(topic, "1"), 1));
        assert_eq!(pushed, [None, None, Some(publication("a", "1"))]);
        assert_eq!(drain(&mut outbox), "b=1 c=1");
    }

    #[test]
    fn what_may_be_lost_is_sent_again_unless_something_newer_waits() {
        let mut outbox = Outbox::new(8);
        keep(&mut outbox, 1, &[("a", "1"), ("b", "2")]);
        drain(&mut outbox);
        keep(&mut outbox, 1, &[("b", "3")]);
        for topic in ["a", "b", "c"] {
            outbox.again(topic);
        }
        assert_eq!(drain(&mut outbox), "b=3 a=1");
        outbox.forget("a");
        outbox.again("a");
        assert!(outbox.is_empty());
    }

    #[test]
    fn what_is_of_no_use_any_more_is_not_sent() {
        let now = Uptime::now();
        let mut outbox = Outbox::new(9);
        outbox.keep(Publication { until: Some(now), ..publication("a", "old") }, 1);
        outbox.keep(publication("b", "always"), 1);
        assert_eq!(&*outbox.next(now).unwrap().topic, "b");
        outbox.take();
        assert!(outbox.next(now).is_none() && outbox.is_empty());
    }
}
