//! Middleware: how observations come in and substitutes go out.
//!
//! One module and one feature a middleware; each is a [`Bridge`]. A bridge never delivers what it has published
//! itself: a substitute goes out under the name of the signal that it replaces, and must not come back as
//! evidence about that signal. Everyone else tells the two apart by [`Message::publisher`].

mod inbox;
#[cfg(feature = "memory")]
pub mod memory;

pub use inbox::Inbox;

use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use std::fmt;
use std::sync::Arc;

/// Who has published a message: unique on its bus, and as wide as the identities of Zenoh and ROS 2 (16 bytes).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PublisherId(pub u128);

impl fmt::Display for PublisherId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:x}", self.0)
    }
}

/// One value on its way.
#[derive(Clone, Debug, PartialEq)]
pub struct Message {
    /// The name under which it was published.
    pub topic: Arc<str>,
    /// Its time stamp, as the publisher gave it.
    pub stamp: Time,
    /// When it was received.
    pub received: Time,
    /// Who published it.
    pub publisher: PublisherId,
    /// A number, an interval or a list, in the unit of the topic.
    pub value: RawValue,
}

/// A connection to a middleware.
///
/// Subscriptions are exact names. What arrives waits in a bounded [`Inbox`], where the newest wins, so a slow
/// reader neither blocks the middleware nor grows without bound.
pub trait Bridge {
    /// Why the middleware could not do what it was asked for.
    type Error: std::error::Error + Send + Sync + 'static;

    /// The identity that this bridge publishes under.
    fn publisher(&self) -> PublisherId;

    /// Receives from now on what others publish under `topic`; asking twice is the same as asking once.
    ///
    /// # Errors
    /// When the middleware refuses or is lost.
    fn subscribe(&mut self, topic: &str) -> Result<(), Self::Error>;

    /// The oldest message that waits, in the order of arrival; `None` when none waits. Does not block.
    ///
    /// # Errors
    /// When the connection is lost.
    fn receive(&mut self) -> Result<Option<Message>, Self::Error>;

    /// Sends a value to all others that have subscribed to `topic`.
    ///
    /// # Errors
    /// When the connection is lost.
    fn publish(&mut self, topic: &str, stamp: Time, value: RawValue) -> Result<(), Self::Error>;

    /// How many messages had to make room for newer ones.
    fn dropped(&self) -> u64;
}
