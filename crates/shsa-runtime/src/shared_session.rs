//! A session shared by two threads: the run's own, and while that sleeps, the thread of the bus that delivers a message.
//!
//! Waking a thread takes longer than handling a message and serving its consequences. Everything else is left to the run's
//! thread, which is woken for it.

use super::runtime::Ending;
use super::session::Session;
use crate::error::RuntimeError;
use shsa_bridge::{DirectReader, Inbox};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError, Weak};

/// A session that one thread at a time may use.
pub(super) struct SharedSession {
    /// `None` once the session has ended.
    session: Mutex<Option<Session>>,
    /// The error of a bus thread.
    problem: Mutex<Option<RuntimeError>>,
}

impl SharedSession {
    /// Runs a session until it is stopped; tells whether every need was served then.
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
        // Other threads find no session from now on: it ends in this thread.
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

    /// After a panic in a bus thread, the session is used further.
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
