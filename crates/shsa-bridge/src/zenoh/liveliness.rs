//! Liveliness on a Zenoh network: tokens that vanish with their holder.
//!
//! A token is gone when its holder drops it, ends, is killed (detected at once), or hangs or is cut off (detected after the
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

/// The tokens of a bridge's network.
#[derive(Debug)]
pub struct Liveliness<'a> {
    connection: &'a Connection,
    inbox: &'a Inbox,
}

/// A held token; dropping it ends our presence.
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

/// A view of tokens, including those that were held before.
#[derive(Debug)]
pub struct Watch {
    changes: Receiver<Presence>,
}

impl<'a> Liveliness<'a> {
    /// The tokens of a connection's network; changes wake the inbox's reader.
    pub(crate) fn new(connection: &'a Connection, inbox: &'a Inbox) -> Liveliness<'a> {
        Liveliness { connection, inbox }
    }

    /// Holds a token under a unique name, such as `shsa/healer/a`; declares it again after a lost connection.
    ///
    /// # Errors
    /// When the name is invalid.
    pub fn declare(&self, name: &str) -> Result<Token, BridgeError> {
        let key = key_of(name)?;
        let held = Arc::new(Mutex::new(Held::Waiting));
        let token = Token(held.clone());
        self.connection.when_open(move |session| {
            let mut held = held.lock().unwrap_or_else(PoisonError::into_inner);
            // Fails only if the session is closed: then there is no receiver.
            if let (Held::Waiting, Ok(token)) = (&*held, session.liveliness().declare_token(key).wait()) {
                *held = Held::Declared { _until_dropped: token };
            }
        });
        Ok(token)
    }

    /// The changes of all tokens whose names match a pattern, including our own: `*` is one level, `**` any number, as in
    /// `shsa/healer/*`. Each change wakes the inbox's reader.
    ///
    /// A token whose connection is cut is gone, and alive again when the connection is restored.
    ///
    /// # Errors
    /// When the pattern is invalid.
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
    let on_sample = move |sample: Sample| {
        let name = Arc::from(sample.key_expr().as_str());
        let change = match sample.kind() {
            SampleKind::Put => Presence::Alive(name),
            SampleKind::Delete => Presence::Gone(name),
        };
        // The receiver may be gone.
        let _ = changes.send(change);
        inbox.wake();
    };
    // Fails only if the session is closed.
    let _ = subscriber.callback(on_sample).background().wait();
}

impl From<Watch> for Attendance {
    fn from(watch: Watch) -> Attendance {
        Box::new(move || watch.next())
    }
}

impl Watch {
    /// The oldest change that was not read yet. Does not block.
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
