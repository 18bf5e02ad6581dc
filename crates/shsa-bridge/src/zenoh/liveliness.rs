//! Who is alive on a Zenoh network: tokens that vanish with their holder.
//!
//! A token is gone when its holder drops it, ends, is killed (noticed at once), or hangs or is cut off (noticed after the
//! holder's lease, [`Options::lease`](super::Options::lease)).

use super::connection::Connection;
use super::key_of;
use crate::{Attendance, BridgeError, Inbox, Presence};
use ::zenoh::Wait;
use ::zenoh::key_expr::KeyExpr;
use ::zenoh::liveliness::{LivelinessSubscriberBuilder, LivelinessToken};
use ::zenoh::sample::{Sample, SampleKind};
use std::sync::mpsc::{self, Receiver, Sender};
use std::sync::{Arc, Mutex, PoisonError};

/// The tokens of the network that a bridge is connected to.
#[derive(Debug)]
pub struct Liveliness<'a> {
    connection: &'a Connection,
    inbox: &'a Inbox,
}

/// A token that is held; dropping it says that we are gone.
#[derive(Debug)]
pub struct Token(Arc<Mutex<Held>>);

#[derive(Debug)]
enum Held {
    /// There is no session yet.
    Waiting,
    Declared {
        _until_dropped: LivelinessToken,
    },
    Dropped,
}

/// A view of tokens, from its beginning on.
#[derive(Debug)]
pub struct Watch {
    changes: Receiver<Presence>,
}

impl<'a> Liveliness<'a> {
    /// Of the network of a connection; changes end the wait of the inbox's reader.
    pub(crate) fn new(connection: &'a Connection, inbox: &'a Inbox) -> Liveliness<'a> {
        Liveliness { connection, inbox }
    }

    /// Says that we are there, under a name that nobody else uses, such as `shsa/healer/a`; again by itself after a
    /// lost connection.
    ///
    /// # Errors
    /// When the name is none.
    pub fn declare(&self, name: &str) -> Result<Token, BridgeError> {
        let key = key_of(name)?;
        let held = Arc::new(Mutex::new(Held::Waiting));
        let token = Token(held.clone());
        self.connection.when_open(move |session| {
            let mut held = held.lock().unwrap_or_else(PoisonError::into_inner);
            // Fails only where the session is closed: then nobody is there to be told.
            if let (Held::Waiting, Ok(token)) = (&*held, session.liveliness().declare_token(key).wait()) {
                *held = Held::Declared { _until_dropped: token };
            }
        });
        Ok(token)
    }

    /// Tells of all tokens whose names a pattern matches, our own among them: `*` is one level, `**` any number, as in
    /// `shsa/healer/*`. Each change ends the wait of the inbox's reader.
    ///
    /// A token whose way is cut is gone, and alive again when the way is back.
    ///
    /// # Errors
    /// When the pattern is none.
    pub fn watch(&self, pattern: &str) -> Result<Watch, BridgeError> {
        let key = KeyExpr::autocanonize(pattern.trim_start_matches('/').to_owned());
        let key =
            key.map_err(|_| BridgeError::Configuration(format!("'{pattern}' is no pattern of names")))?;
        let (sender, changes) = mpsc::channel();
        let inbox = self.inbox.clone();
        self.connection.when_open(move |session| {
            let liveliness = session.liveliness();
            let subscriber = liveliness.declare_subscriber(key).history(true);
            watch(subscriber, sender, inbox);
        });
        Ok(Watch { changes })
    }
}

fn watch(
    subscriber: LivelinessSubscriberBuilder<'_, '_, ::zenoh::handlers::DefaultHandler>,
    changes: Sender<Presence>,
    inbox: Inbox,
) {
    let tell = move |sample: Sample| {
        let name = Arc::from(sample.key_expr().as_str());
        let change = match sample.kind() {
            SampleKind::Put => Presence::Alive(name),
            SampleKind::Delete => Presence::Gone(name),
        };
        // Nobody looks any more.
        let _ = changes.send(change);
        inbox.wake();
    };
    // Fails only where the session is closed.
    let _ = subscriber.callback(tell).background().wait();
}

impl From<Watch> for Attendance {
    fn from(watch: Watch) -> Attendance {
        Box::new(move || watch.next())
    }
}

impl Watch {
    /// The oldest change that was not yet looked at; does not block.
    #[must_use]
    pub fn next(&self) -> Option<Presence> {
        self.changes.try_recv().ok()
    }
}

impl Drop for Token {
    fn drop(&mut self) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Held::Dropped;
    }
}
