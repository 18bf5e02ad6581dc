//! Our own edge node: its births have all metrics, its data the changes, its will is its death.

use super::host::milliseconds;
use super::metrics::OwnMetrics;
use super::name::NodeName;
use crate::clock::Uptime;
use crate::mqtt::client::Arrived;
use crate::mqtt::options::Delivery;
use crate::mqtt::outbox::Publication;
use crate::mqtt::profile::{Profile, Will};
use crate::{BridgeError, Clock, Offered, Outgoing, Quality};
use bytes::Bytes;
use shsa_core::time::Time;
use shsa_message::sparkplug::{BD_SEQ, NewMetric, NewValue, Payload, REBIRTH, Value, Writer};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The metric that names this program.
const APPLICATION: &str = "Properties/Application";

/// Our own edge node.
pub(super) struct EdgeNode {
    topics: Topics,
    clock: Clock,
    state: Mutex<State>,
}

/// The topics of its messages.
struct Topics {
    birth: Arc<str>,
    data: Arc<str>,
    death: Arc<str>,
    commands: Arc<str>,
}

#[derive(Default)]
struct State {
    metrics: OwnMetrics,
    /// The number in the present will and birth; `None`: there was no connection yet.
    bd_seq: Option<u8>,
    /// The next sequence number.
    seq: u8,
    is_connected: bool,
    /// Whether any metric is known: before that there is no birth.
    is_announced: bool,
    has_left: bool,
}

impl EdgeNode {
    pub(super) fn new(name: &NodeName, clock: Clock) -> EdgeNode {
        let topic = |message_type| name.topic(message_type).into();
        let topics = Topics {
            birth: topic("NBIRTH"),
            data: topic("NDATA"),
            death: topic("NDEATH"),
            commands: topic("NCMD"),
        };
        EdgeNode { topics, clock, state: Mutex::default() }
    }

    /// A thread that panicked with the lock has left whole entries behind.
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn now(&self) -> u64 {
        milliseconds(self.clock.by_wall(self.clock.now()))
    }

    /// The metrics of this owner are those of these names; without a value, their quality is bad.
    pub(super) fn announce(&self, owner: &str, offered: &[Offered<'_>]) {
        let names = offered.iter().map(|it| (it.topic, it.unit.map(ToString::to_string)));
        let mut state = self.lock();
        state.is_announced = true;
        state.metrics.announce(owner, names, self.now());
    }

    /// Takes in a value; [`Profile::pump`] sends it.
    pub(super) fn publish(&self, message: &Outgoing<'_>, until: Option<Uptime>) -> Result<(), BridgeError> {
        let mut state = self.lock();
        state.is_announced = true;
        state.metrics.publish(message, milliseconds(message.stamp), until)
    }

    /// Takes in a quality that has changed without a value.
    pub(super) fn rate(&self, topic: &str, quality: Quality, stamp: Time) {
        self.lock().metrics.rate(topic, quality, milliseconds(stamp));
    }

    fn publication(&self, topic: &Arc<str>, payload: Vec<u8>) -> Publication {
        let publication = Publication::new(topic.clone(), payload.into(), self.clock.now());
        Publication { profiled: Some(Delivery::AtMostOnce), ..publication }
    }

    fn birth(&self, state: &State) -> Publication {
        let now = self.now();
        let mut writer = Writer::new(now, Some(0));
        let own = [
            (BD_SEQ, NewValue::Whole(state.bd_seq.unwrap_or(0).into())),
            (REBIRTH, NewValue::Truth(false)),
            (APPLICATION, NewValue::Text(concat!("shsa ", env!("CARGO_PKG_VERSION")))),
        ];
        for (name, value) in own {
            let data_type = Some(value.data_type());
            writer.push(&NewMetric { name, timestamp: now, data_type, value: Some(value), properties: &[] });
        }
        state.metrics.write_all(&mut writer);
        self.publication(&self.topics.birth, writer.finish())
    }

    /// The payload of the death that belongs to a birth.
    fn death(&self, bd_seq: u8) -> Bytes {
        let now = self.now();
        let mut writer = Writer::new(now, None);
        let value = NewValue::Whole(bd_seq.into());
        let data_type = Some(value.data_type());
        writer.push(&NewMetric {
            name: BD_SEQ,
            timestamp: now,
            data_type,
            value: Some(value),
            properties: &[],
        });
        writer.finish().into()
    }
}

impl Profile for EdgeNode {
    fn will(&self) -> Option<Will> {
        let mut state = self.lock();
        let bd_seq = state.bd_seq.map_or(0, |before| before.wrapping_add(1));
        state.bd_seq = Some(bd_seq);
        Some(Will { topic: self.topics.death.to_string(), payload: self.death(bd_seq), retain: false })
    }

    fn filters(&self) -> Vec<String> {
        vec![self.topics.commands.to_string()]
    }

    fn connected(&self) -> Vec<Publication> {
        let mut state = self.lock();
        (state.is_connected, state.metrics.needs_birth) = (true, true);
        Vec::new()
    }

    fn disconnected(&self) {
        self.lock().is_connected = false;
    }

    fn leave(&self) -> Vec<Publication> {
        let mut state = self.lock();
        let was_here = state.is_connected && !std::mem::replace(&mut state.has_left, true);
        let death = state.bd_seq.filter(|_| was_here).map(|bd_seq| {
            let publication = self.publication(&self.topics.death, Vec::new());
            Publication { payload: self.death(bd_seq), ..publication }
        });
        death.into_iter().collect()
    }

    fn arrived(&self, arrived: &Arrived) -> Option<Vec<Publication>> {
        if *arrived.topic != *self.topics.commands.as_bytes() {
            return None;
        }
        let asks = |payload: Payload<'_>| {
            payload.metrics().any(|it| it.name == Some(REBIRTH) && it.value == Value::Truth(true))
        };
        // A retained command is of any age.
        if !arrived.retained && Payload::read(&arrived.payload).is_some_and(asks) {
            self.lock().metrics.needs_birth = true;
        }
        Some(Vec::new())
    }

    fn pump(&self, send: &mut dyn FnMut(&Publication) -> bool) {
        let mut state = self.lock();
        if !state.is_connected || !state.is_announced || state.has_left {
            return state.metrics.forget_changes();
        }
        if state.metrics.needs_birth {
            if !send(&self.birth(&state)) {
                return;
            }
            (state.metrics.needs_birth, state.seq) = (false, 1);
            state.metrics.forget_changes();
        }
        while state.metrics.has_changed() {
            let mut writer = Writer::new(self.now(), Some(state.seq));
            let (count, until) = state.metrics.write_changes(&mut writer, Uptime::now());
            if count == 0 {
                return;
            }
            let publication = self.publication(&self.topics.data, writer.finish());
            if !send(&Publication { until, ..publication }) {
                return;
            }
            state.seq = state.seq.wrapping_add(1);
            state.metrics.sent(count);
        }
    }
}
