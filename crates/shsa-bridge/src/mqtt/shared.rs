//! The state shared by the bridge and the connection: subscriptions, waiting messages, and results.

mod leaving;
mod presence;
mod sending;

use super::claims::Claims;
use super::client::{Arrived, Client, Failure, Happening, Sender};
use super::echo::Echo;
use super::options::{Options, Presence};
use super::outbox::{Outbox, Publication};
use super::profile::Profile;
use super::served::Served;
use super::unasked::Unasked;
use crate::clock::Uptime;
use crate::{BridgeError, Inbox, Link, Message, Outage, Payload, PublisherId, Quality};
use bytes::Bytes;
use leaving::Leaving;
use presence::Corrections;
use sending::Attempts;
use shsa_core::time::{Span, Time};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, mpsc};
use std::time::Duration;
use tokio::sync::Notify;

/// The number of topics with waiting messages.
const TOPICS_MAX: usize = 4096;

/// What the connection and the bridge share.
pub(super) struct Shared {
    state: Mutex<State>,
    /// Notified when the first attempt has ended.
    attempted: Condvar,
    /// Notified when the connection is to end.
    pub(super) stop: Notify,
    pub(super) inbox: Inbox,
    pub(super) publisher: PublisherId,
    size_limit: usize,
    presence: Option<Presence>,
    /// The protocol on top of MQTT whose rules the connection follows.
    profile: Option<Arc<dyn Profile>>,
    /// The claims of this client, and of other ones.
    pub(super) claims: Arc<Claims>,
    /// How long the broker keeps messages for us.
    session: Duration,
}

struct State {
    link: Link,
    /// The result of the first attempt to connect.
    first: Option<Result<(), BridgeError>>,
    /// `Some` while connected.
    sender: Option<Sender>,
    /// When the connection broke; `None` while connected, and before the first connection.
    gone_since: Option<Uptime>,
    /// The last outage after the first connection.
    outage: Option<Outage>,
    stopping: bool,
    outbox: Outbox,
    /// The subscribed topics.
    wanted: BTreeSet<Arc<str>>,
    wants_everything: bool,
    /// The topics with servers.
    served: BTreeMap<String, Served>,
    /// Requests to the broker that wait for their turn: topics, and whether to subscribe.
    requests: VecDeque<(String, bool)>,
    /// Messages of the profile: those that go out before all others, and those that go out as the last ones.
    ahead: VecDeque<Publication>,
    last: VecDeque<Publication>,
    /// What the profile subscribes to.
    followed: BTreeSet<String>,
    /// Subscriptions that were requested; then, sent ones by number.
    asked: VecDeque<String>,
    numbered: BTreeMap<u16, String>,
    /// The topics of publications that were requested; then, sent ones by number until the number is used again.
    leaving: Leaving,
    unacknowledged: BTreeMap<u16, Arc<str>>,
    unasked: Unasked,
    echo: Echo,
    corrections: Corrections,
    /// The askers that wait for answers, in order, by the topic of the answers.
    asking: BTreeMap<String, VecDeque<mpsc::Sender<Bytes>>>,
    attempts: Attempts,
    troubles: VecDeque<BridgeError>,
    /// Messages that the broker has refused, by topic.
    refused: VecDeque<(Arc<str>, BridgeError)>,
}

/// The subscription to everything; excludes the topics of brokers about themselves.
const EVERYTHING: &str = "#";

impl Shared {
    pub(super) fn new(
        options: &Options,
        inbox: Inbox,
        publisher: PublisherId,
        profile: Option<Arc<dyn Profile>>,
    ) -> Shared {
        let state = State {
            link: Link::Down("not yet connected".to_owned()),
            first: None,
            sender: None,
            gone_since: None,
            outage: None,
            stopping: false,
            outbox: Outbox::new(TOPICS_MAX),
            wanted: BTreeSet::new(),
            wants_everything: false,
            served: BTreeMap::new(),
            requests: VecDeque::new(),
            ahead: VecDeque::new(),
            last: VecDeque::new(),
            followed: BTreeSet::new(),
            asked: VecDeque::new(),
            numbered: BTreeMap::new(),
            leaving: Leaving::default(),
            unacknowledged: BTreeMap::new(),
            unasked: Unasked::default(),
            echo: Echo::default(),
            corrections: Corrections::default(),
            asking: BTreeMap::new(),
            attempts: Attempts::default(),
            troubles: VecDeque::new(),
            refused: VecDeque::new(),
        };
        let claims = Claims::new(options.claims.clone(), inbox.clone());
        Shared {
            state: Mutex::new(state),
            attempted: Condvar::new(),
            stop: Notify::new(),
            inbox,
            publisher,
            size_limit: options.size_limit,
            session: options.session,
            presence: options.presence.clone(),
            profile,
            claims,
        }
    }

    /// A thread that panicked with the lock has left whole entries behind.
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn link(&self) -> Link {
        self.lock().link.clone()
    }

    pub(super) fn outage(&self) -> Option<Outage> {
        self.lock().outage.clone()
    }

    pub(super) fn troubles(&self) -> Vec<BridgeError> {
        self.lock().troubles.drain(..).collect()
    }

    pub(super) fn refusals(&self) -> Vec<(Arc<str>, BridgeError)> {
        self.lock().refused.drain(..).collect()
    }

    /// Waits until the first attempt to connect has ended, or the time has passed; returns the result.
    pub(super) fn first_attempt(&self, at_most: Duration) -> Option<Result<(), BridgeError>> {
        let waited = self.attempted.wait_timeout_while(self.lock(), at_most, |state| state.first.is_none());
        waited.unwrap_or_else(PoisonError::into_inner).0.first.clone()
    }

    pub(super) fn subscribe(&self, topic: &str) {
        let mut state = self.lock();
        if !state.wanted.insert(topic.into()) {
            return;
        }
        state.deliver_unasked(&self.inbox);
        if state.sender.is_some() && !state.wants_everything {
            state.requests.push_back((topic.to_owned(), true));
            state.pump(self.profile.as_deref());
        }
    }

    pub(super) fn subscribe_all(&self) {
        let mut state = self.lock();
        let wanted_already = std::mem::replace(&mut state.wants_everything, true);
        state.deliver_unasked(&self.inbox);
        if !wanted_already && state.sender.is_some() {
            // Some brokers send a message twice for two overlapping subscriptions.
            let single: Vec<String> = state.wanted.iter().map(|topic| topic.to_string()).collect();
            state.requests.extend(single.into_iter().map(|topic| (topic, false)));
            state.requests.push_back((EVERYTHING.to_owned(), true));
            state.pump(self.profile.as_deref());
        }
    }

    /// Passes messages under this name to a server.
    pub(super) fn serve(&self, name: &str, served: Served) {
        let mut state = self.lock();
        let is_new = state.served.insert(name.to_owned(), served).is_none();
        if is_new && state.sender.is_some() && !state.wants_everything {
            state.requests.push_back((name.to_owned(), true));
            state.pump(self.profile.as_deref());
        }
    }

    /// Sends a message now, or as soon as there is a connection.
    pub(super) fn publish(&self, publication: Publication) -> Result<(), BridgeError> {
        let (size, limit) = (publication.payload.len(), self.size_limit);
        if size > limit {
            return Err(BridgeError::Refused(format!("a message of {size} bytes, more than {limit}")));
        }
        self.lock().publish(publication);
        Ok(())
    }

    /// Sends a message that is answered under another name; answers arrive in the order of the questions.
    pub(super) fn ask(
        &self,
        answers: &str,
        question: Publication,
    ) -> Result<mpsc::Receiver<Bytes>, BridgeError> {
        self.subscribe(answers);
        let (sender, answer) = mpsc::channel();
        self.lock().asking.entry(answers.to_owned()).or_default().push_back(sender);
        self.publish(question)?;
        Ok(answer)
    }

    /// Ends the connection; sends waiting messages first if that is quick.
    pub(super) fn stop(&self) {
        let mut state = self.lock();
        state.stopping = true;
        self.publish_gone(&mut state);
        state.last.extend(self.profile.iter().flat_map(|profile| profile.leave()));
        self.stop.notify_one();
    }

    pub(super) fn is_stopping(&self) -> bool {
        self.lock().stopping
    }

    /// `has_kept`: the broker has a session of ours, and messages that came while we were gone.
    pub(super) fn connected(&self, sender: &Sender, has_kept: bool) {
        let mut state = self.lock();
        let away = state.gone_since.take().map_or(self.session, |since| since.elapsed());
        if has_kept {
            self.inbox.was_away(Span::from_seconds(away.as_secs_f64()));
        }
        state.link = Link::Up;
        if let Some(outage) = &mut state.outage {
            outage.found.get_or_insert(self.inbox.clock().now());
        }
        state.sender = Some(sender.clone());
        state.asked.clear();
        state.numbered.clear();
        state.leaving.clear();
        state.unacknowledged.clear();
        state.unasked.connected();
        state.corrections.connected();
        state.requests.clear();
        self.begin_profile(&mut state);
        let all: Vec<String> = match state.wants_everything {
            true => vec![EVERYTHING.to_owned()],
            false => {
                // Claims are subscribed to first, so that other instances are known before the first value arrives.
                let wanted = state.wanted.iter().map(|topic| topic.to_string());
                self.claims.topics().chain(wanted).chain(state.served.keys().cloned()).collect()
            }
        };
        state.requests.extend(all.into_iter().map(|topic| (topic, true)));
        self.attempt_ended(&mut state, Ok(()));
        self.publish_here(&mut state);
        state.pump(self.profile.as_deref());
    }

    fn attempt_ended(&self, state: &mut State, how: Result<(), BridgeError>) {
        state.first.get_or_insert(how);
        self.attempted.notify_all();
    }

    /// Takes in the end of the connection; unfinished messages wait for the next one.
    pub(super) fn disconnected(&self, failure: &Failure, client: &mut Client) {
        let mut state = self.lock();
        // From now on nothing can enter the client's queue.
        state.sender = None;
        state.ahead.clear();
        self.profile.iter().for_each(|profile| profile.disconnected());
        if state.link == Link::Up {
            state.gone_since = Some(Uptime::now());
            let number = state.outage.as_ref().map_or(1, |before| before.number + 1);
            let (lost, because) = (self.inbox.clock().now(), failure.reason.clone());
            state.outage = Some(Outage { number, lost, found: None, because });
        }
        state.outbox.keep_newest();
        state.unfinished(client.unfinished());
        let Failure { is_refusal, reason } = failure;
        let error = match is_refusal {
            true => BridgeError::Refused(reason.clone()),
            false => BridgeError::Lost(reason.clone()),
        };
        state.link = Link::Down(if *is_refusal { error.to_string() } else { reason.clone() });
        self.attempt_ended(&mut state, Err(error));
        drop(state);
        self.inbox.wake();
    }

    pub(super) fn happened(&self, happening: Happening) {
        match happening {
            Happening::Arrived(arrived) => self.arrived(arrived),
            Happening::Subscribing(number) => {
                let mut state = self.lock();
                let topic = state.asked.pop_front();
                state.numbered.extend(topic.map(|topic| (number, topic)));
            }
            Happening::Subscribed(number, refusal) => {
                let mut state = self.lock();
                let topic = state.numbered.remove(&number).unwrap_or_default();
                let text = refusal.map(|reason| format!("the subscription to `{topic}`: {reason}"));
                text.into_iter().for_each(|text| state.trouble(BridgeError::Refused(text)));
            }
            Happening::Publishing(number) => {
                let mut state = self.lock();
                let topic = state.leaving.pop().filter(|_| number != 0);
                state.unacknowledged.extend(topic.map(|topic| (number, topic)));
            }
            Happening::Refused(number, reason) => {
                self.lock().refuse(number, reason);
                self.inbox.wake();
            }
            Happening::Connected { .. } | Happening::Other => {}
        }
    }

    fn arrived(&self, arrived: Arrived) {
        if self.pass_profile(&arrived) {
            return;
        }
        let received = self.inbox.clock().now();
        let served = self.lock().served.get(&*String::from_utf8_lossy(&arrived.topic)).cloned();
        if let Some(served) = served.filter(|_| arrived.payload.len() <= self.size_limit) {
            return served.ask(arrived);
        }
        let Arrived { topic, payload, retained, duplicate, properties, .. } = arrived;
        let topic = String::from_utf8_lossy(&topic);
        if payload.len() > self.size_limit {
            let text =
                format!("a message of {} bytes on `{topic}`, more than {}", payload.len(), self.size_limit);
            return self.lock().trouble(BridgeError::Refused(text));
        }
        let is_claim = self.hear_of_clients(&topic, &payload, retained);
        let property = |name: &str| properties.iter().find(|(key, _)| key == name).map(|(_, value)| &**value);
        let publisher =
            property("publisher").and_then(|id| u128::from_str_radix(id, 16).ok()).map(PublisherId);
        if publisher == Some(self.publisher) {
            return;
        }
        let mut state = self.lock();
        if state.echo.is_own(&topic, &payload, duplicate, Uptime::now()) {
            return;
        }
        if !retained && state.answer(&topic, &payload) {
            return;
        }
        let name = state.wanted.get(&*topic).cloned();
        let is_wanted = name.is_some() || state.wants_everything;
        if is_claim && !is_wanted {
            return;
        }
        let message = Message {
            stamp: property("stamp_ns").and_then(|stamp| stamp.parse().ok()).map(Time),
            quality: property("quality").and_then(Quality::named),
            publisher,
            retained,
            ..Message::new(name.unwrap_or_else(|| (*topic).into()), received, Payload::Bytes(payload))
        };
        if is_wanted {
            drop(state);
            self.inbox.push(message);
        } else {
            let unwanted = state.unasked.keep(message);
            state.requests.extend(unwanted.map(|topic| (topic, false)));
        }
    }

    /// Sends waiting requests and messages, as far as the connection accepts them.
    pub(super) fn pump(&self) {
        self.lock().pump(self.profile.as_deref());
    }

    /// Whether everything has been sent.
    pub(super) fn has_sent_all(&self) -> bool {
        self.lock().has_sent_all()
    }

    /// The connection has lasted, so earlier unfinished messages were not the cause of its break.
    pub(super) fn lasted(&self) {
        self.lock().attempts = Attempts::default();
    }
}
