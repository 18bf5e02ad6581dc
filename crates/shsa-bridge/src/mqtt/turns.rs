//! Who drives the connection: whoever waits for messages, while it waits; a thread where nobody waits or the reader is behind.
//!
//! A reader that drives by itself reads a message from the socket, and its answer goes out when it waits again: no other thread
//! has to be woken in between, which costs more than all the rest. A reader that cannot keep up leaves the connection to the thread, so
//! that the broker's queue is emptied, and the inbox decides what makes room.

use crate::inbox::Driver;
use std::io;
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU32, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread::{self, JoinHandle, Thread};
use std::time::Duration;
use tokio::runtime::{Builder, Handle, Runtime};
use tokio::sync::Notify;
use tokio::task::yield_now;
use tokio::time::{sleep, timeout};

/// How often the thread looks whether anybody drives, and for how long at least it does itself.
const TICK: Duration = Duration::from_millis(10);
/// After so many turns that have not come to the end of what waits at the socket, the reader is behind.
const BEHIND: u32 = 64;

/// What the thread does.
const WATCHES: u8 = 0;
/// It drives, and has begun only now.
const BEGINS: u8 = 1;
/// It drives, and leaves that to the reader when it waits.
const DRIVES: u8 = 2;

/// The event loop, and whose turn it is.
pub(super) struct Turns {
    /// There until the end.
    runtime: Option<Runtime>,
    /// Ends the reader's turn.
    arrival: Notify,
    /// Ends the thread's turn.
    wanted: Notify,
    thread: OnceLock<Thread>,
    /// What the thread does.
    does: AtomicU8,
    /// The reader has asked the thread to drive.
    is_behind: AtomicBool,
    /// The reader drives.
    is_reading: AtomicBool,
    /// The reader's turns so far.
    read: AtomicU32,
    /// Of those, the last ones that did not come to the end of what waits.
    unfinished: AtomicU32,
    is_ending: AtomicBool,
}

impl Turns {
    /// Nobody drives yet.
    ///
    /// # Errors
    /// When the system gives no event queue.
    pub(super) fn new() -> io::Result<Turns> {
        Ok(Turns {
            runtime: Some(Builder::new_current_thread().enable_all().build()?),
            arrival: Notify::new(),
            wanted: Notify::new(),
            thread: OnceLock::new(),
            does: AtomicU8::new(BEGINS),
            is_behind: AtomicBool::new(false),
            is_reading: AtomicBool::new(false),
            read: AtomicU32::new(0),
            unfinished: AtomicU32::new(0),
            is_ending: AtomicBool::new(false),
        })
    }

    /// Starts the thread, which drives the connection until a reader waits.
    ///
    /// # Errors
    /// When the system gives no thread.
    pub(super) fn keep(
        turns: &Arc<Turns>,
        connection: impl Future<Output = ()> + Send + 'static,
    ) -> io::Result<JoinHandle<()>> {
        let of_thread = turns.clone();
        let thread =
            thread::Builder::new().name("mqtt".to_owned()).spawn(move || of_thread.watch(connection))?;
        let _first = turns.thread.set(thread.thread().clone());
        Ok(thread)
    }

    /// The connection is about to end by itself: the thread sees to it.
    pub(super) fn end(&self) {
        self.is_ending.store(true, Ordering::Release);
        self.wanted.notify_one();
        self.unpark();
    }

    /// The connection has come to the end of what waits at the socket.
    pub(super) fn nothing_waits(&self) {
        self.unfinished.store(0, Ordering::Relaxed);
    }

    fn watch(&self, connection: impl Future<Output = ()> + Send + 'static) {
        let Some(runtime) = &self.runtime else { return };
        let connection = runtime.spawn(connection);
        while !self.is_ending.load(Ordering::Acquire) {
            runtime.block_on(self.leave_when_wanted());
            self.does.store(WATCHES, Ordering::Release);
            self.rest_while_driven();
            self.does.store(BEGINS, Ordering::Release);
        }
        // A connection that panicked has ended, too.
        let _ended = runtime.block_on(connection);
    }

    /// Ends when the reader wants to drive, not at once: who has just been behind will soon be again.
    async fn leave_when_wanted(&self) {
        let _ending = timeout(TICK, self.wanted.notified()).await;
        self.does.store(DRIVES, Ordering::Release);
        if !self.is_ending.load(Ordering::Acquire) {
            self.wanted.notified().await;
        }
    }

    /// Sleeps until nobody has driven for a while, the reader is behind, or the end.
    fn rest_while_driven(&self) {
        loop {
            let read = self.read.load(Ordering::Acquire);
            thread::park_timeout(TICK);
            let is_idle =
                !self.is_reading.load(Ordering::Acquire) && self.read.load(Ordering::Acquire) == read;
            let is_behind = self.is_behind.swap(false, Ordering::AcqRel);
            if is_idle || is_behind || self.is_ending.load(Ordering::Acquire) {
                return;
            }
        }
    }

    fn unpark(&self) {
        if let Some(thread) = self.thread.get() {
            thread.unpark();
        }
    }

    /// Whether it is the reader's turn; else the thread drives, or is asked to.
    fn is_readers(&self, is_behind: bool) -> bool {
        if self.is_ending.load(Ordering::Acquire) || Handle::try_current().is_ok() {
            return false;
        }
        let is_behind = is_behind || self.unfinished.load(Ordering::Relaxed) > BEHIND;
        match self.does.load(Ordering::Acquire) {
            WATCHES if is_behind => {
                self.is_behind.store(true, Ordering::Release);
                self.unfinished.store(0, Ordering::Relaxed);
                self.unpark();
                false
            }
            WATCHES => true,
            DRIVES if !is_behind => {
                self.wanted.notify_one();
                true
            }
            _ => false,
        }
    }
}

impl Driver for Turns {
    fn drive(&self, is_behind: bool, at_most: Duration) -> bool {
        let Some(runtime) = self.runtime.as_ref().filter(|_| self.is_readers(is_behind)) else {
            return false;
        };
        self.is_reading.store(true, Ordering::Release);
        self.unfinished.fetch_add(1, Ordering::Relaxed);
        runtime.block_on(async {
            if at_most.is_zero() {
                // Once for the system to say what has come, once for the connection to take it.
                yield_now().await;
                yield_now().await;
            } else {
                tokio::select! {
                    () = self.arrival.notified() => {}
                    () = sleep(at_most) => {}
                }
            }
        });
        self.read.fetch_add(1, Ordering::AcqRel);
        self.is_reading.store(false, Ordering::Release);
        true
    }

    fn wake(&self) {
        self.arrival.notify_one();
    }
}

impl Drop for Turns {
    /// Looking up a name may still go on in a thread of its own; nobody waits for that.
    fn drop(&mut self) {
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_background();
        }
    }
}
