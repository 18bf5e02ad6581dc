//! The host application: follows edge nodes, asks them for births, and publishes by its STATE whether it is here.

use super::followed::{Followed, Step};
use super::name::{Heading, NAMESPACE, NodeName, Place};
use crate::clock::Uptime;
use crate::mqtt::client::Arrived;
use crate::mqtt::options::Delivery;
use crate::mqtt::outbox::Publication;
use crate::mqtt::profile::{Profile, Will};
use crate::payload::{METRICS, STALE};
use crate::{BridgeError, Inbox, Message, Payload};
use bytes::Bytes;
use shsa_message::sparkplug::{NewMetric, NewValue, REBIRTH, Writer};
use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// After an outage of this length, the values of all edge nodes are out of date.
const OUTAGE_MAX: Duration = Duration::from_secs(2);
/// An edge node that sends no birth for this long after our connection was made anew is gone.
const SILENCE_MAX: Duration = Duration::from_secs(5);
/// The most edge nodes that are followed.
const NODES_MAX: usize = 1024;
/// The number of troubles that are kept.
const TROUBLES_MAX: usize = 64;

/// The reasons why values are out of date.
const NO_BROKER: &str = "the connection to the broker is lost";
const NO_BIRTH: &str = "the edge node has sent no birth since the connection to the broker was restored";

/// How a host application behaves.
#[derive(Clone, Debug)]
pub(super) struct HostOptions {
    /// Its identifier; `None`: an observer, which announces itself to nobody.
    pub(super) id: Option<String>,
    /// How long a message may wait for a missing earlier one.
    pub(super) reorder: Duration,
    /// Our own edge node, which is not followed.
    pub(super) own: Option<NodeName>,
    /// The largest payload in bytes.
    pub(super) size_limit: usize,
}

/// A host application.
pub(super) struct Host {
    options: HostOptions,
    inbox: Inbox,
    types: Types,
    state: Mutex<State>,
}

/// The types of its messages, shared by all of them.
struct Types {
    metrics: Arc<str>,
    stale: Arc<str>,
}

#[derive(Default)]
struct State {
    /// The time in the present will and in the message that we are here, milliseconds since 1970.
    timestamp: u64,
    is_connected: bool,
    has_left: bool,
    /// When the connection broke, until what follows from that was done.
    lost_since: Option<Uptime>,
    /// Until when the edge nodes may answer after a new connection.
    answer_until: Option<Uptime>,
    wants_everything: bool,
    nodes: Nodes,
    troubles: VecDeque<BridgeError>,
}

/// The edge nodes, by group and name.
#[derive(Default)]
struct Nodes(BTreeMap<String, BTreeMap<String, Watched>>);

/// An edge node, and the names under which it and its devices are wanted.
struct Watched {
    name: NodeName,
    followed: Followed,
    wanted: Vec<Wanted>,
}

struct Wanted {
    device: Option<String>,
    topic: Arc<str>,
}

impl Host {
    pub(super) fn new(options: HostOptions, inbox: Inbox) -> Host {
        let types = Types { metrics: METRICS.into(), stale: STALE.into() };
        Host { options, inbox, types, state: Mutex::default() }
    }

    /// A thread that panicked with the lock has left whole entries behind.
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn timestamp(&self) -> u64 {
        let clock = self.inbox.clock();
        milliseconds(clock.by_wall(clock.now()))
    }

    /// Follows an edge node or a device under this name; returns the request for the births of a node that is new.
    pub(super) fn follow(&self, topic: &str) -> Result<Option<Publication>, BridgeError> {
        let Place { node, device } = Place::parse(topic)?;
        if self.options.own.as_ref() == Some(&node) {
            return Err(BridgeError::Refused(format!(
                "`{topic}` is this instance's own edge node: what it publishes is no evidence"
            )));
        }
        let mut state = self.lock();
        let is_new = state.nodes.get_mut(&node.group, &node.node).is_none();
        let watched = state.nodes.watch(&node, self.options.reorder);
        if !watched.wanted.iter().any(|wanted| *wanted.topic == *topic) {
            watched.wanted.push(Wanted { device, topic: topic.into() });
        }
        Ok((is_new && state.is_connected).then(|| self.request(&node)))
    }

    /// Follows all edge nodes.
    pub(super) fn follow_all(&self) {
        self.lock().wants_everything = true;
    }

    /// Does what is due without a message; returns requests for births. Usually costs a look at the clock.
    pub(super) fn pass(&self) -> Vec<Publication> {
        let mut state = self.lock();
        let now = Uptime::now();
        let over = |since: Uptime, span: Duration| now.saturating_duration_since(since) >= span;
        if state.lost_since.is_some_and(|since| over(since, OUTAGE_MAX)) {
            state.lost_since = None;
            self.bury(&mut state, NO_BROKER, |_| true);
        }
        if state.answer_until.is_some_and(|until| until <= now) {
            state.answer_until = None;
            self.bury(&mut state, NO_BIRTH, Followed::is_awaited);
        }
        if !state.is_connected {
            return Vec::new();
        }
        let mut requests = Vec::new();
        for Watched { name, followed, wanted } in state.nodes.iter_mut() {
            if followed.due().is_some_and(|due| due <= now) {
                followed.pass(now, &mut |step| match step {
                    Step::AskRebirth => requests.push(self.request(name)),
                    step => self.deliver(step, wanted, None),
                });
            }
        }
        requests
    }

    /// The troubles since the last call.
    pub(super) fn troubles(&self) -> Vec<BridgeError> {
        self.lock().troubles.drain(..).collect()
    }

    /// The values of born nodes of which this holds are out of date.
    fn bury(&self, state: &mut State, because: &'static str, is_over: impl Fn(&Followed) -> bool) {
        for Watched { followed, wanted, .. } in state.nodes.iter_mut() {
            if followed.is_born() && is_over(followed) {
                followed.bury();
                self.deliver(Step::Stale { device: None, because }, wanted, None);
            }
        }
    }

    /// Passes on what follows from a message, under the wanted names, else under `other`.
    fn deliver(&self, step: Step<'_>, wanted: &[Wanted], other: Option<&Heading<'_>>) {
        let (device, is_all, payload, message_type) = match step {
            Step::Deliver { device, payload } => (device, false, payload, &self.types.metrics),
            Step::Stale { device, because } => {
                (device, device.is_none(), Bytes::from_static(because.as_bytes()), &self.types.stale)
            }
            Step::AskRebirth | Step::Unreadable => return,
        };
        let received = self.inbox.clock().now();
        let push = |topic: Arc<str>| {
            let message = Message::new(topic, received, Payload::Bytes(payload.clone()));
            self.inbox.push(Message { message_type: Some(message_type.clone()), ..message });
        };
        for wanted in wanted.iter().filter(|wanted| is_all || wanted.device.as_deref() == device) {
            push(wanted.topic.clone());
        }
        if let Some(Heading { group, node, .. }) = other.filter(|_| wanted.is_empty()) {
            let device = device.map_or(String::new(), |device| format!("/{device}"));
            push(format!("{group}/{node}{device}").into());
        }
    }

    /// The request for the births of an edge node.
    fn request(&self, node: &NodeName) -> Publication {
        let timestamp = self.timestamp();
        let mut writer = Writer::new(timestamp, None);
        let value = NewValue::Truth(true);
        // The type may be left out, but implementations fail without it: they know no birth of a command.
        let data_type = Some(value.data_type());
        writer.push(&NewMetric { name: REBIRTH, timestamp, data_type, value: Some(value), properties: &[] });
        self.publication(node.topic("NCMD"), writer.finish().into(), Delivery::AtMostOnce)
    }

    fn publication(&self, topic: String, payload: Bytes, delivery: Delivery) -> Publication {
        let stamp = self.inbox.clock().now();
        Publication { profiled: Some(delivery), ..Publication::new(topic.into(), payload, stamp) }
    }

    /// The topic of the host's state.
    fn topic(id: &str) -> String {
        format!("{NAMESPACE}/STATE/{id}")
    }

    fn state_message(&self, id: &str, state: &State, is_online: bool) -> Publication {
        let payload = state_text(is_online, state.timestamp);
        let publication = self.publication(Host::topic(id), payload.into(), Delivery::AtLeastOnce);
        Publication { retain: true, ..publication }
    }

    /// Takes in a state of this host, which the broker may publish late for an earlier connection.
    fn meet_itself(&self, id: &str, payload: &[u8]) -> Vec<Publication> {
        let state = self.lock();
        let text: String =
            String::from_utf8_lossy(payload).chars().filter(|char| !char.is_whitespace()).collect();
        let is_wrong = text.contains("\"online\":false") && state.is_connected && !state.has_left;
        is_wrong.then(|| self.state_message(id, &state, true)).into_iter().collect()
    }

    fn take(&self, heading: &Heading<'_>, arrived: &Arrived) -> Option<Publication> {
        let Heading { kind, group, node, device } = *heading;
        let mut state = self.lock();
        if state.wants_everything && state.nodes.get_mut(group, node).is_none() {
            let name = NodeName { group: group.to_owned(), node: node.to_owned() };
            if state.nodes.len() < NODES_MAX && self.options.own.as_ref() != Some(&name) {
                state.nodes.watch(&name, self.options.reorder);
            }
        }
        let Watched { name, followed, wanted } = state.nodes.get_mut(group, node)?;
        let (mut is_asked, mut is_unreadable) = (false, false);
        followed.take(kind, device, &arrived.payload, Uptime::now(), &mut |step| match step {
            Step::AskRebirth => is_asked = true,
            Step::Unreadable => is_unreadable = true,
            step => self.deliver(step, wanted, Some(heading)),
        });
        let request = is_asked.then(|| self.request(name));
        if is_unreadable {
            let topic = String::from_utf8_lossy(&arrived.topic).into_owned();
            state.trouble(format!("a message on `{topic}`: its payload is none of Sparkplug B"));
        }
        request
    }
}

impl Nodes {
    fn get_mut(&mut self, group: &str, node: &str) -> Option<&mut Watched> {
        self.0.get_mut(group)?.get_mut(node)
    }

    /// The edge node of this name, followed from now on.
    fn watch(&mut self, name: &NodeName, reorder: Duration) -> &mut Watched {
        let group = self.0.entry(name.group.clone()).or_default();
        let new = || Watched { name: name.clone(), followed: Followed::new(reorder), wanted: Vec::new() };
        group.entry(name.node.clone()).or_insert_with(new)
    }

    fn iter(&self) -> impl Iterator<Item = &Watched> {
        self.0.values().flat_map(BTreeMap::values)
    }

    fn iter_mut(&mut self) -> impl Iterator<Item = &mut Watched> {
        self.0.values_mut().flat_map(BTreeMap::values_mut)
    }

    fn len(&self) -> usize {
        self.0.values().map(BTreeMap::len).sum()
    }
}

impl State {
    fn trouble(&mut self, text: String) {
        let trouble = BridgeError::Refused(text);
        if !self.troubles.contains(&trouble) {
            self.troubles.truncate(TROUBLES_MAX - 1);
            self.troubles.push_back(trouble);
        }
    }
}

impl Profile for Host {
    fn will(&self) -> Option<Will> {
        let id = self.options.id.as_ref()?;
        let timestamp = self.timestamp();
        self.lock().timestamp = timestamp;
        Some(Will { topic: Host::topic(id), payload: state_text(false, timestamp).into(), retain: true })
    }

    fn filters(&self) -> Vec<String> {
        let state = self.lock();
        let own = self.options.id.as_ref().map(|id| Host::topic(id));
        if state.wants_everything {
            return own.into_iter().chain([format!("{NAMESPACE}/#")]).collect();
        }
        own.into_iter().chain(state.nodes.iter().map(|watched| watched.name.pattern())).collect()
    }

    fn connected(&self) -> Vec<Publication> {
        let mut state = self.lock();
        let now = Uptime::now();
        (state.is_connected, state.lost_since) = (true, None);
        state.nodes.iter_mut().for_each(|watched| watched.followed.reconnected(now));
        state.answer_until = Some(now + SILENCE_MAX);
        let here = self.options.id.as_ref().map(|id| self.state_message(id, &state, true));
        let requests = state.nodes.iter().map(|watched| self.request(&watched.name));
        here.into_iter().chain(requests).collect()
    }

    fn disconnected(&self) {
        let mut state = self.lock();
        if std::mem::take(&mut state.is_connected) {
            state.lost_since = Some(Uptime::now());
        }
    }

    fn leave(&self) -> Vec<Publication> {
        let mut state = self.lock();
        state.has_left = true;
        let gone = self.options.id.as_ref().map(|id| self.state_message(id, &state, false));
        gone.into_iter().collect()
    }

    fn arrived(&self, arrived: &Arrived) -> Option<Vec<Publication>> {
        let topic = String::from_utf8_lossy(&arrived.topic);
        let of_state = topic.strip_prefix(NAMESPACE).and_then(|rest| rest.strip_prefix("/STATE/"));
        if let Some(id) = self.options.id.as_ref().filter(|id| of_state == Some(id)) {
            // A retained one is from before our birth, which replaces it.
            let payload: &[u8] = if arrived.retained { &[] } else { &arrived.payload };
            return Some(self.meet_itself(id, payload));
        }
        let (size, limit) = (arrived.payload.len(), self.options.size_limit);
        match Heading::read(&topic) {
            // A retained message says nothing about the present.
            Some(_) if arrived.retained => {}
            Some(_) if size > limit => {
                self.lock().trouble(format!("a message of {size} bytes on `{topic}`, more than {limit}"));
            }
            Some(heading) => return Some(self.take(&heading, arrived).into_iter().collect()),
            None => return topic.starts_with(NAMESPACE).then(Vec::new),
        }
        Some(Vec::new())
    }

    fn pump(&self, _send: &mut dyn FnMut(&Publication) -> bool) {}
}

/// A wall-clock time in milliseconds since 1970.
pub(super) fn milliseconds(time: shsa_core::time::Time) -> u64 {
    u64::try_from(time.0 / 1_000_000).unwrap_or(0)
}

/// The payload of a STATE message.
fn state_text(is_online: bool, timestamp: u64) -> String {
    format!(r#"{{"online":{is_online},"timestamp":{timestamp}}}"#)
}
