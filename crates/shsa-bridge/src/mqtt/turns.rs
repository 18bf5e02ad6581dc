//! Decides which thread drives the connection: the reader while it waits for messages; a thread of its own while nobody waits or
//! the reader is behind.
//!
//! A reader that drives by itself reads a message from the socket, and its answer goes out when it waits again. No other thread
//! has to be woken in between, which would cost more than all the rest. A reader that cannot keep up leaves the connection to the
//! thread, so that the broker's queue is emptied, and the inbox decides what to drop.

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

/// How often the thread checks whether the reader drives, and the shortest time for which the thread drives.
const TICK: Duration = Duration::from_millis(10);
/// After this many turns without reaching the end of the socket's data, the reader is behind.
const BEHIND: u32 = 64;

/// The states of the thread: it watches whether the reader drives.
const WATCHES: u8 = 0;
/// It drives, and has just begun.
const BEGINS: u8 = 1;
/// It drives, and leaves the connection to the reader on request.
const DRIVES: u8 = 2;

/// The event loop, and the thread that drives it.
pub(super) struct Turns {
    /// `Some` until the end.
    runtime: Option<Runtime>,
    /// Ends the reader's turn.
    arrival: Notify,
    /// Ends the thread's turn.
    wanted: Notify,
    thread: OnceLock<Thread>,
    /// The state of the thread.
    does: AtomicU8,
    /// Whether the reader has asked the thread to drive.
    is_behind: AtomicBool,
    /// Whether the reader drives.
    is_reading: AtomicBool,
    /// The number of the reader's turns.
    read: AtomicU32,
    /// The last turns in a row that did not reach the end of the socket's data.
    unfinished: AtomicU32,
    is_ending: AtomicBool,
}

impl Turns {
    /// Turns of a connection that nobody drives yet.
    ///
    /// # Errors
    /// When the system has no event queue left.
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
    /// When no thread can be started.
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

    /// The connection is about to end by itself: the thread drives it to its end.
    pub(super) fn end(&self) {
        self.is_ending.store(true, Ordering::Release);
        self.wanted.notify_one();
        self.unpark();
    }

    /// The connection has reached the end of the socket's data.
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

    /// Ends when the reader wants to drive, but not at once: a reader that was just behind will soon be behind again.
    async fn leave_when_wanted(&self) {
        let _ending = timeout(TICK, self.wanted.notified()).await;
        self.does.store(DRIVES, Ordering::Release);
        if !self.is_ending.load(Ordering::Acquire) {
            self.wanted.notified().await;
        }
    }

    /// Sleeps until the reader has not driven for a while, the reader is behind, or the connection ends.
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

    /// Whether the reader may drive; else the thread drives, or is asked to.
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
                // The first yield lets the system report new data, the second lets the connection take them.
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
    /// A name lookup may still run in a thread of its own; the drop does not wait for it.
    fn drop(&mut self) {
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_background();
        }
    }
}
