//! Converts samples of Zenoh to messages, and learns the type of each topic.

use super::Wire;
use super::name::{Attachment, WireType, parts};
use crate::zenoh::{bytes_of, stamp_of};
use crate::{Inbox, Message, Payload};
use ::zenoh::sample::{Sample, SampleKind};
use shsa_message::ros::full_name;
use std::collections::BTreeMap;
use std::sync::{Arc, PoisonError, RwLock};

/// Clones share the known types.
#[derive(Clone, Debug)]
pub(super) struct Discovery {
    wire: Wire,
    inbox: Inbox,
    topics: Arc<RwLock<BTreeMap<String, Known>>>,
}

/// The type of a topic, from its messages or from the subscription.
#[derive(Clone, Debug)]
struct Known {
    wire_type: WireType,
    message_type: Arc<str>,
}

impl Known {
    fn new(dds: &str, hash: &str) -> Known {
        let wire_type = WireType { dds: dds.to_owned(), hash: hash.to_owned() };
        Known { wire_type, message_type: full_name(dds).into() }
    }
}

impl Discovery {
    pub(super) fn new(wire: Wire, inbox: Inbox) -> Discovery {
        Discovery { wire, inbox, topics: Arc::default() }
    }

    /// Sets the type of a topic (without its leading slash), unless it is already known.
    pub(super) fn expect(&self, topic: &str, wire_type: &WireType) {
        let mut topics = self.topics.write().unwrap_or_else(PoisonError::into_inner);
        topics.entry(topic.to_owned()).or_insert_with(|| Known::new(&wire_type.dds, &wire_type.hash));
    }

    /// The type of a topic.
    pub(super) fn found(&self, topic: &str) -> Option<(WireType, Arc<str>)> {
        let topics = self.topics.read().unwrap_or_else(PoisonError::into_inner);
        topics.get(topic).map(|known| (known.wire_type.clone(), known.message_type.clone()))
    }

    /// Runs in Zenoh's threads: only the key and the attachment are decoded here, the rest by the reader, or in its place while
    /// it sleeps. `name` gives the name of a topic without its leading slash, or `None` if nobody wants it; `declared_type` is
    /// the type if the key does not contain it.
    pub(super) fn deliver(
        &self,
        sample: &Sample,
        declared_type: Option<&Arc<str>>,
        name: impl Fn(&str) -> Option<Arc<str>>,
    ) {
        let key = sample.key_expr().as_str();
        let (topic, message_type) = match (self.wire, parts(key)) {
            (Wire::Plain, _) => (key, declared_type.cloned()),
            (Wire::Rmw, Some((topic, dds, hash))) => (topic, Some(self.learn(topic, dds, hash))),
            (Wire::Rmw, None) => return,
        };
        let Some(topic) = name(topic).filter(|_| sample.kind() == SampleKind::Put) else { return };
        let beside = sample.attachment().and_then(|bytes| Attachment::read(&bytes.to_bytes()));
        self.inbox.hand(Message {
            stamp: beside.map(|beside| beside.stamp).or_else(|| stamp_of(sample)),
            publisher: beside.map(|beside| beside.publisher),
            message_type,
            ..Message::new(topic, self.inbox.clock().now(), Payload::Bytes(bytes_of(sample)))
        });
    }

    fn learn(&self, topic: &str, dds: &str, hash: &str) -> Arc<str> {
        let is_known = |known: &&Known| known.wire_type.dds == dds && known.wire_type.hash == hash;
        {
            let topics = self.topics.read().unwrap_or_else(PoisonError::into_inner);
            if let Some(known) = topics.get(topic).filter(is_known) {
                return known.message_type.clone();
            }
        }
        let known = Known::new(dds, hash);
        let message_type = known.message_type.clone();
        self.topics.write().unwrap_or_else(PoisonError::into_inner).insert(topic.to_owned(), known);
        message_type
    }
}
