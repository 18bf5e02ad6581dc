//! Middleware: receives observations and publishes substitutes.
//!
//! Each middleware is a module, a feature and a [`Bridge`]. A bridge never delivers its own publications: a substitute has the
//! name of the signal that it replaces, and must not count as evidence about that signal. Other readers distinguish them by
//! [`Message::publisher`] or by the [`Provenance`].
//!
//! Received messages wait in an [`Inbox`], bounded for each topic: a flood of one topic costs that topic its oldest messages, and
//! other topics nothing. Each message carries the time of its reception by a [`Clock`], which does not follow steps of the wall clock.
//!
//! A bridge reconnects by itself. A program with messages of its own needs no middleware: [`OwnBus`] connects an inbox and a function.
//!
//! # Example
//!
//! ```
//! use shsa_bridge::{Bridge, Clock, Inbox, Message, Outgoing, OwnBus, Payload};
//! use shsa_core::observation::RawValue;
//! use shsa_core::time::Time;
//!
//! let inbox = Inbox::new(8, Clock::manual());
//! let mut bus = OwnBus::new(inbox.clone(), |message: Outgoing<'_>| {
//!     assert_eq!(message.topic, "healed/speed");
//!     Ok(())
//! });
//! let speed = Payload::Value(RawValue::Number(13.6));
//! inbox.push(Message::new("wheel/speed".into(), Time(3), speed.clone()));
//! let received = bus.receive().unwrap();
//! assert_eq!(&*received.topic, "wheel/speed");
//! bus.publish(Outgoing::new("healed/speed", Time(3), speed))?;
//! # Ok::<(), shsa_bridge::BridgeError>(())
//! ```

mod backlog;
mod channel;
mod clock;
mod diagnostic;
mod error;
mod inbox;
mod own;
mod provenance;
mod question;
pub mod cdr;
pub mod payload;
#[cfg(feature = "memory")]
pub mod memory;
#[cfg(feature = "mqtt")]
pub mod mqtt;
#[cfg(feature = "zenoh")]
pub mod zenoh;
#[cfg(any(feature = "ros2", feature = "ros2-dds"))]
mod ros;
#[cfg(feature = "ros2")]
pub mod ros2;
#[cfg(feature = "ros2-dds")]
pub mod dds;
#[cfg(feature = "memory")]
mod address;

#[cfg(feature = "memory")]
pub use address::{Address, BusOptions};
pub use channel::Channel;
pub use clock::{Clock, SourceClock};
pub use diagnostic::{Diagnostic, Level};
pub use error::BridgeError;
pub use inbox::{Absence, DirectReader, Inbox, Losses};
pub use own::{OwnBus, OwnConnection};
pub use provenance::{Admission, Provenance, Quality};
pub use question::{Question, Server, Taker};

use bytes::Bytes;
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use shsa_core::unit::Unit;
use std::fmt;
use std::sync::Arc;
use std::time::Duration;

/// The identity of a publisher: unique on its bus, and as wide as the identities of Zenoh and ROS 2 (16 bytes).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PublisherId(pub u128);

impl fmt::Display for PublisherId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:x}", self.0)
    }
}

/// The content of a message.
#[derive(Clone, Debug, PartialEq)]
pub enum Payload {
    /// A value, not encoded: within one process.
    Value(RawValue),
    /// Bytes as received.
    Bytes(Bytes),
}

/// A received message.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    /// The topic.
    pub topic: Arc<str>,
    /// The publisher's wall-clock stamp, if the transport carries one beside the payload.
    pub stamp: Option<Time>,
    /// The time of reception, by the inbox's [`Clock`].
    pub received: Time,
    /// The publisher, if the transport gives it.
    pub publisher: Option<PublisherId>,
    /// The type of the payload if the transport gives it, such as `sensor_msgs/msg/LaserScan`.
    pub message_type: Option<Arc<str>>,
    /// The quality of the value, if the transport carries it beside the payload. A message with a quality other than
    /// [`Quality::Good`] is no evidence about the signal: another instance may have published a substitute.
    pub quality: Option<Quality>,
    /// Whether the message may be of any age: it was kept for later subscribers (MQTT's retained messages), or has waited during
    /// an absence ([`Inbox::attend`]). Without a stamp of its own it is no evidence about the present.
    pub retained: bool,
    /// The value, or its encoding.
    pub payload: Payload,
}

impl Message {
    /// A message of which the transport gives only the topic.
    #[must_use]
    pub fn new(topic: Arc<str>, received: Time, payload: Payload) -> Message {
        Message {
            topic,
            stamp: None,
            received,
            publisher: None,
            message_type: None,
            quality: None,
            retained: false,
            payload,
        }
    }

    /// The value, if it is not encoded.
    #[must_use]
    pub fn value(&self) -> Option<&RawValue> {
        match &self.payload {
            Payload::Value(value) => Some(value),
            Payload::Bytes(_) => None,
        }
    }

    /// Its stamp, or if there is none, the time of reception.
    #[must_use]
    pub fn stamped(&self) -> Time {
        self.stamp.unwrap_or(self.received)
    }
}

/// A message to be sent.
#[derive(Clone, Debug, PartialEq)]
pub struct Outgoing<'a> {
    /// The topic.
    pub topic: &'a str,
    /// The wall-clock time at which the value was true; for transports that carry a stamp beside the payload.
    pub stamp: Time,
    /// A transport of bytes writes a value as text: a number, or a list of numbers in JSON.
    pub payload: Payload,
    /// The provenance of the value, for transports that carry more than the payload (Zenoh's attachment, MQTT 5's user
    /// properties).
    pub provenance: Option<&'a Provenance>,
    /// Whether later subscribers get it, too: MQTT's retained messages. Other transports do not keep messages.
    pub retain: bool,
    /// The message is useless from this time of the bridge's clock on: it is not sent then, and a broker of MQTT 5 does not deliver it
    /// (in whole seconds).
    pub expires: Option<Time>,
}

impl<'a> Outgoing<'a> {
    /// A message without provenance that is not retained.
    #[must_use]
    pub fn new(topic: &'a str, stamp: Time, payload: Payload) -> Outgoing<'a> {
        Outgoing { topic, stamp, payload, provenance: None, retain: false, expires: None }
    }
}

/// A name under which values will be published.
#[derive(Clone, Copy, Debug)]
pub struct Offered<'a> {
    /// The topic of the values.
    pub topic: &'a str,
    /// Their unit.
    pub unit: Option<&'a Unit>,
}

/// The state of a bridge's connection.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Link {
    /// Connected.
    Up,
    /// Not connected, for this reason; the bridge keeps trying.
    Down(String),
}

/// A time without a connection.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Outage {
    /// Its number: 1 is the first one since the bridge was opened.
    pub number: u64,
    /// When the connection was lost, by the inbox's [`Clock`].
    pub lost: Time,
    /// When the connection was restored; `None`: it is not yet.
    pub found: Option<Time>,
    /// Why the connection was lost.
    pub because: String,
}

/// A change of a token.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Presence {
    /// The token is held; reported once for each token that was held before.
    Alive(Arc<str>),
    /// The token's holder is gone.
    Gone(Arc<str>),
}

/// Returns the oldest change of tokens that was not read yet, beginning with the present holders. Does not block.
pub type Attendance = Box<dyn FnMut() -> Option<Presence> + Send>;

/// Waits for the answer to a request, at most for its time limit; an error if nobody answers or the answer is a refusal.
pub type Answer = Box<dyn FnOnce() -> Result<Bytes, BridgeError> + Send>;

/// A connection to a middleware.
///
/// Subscriptions are exact names. A lost connection is no error: the bridge reconnects by itself and subscribes again;
/// [`Bridge::link`] tells its state.
pub trait Bridge: Send {
    /// The identity of this bridge's publications.
    fn publisher(&self) -> PublisherId;

    /// The inbox of this bridge.
    fn inbox(&self) -> &Inbox;

    /// Subscribes to `topic`; a second call has no effect. `message_type`, if known, is for transports whose names depend on it.
    ///
    /// # Errors
    /// When the middleware refuses the name.
    fn subscribe(&mut self, topic: &str, message_type: Option<&str>) -> Result<(), BridgeError>;

    /// Subscribes to everything.
    ///
    /// # Errors
    /// When the middleware refuses.
    fn subscribe_all(&mut self) -> Result<(), BridgeError>;

    /// Announces that messages of this type will be published under `topic`: some transports need the type for the name, or list
    /// publishers. Without it, the first message sets up the publisher.
    ///
    /// # Errors
    /// When the middleware refuses the name or the type.
    fn advertise(&mut self, _topic: &str, _message_type: &str) -> Result<(), BridgeError> {
        Ok(())
    }

    /// Announces all names under which `owner` will publish from now on, instead of those that it has announced before: Sparkplug
    /// has all of them in the first message.
    fn offer(&mut self, _owner: &str, _offered: &[Offered<'_>]) {}

    /// Tells that the quality of what was published last under this topic has changed without a value, where the middleware
    /// keeps values with their qualities: as properties of Sparkplug's metrics.
    fn rate(&mut self, _topic: &str, _stamp: Time, _quality: Quality) {}

    /// Sends to all others that have subscribed to the topic.
    ///
    /// # Errors
    /// When the middleware refuses the message, or can neither send it nor keep it for sending.
    fn publish(&mut self, message: Outgoing<'_>) -> Result<(), BridgeError>;

    /// Sends published messages now, if they would wait until a reader waits for messages. Does not block.
    fn flush(&mut self) {}

    /// Publishes the states of parts where the middleware has a topic for them: `/diagnostics` of ROS. `states` is asked only there.
    ///
    /// # Errors
    /// As [`Bridge::publish`].
    fn diagnose(
        &mut self,
        _stamp: Time,
        _states: &mut dyn FnMut() -> Vec<Diagnostic>,
    ) -> Result<(), BridgeError> {
        Ok(())
    }

    /// The state of the connection.
    fn link(&self) -> Link;

    /// What protects the messages of the connection, by how it is made. It is the same for all connections that the bridge makes.
    fn channel(&self) -> Channel {
        Channel::default()
    }

    /// The last outage after the first connection, if the bridge detects even the shortest ones. `None`: there was none, or the
    /// middleware does not report them; then [`Bridge::link`] gives the present state.
    fn outage(&self) -> Option<Outage> {
        None
    }

    /// Holds a token under a unique name until the returned value is dropped or the connection ends. `None` if the middleware has
    /// no tokens.
    ///
    /// # Errors
    /// When the name is invalid.
    fn attend(&self, _name: &str) -> Result<Option<Box<dyn Send>>, BridgeError> {
        Ok(None)
    }

    /// The changes of all tokens whose names match a pattern, including our own: `*` is one level, `**` any number. Each change
    /// wakes the inbox's reader. `None` if the middleware has no tokens.
    ///
    /// # Errors
    /// When the pattern is invalid.
    fn attendance(&self, _pattern: &str) -> Result<Option<Attendance>, BridgeError> {
        Ok(None)
    }

    /// Sends a request to a name: a query of Zenoh, a service of ROS 2 (in CDR), a message of MQTT 5 that is answered under
    /// `to/response`. Returns at once; any thread can wait for the answer.
    ///
    /// # Errors
    /// When the middleware has no requests, refuses the name, or is not connected.
    fn request(&mut self, _to: &str, _payload: Bytes, _within: Duration) -> Result<Answer, BridgeError> {
        Err(BridgeError::Configuration("this bus has no requests".to_owned()))
    }

    /// Whether a scalar goes out with its bounds, as to functions of one process or as properties beside the value, so that the middle of
    /// an uncertain value is not taken for the value.
    fn carries_bounds(&self) -> bool {
        false
    }

    /// Whether the bridge always recognises its own messages. If it knows them only by content, it cannot tell whether another
    /// publisher uses the same name.
    fn knows_own(&self) -> bool {
        true
    }

    /// Passes requests under `name` to `server` from now on: messages that are published there, and queries if the middleware has
    /// them. Answers to messages are published under `answers`, or under a name below it that the asker has chosen. Has no effect
    /// if the middleware has no requests.
    ///
    /// # Errors
    /// When the middleware refuses a name.
    fn serve(&mut self, _name: &str, _answers: &str, _server: Server) -> Result<(), BridgeError> {
        Ok(())
    }

    /// Queries `name` once, and passes the first answer of at most `longest` bytes to `take`, which must not wait; this wakes the
    /// inbox's reader. `take` is never called if nobody answers, or the middleware has no queries.
    ///
    /// # Errors
    /// When the name is invalid.
    fn ask(&self, _name: &str, _longest: usize, _take: Taker) -> Result<(), BridgeError> {
        Ok(())
    }

    /// Refusals of the other side since the last call that did not end the connection: of a subscription, of a message. Bounded;
    /// the oldest are forgotten.
    fn troubles(&mut self) -> Vec<BridgeError> {
        Vec::new()
    }

    /// Messages that the other side has refused after [`Bridge::publish`] took them, since the last call: the topic of each, with
    /// the reason. Bounded; the oldest are forgotten. Each wakes the inbox's reader. None where the middleware does not tell.
    fn refusals(&mut self) -> Vec<(Arc<str>, BridgeError)> {
        Vec::new()
    }

    /// The oldest waiting message, if there is one. Does not block.
    fn receive(&mut self) -> Option<Message> {
        self.inbox().pop()
    }
}
