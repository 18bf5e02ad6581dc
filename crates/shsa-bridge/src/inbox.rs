//! What has arrived and not yet been read: bounded for each topic, the newest wins, losses are counted.
//!
//! To wake a reader that sleeps takes longer than to read. Both sides may spare that: a reader that waits may drive the
//! connection itself ([`Driver`]), and a thread that brings a message may read in the place of the reader ([`DirectReader`]).

mod absence;

pub use absence::Absence;

use crate::{Clock, Message};
use absence::Attendance;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap, VecDeque};
use std::fmt;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError, Weak};
use std::time::Duration;

/// Queues of messages, one a topic, read in the order of arrival; clones are the same inbox.
///
/// A bridge's threads push, one reader pops. A topic whose queue is full loses its oldest message, so a flood of one
/// topic delays another by at most one queue.
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

/// What reads in the place of a reader that sleeps, in the thread that has brought a message.
pub trait DirectReader: Send + Sync {
    /// Reads what waits. The answer is no when there is something left to do for the reader, who is woken then. Must not
    /// block for long: the thread is the middleware's.
    fn read(&self) -> bool;
}

/// A connection which the inbox's reader can drive while it waits.
pub(crate) trait Driver: Send + Sync {
    /// Drives the connection until [`Driver::wake`] is called or the time is over; once where that is zero. `is_behind`:
    /// messages wait that the reader has not come to. The answer is no when somebody else drives: the reader waits by itself then.
    fn drive(&self, is_behind: bool, at_most: Duration) -> bool;

    /// Ends the present call of [`Driver::drive`], or else the next.
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
    /// The topics that have messages, by the arrival of what was their oldest when they were entered here.
    order: BinaryHeap<Reverse<(u64, usize)>>,
    capacity: usize,
    arrived: u64,
    /// Whether somebody wants the reader to look up although no message has come.
    woken: bool,
    /// Readers that sleep.
    sleepers: usize,
    /// Of those, the ones that drive the connection meanwhile.
    drivers: usize,
    attendance: Attendance,
}

#[derive(Debug)]
struct Queue {
    topic: Arc<str>,
    /// The count of arrivals before each message.
    waiting: VecDeque<(u64, Message)>,
    dropped: u64,
}

/// Messages of one topic that had to make room for newer ones.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Losses {
    /// The name under which they were published.
    pub topic: Arc<str>,
    /// How many since the beginning.
    pub dropped: u64,
}

impl Inbox {
    /// For at most `capacity` messages a topic, at least one; reception is stamped by `clock`.
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

    /// The clock by which reception is stamped.
    #[must_use]
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// Whoever waits for messages drives this connection meanwhile; of several the first, the others see to themselves.
    #[cfg_attr(not(feature = "mqtt"), allow(dead_code, reason = "only MQTT has a connection to drive"))]
    pub(crate) fn driven_by(&self, driver: &Arc<dyn Driver>) {
        let _first = self.shared.driver.set(Arc::downgrade(driver));
    }

    /// Where a bridge's threads may read, this does for a reader that sleeps; of several the first.
    pub fn read_by(&self, direct: Weak<dyn DirectReader>) {
        let _first = self.shared.direct.set(direct);
    }

    /// Appends a message as [`Inbox::push`], from a thread that may read in the place of a sleeping reader.
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

    /// Appends a message; when its topic's queue is full, the oldest makes room and is counted as dropped.
    pub fn push(&self, message: Message) {
        self.tell(|queues| queues.push(message));
    }

    /// Changes something, and wakes the reader where it sleeps and nothing has woken it yet: that is a system call.
    fn tell(&self, change: impl FnOnce(&mut Queues)) {
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

    /// Waits until a message is there, [`Inbox::wake`] was called, or the time is over. Call it also with no time to wait: a
    /// connection that the reader drives has its turn meanwhile.
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

    /// Waits as [`Inbox::wait`], but by driving the connection; no: somebody else does.
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

    /// Ends the reader's wait, the present one or else the next.
    pub fn wake(&self) {
        self.tell(|queues| queues.woken = true);
    }

    /// How many messages wait.
    #[must_use]
    pub fn len(&self) -> usize {
        self.lock().topics.iter().map(|queue| queue.waiting.len()).sum()
    }

    /// Whether none waits.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.lock().order.is_empty()
    }

    /// How many messages of all topics had to make room for newer ones.
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

    /// A thread that panicked while it held the lock has left whole messages behind: the others go on.
    fn lock(&self) -> MutexGuard<'_, Queues> {
        self.shared.queues.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Queues {
    /// Whether there is nothing for a reader to do.
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
            let (arrival, message) = waiting.pop_front()?;
            if arrival != entered {
                // What had been the oldest has made room meanwhile: another topic may be first now.
                waiting.push_front((arrival, message));
                self.order.push(Reverse((arrival, id)));
                continue;
            }
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
        self.topics.push(Queue { topic: topic.clone(), waiting: VecDeque::new(), dropped: 0 });
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

    /// What waits, in order.
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

    /// Reads everything, or refuses.
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
