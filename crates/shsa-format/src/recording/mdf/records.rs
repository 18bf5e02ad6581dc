//! The records of a data group: found in its bytes, and reported as messages or as frames of a bus.

use super::super::Place;
use super::super::can::{Bus, EXTENDED, Frame};
use super::super::topic::{Body, Field, Fields, Listener, Times, Topic, TopicId, Value};
use super::super::unpack::Budget;
use super::block::Blocks;
use super::channel::{Bits, Channel, Role};
use super::{DataGroup, FrameChannels, Group, data};
use shsa_core::time::{Span, Time};

/// How far the reader searches after damage, bytes.
const SEARCH_MAX: usize = 1 << 12;

/// The largest part of a record that waits for the next piece, bytes.
const WAITING_MAX: usize = 1 << 23;

/// Reports the records of a file.
pub(super) struct Reporter<'a> {
    start: Time,
    bus: Option<Bus>,
    /// How many values may be read, as many as bytes may be unpacked: channels may share their bytes.
    values: Budget,
    /// Whether that was reported to be too little.
    is_full: bool,
    listener: &'a mut dyn Listener,
}

impl<'a> Reporter<'a> {
    /// For a file of this many bytes, whose times count from `start`.
    pub(super) fn new(
        start: Time,
        bus: Option<Bus>,
        length: u64,
        listener: &'a mut dyn Listener,
    ) -> Reporter<'a> {
        Reporter { start, bus, values: Budget::of(length), is_full: false, listener }
    }

    /// Reports what was left out.
    pub(super) fn finish(self) {
        if let Some(bus) = self.bus {
            bus.finish(self.listener);
        }
    }

    /// Reports all records of a data group.
    pub(super) fn report_all(&mut self, all: &mut DataGroup, blocks: &mut Blocks<'_>, is_finished: bool) {
        let mut left: Vec<u8> = Vec::new();
        let data = all.data;
        data::pieces(blocks, data, is_finished, &mut |piece| match piece {
            Ok(bytes) => {
                self.append(all, &mut left, bytes);
                if left.len() > WAITING_MAX {
                    let problem = format!("a record of more than {} MiB, left out", WAITING_MAX >> 20);
                    self.listener.damaged(Place::Offset(data), problem);
                    left = Vec::new();
                }
            }
            Err((at, problem)) => self.listener.damaged(Place::Offset(at), problem),
        });
        if !left.is_empty() {
            let problem = format!("the last {} bytes of a data group are no whole record", left.len());
            self.listener.damaged(Place::Offset(data), problem);
        }
    }

    /// Reports the whole records of the bytes that were left and of the next ones; what is no whole record is left.
    fn append(&mut self, all: &mut DataGroup, left: &mut Vec<u8>, bytes: &[u8]) {
        if left.is_empty() {
            let taken = self.records(all, bytes);
            return left.extend_from_slice(bytes.get(taken..).unwrap_or_default());
        }
        left.extend_from_slice(bytes);
        let taken = self.records(all, left);
        left.drain(..taken);
    }

    /// Whether so many values of a record may still be read; reports the first time that they may not.
    fn has_room(&mut self, values: usize, data: u64) -> bool {
        if !self.is_full
            && let Err(problem) = self.values.take(values as u64)
        {
            self.listener.damaged(Place::Offset(data), format!("the other records are left out: {problem}"));
            self.is_full = true;
        }
        !self.is_full
    }

    /// Reports the whole records of these bytes; returns their length.
    fn records(&mut self, all: &mut DataGroup, bytes: &[u8]) -> usize {
        let mut at = 0;
        while let Some(rest) = bytes.get(at..).filter(|rest| rest.len() > all.id_length) {
            let Some(length) = all.length(rest) else {
                let searched = rest.len().min(SEARCH_MAX);
                let found = (1..searched).find(|at| rest.get(*at..).is_some_and(|rest| all.is_way(rest)));
                let lost = found.unwrap_or(searched);
                let problem = format!("{lost} bytes of a data group are no record");
                self.listener.damaged(Place::Offset(all.data), problem);
                at += lost;
                continue;
            };
            let Some(record) = rest.get(all.id_length..length) else { break };
            if let Some(group) = all.id(rest).and_then(|id| all.groups.get_mut(&id)) {
                self.record(group, record, all.data);
            }
            at += length;
        }
        at
    }

    fn record(&mut self, group: &mut Group, record: &[u8], data: u64) {
        if group.is_variable {
            return;
        }
        let number = group.count;
        group.count += 1;
        let value =
            |at: usize| group.channels.get(at).and_then(|it| it.value(record, number, group.data_length));
        // In a group without a time, records are a second apart.
        let since_s = group.time.map_or(Some(number as f64), value);
        let Some(since) = since_s.filter(|since| since.is_finite()) else { return };
        let time = self.start + Span::from_seconds(since);
        if let (Some(frame), Some(bus)) = (&group.frame, &mut self.bus) {
            return report_frame(group, frame, record, time, bus, self.listener);
        }
        let topic = *group
            .topic
            .get_or_insert_with(|| report_topic(&group.name, &group.full, &group.channels, self.listener));
        if self.listener.is_wanted(topic) && self.has_room(group.channels.len(), data) {
            let shown = (0..group.channels.len()).filter(|at| group.channels.get(*at).is_some_and(is_shown));
            let values: Vec<Value<'_>> = shown
                .map(|at| {
                    let value =
                        group.channels.get(at).and_then(|it| it.value(record, number, group.data_length));
                    value.map_or(Value::Missing, Value::Number)
                })
                .collect();
            self.listener.message(topic, Times::at(time), Body::Values(&values));
        }
    }
}

/// Whether a channel is a field, that is, a number.
fn is_shown(channel: &Channel) -> bool {
    channel.role != Role::Other
}

fn report_topic(name: &str, full: &str, channels: &[Channel], listener: &mut dyn Listener) -> TopicId {
    let field = |channel: &Channel| {
        let unit = (!channel.unit.is_empty()).then(|| channel.unit.clone());
        Field { name: channel.name.clone(), unit }
    };
    let fields = Fields::named(channels.iter().filter(|channel| is_shown(channel)).map(field));
    listener.topic(Topic { full, ..Topic::new(name, "MDF channel group", fields) })
}

fn report_frame(
    group: &Group,
    frame: &FrameChannels,
    record: &[u8],
    time: Time,
    bus: &mut Bus,
    listener: &mut dyn Listener,
) {
    let value =
        |at: usize| group.channels.get(at).and_then(|it| it.value(record, group.count, group.data_length));
    let whole = |at: Option<usize>| at.and_then(value).map(|value| value as u32);
    let Some(id) = whole(Some(frame.id)) else { return bus.pass() };
    let Some(bytes) = group.channels.get(frame.bytes) else { return bus.pass() };
    let room = if bytes.bits == Bits::Bytes { bytes.length / 8 } else { 0 };
    let length = whole(frame.length).map_or(room, |length| (length as usize).min(room));
    let is_extended = whole(frame.is_extended).map_or(id > 0x7ff, |flag| flag == 1);
    let id = if is_extended { id | EXTENDED } else { id };
    let channel = whole(frame.bus).map_or(group.name.clone(), |number| number.to_string());
    match record.get(bytes.byte..bytes.byte.saturating_add(length)) {
        Some(data) => bus.report(&Frame { time, channel: &channel, id, data }, listener),
        None => bus.pass(),
    }
}
