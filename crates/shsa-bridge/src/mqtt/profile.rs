//! Protocols on top of MQTT that have rules for a whole connection: its will, its first and last messages, and what arrives.

use super::client::Arrived;
use super::outbox::Publication;
use bytes::Bytes;

/// The message that the broker publishes when the connection breaks, delivered at least once.
pub(super) struct Will {
    pub(super) topic: String,
    pub(super) payload: Bytes,
    pub(super) retain: bool,
}

/// A protocol on top of MQTT. Its methods are called with the connection's state locked: they must not wait, nor use the
/// connection.
pub(super) trait Profile: Send + Sync {
    /// The will of the next connection; `None`: it has none.
    fn will(&self) -> Option<Will>;

    /// What is subscribed to before all else, patterns included.
    fn filters(&self) -> Vec<String>;

    /// A connection was made: the first messages after the subscriptions.
    fn connected(&self) -> Vec<Publication>;

    /// The connection has broken.
    fn disconnected(&self);

    /// The last messages before the connection is ended in order.
    fn leave(&self) -> Vec<Publication>;

    /// Takes in a message, and gives its answers; `None`: the message is none of the profile.
    fn arrived(&self, arrived: &Arrived) -> Option<Vec<Publication>>;

    /// Passes what waits to be sent to `send`, until that refuses because its queue is full.
    fn pump(&self, send: &mut dyn FnMut(&Publication) -> bool);
}
