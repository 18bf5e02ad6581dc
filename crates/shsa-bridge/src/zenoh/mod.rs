//! Zenoh: a peer or a client of routers, over TCP, TLS or Unix sockets.
//!
//! A topic's name is its key without the leading slash: `/odom/speed` is found under `odom/speed`. A received message has the
//! name that was subscribed to; without such a name, its key without a slash. Names hold no `*`, `$`, `?`, `#`, and no empty
//! parts.
//!
//! Time stamp, our identity and the provenance ([`Outgoing::provenance`]) are in an attachment beside each payload; the module
//! `attachment` defines its form. A message without such a stamp has Zenoh's, if a router sets one.
//!
//! Sending never waits for a slow consumer (except once, for 10 ms): its messages are lost when 1 MiB waits. More than 16 MB a
//! second is paced, so that a burst does not lose its end. Routers in between drop messages by their own configuration
//! (`transport/link/tx/queue`), by default when 128 KiB wait for 1 ms. Messages are lost while the link is down: an old
//! substitute is useless.

mod attachment;
mod connection;
mod liveliness;
mod options;
mod pace;
mod questions;
pub(crate) mod request;

pub use crate::Presence;
pub use liveliness::{Liveliness, Token, Watch};
pub use options::{Mode, Options, Secret};

pub(crate) use connection::Connection;
pub(crate) use pace::Pace;
pub(crate) use questions::{ask, serve};

use crate::payload::plain;
use crate::{
    Answer, Attendance, Bridge, BridgeError, Channel, Inbox, Link, Message, Outgoing, Payload, PublisherId,
    Server, Taker,
};
use ::zenoh::bytes::Encoding;
use ::zenoh::key_expr::KeyExpr;
use ::zenoh::pubsub::Publisher;
use ::zenoh::qos::{CongestionControl, Priority};
use ::zenoh::sample::{Locality, Sample, SampleKind};
use ::zenoh::{Session, Wait};
use bytes::Bytes;
use shsa_core::time::Time;
use std::collections::BTreeMap;
use std::sync::{Arc, PoisonError, RwLock};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// A connection to a Zenoh network.
#[derive(Debug)]
pub struct ZenohBridge {
    // Declared before the connection, to be dropped first: a publisher that outlives its session complains.
    publishers: BTreeMap<String, Publisher<'static>>,
    connection: Connection,
    pace: Pace,
    inbox: Inbox,
    topics: Topics,
    all: bool,
}

/// The subscribed topics, by key: several names may have the same key.
type Topics = Arc<RwLock<BTreeMap<String, Vec<Arc<str>>>>>;

impl ZenohBridge {
    /// Connects; an unreachable network is tried again in the background ([`Bridge::link`] shows the state).
    ///
    /// # Errors
    /// When the options cannot be used, an address cannot be listened on, or the other side refuses us.
    pub fn open(options: &Options, inbox: Inbox) -> Result<ZenohBridge, BridgeError> {
        let connection = Connection::open(options)?;
        Ok(ZenohBridge {
            publishers: BTreeMap::new(),
            connection,
            pace: Pace::default(),
            inbox,
            topics: Topics::default(),
            all: false,
        })
    }

    /// The liveliness tokens of this network.
    #[must_use]
    pub fn liveliness(&self) -> Liveliness<'_> {
        Liveliness::new(&self.connection, &self.inbox)
    }

    fn publisher_of(&mut self, topic: &str) -> Result<&Publisher<'static>, BridgeError> {
        if !self.publishers.contains_key(topic) {
            let key = key_of(topic)?;
            let session = self.connection.session().ok_or_else(|| not_open(&self.connection))?;
            self.publishers.insert(topic.to_owned(), declare_publisher(session, key)?);
        }
        self.publishers.get(topic).ok_or_else(|| not_open(&self.connection))
    }
}

impl Bridge for ZenohBridge {
    fn publisher(&self) -> PublisherId {
        self.connection.publisher()
    }

    fn channel(&self) -> Channel {
        self.connection.channel()
    }

    fn inbox(&self) -> &Inbox {
        &self.inbox
    }

    fn subscribe(&mut self, topic: &str, _message_type: Option<&str>) -> Result<(), BridgeError> {
        let (key, topic): (_, Arc<str>) = (key_of(topic)?, topic.into());
        {
            let mut topics = self.topics.write().unwrap_or_else(PoisonError::into_inner);
            let names = topics.entry(key.as_str().to_owned()).or_default();
            if names.contains(&topic) {
                return Ok(());
            }
            names.push(topic.clone());
        }
        let inbox = self.inbox.clone();
        let deliver = move |sample: Sample| deliver(&inbox, topic.clone(), &sample);
        subscribe(&self.connection, key, deliver);
        Ok(())
    }

    fn subscribe_all(&mut self) -> Result<(), BridgeError> {
        if std::mem::replace(&mut self.all, true) {
            return Ok(());
        }
        let (inbox, topics) = (self.inbox.clone(), self.topics.clone());
        let deliver = move |sample: Sample| {
            // A named topic has a subscription of its own.
            let key = sample.key_expr().as_str();
            if !topics.read().unwrap_or_else(PoisonError::into_inner).contains_key(key) {
                deliver(&inbox, key.into(), &sample);
            }
        };
        subscribe(&self.connection, KeyExpr::try_from("**").map_err(lost)?, deliver);
        Ok(())
    }

    fn publish(&mut self, message: Outgoing<'_>) -> Result<(), BridgeError> {
        let beside = attachment::write(&message, self.publisher());
        let (payload, encoding) = match message.payload {
            Payload::Value(value) => (Bytes::from(plain(&value)), Encoding::APPLICATION_JSON),
            Payload::Bytes(bytes) => (bytes, Encoding::default()),
        };
        self.pace.take(payload.len() + beside.len() + message.topic.len());
        let put = self.publisher_of(message.topic)?.put(payload).encoding(encoding);
        put.attachment(beside).wait().map_err(lost)
    }

    fn link(&self) -> Link {
        self.connection.link()
    }

    fn serve(&mut self, name: &str, answers: &str, server: Server) -> Result<(), BridgeError> {
        serve(&self.connection, name, answers, server)
    }

    fn ask(&self, name: &str, longest: usize, take: Taker) -> Result<(), BridgeError> {
        ask(&self.connection, &self.inbox, name, longest, take)
    }

    fn attend(&self, name: &str) -> Result<Option<Box<dyn Send>>, BridgeError> {
        Ok(Some(Box::new(self.liveliness().declare(name)?)))
    }

    fn attendance(&self, pattern: &str) -> Result<Option<Attendance>, BridgeError> {
        Ok(Some(self.liveliness().watch(pattern)?.into()))
    }

    fn request(&mut self, to: &str, payload: Bytes, within: Duration) -> Result<Answer, BridgeError> {
        request::request(&self.connection, key_of(to)?, payload, None, within)
    }
}

/// Calls back for each message of others, once there is a session.
pub(crate) fn subscribe(
    connection: &Connection,
    key: KeyExpr<'static>,
    deliver: impl Fn(Sample) + Send + Sync + 'static,
) {
    connection.when_open(move |session| {
        let subscriber = session.declare_subscriber(key).allowed_origin(Locality::Remote).callback(deliver);
        // Fails only if the session is closed: then nothing is wanted any more.
        let _ = subscriber.background().wait();
    });
}

/// A publisher of messages whose value lies in being new. They are not `express`: this is no faster while nothing waits, and then
/// each message takes one of the queue's 16 places.
pub(crate) fn declare_publisher(
    session: &Session,
    key: KeyExpr<'static>,
) -> Result<Publisher<'static>, BridgeError> {
    let publisher = session
        .declare_publisher(key)
        .congestion_control(CongestionControl::Drop)
        .priority(Priority::RealTime)
        .wait();
    publisher.map_err(lost)
}

/// Runs in Zenoh's threads: only the attachment is decoded here, the rest by the reader, or in its place while it sleeps.
fn deliver(inbox: &Inbox, topic: Arc<str>, sample: &Sample) {
    if sample.kind() != SampleKind::Put {
        return;
    }
    let beside = sample.attachment().map(|bytes| attachment::read(&bytes.to_bytes())).unwrap_or_default();
    inbox.hand(Message {
        stamp: beside.stamp.or_else(|| stamp_of(sample)),
        publisher: beside.publisher,
        message_type: type_of(sample),
        quality: beside.quality,
        ..Message::new(topic, inbox.clock().now(), Payload::Bytes(bytes_of(sample)))
    });
}

pub(crate) fn bytes_of(sample: &Sample) -> Bytes {
    Bytes::from(sample.payload().to_bytes().into_owned())
}

/// The stamp of Zenoh's routers.
pub(crate) fn stamp_of(sample: &Sample) -> Option<Time> {
    let time: SystemTime = sample.timestamp()?.get_time().to_system_time();
    let since = time.duration_since(UNIX_EPOCH).ok()?;
    i64::try_from(since.as_nanos()).ok().map(Time)
}

/// The schema of the encoding, after its `;`: `application/cdr;sensor_msgs/msg/LaserScan`.
fn type_of(sample: &Sample) -> Option<Arc<str>> {
    // The encodings of most messages, without a schema.
    if [Encoding::ZENOH_BYTES, Encoding::APPLICATION_JSON].contains(sample.encoding()) {
        return None;
    }
    let encoding = sample.encoding().to_string();
    encoding.split_once(';').map(|(_, schema)| schema.into())
}

/// The key of a topic's name.
pub(crate) fn key_of(topic: &str) -> Result<KeyExpr<'static>, BridgeError> {
    let bare = topic.strip_prefix('/').unwrap_or(topic);
    let key = KeyExpr::try_from(bare.to_owned()).ok().filter(|key| !key.contains('*'));
    key.ok_or_else(|| {
        let help = "parts between slashes, none of them empty, without * $ ? #";
        BridgeError::Configuration(format!("topic '{topic}' is no name for Zenoh: {help}"))
    })
}

pub(crate) fn not_open(connection: &Connection) -> BridgeError {
    match connection.link() {
        Link::Down(problem) => BridgeError::Lost(problem),
        Link::Up => BridgeError::Lost("the session is being opened".into()),
    }
}

pub(crate) fn lost(problem: impl std::fmt::Display) -> BridgeError {
    BridgeError::Lost(options::first_line(&problem.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_names_without_the_leading_slash() {
        let check = |topic: &str, expected: &str| {
            let shown = key_of(topic).map_or_else(|problem| problem.to_string(), |key| key.to_string());
            assert!(shown.starts_with(expected), "{shown}");
        };
        check("/odom/speed", "odom/speed");
        check("odom", "odom");
        check("a b/ä", "a b/ä");
        for topic in ["", "/", "a//b", "a/", "a/*", "**", "a$*b", "a#b", "a?b", "//a"] {
            check(topic, &format!("topic '{topic}' is no name for Zenoh: "));
        }
    }
}
