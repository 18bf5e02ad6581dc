//! Middleware: how observations come in and substitutes go out.
//!
//! One module and one feature a middleware; each is a [`Bridge`]. A bridge never delivers what it has published
//! itself: a substitute goes out under the name of the signal that it replaces, and must not come back as
//! evidence about that signal. Everyone else tells the two apart by [`Message::publisher`] or by the [`Provenance`].
//!
//! What arrives waits in an [`Inbox`], bounded for each topic by itself: a flood of one topic costs that topic its oldest
//! messages, and no other topic anything.

mod clock;
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
#[cfg(feature = "ros2")]
pub mod ros2;
#[cfg(feature = "memory")]
mod address;

#[cfg(feature = "memory")]
pub use address::{Address, BusOptions};
pub use clock::Clock;
pub use error::BridgeError;
pub use inbox::{Absence, DirectReader, Inbox, Losses};
pub use own::OwnBus;
pub use provenance::{Admission, Provenance, Quality};
pub use question::{Question, Server, Taker};

use bytes::Bytes;
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};
use std::fmt;
use std::sync::Arc;
use std::time::Duration;

/// Who has published a message: unique on its bus, and as wide as the identities of Zenoh and ROS 2 (16 bytes).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PublisherId(pub u128);

impl fmt::Display for PublisherId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:x}", self.0)
    }
}

/// What a message carries.
#[derive(Clone, Debug, PartialEq)]
pub enum Payload {
    /// A value as it is: within one process nothing is encoded.
    Value(RawValue),
    /// As it came over the wire.
    Bytes(Bytes),
}

/// What has arrived.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    /// The name under which it was published.
    pub topic: Arc<str>,
    /// The publisher's time stamp where the transport carries one beside the payload; by the wall clock.
    pub stamp: Option<Time>,
    /// When it was received, by the inbox's [`Clock`].
    pub received: Time,
    /// Who published it, where the transport tells.
    pub publisher: Option<PublisherId>,
    /// The type of the payload where the transport tells, such as `sensor_msgs/msg/LaserScan`.
    pub message_type: Option<Arc<str>>,
    /// How far its publisher trusts it, where the transport says so beside the payload. What is neither silent on it nor
    /// [`Quality::Good`] is no evidence about the signal: another instance may have published a substitute.
    pub quality: Option<Quality>,
    /// Whether it may be of any age: it was kept for later subscribers (MQTT's retained messages), or has waited while nobody was
    /// here ([`Inbox::attend`]). Without a stamp of its own it says nothing about now.
    pub retained: bool,
    /// The value, or the bytes that hold it.
    pub payload: Payload,
}

impl Message {
    /// One of which the transport tells nothing but the topic.
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

    /// The value, where nothing has to be decoded.
    #[must_use]
    pub fn value(&self) -> Option<&RawValue> {
        match &self.payload {
            Payload::Value(value) => Some(value),
            Payload::Bytes(_) => None,
        }
    }

    /// Its time stamp, else when it was received.
    #[must_use]
    pub fn stamped(&self) -> Time {
        self.stamp.unwrap_or(self.received)
    }
}

/// What is to be sent.
#[derive(Clone, Debug, PartialEq)]
pub struct Outgoing<'a> {
    /// The name to publish under.
    pub topic: &'a str,
    /// When the value was true, by the wall clock; for transports that carry a stamp beside the payload.
    pub stamp: Time,
    /// A transport that carries bytes only writes a value as text: a number, or a list of numbers in JSON.
    pub payload: Payload,
    /// Where the value comes from, for transports that carry more than the payload (Zenoh's attachment, MQTT 5's user
    /// properties).
    pub provenance: Option<&'a Provenance>,
    /// Whether who subscribes later gets it, too: MQTT's retained messages. Other transports do not keep messages.
    pub retain: bool,
    /// After this time it is of no use to anybody: a broker of MQTT 5 gives it to nobody then (in whole seconds).
    pub expires: Option<Span>,
}

impl<'a> Outgoing<'a> {
    /// A message that says nothing of its provenance and is not kept.
    #[must_use]
    pub fn new(topic: &'a str, stamp: Time, payload: Payload) -> Outgoing<'a> {
        Outgoing { topic, stamp, payload, provenance: None, retain: false, expires: None }
    }
}

/// Whether a bridge is connected.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Link {
    /// It is.
    Up,
    /// It is not, for this reason; it keeps trying.
    Down(String),
}

/// A time without a connection.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Outage {
    /// Its number: 1 is the first since the bridge was opened.
    pub number: u64,
    /// When the connection was lost, by the inbox's [`Clock`].
    pub lost: Time,
    /// When it was there again; `None`: it is not yet.
    pub found: Option<Time>,
    /// Why it was lost.
    pub because: String,
}

/// Somebody came, or has gone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Presence {
    /// Who holds this token is there; said once for each token that was there before.
    Alive(Arc<str>),
    /// Who held it is gone.
    Gone(Arc<str>),
}

/// Who comes and goes, from the beginning on: the oldest change that was not yet looked at. Does not block.
pub type Attendance = Box<dyn FnMut() -> Option<Presence> + Send>;

/// Waits for what was asked for, as long as was said at the most; an error where nobody answers or the answer is no.
pub type Answer = Box<dyn FnOnce() -> Result<Bytes, BridgeError> + Send>;

/// A connection to a middleware.
///
/// Subscriptions are exact names. A lost connection is no error: the bridge reconnects by itself, subscribes again, and
/// tells by [`Bridge::link`] how it stands.
pub trait Bridge: Send {
    /// The identity that this bridge publishes under.
    fn publisher(&self) -> PublisherId;

    /// Where messages wait.
    fn inbox(&self) -> &Inbox;

    /// Receives from now on what others publish under `topic`; asking twice is the same as asking once. `message_type`
    /// is for transports whose names depend on it, where it is known.
    ///
    /// # Errors
    /// When the middleware refuses the name.
    fn subscribe(&mut self, topic: &str, message_type: Option<&str>) -> Result<(), BridgeError>;

    /// Receives from now on everything that is published.
    ///
    /// # Errors
    /// When the middleware refuses.
    fn subscribe_all(&mut self) -> Result<(), BridgeError>;

    /// Says ahead that messages of this type will be published under `topic`: some transports need the type for the
    /// name, or list publishers. Without it, a publisher is set up with its first message.
    ///
    /// # Errors
    /// When the middleware refuses the name or the type.
    fn advertise(&mut self, _topic: &str, _message_type: &str) -> Result<(), BridgeError> {
        Ok(())
    }

    /// Sends to all others that have subscribed to the topic.
    ///
    /// # Errors
    /// When the middleware refuses the message, or it could neither be sent nor kept for sending.
    fn publish(&mut self, message: Outgoing<'_>) -> Result<(), BridgeError>;

    /// Sends what was published now, where it would wait until somebody waits for messages. Does not block.
    fn flush(&mut self) {}

    /// Whether it is connected.
    fn link(&self) -> Link;

    /// The last time without a connection since the first one, where the bridge notices even the shortest. `None`: there was none, or
    /// the middleware does not tell; then [`Bridge::link`] does, for who looks at that moment.
    fn outage(&self) -> Option<Outage> {
        None
    }

    /// Says that we are there, under a name that nobody else uses, until what is returned is dropped or we are gone.
    /// `None` where the middleware has no such tokens.
    ///
    /// # Errors
    /// When the name is none.
    fn attend(&self, _name: &str) -> Result<Option<Box<dyn Send>>, BridgeError> {
        Ok(None)
    }

    /// Tells of all tokens whose names a pattern matches, our own among them: `*` is one level, `**` any number. Each
    /// change ends the wait of the inbox's reader. `None` where the middleware has no such tokens.
    ///
    /// # Errors
    /// When the pattern is none.
    fn attendance(&self, _pattern: &str) -> Result<Option<Attendance>, BridgeError> {
        Ok(None)
    }

    /// Asks who answers under a name: a query of Zenoh, a service of ROS 2 (in CDR), a message of MQTT 5 that is answered
    /// under `to/response`. Returns at once; the answer can be waited for anywhere.
    ///
    /// # Errors
    /// When the middleware has no requests, refuses the name, or is not connected.
    fn request(&mut self, _to: &str, _payload: Bytes, _within: Duration) -> Result<Answer, BridgeError> {
        Err(BridgeError::Configuration("this bus has no requests".to_owned()))
    }

    /// Whether it is sure which messages are our own. Where they are only known by their content, nobody can say
    /// whether somebody else publishes under a name that we publish under.
    fn knows_own(&self) -> bool {
        true
    }

    /// Hands what others ask under `name` to `server`, from now on: messages that are published there, and queries where the
    /// middleware has them. Answers to messages go out under `answers`, or a name below it that the asker has chosen.
    /// Nothing comes where nobody can ask.
    ///
    /// # Errors
    /// When the middleware refuses a name.
    fn serve(&mut self, _name: &str, _answers: &str, _server: Server) -> Result<(), BridgeError> {
        Ok(())
    }

    /// Asks once under `name`, and gives the first answer of at most `longest` bytes to `take`, which must not wait; that
    /// ends the wait of the inbox's reader. Nothing comes where nobody answers, or the middleware has no queries.
    ///
    /// # Errors
    /// When the name is none.
    fn ask(&self, _name: &str, _longest: usize, _take: Taker) -> Result<(), BridgeError> {
        Ok(())
    }

    /// What the other side has refused since it was asked last, without ending the connection: a subscription, a
    /// message. Bounded; the oldest are forgotten.
    fn troubles(&mut self) -> Vec<BridgeError> {
        Vec::new()
    }

    /// The oldest message that waits; `None` when none does. Does not block.
    fn receive(&mut self) -> Option<Message> {
        self.inbox().pop()
    }
}
