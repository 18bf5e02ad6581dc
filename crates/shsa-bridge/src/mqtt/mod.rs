//! MQTT 3.1.1 and 5: a client that reconnects by itself.
//!
//! `publish -> outbox -> connection -> broker -> connection -> inbox`
//!
//! A reader that waits for messages drives the connection. A thread does so while nobody waits, or the reader is behind.
//!
//! The broker knows the client by its name and keeps its messages during an absence. Publications meanwhile wait here, the newest
//! of each topic. In version 5, provenance, stamp and publisher are user properties beside the payload, and a broker sends no
//! message back to its publisher; in 3.1.1, own messages are recognised by content.
//!
//! Topics are taken literally: `/scan` and `scan` are two.

mod claims;
mod client;
mod echo;
mod options;
mod outbox;
mod profile;
mod served;
mod session;
mod shared;
mod tls;
mod turns;
mod unasked;
pub mod sparkplug;

pub use options::{Credentials, Delivery, Options, Presence, Version};
pub use tls::Tls;

use crate::clock::Uptime;
use crate::inbox::Driver;
use crate::{
    Answer, Attendance, Bridge, BridgeError, Channel, Inbox, Link, Outage, Outgoing, Payload, Provenance,
    PublisherId, Server, payload,
};
use bytes::Bytes;
use outbox::Publication;
use profile::Profile;
use served::{Served, Words};
use shared::Shared;
use shsa_core::time::Time;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;
use turns::Turns;

/// A connection to a broker, and the thread that drives it while nobody waits for messages.
pub struct MqttBridge {
    shared: Arc<Shared>,
    turns: Arc<Turns>,
    version: Version,
    channel: Channel,
    /// The topics of its publications, each with the last provenance.
    published: BTreeMap<Arc<str>, Option<Arc<Provenance>>>,
    /// Whether a publication may wait for the thread that drives the connection.
    has_published: bool,
    /// Another connection that the same thread drives, under another name.
    companion: Option<Arc<Shared>>,
    thread: Option<JoinHandle<()>>,
}

/// Another connection beside that of a bridge.
struct Companion {
    options: Options,
    profile: Arc<dyn Profile>,
}

impl MqttBridge {
    /// Connects; received messages wait in `inbox`. Returns when the first attempt has ended, or its time has passed. An
    /// unreachable broker is no error: the bridge keeps trying, and [`Bridge::link`] shows the state.
    ///
    /// # Errors
    /// [`BridgeError::Configuration`] for files that cannot be used, [`BridgeError::Refused`] when the broker refuses the
    /// credentials or the name, or one side the other's certificate.
    pub fn open(options: &Options, inbox: Inbox) -> Result<MqttBridge, BridgeError> {
        MqttBridge::open_with(options, inbox, None, None)
    }

    /// As [`MqttBridge::open`], by the rules of a profile, and with another connection.
    fn open_with(
        options: &Options,
        inbox: Inbox,
        profile: Option<Arc<dyn Profile>>,
        companion: Option<Companion>,
    ) -> Result<MqttBridge, BridgeError> {
        check_name(&options.name, "the client's name")?;
        let publisher = identity(&options.name);
        // Unusable files are an error at once, not in the thread.
        drop(client::new(options, publisher, None)?);
        let turns = Turns::new().map_err(|error| BridgeError::Lost(format!("no event loop: {error}")))?;
        let turns = Arc::new(turns);
        let driver: Arc<dyn Driver> = turns.clone();
        inbox.driven_by(&driver);
        let other = companion.map(|Companion { options, profile }| {
            let publisher = identity(&options.name);
            (Arc::new(Shared::new(&options, inbox.clone(), publisher, Some(profile))), options)
        });
        let companion = other.as_ref().map(|(shared, _)| shared.clone());
        let shared = Arc::new(Shared::new(options, inbox, publisher, profile));
        let first = session::run(shared.clone(), options.clone(), turns.clone());
        let of_second = turns.clone();
        let connections = async move {
            let second = async {
                if let Some((shared, options)) = other {
                    session::run(shared, options, of_second).await;
                }
            };
            tokio::join!(first, second);
        };
        let thread = Turns::keep(&turns, connections)
            .map_err(|error| BridgeError::Lost(format!("no thread: {error}")))?;
        let (version, channel) = (options.version, options.channel());
        let (published, thread) = (BTreeMap::new(), Some(thread));
        let bridge = MqttBridge {
            shared,
            turns,
            version,
            channel,
            published,
            has_published: false,
            companion,
            thread,
        };
        match bridge.shared.first_attempt(options.first_attempt) {
            Some(Err(refused @ BridgeError::Refused(_))) => Err(refused),
            _ => Ok(bridge),
        }
    }
}

impl MqttBridge {
    /// When a message that expires then is over; `None`: never. A suspension of the process in between makes this earlier, not later.
    fn until(&self, expires: Option<Time>) -> Option<Uptime> {
        let now = Uptime::now();
        let left = expires? - self.shared.inbox.clock().now();
        now.checked_add(Duration::from_nanos(u64::try_from(left.0).unwrap_or(0)))
    }

    /// The topic and the provenance, shared with earlier messages that have the same.
    fn names(&mut self, topic: &str, provenance: Option<&Provenance>) -> (Arc<str>, Option<Arc<Provenance>>) {
        let known =
            self.published.get_key_value(topic).filter(|(_, published)| published.as_deref() == provenance);
        if let Some((topic, published)) = known {
            return (topic.clone(), published.clone());
        }
        let (topic, published) = (Arc::<str>::from(topic), provenance.cloned().map(Arc::new));
        self.published.insert(topic.clone(), published.clone());
        (topic, published)
    }
}

impl Drop for MqttBridge {
    /// Sends waiting messages and disconnects, within about a second.
    fn drop(&mut self) {
        self.companion.iter().for_each(|companion| companion.stop());
        self.shared.stop();
        self.turns.end();
        if let Some(thread) = self.thread.take() {
            let _whether_it_panicked = thread.join();
        }
    }
}

impl Bridge for MqttBridge {
    fn publisher(&self) -> PublisherId {
        self.shared.publisher
    }

    fn channel(&self) -> Channel {
        self.channel
    }

    fn inbox(&self) -> &Inbox {
        &self.shared.inbox
    }

    fn subscribe(&mut self, topic: &str, _message_type: Option<&str>) -> Result<(), BridgeError> {
        check_topic(topic)?;
        self.shared.subscribe(topic);
        Ok(())
    }

    fn subscribe_all(&mut self) -> Result<(), BridgeError> {
        self.shared.subscribe_all();
        Ok(())
    }

    fn publish(&mut self, message: Outgoing<'_>) -> Result<(), BridgeError> {
        let until = self.until(message.expires);
        check_topic(message.topic)?;
        let payload = match message.payload {
            Payload::Bytes(bytes) => bytes,
            Payload::Value(value) => Bytes::from(payload::plain(&value)),
        };
        let (topic, provenance) = self.names(message.topic, message.provenance);
        self.has_published = true;
        self.shared.publish(Publication {
            retain: message.retain,
            provenance,
            until,
            ..Publication::new(topic, payload, message.stamp)
        })
    }

    fn serve(&mut self, name: &str, answers: &str, server: Server) -> Result<(), BridgeError> {
        check_topic(name)?;
        check_topic(answers)?;
        let (shared, clock) = (Arc::downgrade(&self.shared), self.inbox().clock().clone());
        let publish = move |answer: Words| {
            let Words { topic, words, correlation } = answer;
            let publication = Publication::new(topic.into(), words, clock.by_wall(clock.now()));
            let sent =
                shared.upgrade().map(|shared| shared.publish(Publication { correlation, ..publication }));
            // An answer that is too large, or whose connection is lost, is dropped.
            drop(sent);
        };
        self.shared.serve(name, Served::new(answers, server, publish));
        Ok(())
    }

    fn flush(&mut self) {
        if std::mem::take(&mut self.has_published) {
            // If another thread drives the connection, it sends already.
            self.turns.drive(false, Duration::ZERO);
        }
    }

    fn link(&self) -> Link {
        self.shared.link()
    }

    fn outage(&self) -> Option<Outage> {
        self.shared.outage()
    }

    /// A retained message that expires lists the claims ([`Options::claims`]).
    fn attend(&self, name: &str) -> Result<Option<Box<dyn Send>>, BridgeError> {
        self.shared.claims.attend(name)
    }

    fn attendance(&self, pattern: &str) -> Result<Option<Attendance>, BridgeError> {
        let attendance = self.shared.claims.attendance(pattern);
        self.shared.watch_claims();
        Ok(attendance)
    }

    fn request(&mut self, to: &str, payload: Bytes, within: Duration) -> Result<Answer, BridgeError> {
        check_topic(to)?;
        if let Link::Down(why) = self.link() {
            // A request that is sent after the outage would have no asker any more.
            return Err(BridgeError::Lost(why));
        }
        let answers = format!("{to}/response");
        let clock = self.shared.inbox.clock();
        let question = Publication {
            answers: Some(answers.as_str().into()),
            ..Publication::new(to.into(), payload, clock.by_wall(clock.now()))
        };
        let answer = self.shared.ask(&answers, question)?;
        Ok(Box::new(move || {
            answer.recv_timeout(within).map_err(|_| BridgeError::Lost(format!("no answer on `{answers}`")))
        }))
    }

    fn knows_own(&self) -> bool {
        self.version == Version::V5
    }

    fn troubles(&mut self) -> Vec<BridgeError> {
        self.shared.troubles()
    }

    fn refusals(&mut self) -> Vec<(Arc<str>, BridgeError)> {
        self.shared.refusals()
    }
}

/// Names are exact: no wildcards, only characters that every broker accepts.
fn check_topic(topic: &str) -> Result<(), BridgeError> {
    if topic.contains(['+', '#']) {
        return Err(BridgeError::Refused(format!(
            "the topic `{topic}`: names are exact, `+` and `#` have a meaning in MQTT"
        )));
    }
    check_name(topic, "the topic")
}

fn check_name(name: &str, what: &str) -> Result<(), BridgeError> {
    let problem = match name.len() {
        0 => "is empty",
        1..=65_535 if name.contains('\0') => "has a NUL character",
        1..=65_535 => return Ok(()),
        _ => "is longer than 65535 bytes",
    };
    Err(BridgeError::Refused(format!("{what} {problem}")))
}

/// The identity for a name: FNV-1a of 128 bits, the same on every machine.
fn identity(name: &str) -> PublisherId {
    const OFFSET: u128 = 0x6c62_272e_07bb_0142_62b8_2175_6295_c58d;
    const PRIME: u128 = 0x0000_0000_0100_0000_0000_0000_0000_013b;
    PublisherId(name.bytes().fold(OFFSET, |hash, byte| (hash ^ u128::from(byte)).wrapping_mul(PRIME)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn identities_are_those_of_the_algorithm() {
        assert_eq!(identity("").0, 0x6c62_272e_07bb_0142_62b8_2175_6295_c58d);
        assert_eq!(identity("a").0, 0xd228_cb69_6f1a_8caf_7891_2b70_4e4a_8964);
    }

    #[test]
    fn names_with_a_meaning_are_refused() {
        for (topic, problem) in
            [("a/+", "names are exact"), ("#", "names are exact"), ("", "is empty"), ("a\0", "has a NUL")]
        {
            let error = check_topic(topic).unwrap_err().to_string();
            assert!(error.contains(problem), "{error}");
        }
        assert_eq!(check_topic("/scan"), Ok(()));
    }
}
