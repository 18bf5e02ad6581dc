//! A bus of the caller's own: the caller pushes messages into the inbox, and a function gets the publications.

use crate::{Bridge, BridgeError, Inbox, Link, Outage, Outgoing, PublisherId};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

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
    connection: OwnConnection,
}

/// The connection of whatever brings the messages to the caller, by which the caller reports outages; clones are the same connection.
#[derive(Clone)]
pub struct OwnConnection {
    inbox: Inbox,
    last: Arc<Mutex<Option<Outage>>>,
}

impl OwnConnection {
    fn last(&self) -> MutexGuard<'_, Option<Outage>> {
        self.last.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The connection is lost now, for a reason; a second loss in a row has no effect.
    pub fn lose(&self, because: String) {
        let mut last = self.last();
        let number = last.as_ref().map_or(0, |last| last.number);
        if last.as_ref().is_none_or(|last| last.found.is_some()) {
            let lost = self.inbox.clock().now();
            *last = Some(Outage { number: number + 1, lost, found: None, because });
        }
        drop(last);
        self.inbox.wake();
    }

    /// The connection is restored now; without a loss before, that has no effect.
    pub fn find(&self) {
        if let Some(last) = self.last().as_mut() {
            last.found.get_or_insert_with(|| self.inbox.clock().now());
        }
    }
}

impl<S: FnMut(Outgoing<'_>) -> Result<(), BridgeError> + Send> OwnBus<S> {
    /// A bus whose messages are pushed into `inbox`; `sink` sends. A failing sink returns [`BridgeError::Lost`] if trying again
    /// is worthwhile.
    pub fn new(inbox: Inbox, sink: S) -> OwnBus<S> {
        let connection = OwnConnection { inbox: inbox.clone(), last: Arc::default() };
        OwnBus { inbox, sink, connection }
    }

    /// The connection that the caller reports; it counts as there until the caller loses it.
    pub fn connection(&self) -> OwnConnection {
        self.connection.clone()
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
        match self.connection.last().as_ref() {
            Some(Outage { found: None, because, .. }) => Link::Down(because.clone()),
            _ => Link::Up,
        }
    }

    fn outage(&self) -> Option<Outage> {
        self.connection.last().clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Clock;

    #[test]
    fn an_outage_lasts_from_the_first_loss_until_it_is_found() {
        let bus = OwnBus::new(Inbox::new(8, Clock::manual()), |_: Outgoing<'_>| Ok(()));
        let connection = bus.connection();
        connection.find();
        assert_eq!((bus.link(), bus.outage()), (Link::Up, None));
        for number in 1..3 {
            connection.lose("the cable".to_owned());
            connection.lose("the same again".to_owned());
            assert_eq!(bus.link(), Link::Down("the cable".to_owned()));
            connection.find();
            assert_eq!(bus.link(), Link::Up);
            let outage = bus.outage().expect("there was one");
            assert_eq!((outage.number, outage.found.is_some()), (number, true));
        }
    }
}
