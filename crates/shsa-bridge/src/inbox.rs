//! Received messages that wait for the reader: bounded for each topic; the newest ones are kept, losses are counted.
//!
//! Waking a sleeping reader takes longer than reading. Both sides can avoid it: a waiting reader can drive the connection itself
//! ([`Driver`]), and a thread that delivers a message can read in place of the reader ([`DirectReader`]).

mod absence;

pub use absence::Absence;

use crate::{Clock, Message, backlog::Backlog};
use absence::Attendance;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};
use std::fmt;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError, Weak};
use std::time::Duration;

/// Queues of messages, one a topic, read in the order of arrival; clones are the same inbox.
///
/// A bridge's threads push, one reader pops. A topic whose queue is full loses its oldest message, so a flood of one topic delays
/// another by at most one queue.
#[derive(Clone, Debug)]
pub struct Inbox {
    shared: Arc<Shared>,
    clock: Clock,
}

struct Shared {
    queues: Mutex<Queues>,
    arrival: Condvar,
    driver: OnceLock<Weak<dyn Driver>>,
    direct: OnceLock<Weak<dyn DirectReader>>,
}

/// Reads in place of a sleeping reader, in the thread that delivers a message.
pub trait DirectReader: Send + Sync {
    /// Reads the waiting messages. Returns `false` to wake the reader for further work. Must not block for long: the thread
    /// belongs to the middleware.
    fn read(&self) -> bool;
}

/// A connection that the inbox's reader can drive while it waits.
pub(crate) trait Driver: Send + Sync {
    /// Drives the connection until [`Driver::wake`] is called or the time has passed; once if the time is zero. `is_behind`:
    /// messages wait that the reader has not read yet. Returns `false` if another thread drives; then the reader waits by itself.
    fn drive(&self, is_behind: bool, at_most: Duration) -> bool;

    /// Ends the present call of [`Driver::drive`], or the next one.
    fn wake(&self);
}

impl fmt::Debug for Shared {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Shared").field("queues", &self.queues).finish_non_exhaustive()
    }
}

#[derive(Debug)]
struct Queues {
    ids: BTreeMap<Arc<str>, usize>,
    topics: Vec<Queue>,
    /// The topics with messages, by the arrival of each topic's oldest message at the time of entry.
    order: BinaryHeap<Reverse<(u64, usize)>>,
    capacity: usize,
    arrived: u64,
    /// Whether the reader shall return without a message.
    woken: bool,
    /// The number of sleeping readers.
    sleepers: usize,
    /// The number of sleeping readers that drive the connection.
    drivers: usize,
    attendance: Attendance,
}

#[derive(Debug)]
struct Queue {
    topic: Arc<str>,
    /// The count of arrivals before each message.
    waiting: Backlog<(u64, Message)>,
    dropped: u64,
}

/// The lost messages of one topic: newer ones took their place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Losses {
    /// The topic.
    pub topic: Arc<str>,
    /// The number since the beginning.
    pub dropped: u64,
}

impl Inbox {
    /// An inbox for at most `capacity` messages a topic (at least one); `clock` stamps the reception.
    #[must_use]
    pub fn new(capacity: usize, clock: Clock) -> Inbox {
        let queues = Queues {
            ids: BTreeMap::new(),
            topics: Vec::new(),
            order: BinaryHeap::new(),
            capacity: capacity.max(1),
            arrived: 0,
            woken: false,
            sleepers: 0,
            drivers: 0,
            attendance: Attendance::default(),
        };
        let (driver, direct) = (OnceLock::new(), OnceLock::new());
        let shared = Shared { queues: Mutex::new(queues), arrival: Condvar::new(), driver, direct };
        Inbox { shared: Arc::new(shared), clock }
    }

    /// The clock that stamps the reception.
    #[must_use]
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// A waiting reader drives this connection. Only the first call counts; other connections must drive themselves.
    #[cfg_attr(not(feature = "mqtt"), allow(dead_code, reason = "only MQTT has a connection to drive"))]
    pub(crate) fn driven_by(&self, driver: &Arc<dyn Driver>) {
        let _first = self.shared.driver.set(Arc::downgrade(driver));
    }

    /// Sets what may read in place of a sleeping reader, in a bridge's thread. Only the first call counts.
    pub fn read_by(&self, direct: Weak<dyn DirectReader>) {
        let _first = self.shared.direct.set(direct);
    }

    /// Appends a message as [`Inbox::push`], from a thread that may read in place of a sleeping reader.
    #[cfg_attr(not(feature = "zenoh"), allow(dead_code, reason = "only Zenoh lends its threads"))]
    pub(crate) fn hand(&self, message: Message) {
        let direct = self.shared.direct.get().and_then(Weak::upgrade);
        let mut queues = self.lock();
        let is_asleep = queues.sleepers > 0 && queues.is_idle();
        queues.push(message);
        drop(queues);
        if is_asleep && !direct.is_some_and(|direct| direct.read()) {
            self.shared.arrival.notify_one();
        }
    }

    /// Appends a message; if its topic's queue is full, drops the oldest one and counts it.
    pub fn push(&self, message: Message) {
        self.update(|queues| queues.push(message));
    }

    /// Applies a change, and wakes the reader only if it sleeps and nothing has woken it yet, because waking is a system call.
    fn update(&self, change: impl FnOnce(&mut Queues)) {
        let mut queues = self.lock();
        let is_asleep = queues.sleepers > 0 && queues.is_idle();
        let drives = queues.drivers > 0;
        change(&mut queues);
        drop(queues);
        match self.driver().filter(|_| is_asleep && drives) {
            Some(driver) => driver.wake(),
            None if is_asleep => self.shared.arrival.notify_one(),
            None => {}
        }
    }

    fn driver(&self) -> Option<Arc<dyn Driver>> {
        self.shared.driver.get().and_then(Weak::upgrade)
    }

    /// Takes the oldest message; `None` when none waits.
    #[must_use]
    pub fn pop(&self) -> Option<Message> {
        self.lock().pop()
    }

    /// Waits until there is a message, [`Inbox::wake`] is called, or the time has passed. Call it even with no time to wait: it
    /// gives a connection that the reader drives its turn.
    pub fn wait(&self, at_most: Duration) {
        if self.driver().is_some_and(|driver| self.drive(driver.as_ref(), at_most)) {
            return;
        }
        let mut queues = self.lock();
        queues.sleepers += 1;
        let waited = self.shared.arrival.wait_timeout_while(queues, at_most, |queues| queues.is_idle());
        let mut queues = waited.unwrap_or_else(PoisonError::into_inner).0;
        queues.sleepers -= 1;
        queues.woken = false;
    }

    /// Waits as [`Inbox::wait`] by driving the connection; `false` if another thread drives.
    fn drive(&self, driver: &dyn Driver, at_most: Duration) -> bool {
        let mut queues = self.lock();
        let is_behind = !queues.order.is_empty();
        let at_most = if queues.is_idle() { at_most } else { Duration::ZERO };
        queues.sleepers += 1;
        queues.drivers += 1;
        drop(queues);
        let has_driven = driver.drive(is_behind, at_most);
        let mut queues = self.lock();
        queues.sleepers -= 1;
        queues.drivers -= 1;
        queues.woken &= !has_driven;
        has_driven
    }

    /// Ends the reader's present wait, or the next one.
    pub fn wake(&self) {
        self.update(|queues| queues.woken = true);
    }

    /// The number of waiting messages.
    #[must_use]
    pub fn len(&self) -> usize {
        self.lock().topics.iter().map(|queue| queue.waiting.len()).sum()
    }

    /// Whether no message waits.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.lock().order.is_empty()
    }

    /// The number of dropped messages of all topics.
    #[must_use]
    pub fn dropped(&self) -> u64 {
        self.lock().topics.iter().map(|queue| queue.dropped).sum()
    }

    /// The topics that have lost messages, in the order of their first arrival.
    #[must_use]
    pub fn losses(&self) -> Vec<Losses> {
        let losses = |queue: &Queue| Losses { topic: queue.topic.clone(), dropped: queue.dropped };
        self.lock().topics.iter().filter(|queue| queue.dropped > 0).map(losses).collect()
    }

    /// A thread that panicked with the lock has left whole messages behind, so the others go on.
    fn lock(&self) -> MutexGuard<'_, Queues> {
        self.shared.queues.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Queues {
    /// Whether the reader has nothing to do.
    fn is_idle(&self) -> bool {
        self.order.is_empty() && !self.woken
    }

    fn push(&mut self, mut message: Message) {
        message.retained |= self.attendance.has_waited(message.received);
        let id = self.id(&message.topic);
        let arrival = self.arrived;
        self.arrived += 1;
        let queue = &mut self.topics[id];
        if queue.waiting.is_empty() {
            self.order.push(Reverse((arrival, id)));
        } else if queue.waiting.len() == self.capacity {
            queue.waiting.pop_front();
            queue.dropped += 1;
        }
        queue.waiting.push_back((arrival, message));
    }

    fn pop(&mut self) -> Option<Message> {
        loop {
            let Reverse((entered, id)) = self.order.pop()?;
            let waiting = &mut self.topics[id].waiting;
            let arrival = waiting.front()?.0;
            if arrival != entered {
                // The oldest message was dropped meanwhile, so another topic may be first now.
                self.order.push(Reverse((arrival, id)));
                continue;
            }
            let (_, message) = waiting.pop_front()?;
            if let Some((next, _)) = waiting.front() {
                self.order.push(Reverse((*next, id)));
            }
            return Some(message);
        }
    }

    fn id(&mut self, topic: &Arc<str>) -> usize {
        if let Some(id) = self.ids.get(topic) {
            return *id;
        }
        self.topics.push(Queue { topic: topic.clone(), waiting: Backlog::new(), dropped: 0 });
        self.ids.insert(topic.clone(), self.topics.len() - 1);
        self.topics.len() - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Payload;
    use shsa_core::observation::RawValue;
    use std::time::Instant;

    fn message(topic: &str, number: f64) -> Message {
        let payload = Payload::Value(RawValue::Number(number));
        Message::new(topic.into(), shsa_core::time::Time(0), payload)
    }

    /// The waiting messages, in order.
    fn read(inbox: &Inbox) -> String {
        let mut text = Vec::new();
        while let Some(message) = inbox.pop() {
            let Payload::Value(RawValue::Number(number)) = message.payload else { panic!("only numbers") };
            text.push(format!("{}={number}", message.topic));
        }
        text.join(" ")
    }

    #[test]
    fn topics_are_read_in_the_order_of_arrival() {
        let inbox = Inbox::new(8, Clock::manual());
        for (topic, number) in [("b", 1.0), ("a", 2.0), ("b", 3.0), ("c", 4.0), ("a", 5.0)] {
            inbox.push(message(topic, number));
        }
        assert_eq!(inbox.len(), 5);
        assert_eq!(read(&inbox), "b=1 a=2 b=3 c=4 a=5");
        assert!(inbox.is_empty());
    }

    #[test]
    fn a_flood_of_one_topic_costs_only_that_topic() {
        let inbox = Inbox::new(3, Clock::manual());
        inbox.push(message("calm", 1.0));
        (0..100).for_each(|n| inbox.push(message("flood", f64::from(n))));
        inbox.push(message("calm", 2.0));
        assert_eq!(inbox.losses(), [Losses { topic: "flood".into(), dropped: 97 }]);
        assert_eq!(read(&inbox), "calm=1 flood=97 flood=98 flood=99 calm=2");
    }

    #[test]
    fn whose_oldest_has_made_room_stands_where_the_next_one_arrived() {
        let inbox = Inbox::new(2, Clock::manual());
        for (topic, number) in [("a", 1.0), ("b", 2.0), ("a", 3.0), ("a", 4.0)] {
            inbox.push(message(topic, number));
        }
        assert_eq!(read(&inbox), "b=2 a=3 a=4");
        assert_eq!(inbox.dropped(), 1);
    }

    #[test]
    fn a_wait_ends_with_a_message_and_with_a_wake() {
        let inbox = Inbox::new(2, Clock::manual());
        inbox.wait(Duration::from_millis(1));
        let far = Duration::from_secs(60);
        let start = Instant::now();
        let other = inbox.clone();
        let sender = std::thread::spawn(move || other.push(message("a", 1.0)));
        inbox.wait(far);
        sender.join().unwrap();
        assert_eq!(read(&inbox), "a=1");
        inbox.wake();
        inbox.wait(far);
        assert!(start.elapsed() < far);
    }

    /// A direct reader that reads everything, or refuses.
    struct Reads {
        inbox: Inbox,
        refuses: bool,
        has_read: Mutex<String>,
    }

    impl DirectReader for Reads {
        fn read(&self) -> bool {
            if !self.refuses {
                self.has_read.lock().unwrap().push_str(&read(&self.inbox));
            }
            !self.refuses
        }
    }

    #[test]
    fn a_deputy_reads_while_the_reader_sleeps_and_wakes_it_where_it_does_not() {
        for refuses in [false, true] {
            let inbox = Inbox::new(2, Clock::manual());
            let direct = Arc::new(Reads { inbox: inbox.clone(), refuses, has_read: Mutex::default() });
            let weak: Weak<dyn DirectReader> = Arc::<Reads>::downgrade(&direct);
            inbox.read_by(weak);
            inbox.hand(message("a", 1.0));
            assert_eq!(read(&inbox), "a=1", "nobody sleeps");
            let (start, sleeper) = (Instant::now(), inbox.clone());
            let sleeper = std::thread::spawn(move || sleeper.wait(Duration::from_secs(60)));
            while inbox.lock().sleepers == 0 && start.elapsed() < Duration::from_secs(30) {
                std::thread::yield_now();
            }
            inbox.hand(message("a", 2.0));
            inbox.hand(message("a", 3.0));
            let mine = direct.has_read.lock().unwrap().clone();
            if !refuses {
                assert_eq!(inbox.lock().sleepers, 1, "it is not woken");
                inbox.wake();
            }
            sleeper.join().unwrap();
            assert_eq!(
                (mine, read(&inbox)),
                match refuses {
                    false => ("a=2a=3".to_owned(), String::new()),
                    true => (String::new(), "a=2 a=3".to_owned()),
                }
            );
            assert!(start.elapsed() < Duration::from_secs(60));
        }
    }
}
