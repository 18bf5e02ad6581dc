//! Publishers that keep their pace, and consumers that look at the clock.

use super::middleware::Middleware;
use anyhow::bail;
use shsa_bridge::{Bridge, Clock, Inbox, Link, Message, Outgoing, Payload};
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// Messages of one topic that may wait for a consumer: more than a second of the fastest.
const QUEUE: usize = 1 << 17;

/// A clock of even steps; a late step does not delay the ones after it.
pub(super) struct Beat {
    began: Instant,
    period: Duration,
    count: u32,
}

impl Beat {
    pub(super) fn new(period: Duration) -> Beat {
        Beat { began: Instant::now(), period, count: 0 }
    }

    /// Waits for the next step.
    pub(super) fn wait(&mut self) {
        self.count += 1;
        let due = self.began + self.period * self.count;
        let left = due.saturating_duration_since(Instant::now());
        if !left.is_zero() {
            thread::sleep(left);
        }
    }
}

/// A publisher of numbers.
pub(super) struct Publisher {
    bridge: Box<dyn Bridge>,
    clock: Clock,
}

impl Publisher {
    /// # Errors
    /// When the middleware refuses.
    pub(super) fn new(middleware: &Middleware, name: &str, at_most_once: bool) -> anyhow::Result<Publisher> {
        let bridge = middleware.join(name, 1, at_most_once)?;
        wait_for_link(bridge.as_ref())?;
        Ok(Publisher { bridge, clock: middleware.clock.clone() })
    }

    /// Publishes a number now; returns the time.
    ///
    /// # Errors
    /// When the number cannot be sent.
    pub(super) fn publish_next(&mut self, topic: &str, number: f64) -> anyhow::Result<Time> {
        let now = self.clock.now();
        let payload = Payload::Value(RawValue::Number(number));
        self.bridge.publish(Outgoing::new(topic, self.clock.by_wall(now), payload))?;
        Ok(now)
    }

    /// The time now.
    pub(super) fn now(&self) -> Time {
        self.clock.now()
    }

    /// The messages that could not be sent.
    pub(super) fn troubles(&mut self) -> Vec<String> {
        self.bridge.troubles().iter().map(ToString::to_string).collect()
    }
}

/// A consumer with a thread of its own.
pub(super) struct Subscriber<S> {
    thread: Option<JoinHandle<S>>,
    stop: Arc<AtomicBool>,
    inbox: Inbox,
    taken: Arc<AtomicU64>,
}

impl<S: Send + 'static> Subscriber<S> {
    /// Receives these topics from now on. Each message goes to `take`, with the time at which it was taken from the inbox.
    ///
    /// # Errors
    /// When the middleware refuses.
    pub(super) fn new(
        middleware: &Middleware,
        name: &str,
        at_most_once: bool,
        topics: impl IntoIterator<Item = String>,
        mut state: S,
        take: impl Fn(&mut S, &Message, Time) + Send + 'static,
    ) -> anyhow::Result<Subscriber<S>> {
        let mut bridge = middleware.join(name, QUEUE, at_most_once)?;
        wait_for_link(bridge.as_ref())?;
        for topic in topics {
            bridge.subscribe(&topic, None)?;
        }
        let (stop, inbox) = (Arc::new(AtomicBool::new(false)), bridge.inbox().clone());
        let (ends, taken) = (stop.clone(), Arc::new(AtomicU64::new(0)));
        let count = taken.clone();
        let thread = thread::Builder::new().name("consumer".into()).spawn(move || {
            let inbox = bridge.inbox().clone();
            while !ends.load(Ordering::Acquire) {
                while let Some(message) = bridge.receive() {
                    take(&mut state, &message, inbox.clock().now());
                    count.fetch_add(1, Ordering::Release);
                }
                inbox.wait(Duration::from_secs(1));
            }
            state
        })?;
        Ok(Subscriber { thread: Some(thread), stop, inbox, taken })
    }

    /// Ends the thread; returns its state.
    ///
    /// # Errors
    /// When the thread has failed.
    pub(super) fn end(mut self) -> anyhow::Result<S> {
        self.ask_to_end();
        let ended = self.thread.take().map(JoinHandle::join);
        let Some(Ok(state)) = ended else { bail!("the consumer has failed") };
        Ok(state)
    }
}

impl<S> Subscriber<S> {
    /// How many messages the consumer has taken.
    pub(super) fn taken(&self) -> u64 {
        self.taken.load(Ordering::Acquire)
    }

    fn ask_to_end(&self) {
        self.stop.store(true, Ordering::Release);
        self.inbox.wake();
    }
}

impl<S> Drop for Subscriber<S> {
    fn drop(&mut self) {
        self.ask_to_end();
    }
}

fn wait_for_link(bridge: &dyn Bridge) -> anyhow::Result<()> {
    let end = Instant::now() + super::middleware::PATIENCE;
    loop {
        match bridge.link() {
            Link::Up => return Ok(()),
            Link::Down(why) if Instant::now() > end => bail!("no connection: {why}"),
            Link::Down(_) => thread::sleep(Duration::from_millis(10)),
        }
    }
}
