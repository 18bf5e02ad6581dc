//! The bus within one process: for demonstrations, tests and nodes that are compiled in.
//!
//! It reads no clock: whoever drives it says what time it is, so that a run repeats byte for byte. Messages reach
//! every subscriber in the order of their publication.

use crate::{Bridge, Inbox, Message, PublisherId};
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use std::collections::BTreeSet;
use std::convert::Infallible;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A bus; clones are the same bus.
#[derive(Clone, Debug, Default)]
pub struct MemoryBus {
    shared: Arc<Mutex<Shared>>,
}

#[derive(Debug, Default)]
struct Shared {
    now: Time,
    members: Vec<Member>,
}

#[derive(Debug)]
struct Member {
    topics: BTreeSet<Arc<str>>,
    inbox: Inbox,
}

impl MemoryBus {
    /// Without members, at time 0.
    #[must_use]
    pub fn new() -> MemoryBus {
        MemoryBus::default()
    }

    /// From now on, what is published is received at `now`.
    pub fn set_time(&self, now: Time) {
        self.lock().now = now;
    }

    /// A new member; at most `capacity` messages wait for it.
    #[must_use]
    pub fn join(&self, capacity: usize) -> MemoryBridge {
        let mut shared = self.lock();
        shared.members.push(Member { topics: BTreeSet::new(), inbox: Inbox::new(capacity) });
        MemoryBridge { bus: self.clone(), member: shared.members.len() - 1 }
    }

    /// A member that panicked leaves whole messages behind: the others go on.
    fn lock(&self) -> MutexGuard<'_, Shared> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Shared {
    fn deliver(&mut self, from: usize, message: &Message) {
        let others = self.members.iter_mut().enumerate().filter(|(member, _)| *member != from);
        for (_, member) in others.filter(|(_, member)| member.topics.contains(&message.topic)) {
            member.inbox.push(message.clone());
        }
    }
}

/// One member of a [`MemoryBus`].
#[derive(Debug)]
pub struct MemoryBridge {
    bus: MemoryBus,
    member: usize,
}

impl Bridge for MemoryBridge {
    type Error = Infallible;

    fn publisher(&self) -> PublisherId {
        PublisherId(self.member as u128)
    }

    fn subscribe(&mut self, topic: &str) -> Result<(), Infallible> {
        self.bus.lock().members[self.member].topics.insert(topic.into());
        Ok(())
    }

    fn receive(&mut self) -> Result<Option<Message>, Infallible> {
        Ok(self.bus.lock().members[self.member].inbox.pop())
    }

    fn publish(&mut self, topic: &str, stamp: Time, value: RawValue) -> Result<(), Infallible> {
        let mut shared = self.bus.lock();
        let (topic, received, publisher) = (topic.into(), shared.now, self.publisher());
        shared.deliver(self.member, &Message { topic, stamp, received, publisher, value });
        Ok(())
    }

    fn dropped(&self) -> u64 {
        self.bus.lock().members[self.member].inbox.dropped()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn send(bridge: &mut MemoryBridge, topic: &str, number: f64) {
        bridge.publish(topic, Time(number as i64), RawValue::Number(number)).unwrap();
    }

    /// What waits at a bridge: topic, publisher, value, in order.
    fn read(bridge: &mut MemoryBridge) -> String {
        let mut text = Vec::new();
        while let Some(message) = bridge.receive().unwrap() {
            let RawValue::Number(number) = message.value else { panic!("only numbers are sent here") };
            text.push(format!("{}:{}={number}", message.publisher, message.topic));
        }
        text.join(" ")
    }

    #[track_caller]
    fn check(bridge: &mut MemoryBridge, expected: &str) {
        assert_eq!(read(bridge), expected);
    }

    #[test]
    fn subscribers_get_their_topics_in_order() {
        let bus = MemoryBus::new();
        let (mut source, mut a, mut b) = (bus.join(8), bus.join(8), bus.join(8));
        a.subscribe("/x").unwrap();
        a.subscribe("/y").unwrap();
        a.subscribe("/y").unwrap();
        b.subscribe("/y").unwrap();
        send(&mut source, "/y", 1.0);
        send(&mut source, "/x", 2.0);
        send(&mut source, "/y", 3.0);
        send(&mut source, "/z", 4.0);
        check(&mut a, "0:/y=1 0:/x=2 0:/y=3");
        check(&mut b, "0:/y=1 0:/y=3");
        check(&mut b, "");
    }

    #[test]
    fn what_was_sent_before_the_subscription_is_gone() {
        let bus = MemoryBus::new();
        let (mut source, mut late) = (bus.join(8), bus.join(8));
        send(&mut source, "/x", 1.0);
        late.subscribe("/x").unwrap();
        send(&mut source, "/x", 2.0);
        check(&mut late, "0:/x=2");
    }

    #[test]
    fn a_substitute_under_the_signals_name_does_not_come_back() {
        let bus = MemoryBus::new();
        let (mut sensor, mut healer, mut consumer) = (bus.join(8), bus.join(8), bus.join(8));
        healer.subscribe("/scan").unwrap();
        consumer.subscribe("/scan").unwrap();
        send(&mut sensor, "/scan", 1.0);
        send(&mut healer, "/scan", 2.0);
        check(&mut healer, "0:/scan=1");
        check(&mut consumer, "0:/scan=1 1:/scan=2");
        assert_eq!(healer.publisher(), PublisherId(1));
    }

    #[test]
    fn a_full_inbox_drops_the_oldest_and_counts() {
        let bus = MemoryBus::new();
        let (mut source, mut slow) = (bus.join(8), bus.join(2));
        slow.subscribe("/x").unwrap();
        for number in 1..=5 {
            send(&mut source, "/x", f64::from(number));
        }
        assert_eq!(slow.dropped(), 3);
        check(&mut slow, "0:/x=4 0:/x=5");
        send(&mut source, "/x", 6.0);
        check(&mut slow, "0:/x=6");
        assert_eq!(slow.dropped(), 3);
    }

    #[test]
    fn reception_is_stamped_by_the_time_of_the_bus() {
        let bus = MemoryBus::new();
        let (mut source, mut sink) = (bus.join(1), bus.join(1));
        sink.subscribe("/x").unwrap();
        bus.set_time(Time(70));
        send(&mut source, "/x", 50.0);
        bus.set_time(Time(90));
        let message = sink.receive().unwrap().unwrap();
        assert_eq!((message.stamp, message.received), (Time(50), Time(70)));
    }

    #[test]
    fn members_may_live_in_threads() {
        let bus = MemoryBus::new();
        let (mut source, mut sink) = (bus.join(1), bus.join(100));
        sink.subscribe("/x").unwrap();
        let sender = std::thread::spawn(move || (0..100).for_each(|n| send(&mut source, "/x", f64::from(n))));
        sender.join().unwrap();
        let expected: Vec<String> = (0..100).map(|n| format!("0:/x={n}")).collect();
        check(&mut sink, &expected.join(" "));
    }
}
