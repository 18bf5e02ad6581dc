//! ROS 2 over DDS, as most installations have it: a participant among the nodes, by RustDDS.
//!
//! Received payloads are CDR; the type is that of the publisher. What is published has the same forms as over Zenoh: a value is a
//! `std_msgs/msg/Float64` (a list a `Float64MultiArray`) unless the topic was [advertised](Bridge::advertise) with another type, as
//! `TYPE#FIELD` if the value is not its field `data`; a text is a `std_msgs/msg/String`. A topic that others publish keeps its type.
//!
//! Readers are best effort and volatile, and so accept every publisher; writers are reliable and volatile, and so are accepted by
//! every subscriber that asks for no earlier messages. A message of ROS cannot carry its provenance.
//!
//! RustDDS cannot bind to one interface: [`Interfaces`] are where we are announced and look for others, but datagrams from
//! everywhere are taken. It counts up to any sequence number that a heartbeat names, so a forged one takes memory without end.

mod bell;
mod raw;
mod network;
mod steps;
mod subscriptions;
mod reception;

pub use network::Interfaces;

use crate::ros::{Form, bare, check_name, dds_name, publish_diagnostics, type_for, unknown};
use crate::{Bridge, BridgeError, Diagnostic, Inbox, Link, Outgoing, Payload, PublisherId};
use bytes::Bytes;
use network::{Participant, Writer};
use reception::{Reception, Shared};
use rustdds::Timestamp;
use rustdds::dds::WriteError;
use shsa_core::time::Time;
use shsa_message::ros::{Types, full_name};
use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;
use std::thread::JoinHandle;

/// How to join the network.
#[derive(Clone, Debug)]
pub struct Options {
    /// Where to be found.
    pub interfaces: Interfaces,
    /// `ROS_DOMAIN_ID` of the nodes, at most 231.
    pub domain: u32,
    /// The known message types.
    pub types: Arc<Types>,
}

impl Default for Options {
    /// Domain 0 on the loopback interface, with the standard messages.
    fn default() -> Options {
        Options { interfaces: Interfaces::Loopback, domain: 0, types: Types::standard() }
    }
}

/// A participant of DDS among the nodes of ROS 2.
pub struct DdsBridge {
    outlets: BTreeMap<String, Outlet>,
    /// The participant of the outlets' writers.
    participant: Arc<Participant>,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

/// A topic that is published.
struct Outlet {
    form: Form,
    dds_type: String,
    /// `Some` while it is announced.
    writer: Option<Writer>,
}

impl fmt::Debug for DdsBridge {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("DdsBridge").field("options", &self.shared.options).finish_non_exhaustive()
    }
}

impl DdsBridge {
    /// Joins.
    ///
    /// # Errors
    /// When the options cannot be used, or no ports are free.
    pub fn open(options: &Options, inbox: Inbox) -> Result<DdsBridge, BridgeError> {
        let shared = Arc::new(Shared::new(options.clone(), inbox)?);
        let reception = Reception::new(shared.clone());
        let thread = std::thread::Builder::new().name("dds".into()).spawn(move || reception.run());
        let thread = thread.map_err(|error| BridgeError::Lost(format!("DDS: no thread: {error}")))?;
        let participant = shared.participant();
        Ok(DdsBridge { outlets: BTreeMap::new(), participant, shared, thread: Some(thread) })
    }

    /// The outlet of a topic: as advertised, else with the type that others publish, else with a type that fits the payload.
    fn advertise_for(&mut self, topic: &str, payload: &Payload) -> Result<(), BridgeError> {
        if self.outlets.contains_key(topic) {
            return Ok(());
        }
        match self.shared.type_of(bare(topic)) {
            Some(message_type) => self.advertise(topic, &message_type),
            None => self.advertise(topic, type_for(topic, payload)?),
        }
    }

    /// Announces the outlets anew after the participant was replaced.
    fn follow(&mut self) {
        let participant = self.shared.participant();
        if !Arc::ptr_eq(&participant, &self.participant) {
            self.outlets.values_mut().for_each(|outlet| outlet.writer = None);
            self.participant = participant;
        }
    }

    /// Writes a message to the subscribers of an outlet.
    fn write(&mut self, topic: &str, bytes: Bytes, stamp: Time) -> Result<(), BridgeError> {
        let lost = |why: String| BridgeError::Lost(format!("topic '{topic}': {why}"));
        let Some(outlet) = self.outlets.get_mut(topic) else { return Ok(()) };
        let types = &self.shared.options.types;
        let open = || self.participant.writer(bare(topic), &outlet.dds_type, types);
        let writer = match outlet.writer.take() {
            Some(writer) => writer,
            None => open()?,
        };
        let written = match writer.write(bytes, timestamp_of(stamp)) {
            Err(WriteError::WouldBlock { data }) => {
                // A subscriber has acknowledged nothing for thousands of messages. A new writer does not wait for it.
                drop(writer);
                let writer = open()?;
                let written = writer.write(data, timestamp_of(stamp));
                outlet.writer = Some(writer);
                written
            }
            written => {
                outlet.writer = Some(writer);
                written
            }
        };
        written.map_err(|error| lost(error.to_string()))
    }
}

impl Drop for DdsBridge {
    fn drop(&mut self) {
        self.shared.end();
        if let Some(thread) = self.thread.take() {
            let _panicked = thread.join();
        }
    }
}

impl Bridge for DdsBridge {
    /// The identity of the participant; a message has that of its writer.
    fn publisher(&self) -> PublisherId {
        PublisherId(u128::from_le_bytes(self.shared.participant().guid()))
    }

    fn inbox(&self) -> &Inbox {
        self.shared.inbox()
    }

    fn subscribe(&mut self, topic: &str, message_type: Option<&str>) -> Result<(), BridgeError> {
        check_name("topic", topic)?;
        self.shared.subscribe(|subscriptions| subscriptions.add(topic, message_type));
        Ok(())
    }

    fn subscribe_all(&mut self) -> Result<(), BridgeError> {
        self.shared.subscribe(|subscriptions| subscriptions.add_all());
        Ok(())
    }

    /// `TYPE`, or `TYPE#FIELD` to write values to another field than `data`.
    fn advertise(&mut self, topic: &str, message_type: &str) -> Result<(), BridgeError> {
        check_name("topic", topic)?;
        if self.outlets.contains_key(topic) {
            return Ok(());
        }
        self.follow();
        let (message_type, field) = message_type.split_once('#').unwrap_or((message_type, ""));
        let types = &self.shared.options.types;
        if types.members(&full_name(message_type)).is_err() {
            return Err(unknown(message_type));
        }
        let form = Form::new(message_type, field, types.clone())?;
        let dds_type = dds_name(message_type);
        let writer = self.participant.writer(bare(topic), &dds_type, types)?;
        self.outlets.insert(topic.to_owned(), Outlet { form, dds_type, writer: Some(writer) });
        Ok(())
    }

    fn publish(&mut self, message: Outgoing<'_>) -> Result<(), BridgeError> {
        self.follow();
        self.advertise_for(message.topic, &message.payload)?;
        let Some(outlet) = self.outlets.get(message.topic) else { return Ok(()) };
        let bytes = outlet.form.encode(&message)?;
        if !raw::is_sendable(&bytes) {
            let problem = "a message in the byte order of big machines cannot be passed on over DDS";
            return Err(BridgeError::Configuration(format!("topic '{}': {problem}", message.topic)));
        }
        self.write(message.topic, bytes, message.stamp)
    }

    fn diagnose(
        &mut self,
        stamp: Time,
        states: &mut dyn FnMut() -> Vec<Diagnostic>,
    ) -> Result<(), BridgeError> {
        publish_diagnostics(self, stamp, &states())
    }

    /// There is no connection that could be lost: others come and go.
    fn link(&self) -> Link {
        Link::Up
    }

    fn troubles(&mut self) -> Vec<BridgeError> {
        self.shared.troubles()
    }
}

const SECOND: u64 = 1_000_000_000;

/// A time as DDS writes it; `None` before 1970.
fn timestamp_of(time: Time) -> Option<Timestamp> {
    let time = u64::try_from(time.0).ok()?;
    let fraction = (((time % SECOND) << 32) + SECOND / 2) / SECOND;
    Some(Timestamp::from_ticks(((time / SECOND) << 32) + fraction))
}

fn time_of(timestamp: Timestamp) -> Time {
    let (seconds, fraction) = (timestamp.to_ticks() >> 32, timestamp.to_ticks() & 0xffff_ffff);
    let nanoseconds = ((fraction * SECOND) + (1 << 31)) >> 32;
    Time(i64::try_from(seconds * SECOND + nanoseconds).unwrap_or(i64::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_not_changed_on_the_way() {
        for time in [0, 1, 999_999_999, 1_000_000_000, 3_000_000_007, 1_790_000_000_123_456_789] {
            assert_eq!(timestamp_of(Time(time)).map(time_of), Some(Time(time)));
        }
        assert_eq!(timestamp_of(Time(-1)), None);
    }
}
