//! Wakes the thread that reads.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::task::Wake;
use std::thread::Thread;
use std::time::{Duration, Instant};

/// Rung by whatever has work for a thread; one ring before the thread waits is enough.
#[derive(Debug, Default)]
pub(super) struct Bell {
    is_rung: AtomicBool,
    sleeper: OnceLock<Thread>,
}

impl Bell {
    pub(super) fn ring(&self) {
        self.is_rung.store(true, Ordering::Release);
        if let Some(sleeper) = self.sleeper.get() {
            sleeper.unpark();
        }
    }

    /// Waits in the thread that it is for; whether it was rung.
    pub(super) fn wait(&self, at_most: Duration) -> bool {
        self.sleeper.get_or_init(std::thread::current);
        let began = Instant::now();
        loop {
            if self.is_rung.swap(false, Ordering::AcqRel) {
                return true;
            }
            let left = at_most.saturating_sub(began.elapsed());
            if left.is_zero() {
                return false;
            }
            // It returns at once where the bell was rung while the thread was awake.
            std::thread::park_timeout(left);
        }
    }
}

/// The bell of one reader, which notes that the reader has messages.
#[derive(Debug)]
pub(super) struct ReaderBell {
    has_messages: AtomicBool,
    bell: Arc<Bell>,
}

impl ReaderBell {
    /// A bell of a new reader, which may have messages already.
    pub(super) fn new(bell: Arc<Bell>) -> Arc<ReaderBell> {
        Arc::new(ReaderBell { has_messages: AtomicBool::new(true), bell })
    }

    /// Whether there may be messages since the last call.
    pub(super) fn take(&self) -> bool {
        self.has_messages.swap(false, Ordering::AcqRel)
    }

    /// Notes that there may be messages, in the thread that looks for them next.
    pub(super) fn note(&self) {
        self.has_messages.store(true, Ordering::Release);
    }

    /// Notes that there may be messages, and wakes the thread.
    pub(super) fn ring(&self) {
        self.note();
        self.bell.ring();
    }
}

impl Wake for ReaderBell {
    fn wake(self: Arc<Self>) {
        self.ring();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ring_that_was_answered_ends_no_other_wait() {
        let bell = Bell::default();
        assert!(!bell.wait(Duration::ZERO));
        bell.ring();
        assert!(bell.wait(Duration::from_secs(60)));
        let (began, short) = (Instant::now(), Duration::from_millis(20));
        assert!(!bell.wait(short));
        assert!(began.elapsed() >= short);
    }

    #[test]
    fn a_ring_ends_the_present_wait_or_the_next_one() {
        let bell = Arc::new(Bell::default());
        bell.ring();
        let (began, far) = (Instant::now(), Duration::from_secs(60));
        assert!(bell.wait(far));
        assert!(!bell.wait(Duration::from_millis(1)));
        let reader = ReaderBell::new(bell.clone());
        assert!(reader.take() && !reader.take());
        let ringer = reader.clone();
        let thread = std::thread::spawn(move || ringer.wake());
        while !bell.wait(far) && began.elapsed() < far {}
        thread.join().unwrap();
        assert!(reader.take() && began.elapsed() < far);
    }
}
