//! Who has a run in hand: its own thread, or while that sleeps the thread of the bus that brings a message.
//!
//! To wake a thread takes longer than to hear a message and to serve what comes of it. Everything else is left to the run's
//! thread, which is woken when there is any.

use super::runtime::Ending;
use super::session::Session;
use crate::error::RuntimeError;
use shsa_bridge::{DirectReader, Inbox};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError, Weak};

/// A session that one thread at a time has in hand.
pub(super) struct SharedSession {
    /// `None` once it has ended.
    session: Mutex<Option<Session>>,
    /// What has gone wrong in a thread of the bus.
    problem: Mutex<Option<RuntimeError>>,
}

impl SharedSession {
    /// Runs a session until it is stopped; the answer is no when a need is unserved then.
    ///
    /// # Errors
    /// When the bus refuses a model that has just taken over.
    pub(super) fn run(session: Session) -> Result<Ending, RuntimeError> {
        let inbox = session.bridge.inbox().clone();
        let shared =
            Arc::new(SharedSession { session: Mutex::new(Some(session)), problem: Mutex::default() });
        let reader: Weak<dyn DirectReader> = Arc::<SharedSession>::downgrade(&shared);
        inbox.read_by(reader);
        let ended = shared.take_turns(&inbox);
        // Whoever comes to it now finds nothing: it ends in this thread.
        let session = shared.lock().take();
        ended?;
        Ok(session.map_or(Ending::Served, Session::finish))
    }

    /// Takes turns until the session is over.
    fn take_turns(&self, inbox: &Inbox) -> Result<(), RuntimeError> {
        loop {
            let rest = match self.lock().as_mut() {
                Some(session) if !session.is_over() => session.turn()?,
                _ => return Ok(()),
            };
            inbox.wait(rest);
            if let Some(problem) = self.problem.lock().unwrap_or_else(PoisonError::into_inner).take() {
                return Err(problem);
            }
        }
    }

    /// A thread of the bus that panicked has left a session behind that goes on.
    fn lock(&self) -> MutexGuard<'_, Option<Session>> {
        self.session.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl DirectReader for SharedSession {
    fn read(&self) -> bool {
        let mut held = match self.session.try_lock() {
            Ok(held) => held,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
            Err(TryLockError::WouldBlock) => return false,
        };
        let Some(session) = held.as_mut() else { return false };
        if let Err(problem) = session.heed() {
            *self.problem.lock().unwrap_or_else(PoisonError::into_inner) = Some(problem);
        } else if session.may_rest() {
            return true;
        }
        session.bridge.inbox().wake();
        false
    }
}
