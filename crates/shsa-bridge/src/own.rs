//! A bus of the caller's own: the caller pushes messages into the inbox, and a function gets the publications.

use crate::{Bridge, BridgeError, Inbox, Link, Outgoing, PublisherId};

/// A caller's own source and sink as a bus.
///
/// The caller pushes received messages into the [`Inbox`], from any thread; the sink gets each publication, in the publishing
/// thread. Our own messages do not come back unless the caller pushes them.
///
/// ```
/// use shsa_bridge::{Bridge, Clock, Inbox, Message, Outgoing, OwnBus, Payload};
/// use shsa_core::observation::RawValue;
/// use shsa_core::time::Time;
///
/// let (sender, sent) = std::sync::mpsc::channel();
/// let inbox = Inbox::new(8, Clock::manual());
/// let mut bus = OwnBus::new(inbox.clone(), move |message: Outgoing<'_>| {
///     let _ = sender.send(message.topic.to_owned());
///     Ok(())
/// });
/// let value = Payload::Value(RawValue::Number(1.5));
/// inbox.push(Message::new("sensor".into(), Time(3), value.clone()));
/// assert_eq!(bus.receive().map(|message| message.payload), Some(value.clone()));
/// bus.publish(Outgoing::new("healed", Time(3), value))?;
/// assert_eq!(sent.recv().unwrap(), "healed");
/// # Ok::<(), shsa_bridge::BridgeError>(())
/// ```
pub struct OwnBus<S> {
    inbox: Inbox,
    sink: S,
}

impl<S: FnMut(Outgoing<'_>) -> Result<(), BridgeError> + Send> OwnBus<S> {
    /// A bus whose messages are pushed into `inbox`; `sink` sends. A failing sink returns [`BridgeError::Lost`] if trying again
    /// is worthwhile.
    pub fn new(inbox: Inbox, sink: S) -> OwnBus<S> {
        OwnBus { inbox, sink }
    }
}

impl<S: FnMut(Outgoing<'_>) -> Result<(), BridgeError> + Send> Bridge for OwnBus<S> {
    fn publisher(&self) -> PublisherId {
        PublisherId(0)
    }

    fn inbox(&self) -> &Inbox {
        &self.inbox
    }

    /// The caller decides what to push.
    fn subscribe(&mut self, _: &str, _: Option<&str>) -> Result<(), BridgeError> {
        Ok(())
    }

    fn subscribe_all(&mut self) -> Result<(), BridgeError> {
        Ok(())
    }

    fn publish(&mut self, message: Outgoing<'_>) -> Result<(), BridgeError> {
        (self.sink)(message)
    }

    /// The sink gets the bounds of every scalar.
    fn carries_bounds(&self) -> bool {
        true
    }

    fn link(&self) -> Link {
        Link::Up
    }
}
