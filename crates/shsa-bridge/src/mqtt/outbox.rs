//! What is to be published and has not surely arrived: the newest of each topic.

use crate::Provenance;
use bytes::Bytes;
use shsa_core::time::Time;
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

/// One message on its way out.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Publication {
    pub(super) topic: Arc<str>,
    pub(super) payload: Bytes,
    pub(super) retain: bool,
    pub(super) stamp: Time,
    pub(super) provenance: Option<Provenance>,
}

/// Messages in the order in which their topics began to wait; a newer one takes the place of the older.
#[derive(Debug)]
pub(super) struct Outbox {
    order: VecDeque<Arc<str>>,
    waiting: BTreeMap<Arc<str>, Publication>,
    /// The newest of each topic that was handed over, for when the connection breaks before it has arrived.
    handed_over: BTreeMap<Arc<str>, Publication>,
    topics_max: usize,
}

impl Outbox {
    pub(super) fn new(topics_max: usize) -> Outbox {
        Outbox { order: VecDeque::new(), waiting: BTreeMap::new(), handed_over: BTreeMap::new(), topics_max }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.waiting.is_empty()
    }

    /// Keeps a message until it can be sent; gives back another topic's that had to make room.
    pub(super) fn keep(&mut self, publication: Publication) -> Option<Publication> {
        let topic = publication.topic.clone();
        if self.waiting.insert(topic.clone(), publication).is_some() {
            return None;
        }
        self.order.push_back(topic);
        if self.order.len() <= self.topics_max {
            return None;
        }
        self.order.pop_front().and_then(|oldest| self.waiting.remove(&oldest))
    }

    /// The message that waits longest.
    pub(super) fn next(&self) -> Option<&Publication> {
        self.order.front().and_then(|topic| self.waiting.get(topic))
    }

    /// The message that waits longest has been handed over.
    pub(super) fn take(&mut self) {
        let taken = self.order.pop_front().and_then(|topic| self.waiting.remove(&topic));
        taken.into_iter().for_each(|publication| self.remember(publication));
    }

    /// A message has been handed over without waiting.
    pub(super) fn remember(&mut self, publication: Publication) {
        if self.handed_over.len() < self.topics_max || self.handed_over.contains_key(&publication.topic) {
            self.handed_over.insert(publication.topic.clone(), publication);
        }
    }

    /// Messages of this topic that were handed over may not have arrived: the newest is to be sent again.
    pub(super) fn again(&mut self, topic: &str) {
        if !self.waiting.contains_key(topic)
            && let Some(publication) = self.handed_over.remove(topic)
        {
            let _other = self.keep(publication);
        }
    }

    /// Nothing of this topic is sent again.
    pub(super) fn forget(&mut self, topic: &str) {
        self.handed_over.remove(topic);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn publication(topic: &str, payload: &'static str) -> Publication {
        let payload = Bytes::from_static(payload.as_bytes());
        Publication { topic: topic.into(), payload, retain: false, stamp: Time(0), provenance: None }
    }

    fn drain(outbox: &mut Outbox) -> String {
        let mut sent = Vec::new();
        while let Some(Publication { topic, payload, .. }) = outbox.next() {
            sent.push(format!("{topic}={}", String::from_utf8_lossy(payload)));
            outbox.take();
        }
        sent.join(" ")
    }

    #[test]
    fn the_newest_of_each_topic_waits_in_its_turn() {
        let mut outbox = Outbox::new(8);
        for (topic, payload) in [("a", "1"), ("b", "2"), ("a", "3")] {
            assert_eq!(outbox.keep(publication(topic, payload)), None);
        }
        assert_eq!(drain(&mut outbox), "a=3 b=2");
        assert!(outbox.is_empty());
    }

    #[test]
    fn too_many_topics_push_the_oldest_out() {
        let mut outbox = Outbox::new(2);
        let pushed: Vec<_> = ["a", "b", "c"].map(|topic| outbox.keep(publication(topic, "1"))).into();
        assert_eq!(pushed, [None, None, Some(publication("a", "1"))]);
        assert_eq!(drain(&mut outbox), "b=1 c=1");
    }

    #[test]
    fn what_may_be_lost_is_sent_again_unless_something_newer_waits() {
        let mut outbox = Outbox::new(8);
        for (topic, payload) in [("a", "1"), ("b", "2")] {
            outbox.keep(publication(topic, payload));
        }
        drain(&mut outbox);
        outbox.keep(publication("b", "3"));
        for topic in ["a", "b", "c"] {
            outbox.again(topic);
        }
        assert_eq!(drain(&mut outbox), "b=3 a=1");
        outbox.forget("a");
        outbox.again("a");
        assert!(outbox.is_empty());
    }
}
