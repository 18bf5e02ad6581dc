//! The session of an edge node as a host application follows it: births give names and types, sequence numbers show losses, and
//! deaths end it.

use super::name::Kind;
use crate::clock::Uptime;
use bytes::Bytes;
use shsa_message::sparkplug::{BD_SEQ, DataType, Known, Metric, Payload, resolved};
use std::collections::BTreeMap;
use std::time::Duration;

/// The number of messages that may wait for one that is missing.
const WAITING_MAX: usize = 64;
/// The most devices of a node, and the most metrics of it and of its devices that are known.
const DEVICES_MAX: usize = 1024;
const METRICS_MAX: usize = 1 << 16;
/// The shortest pause between two requests for a birth; it doubles without an answer.
const PAUSE_MIN: Duration = Duration::from_secs(1);
/// The longest pause.
const PAUSE_MAX: Duration = Duration::from_secs(60);

/// What follows from a message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Step<'a> {
    /// The payload of the node (`None`) or of a device, with names and types.
    Deliver { device: Option<&'a str>, payload: Bytes },
    /// The values of a device, or of the node and all its devices (`None`), are out of date.
    Stale { device: Option<&'a str>, because: &'static str },
    /// The node is to send its births again.
    AskRebirth,
    /// The message is no payload of Sparkplug B.
    Unreadable,
}

/// Takes what follows.
pub(super) type Steps<'s> = &'s mut dyn FnMut(Step<'_>);

/// The reasons why values are out of date.
const NODE_DEAD: &str = "the edge node has died (NDEATH)";
const DEVICE_DEAD: &str = "the device has died (DDEATH)";

/// A message that waits for an earlier one.
#[derive(Clone, Debug)]
struct Waiting {
    kind: Kind,
    device: Option<String>,
    payload: Bytes,
}

/// The metrics of a node or of a device, as its birth has declared them.
#[derive(Clone, Debug, Default)]
struct Metrics {
    types: BTreeMap<Box<str>, DataType>,
    aliases: BTreeMap<u64, Box<str>>,
}

/// The state of an edge node.
#[derive(Clone, Debug)]
pub(super) struct Followed {
    /// How long a message may wait for a missing one.
    reorder: Duration,
    is_born: bool,
    /// Whether every message since the birth has come: else a birth may be missing, and an alias may mean another metric.
    is_complete: bool,
    /// Whether it was born before our connection broke, and has sent no birth since.
    is_awaited: bool,
    bd_seq: Option<u64>,
    /// The next sequence number; `None`: not known.
    next: Option<u8>,
    /// Messages that came too early, by their distance from the next one.
    early: BTreeMap<u8, Waiting>,
    /// When the missing message counts as lost.
    lost_at: Option<Uptime>,
    /// The metrics of the devices by their names, and of the node itself under the empty name.
    metrics: BTreeMap<Box<str>, Metrics>,
    /// When a birth may be requested again, and the pause after that.
    ask_at: Option<Uptime>,
    pause: Duration,
}

impl Followed {
    pub(super) fn new(reorder: Duration) -> Followed {
        Followed {
            reorder,
            is_born: false,
            is_complete: false,
            is_awaited: false,
            bd_seq: None,
            next: None,
            early: BTreeMap::new(),
            lost_at: None,
            metrics: BTreeMap::new(),
            ask_at: None,
            pause: PAUSE_MIN,
        }
    }

    /// Whether the node has sent its birth and no death.
    pub(super) fn is_born(&self) -> bool {
        self.is_born
    }

    /// Whether the node was born before our connection broke, and has sent no birth since.
    pub(super) fn is_awaited(&self) -> bool {
        self.is_born && self.is_awaited
    }

    /// Our connection was made anew: the node may have sent anything meanwhile. The caller asks for its births.
    pub(super) fn reconnected(&mut self, now: Uptime) {
        self.is_complete = false;
        self.is_awaited = self.is_born;
        self.next = None;
        self.early.clear();
        self.lost_at = None;
        self.ask_at = Some(now + PAUSE_MIN);
        self.pause = PAUSE_MIN;
    }

    /// The node counts as gone until its next birth.
    pub(super) fn bury(&mut self) {
        (self.is_born, self.is_complete) = (false, false);
    }

    /// When something is due without a message.
    pub(super) fn due(&self) -> Option<Uptime> {
        self.lost_at.into_iter().chain(self.ask_at.filter(|_| self.is_born && !self.is_complete)).min()
    }

    /// Does what is due.
    pub(super) fn pass(&mut self, now: Uptime, steps: Steps<'_>) {
        if self.lost_at.is_some_and(|at| at <= now) {
            self.give_up(now, steps);
        }
        if self.is_born && !self.is_complete {
            self.ask(now, steps);
        }
    }

    /// Takes in a message of the node (`None`) or of a device.
    pub(super) fn take(
        &mut self,
        kind: Kind,
        device: Option<&str>,
        bytes: &Bytes,
        now: Uptime,
        steps: Steps<'_>,
    ) {
        let Some(payload) = Payload::read(bytes) else { return steps(Step::Unreadable) };
        match kind {
            Kind::NodeBirth => return self.be_born(&payload, bytes, now, steps),
            Kind::NodeDeath => return self.die(&payload, steps),
            _ => {}
        }
        let seq = seq(&payload);
        let ahead = self.next.map_or(0, |next| seq.wrapping_sub(next));
        if ahead == 0 {
            self.next = Some(seq.wrapping_add(1));
            self.accept(kind, device, bytes, now, steps);
            self.catch_up(now, steps);
        } else if self.reorder.is_zero() || !self.is_complete {
            self.miss(now, steps);
            self.next = Some(seq.wrapping_add(1));
            self.accept(kind, device, bytes, now, steps);
        } else {
            self.lost_at.get_or_insert(now + self.reorder);
            let waiting = Waiting { kind, device: device.map(str::to_owned), payload: bytes.clone() };
            self.early.insert(ahead, waiting);
            if self.early.len() > WAITING_MAX {
                self.give_up(now, steps);
            }
        }
    }

    fn be_born(&mut self, payload: &Payload<'_>, bytes: &Bytes, now: Uptime, steps: Steps<'_>) {
        let Followed { reorder, ask_at, pause, .. } = *self;
        *self = Followed { is_born: true, is_complete: true, ask_at, pause, ..Followed::new(reorder) };
        self.next = Some(seq(payload).wrapping_add(1));
        self.bd_seq = bd_seq(payload);
        self.learn(None, payload);
        self.deliver(None, bytes, now, steps);
    }

    fn die(&mut self, payload: &Payload<'_>, steps: Steps<'_>) {
        let numbers = bd_seq(payload).zip(self.bd_seq);
        if self.is_born && numbers.is_some_and(|(of_death, of_birth)| of_death != of_birth) {
            // The death of an earlier session, which the broker sends late.
            return;
        }
        self.bury();
        steps(Step::Stale { device: None, because: NODE_DEAD });
    }

    /// Takes in the messages that have waited for the one that has just come.
    fn catch_up(&mut self, now: Uptime, steps: Steps<'_>) {
        let mut passed = 1_u8;
        while let Some(Waiting { kind, device, payload }) = self.early.remove(&passed) {
            self.next = self.next.map(|next| next.wrapping_add(1));
            self.accept(kind, device.as_deref(), &payload, now, steps);
            passed = passed.wrapping_add(1);
        }
        let early = std::mem::take(&mut self.early);
        self.early = early.into_iter().map(|(ahead, it)| (ahead.wrapping_sub(passed), it)).collect();
        self.lost_at = self.lost_at.filter(|_| !self.early.is_empty());
    }

    /// The missing message is lost: the others go on without it.
    fn give_up(&mut self, now: Uptime, steps: Steps<'_>) {
        self.lost_at = None;
        self.miss(now, steps);
        let next = self.next.unwrap_or(0);
        for (ahead, Waiting { kind, device, payload }) in std::mem::take(&mut self.early) {
            self.next = Some(next.wrapping_add(ahead).wrapping_add(1));
            self.accept(kind, device.as_deref(), &payload, now, steps);
        }
    }

    /// A message is missing.
    fn miss(&mut self, now: Uptime, steps: Steps<'_>) {
        self.is_complete = false;
        self.ask(now, steps);
    }

    /// Asks for births, unless that was done a moment ago.
    fn ask(&mut self, now: Uptime, steps: Steps<'_>) {
        if self.ask_at.is_some_and(|at| at > now) {
            return;
        }
        if self.ask_at.is_none_or(|at| now.saturating_duration_since(at) > PAUSE_MAX) {
            self.pause = PAUSE_MIN;
        }
        self.ask_at = Some(now + self.pause);
        self.pause = (self.pause * 2).min(PAUSE_MAX);
        steps(Step::AskRebirth);
    }

    /// Takes in a message in its order.
    fn accept(&mut self, kind: Kind, device: Option<&str>, bytes: &Bytes, now: Uptime, steps: Steps<'_>) {
        if !self.is_born {
            self.ask(now, steps);
        }
        match (kind, device) {
            (Kind::DeviceDeath, Some(name)) => {
                self.metrics.remove(name);
                steps(Step::Stale { device, because: DEVICE_DEAD });
            }
            (Kind::DeviceBirth, Some(_)) => {
                if let Some(birth) = Payload::read(bytes) {
                    self.learn(device, &birth);
                }
                self.deliver(device, bytes, now, steps);
            }
            _ => self.deliver(device, bytes, now, steps),
        }
    }

    /// Learns the metrics of a birth.
    fn learn(&mut self, device: Option<&str>, birth: &Payload<'_>) {
        let key = device.unwrap_or_default();
        self.metrics.remove(key);
        let count: usize = self.metrics.values().map(|metrics| metrics.types.len()).sum();
        if self.metrics.len() > DEVICES_MAX {
            return;
        }
        let mut metrics = Metrics::default();
        for metric in birth.metrics().take(METRICS_MAX.saturating_sub(count)) {
            let Some(name) = metric.name else { continue };
            metrics.types.insert(name.into(), metric.data_type.unwrap_or(DataType::UINT64));
            if let Some(alias) = metric.alias {
                metrics.aliases.insert(alias, name.into());
            }
        }
        self.metrics.insert(key.into(), metrics);
    }

    /// Delivers the metrics of a payload: those that a birth has declared, and those that need no birth, since some edge nodes
    /// answer no request. Asks for births where there is any that no birth has declared.
    fn deliver(&mut self, device: Option<&str>, bytes: &Bytes, now: Uptime, steps: Steps<'_>) {
        let Some(payload) = Payload::read(bytes) else { return };
        let (of_birth, is_complete) = (self.metrics.get(device.unwrap_or_default()), self.is_complete);
        let declared = |metric: &Metric<'_>| of_birth?.known(metric, is_complete);
        let known = |metric: &Metric<'_>| declared(metric).or_else(|| by_itself(metric));
        let (mut is_whole, mut is_declared, mut is_empty) = (true, true, true);
        for metric in payload.metrics() {
            is_whole &= by_itself(&metric).is_some();
            is_declared &= declared(&metric).is_some();
            is_empty &= known(&metric).is_none();
        }
        if !is_empty {
            let payload = if is_whole { bytes.clone() } else { resolved(bytes, known).into() };
            steps(Step::Deliver { device, payload });
        }
        if !is_declared {
            self.ask(now, steps);
        }
    }
}

/// A metric that has a name, and a type where that matters.
fn by_itself(metric: &Metric<'_>) -> Option<Known<'static>> {
    let data_type = metric.data_type.unwrap_or(DataType::UINT64);
    // Its own name stays.
    (metric.name.is_some() && !metric.lacks_type()).then_some(Known { name: "", data_type })
}

impl Metrics {
    /// What the birth has declared of a metric; an alias counts only while no birth can be missing.
    fn known(&self, metric: &Metric<'_>, is_complete: bool) -> Option<Known<'_>> {
        let alias = metric.alias.filter(|_| is_complete);
        let name = match metric.name {
            Some(name) => name,
            None => self.aliases.get(&alias?)?,
        };
        let (name, data_type) = self.types.get_key_value(name)?;
        Some(Known { name, data_type: *data_type })
    }
}

/// The sequence number. Encoders that leave out zeros leave it out where it is 0.
fn seq(payload: &Payload<'_>) -> u8 {
    payload.seq.and_then(|seq| u8::try_from(seq).ok()).unwrap_or(0)
}

/// The number that relates births and deaths.
fn bd_seq(payload: &Payload<'_>) -> Option<u64> {
    let number = payload.metrics().find(|metric| metric.name == Some(BD_SEQ))?.number()?;
    (0.0..=255.0).contains(&number).then_some(number as u64)
}

#[cfg(test)]
mod tests;
