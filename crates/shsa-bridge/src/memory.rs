//! The bus within one process: for demonstrations, tests and compiled-in nodes.
//!
//! With a manual [`Clock`] the caller sets the time, so that a run can be repeated byte for byte. Every subscriber gets the
//! messages in the order of their publication.

use crate::{
    Answer, Bridge, BridgeError, Channel, Clock, Inbox, Link, Message, Outgoing, Payload, PublisherId,
};
use crate::{Question, Server, Taker, payload};
use bytes::Bytes;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::sync::mpsc::channel;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// A bus; clones are the same bus.
#[derive(Clone, Debug)]
pub struct MemoryBus {
    clock: Clock,
    members: Arc<Mutex<Vec<Member>>>,
}

struct Member {
    /// `None`: every topic.
    topics: Option<BTreeSet<Arc<str>>>,
    inbox: Inbox,
    /// The topics of its servers, each with the topic of the answers.
    served: BTreeMap<Arc<str>, (Arc<str>, Server)>,
}

impl Member {
    fn wants(&self, topic: &str) -> bool {
        self.topics.as_ref().is_none_or(|topics| topics.contains(topic))
    }
}

impl fmt::Debug for Member {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Member({:?}, {} served)", self.topics, self.served.len())
    }
}

impl MemoryBus {
    /// A bus without members; a published message is received at once, at the time of `clock`.
    #[must_use]
    pub fn new(clock: Clock) -> MemoryBus {
        MemoryBus { clock, members: Arc::default() }
    }

    /// The clock that stamps the reception.
    #[must_use]
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// A new member with room for `capacity` waiting messages a topic.
    #[must_use]
    pub fn join(&self, capacity: usize) -> MemoryBridge {
        self.join_with(Inbox::new(capacity, self.clock.clone()))
    }

    /// A new member whose messages wait in `inbox`, which must have the clock of the bus.
    #[must_use]
    pub fn join_with(&self, inbox: Inbox) -> MemoryBridge {
        let mut members = self.lock();
        members.push(Member { topics: Some(BTreeSet::new()), inbox: inbox.clone(), served: BTreeMap::new() });
        MemoryBridge { bus: self.clone(), inbox, member: members.len() - 1, published: BTreeSet::new() }
    }

    /// Passes a message to all members except `from`, then to the servers of its topic.
    fn send(&self, from: usize, message: &Message) {
        let members = self.lock();
        let others = || members.iter().enumerate().filter(|(member, _)| *member != from);
        for (_, member) in others().filter(|(_, member)| member.wants(&message.topic)) {
            member.inbox.push(message.clone());
        }
        let served =
            others().filter_map(|(at, member)| Some((at, member.served.get(&message.topic)?.clone())));
        let served: Vec<_> = served.collect();
        // A server may send messages while it answers, which needs the lock.
        drop(members);
        for (member, (answers, server)) in served {
            server(self.question(member, answers, message));
        }
    }

    fn question(&self, member: usize, answers: Arc<str>, message: &Message) -> Question {
        let words = match &message.payload {
            Payload::Bytes(bytes) => bytes.clone(),
            Payload::Value(value) => Bytes::from(payload::plain(value)),
        };
        let bus = self.clone();
        Question::new(words, move |words| {
            let publisher = Some(PublisherId(member as u128));
            let now = bus.clock.now();
            bus.send(member, &Message { publisher, ..Message::new(answers, now, Payload::Bytes(words)) });
        })
    }

    /// Asks all servers of a name except those of `from`; passes each answer to `take`.
    fn ask(&self, from: usize, name: &str, words: &Bytes, take: impl Fn(Bytes) + Send + Clone + 'static) {
        let members = self.lock();
        let others = members.iter().enumerate().filter(|(member, _)| *member != from);
        let servers = others.filter_map(|(_, member)| Some(member.served.get(name)?.1.clone()));
        let servers: Vec<_> = servers.collect();
        // A server may send messages while it answers, which needs the lock.
        drop(members);
        for server in &servers {
            let mut question = Question::new(words.clone(), take.clone());
            question.is_addressed = true;
            server(question);
        }
    }

    /// A member that panicked leaves whole messages behind, so the others go on.
    fn lock(&self) -> MutexGuard<'_, Vec<Member>> {
        self.members.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// One member of a [`MemoryBus`].
#[derive(Debug)]
pub struct MemoryBridge {
    bus: MemoryBus,
    inbox: Inbox,
    member: usize,
    /// The topics of its publications; all messages of a topic share one name.
    published: BTreeSet<Arc<str>>,
}

impl MemoryBridge {
    fn name(&mut self, topic: &str) -> Arc<str> {
        if let Some(name) = self.published.get(topic) {
            return name.clone();
        }
        let name: Arc<str> = topic.into();
        self.published.insert(name.clone());
        name
    }
}

impl Bridge for MemoryBridge {
    fn publisher(&self) -> PublisherId {
        PublisherId(self.member as u128)
    }

    fn channel(&self) -> Channel {
        Channel::WITHIN
    }

    fn inbox(&self) -> &Inbox {
        &self.inbox
    }

    fn subscribe(&mut self, topic: &str, _message_type: Option<&str>) -> Result<(), BridgeError> {
        if let Some(topics) = &mut self.bus.lock()[self.member].topics {
            topics.insert(topic.into());
        }
        Ok(())
    }

    fn subscribe_all(&mut self) -> Result<(), BridgeError> {
        self.bus.lock()[self.member].topics = None;
        Ok(())
    }

    fn publish(&mut self, message: Outgoing<'_>) -> Result<(), BridgeError> {
        let message = Message {
            stamp: Some(message.stamp),
            publisher: Some(self.publisher()),
            quality: message.provenance.map(|provenance| provenance.quality),
            ..Message::new(self.name(message.topic), self.bus.clock.now(), message.payload)
        };
        self.bus.send(self.member, &message);
        Ok(())
    }

    fn link(&self) -> Link {
        Link::Up
    }

    fn serve(&mut self, name: &str, answers: &str, server: Server) -> Result<(), BridgeError> {
        self.bus.lock()[self.member].served.insert(name.into(), (answers.into(), server));
        Ok(())
    }

    fn request(&mut self, to: &str, payload: Bytes, within: Duration) -> Result<Answer, BridgeError> {
        let (sender, answers) = channel();
        // The asker may have given up.
        self.bus.ask(self.member, to, &payload, move |words| drop(sender.send(words)));
        let name = to.to_owned();
        Ok(Box::new(move || {
            answers
                .recv_timeout(within)
                .map_err(|_| BridgeError::Lost(format!("nobody answers under `{name}`")))
        }))
    }

    fn ask(&self, name: &str, longest: usize, take: Taker) -> Result<(), BridgeError> {
        let (take, inbox) = (Arc::new(Mutex::new(Some(take))), self.inbox.clone());
        self.bus.ask(self.member, name, &Bytes::new(), move |words| {
            if words.len() > longest {
                return;
            }
            let first = take.lock().unwrap_or_else(PoisonError::into_inner).take();
            if let Some(take) = first {
                take(words.into());
                inbox.wake();
            }
        });
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Payload;
    use shsa_core::observation::RawValue;
    use shsa_core::time::Time;

    #[test]
    fn a_question_is_answered_to_all_but_the_one_who_answers() {
        let bus = bus();
        let (mut asker, mut server) = (bus.join(8), bus.join(8));
        asker.subscribe("/answers", None).unwrap();
        server.subscribe_all().unwrap();
        let echo = |question: Question| {
            let words = question.payload.clone();
            question.answer(words);
        };
        server.serve("/questions", "/answers", Arc::new(echo)).unwrap();
        send(&mut asker, "/questions", 4.0);
        assert_eq!(asker.receive().unwrap().payload, Payload::Bytes(Bytes::from_static(b"4")));
        check(&mut server, "0:/questions=4");
    }

    fn bus() -> MemoryBus {
        MemoryBus::new(Clock::manual())
    }

    fn send(bridge: &mut MemoryBridge, topic: &str, number: f64) {
        let payload = Payload::Value(RawValue::Number(number));
        bridge.publish(Outgoing::new(topic, Time(number as i64), payload)).unwrap();
    }

    /// The waiting messages of a bridge in order: topic, publisher, value.
    fn read(bridge: &mut MemoryBridge) -> String {
        let mut text = Vec::new();
        while let Some(message) = bridge.receive() {
            let Payload::Value(RawValue::Number(number)) = message.payload else {
                panic!("only numbers are sent here")
            };
            let publisher = message.publisher.unwrap();
            text.push(format!("{publisher}:{}={number}", message.topic));
        }
        text.join(" ")
    }

    #[track_caller]
    fn check(bridge: &mut MemoryBridge, expected: &str) {
        assert_eq!(read(bridge), expected);
    }

    #[test]
    fn subscribers_get_their_topics_in_order() {
        let bus = bus();
        let (mut source, mut a, mut b) = (bus.join(8), bus.join(8), bus.join(8));
        a.subscribe("/x", None).unwrap();
        a.subscribe("/y", None).unwrap();
        a.subscribe("/y", None).unwrap();
        b.subscribe("/y", None).unwrap();
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
        let bus = bus();
        let (mut source, mut late) = (bus.join(8), bus.join(8));
        send(&mut source, "/x", 1.0);
        late.subscribe("/x", None).unwrap();
        send(&mut source, "/x", 2.0);
        check(&mut late, "0:/x=2");
    }

    #[test]
    fn a_substitute_under_the_signals_name_does_not_come_back() {
        let bus = bus();
        let (mut sensor, mut healer, mut consumer) = (bus.join(8), bus.join(8), bus.join(8));
        healer.subscribe("/scan", None).unwrap();
        consumer.subscribe("/scan", None).unwrap();
        send(&mut sensor, "/scan", 1.0);
        send(&mut healer, "/scan", 2.0);
        check(&mut healer, "0:/scan=1");
        check(&mut consumer, "0:/scan=1 1:/scan=2");
        assert_eq!(healer.publisher(), PublisherId(1));
    }

    #[test]
    fn a_full_inbox_drops_the_oldest_and_counts() {
        let bus = bus();
        let (mut source, mut slow) = (bus.join(8), bus.join(2));
        slow.subscribe("/x", None).unwrap();
        for number in 1..=5 {
            send(&mut source, "/x", f64::from(number));
        }
        assert_eq!(slow.inbox().dropped(), 3);
        check(&mut slow, "0:/x=4 0:/x=5");
        send(&mut source, "/x", 6.0);
        check(&mut slow, "0:/x=6");
        assert_eq!(slow.inbox().dropped(), 3);
    }

    #[test]
    fn reception_is_stamped_by_the_time_of_the_bus() {
        let bus = bus();
        let (mut source, mut sink) = (bus.join(1), bus.join(1));
        sink.subscribe("/x", None).unwrap();
        bus.clock().set(Time(70));
        send(&mut source, "/x", 50.0);
        bus.clock().set(Time(90));
        let message = sink.receive().unwrap();
        assert_eq!((message.stamp, message.received), (Some(Time(50)), Time(70)));
    }

    #[test]
    fn members_may_live_in_threads() {
        let bus = bus();
        let (mut source, mut sink) = (bus.join(1), bus.join(100));
        sink.subscribe("/x", None).unwrap();
        let sender = std::thread::spawn(move || (0..100).for_each(|n| send(&mut source, "/x", f64::from(n))));
        sender.join().unwrap();
        let expected: Vec<String> = (0..100).map(|n| format!("0:/x={n}")).collect();
        check(&mut sink, &expected.join(" "));
    }
}
