//! The inputs of a service: the latest fresh value of each.

use anyhow::{Context, anyhow};
use shsa_bridge::payload::{Reader, SIZE_LIMIT};
use shsa_bridge::{Clock, Message, Quality};
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};
use shsa_message::source::Field;
use shsa_message::source::Source;
use std::collections::BTreeMap;
use std::sync::Arc;

/// All inputs.
#[derive(Debug)]
pub(super) struct Ports {
    ports: Vec<Port>,
    topics: BTreeMap<Arc<str>, (Reader, Vec<usize>)>,
    /// The number of unreadable payloads, and the reason for the last one.
    pub(super) unreadable: u64,
    pub(super) because: Option<String>,
}

/// One input.
#[derive(Clone, Debug)]
struct Port {
    max_age: Option<Span>,
    /// The latest value, its time, and the quality given by its publisher.
    latest: Option<(RawValue, Time, Option<Quality>)>,
    is_new: bool,
}

impl Ports {
    /// Inputs as `TOPIC#FIELD`; `max_ages` is empty, one for all, or one for each.
    ///
    /// # Errors
    /// When a text names no topic and field, or the ages do not fit the inputs.
    pub(super) fn new(inputs: &[String], max_ages: &[Span]) -> anyhow::Result<Ports> {
        if max_ages.len() > 1 && max_ages.len() != inputs.len() {
            return Err(anyhow!(
                "{} greatest ages for {} inputs: give one for all, or one for each",
                max_ages.len(),
                inputs.len()
            ));
        }
        let mut fields: BTreeMap<Arc<str>, (Vec<Field>, Vec<usize>)> = BTreeMap::new();
        for (at, text) in inputs.iter().enumerate() {
            let source: Source = text.parse().map_err(|why| anyhow!("the input {text}: {why}"))?;
            let (topic, field) = source.on_bus();
            let (list, ports) = fields.entry(topic).or_default();
            list.push(field);
            ports.push(at);
        }
        let reader = |(topic, (fields, ports)): (Arc<str>, (Vec<Field>, Vec<usize>))| {
            let reader =
                Reader::new(&fields, SIZE_LIMIT).with_context(|| format!("the fields of {topic}"))?;
            Ok((topic, (reader, ports)))
        };
        let topics = fields.into_iter().map(reader).collect::<anyhow::Result<_>>()?;
        let max_age = |at: usize| max_ages.get(at).or(max_ages.first()).copied();
        let port = |at: usize| Port { max_age: max_age(at), latest: None, is_new: false };
        Ok(Ports { ports: (0..inputs.len()).map(port).collect(), topics, unreadable: 0, because: None })
    }

    /// Every topic once.
    pub(super) fn topics(&self) -> impl Iterator<Item = &Arc<str>> {
        self.topics.keys()
    }

    /// Takes a message in; returns the time of its newest value, by our clock. A value older than the latest one is ignored.
    pub(super) fn receive(&mut self, message: &Message, clock: &Clock) -> Option<Time> {
        let (reader, places) = self.topics.get_mut(&message.topic)?;
        let (ports, unreadable, because) = (&mut self.ports, &mut self.unreadable, &mut self.because);
        let mut newest = None;
        reader.read(message, |field, reading| {
            let Some(port) = places.get(field).and_then(|at| ports.get_mut(*at)) else { return };
            let reading = match reading {
                Ok(reading) => reading,
                Err(why) => {
                    *unreadable += 1;
                    *because = Some(format!("{}: {why}", message.topic));
                    return;
                }
            };
            let received = message.received;
            let stamp = reading.stamp.or(message.stamp);
            let stamp = stamp.map_or(received, |stamp| clock.steady(stamp, received));
            if port.latest.as_ref().is_some_and(|(_, before, _)| *before > stamp) {
                return;
            }
            port.latest = Some((reading.value, stamp, message.quality));
            port.is_new = true;
            newest = newest.max(Some(stamp));
        });
        newest
    }

    /// Whether every input has ever had a value.
    pub(super) fn are_known(&self) -> bool {
        self.ports.iter().all(|port| port.latest.is_some())
    }

    /// Whether every input has had a new value since [`Ports::use_up`].
    pub(super) fn are_new(&self) -> bool {
        self.ports.iter().all(|port| port.is_new)
    }

    /// Marks the present values as used.
    pub(super) fn use_up(&mut self) {
        self.ports.iter_mut().for_each(|port| port.is_new = false);
    }

    /// The latest values; `None` for those that are too old.
    pub(super) fn values(&self, now: Time) -> Vec<Option<&RawValue>> {
        let is_fresh = |port: &Port, stamp: Time| port.max_age.is_none_or(|most| now - stamp <= most);
        let value =
            |port: &Port| port.latest.as_ref().filter(|(_, stamp, _)| is_fresh(port, *stamp)).is_some();
        let fresh = self.ports.iter().map(|port| if value(port) { port.latest.as_ref() } else { None });
        fresh.map(|latest| latest.map(|(value, ..)| value)).collect()
    }

    /// The worst quality given by a publisher: the results are no better.
    pub(super) fn quality(&self) -> Quality {
        let rank = |quality: &Quality| Quality::ALL.iter().position(|known| known == quality);
        let qualities = self.ports.iter().filter_map(|port| port.latest.as_ref()?.2);
        qualities.max_by_key(rank).unwrap_or(Quality::Good)
    }
}
