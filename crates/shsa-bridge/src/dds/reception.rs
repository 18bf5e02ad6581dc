//! A thread that reads: it opens a reader for each wanted topic and type, and delivers what the readers receive.

use super::bell::{Bell, ReaderBell};
use super::network::{Participant, Reader, TOPICS};
use super::steps::Steps;
use super::subscriptions::Subscriptions;
use super::{Options, time_of};
use crate::{BridgeError, Inbox, Message, Payload, PublisherId};
use bytes::Bytes;
use rustdds::dds::no_key::DeserializedCacheChange;
use rustdds::{DomainParticipantStatusEvent, GUID, StatusEvented};
use shsa_message::ros::full_name;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// How often the network is looked at without a message.
const TICK: Duration = Duration::from_millis(100);
/// The messages that one reader delivers before the others have their turn.
const TURN: usize = 256;
/// The errors that are kept for the bridge.
const TROUBLES_MAX: usize = 16;

/// What the thread and its bridge share.
pub(super) struct Shared {
    pub(super) options: Options,
    inbox: Inbox,
    participant: Mutex<Arc<Participant>>,
    subscriptions: Mutex<Subscriptions>,
    /// Whether the subscriptions have changed since the thread looked at them.
    is_changed: AtomicBool,
    /// The type of each topic, without its leading slash, by its publishers.
    types: Mutex<BTreeMap<String, Arc<str>>>,
    troubles: Mutex<Vec<BridgeError>>,
    bell: Arc<Bell>,
    ends: AtomicBool,
}

impl Shared {
    pub(super) fn new(options: Options, inbox: Inbox) -> Result<Shared, BridgeError> {
        let participant = Participant::open(options.domain, &options.interfaces)?;
        Ok(Shared {
            options,
            inbox,
            participant: Mutex::new(Arc::new(participant)),
            subscriptions: Mutex::default(),
            is_changed: AtomicBool::new(false),
            types: Mutex::default(),
            troubles: Mutex::default(),
            bell: Arc::default(),
            ends: AtomicBool::new(false),
        })
    }

    pub(super) fn inbox(&self) -> &Inbox {
        &self.inbox
    }

    /// The present participant: another one after the wall clock was set back.
    pub(super) fn participant(&self) -> Arc<Participant> {
        locked(&self.participant).clone()
    }

    /// Changes the subscriptions; `change` returns whether it has.
    pub(super) fn subscribe(&self, change: impl FnOnce(&mut Subscriptions) -> bool) {
        if change(&mut locked(&self.subscriptions)) {
            self.is_changed.store(true, Ordering::Release);
            self.bell.ring();
        }
    }

    /// The type of a topic, by those who publish it.
    pub(super) fn type_of(&self, topic: &str) -> Option<Arc<str>> {
        locked(&self.types).get(topic).cloned()
    }

    pub(super) fn troubles(&self) -> Vec<BridgeError> {
        std::mem::take(&mut *locked(&self.troubles))
    }

    fn trouble(&self, error: BridgeError) {
        let mut troubles = locked(&self.troubles);
        if troubles.len() < TROUBLES_MAX && !troubles.contains(&error) {
            troubles.push(error);
        }
    }

    /// Ends the thread.
    pub(super) fn end(&self) {
        self.ends.store(true, Ordering::Release);
        self.bell.ring();
    }
}

/// A thread that panicked with the lock has left whole values behind, so the others go on.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The topic, without its leading slash, and the type of a reader or of a publisher.
type Subject = (String, String);

/// A reader at work.
struct Inlet {
    reader: Reader,
    bell: Arc<ReaderBell>,
    /// The type as messages name it.
    message_type: Arc<str>,
}

/// The state of the thread.
pub(super) struct Reception {
    shared: Arc<Shared>,
    // Before its participant, to be dropped first.
    inlets: BTreeMap<Subject, Inlet>,
    participant: Arc<Participant>,
    /// The publishers of others.
    publishers: BTreeMap<GUID, Subject>,
    /// Whether there may be readers to open.
    has_news: bool,
    steps: Steps,
}

impl Reception {
    pub(super) fn new(shared: Arc<Shared>) -> Reception {
        let participant = shared.participant();
        Reception {
            shared,
            inlets: BTreeMap::new(),
            participant,
            publishers: BTreeMap::new(),
            has_news: true,
            steps: Steps::new(),
        }
    }

    /// Reads until the bridge ends.
    pub(super) fn run(mut self) {
        let shared = self.shared.clone();
        while !shared.ends.load(Ordering::Acquire) {
            if !shared.bell.wait(TICK) {
                // A clock that was slewed can hide a message from a reader for a moment, which is not reported again.
                self.inlets.values().for_each(|inlet| inlet.bell.note());
            }
            if self.steps.is_back() {
                self.open_anew();
            }
            self.discover();
            if shared.is_changed.swap(false, Ordering::AcqRel) || self.has_news {
                self.open_readers();
            }
            self.deliver();
        }
    }

    /// RustDDS orders received messages by the wall clock: after a step back it would deliver none until the clock is there
    /// again. A new participant begins anew.
    fn open_anew(&mut self) {
        let Options { domain, interfaces, .. } = &self.shared.options;
        match Participant::open(*domain, interfaces) {
            Ok(participant) => {
                self.steps.forget();
                self.inlets.clear();
                self.publishers.clear();
                self.has_news = true;
                self.participant = Arc::new(participant);
                *locked(&self.shared.participant) = self.participant.clone();
            }
            // It is tried again at the next tick.
            Err(error) => self.shared.trouble(error),
        }
    }

    /// Takes note of the publishers that have come and gone.
    fn discover(&mut self) {
        let listener = self.participant.domain.status_listener();
        while let Some(event) = listener.try_recv_status() {
            match event {
                DomainParticipantStatusEvent::WriterDetected { writer } => {
                    self.note(writer.guid, &writer.topic_name, writer.type_name);
                }
                DomainParticipantStatusEvent::WriterLost { guid, .. } => {
                    self.publishers.remove(&guid);
                }
                _ => {}
            }
        }
    }

    fn note(&mut self, guid: GUID, topic: &str, dds_type: String) {
        let Some(topic) = topic.strip_prefix(TOPICS) else { return };
        if !self.is_own(guid) {
            locked(&self.shared.types).insert(topic.to_owned(), full_name(&dds_type).into());
            self.publishers.insert(guid, (topic.to_owned(), dds_type));
            self.has_news = true;
        }
    }

    fn is_own(&self, guid: GUID) -> bool {
        guid.prefix.as_ref() == self.participant.prefix()
    }

    /// Opens the readers that are wanted and absent.
    fn open_readers(&mut self) {
        let subscriptions = locked(&self.shared.subscriptions);
        let typed = subscriptions.typed().map(|(topic, dds_type)| (topic.to_owned(), dds_type.to_owned()));
        let found = self.publishers.values().filter(|(topic, dds_type)| subscriptions.wants(topic, dds_type));
        let absent: Vec<Subject> =
            typed.chain(found.cloned()).filter(|subject| !self.inlets.contains_key(subject)).collect();
        drop(subscriptions);
        self.has_news = false;
        for (topic, dds_type) in absent {
            match self.participant.reader(&topic, &dds_type, &self.shared.options.types) {
                Ok(reader) => {
                    let bell = ReaderBell::new(self.shared.bell.clone());
                    let inlet = Inlet { reader, bell, message_type: full_name(&dds_type).into() };
                    self.inlets.insert((topic, dds_type), inlet);
                }
                Err(error) => {
                    // It is tried again at the next tick.
                    self.has_news = true;
                    self.shared.trouble(error);
                }
            }
        }
    }

    /// Delivers what the readers have received.
    fn deliver(&mut self) {
        let mut early = Vec::new();
        for (subject, inlet) in &self.inlets {
            let (Inlet { reader, bell, .. }, topic) = (inlet, &subject.0);
            if !bell.take() {
                continue;
            }
            // RustDDS forgets the waker with each call.
            reader.set_waker(Some(bell.clone().into()));
            reader.drain_read_notifications();
            for turn in 0.. {
                if turn == TURN {
                    bell.ring();
                    break;
                }
                match reader.try_take_one() {
                    Ok(Some(sample)) if self.is_known(sample.writer_guid) => {
                        self.hand(subject, inlet, sample)
                    }
                    Ok(Some(sample)) => early.push((subject.clone(), sample)),
                    Ok(None) => break,
                    // Of another encoding: the next one may be read.
                    Err(error) => {
                        self.shared.trouble(BridgeError::Lost(format!("topic '/{topic}': {error}")))
                    }
                }
            }
        }
        if early.is_empty() {
            return;
        }
        // Their publishers have come since the last look.
        self.discover();
        for (subject, sample) in early {
            if let Some(inlet) = self.inlets.get(&subject) {
                self.hand(&subject, inlet, sample);
            }
        }
    }

    /// Whether this publisher was discovered, so that its type is known.
    fn is_known(&self, guid: GUID) -> bool {
        self.is_own(guid) || self.publishers.contains_key(&guid)
    }

    /// Hands a message over. RustDDS gives a reader what is published under its topic with another type, too.
    fn hand(&self, subject: &Subject, inlet: &Inlet, sample: DeserializedCacheChange<Bytes>) {
        let (topic, dds_type) = subject;
        let guid = sample.writer_guid;
        let is_other = || self.publishers.get(&guid).is_some_and(|(_, its_type)| its_type != dds_type);
        if self.is_own(guid) || is_other() {
            return;
        }
        let names = locked(&self.shared.subscriptions).names(topic, dds_type);
        let inbox = &self.shared.inbox;
        for name in names {
            inbox.hand(Message {
                stamp: sample.write_options.source_timestamp().map(time_of),
                publisher: Some(PublisherId(u128::from_le_bytes(guid.to_bytes()))),
                message_type: Some(inlet.message_type.clone()),
                ..Message::new(name, inbox.clock().now(), Payload::Bytes(sample.sample.clone()))
            });
        }
    }
}
