//! The received messages of one topic.

use shsa_bridge::payload::{Content, Leaf, Unreadable, explore};
use shsa_bridge::{Message, Payload, PublisherId, Quality};
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// The number of messages whose fields are read from the first one on; of later ones only the last is read.
const EXPLORED_MAX: u64 = 100;
/// The most publishers that are counted.
const PUBLISHERS_MAX: usize = 16;

/// The messages of one topic.
#[derive(Default)]
pub(super) struct TopicRecord {
    /// Messages that were sent during the scan.
    pub(super) count: u64,
    /// Messages that the bus had kept from before.
    pub(super) kept: u64,
    first: Option<Time>,
    pub(super) last: Option<Time>,
    /// The longest time between two messages, nanoseconds.
    longest_gap: i64,
    pub(super) message_type: Option<Arc<str>>,
    pub(super) publishers: BTreeSet<PublisherId>,
    pub(super) quality: Option<Quality>,
    /// In the order in which they were first seen.
    pub(super) fields: Vec<Leaf>,
    pub(super) unreadable: Option<Unreadable>,
    pub(super) last_message: Option<Message>,
    /// When numbers were received, with their values, by their paths; for a draft.
    values: BTreeMap<String, Vec<(Time, f64)>>,
}

impl TopicRecord {
    /// Takes in a message, and keeps its numbers as long as there is `room` for them.
    pub(super) fn take(&mut self, message: Message, room: &mut usize) {
        if message.retained {
            self.kept += 1;
        } else {
            self.count += 1;
            let now = message.received;
            if let Some(before) = self.last.replace(now) {
                self.longest_gap = self.longest_gap.max(now.0.saturating_sub(before.0));
            }
            self.first.get_or_insert(now);
        }
        if self.publishers.len() < PUBLISHERS_MAX {
            self.publishers.extend(message.publisher);
        }
        self.quality = message.quality.or(self.quality);
        self.message_type = message.message_type.clone().or_else(|| self.message_type.take());
        if *room > 0 || self.count + self.kept <= EXPLORED_MAX {
            self.explore(&message, room);
        }
        self.last_message = Some(message);
    }

    /// Keeps the number of a field, if there is room for it.
    fn keep(&mut self, received: Time, leaf: &Leaf, room: &mut usize) {
        let Content::Value(RawValue::Number(number)) = leaf.content else { return };
        let Some(less) = room.checked_sub(1) else { return };
        *room = less;
        match self.values.get_mut(&leaf.path) {
            Some(values) => values.push((received, number)),
            None => _ = self.values.insert(leaf.path.clone(), vec![(received, number)]),
        }
    }

    /// The values of a field that were kept, with the times of their reception.
    pub(super) fn values(&self, path: &str) -> &[(Time, f64)] {
        self.values.get(path).map_or(&[], Vec::as_slice)
    }

    /// Reads the fields of the last message, if that has not been done.
    pub(super) fn finish(&mut self) {
        if self.count + self.kept > EXPLORED_MAX
            && let Some(message) = self.last_message.clone()
        {
            self.explore(&message, &mut 0);
        }
    }

    fn explore(&mut self, message: &Message, room: &mut usize) {
        match explore(message) {
            Err(unreadable) => self.unreadable = Some(unreadable),
            Ok(leaves) => {
                for leaf in leaves {
                    if !message.retained {
                        self.keep(message.received, &leaf, room);
                    }
                    self.update(leaf);
                }
            }
        }
    }

    fn update(&mut self, leaf: Leaf) {
        match self.fields.iter_mut().find(|known| known.path == leaf.path) {
            Some(known) => known.content = leaf.content,
            None => self.fields.push(leaf),
        }
    }

    /// The rate in messages a second; `None` for fewer than two.
    pub(super) fn rate_hz(&self) -> Option<f64> {
        let passed = self.last?.0.checked_sub(self.first?.0)?;
        (self.count > 1 && passed > 0).then(|| (self.count - 1) as f64 * 1e9 / passed as f64)
    }

    /// The longest time between two messages in seconds; `None` for fewer than two.
    pub(super) fn longest_gap_s(&self) -> Option<f64> {
        (self.count > 1).then_some(self.longest_gap as f64 / 1e9)
    }

    /// Whether the messages are not encoded.
    pub(super) fn is_value(&self) -> bool {
        self.last_message.as_ref().is_some_and(|message| message.value().is_some())
    }

    /// The type if the bus gives it, else the form of the payload.
    pub(super) fn form(&self) -> String {
        if let Some(message_type) = &self.message_type {
            return message_type.to_string();
        }
        let is_plain = self.fields.iter().all(|leaf| leaf.path.is_empty());
        let is_text = |leaf: &Leaf| !matches!(leaf.content, Content::Value(_));
        let form = match self.last_message.as_ref().map(|message| &message.payload) {
            Some(Payload::Value(_)) => "value",
            Some(Payload::Bytes(bytes)) if bytes.is_empty() => "empty",
            _ if self.fields.is_empty() => "unreadable",
            _ if !is_plain => "JSON",
            _ if self.fields.iter().all(is_text) => "text",
            _ => "number",
        };
        form.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(milliseconds: i64, payload: &str, retained: bool) -> Message {
        let payload = Payload::Bytes(payload.to_owned().into());
        Message { retained, ..Message::new("a".into(), Time(milliseconds * 1_000_000), payload) }
    }

    fn topic_record(messages: &[(i64, &str, bool)]) -> TopicRecord {
        let mut topic_record = TopicRecord::default();
        messages
            .iter()
            .for_each(|(at, payload, retained)| topic_record.take(message(*at, payload, *retained), &mut 0));
        topic_record.finish();
        topic_record
    }

    #[test]
    fn rates_and_gaps_are_those_of_what_was_sent_meanwhile() {
        let topic_record =
            topic_record(&[(0, "1", true), (1000, "2", false), (1100, "3", false), (1300, "4", false)]);
        assert_eq!((topic_record.count, topic_record.kept), (3, 1));
        assert_eq!(
            (topic_record.rate_hz().unwrap(), topic_record.longest_gap_s().unwrap()),
            (2.0 / 0.3, 0.2)
        );
        assert_eq!(topic_record.form(), "number");
    }

    #[test]
    fn one_message_has_no_rate() {
        let topic_record = topic_record(&[(5, "{\"x\": \"on\"}", false)]);
        assert_eq!(
            (topic_record.rate_hz(), topic_record.longest_gap_s(), topic_record.form()),
            (None, None, "JSON".to_owned())
        );
    }

    #[test]
    fn fields_of_all_messages_are_reported_with_their_last_values() {
        let topic_record = topic_record(&[
            (0, "{\"x\": 1}", false),
            (1, "{\"y\": 2}", false),
            (2, "{\"x\": 3}", false),
            (3, "{", false),
        ]);
        let fields: Vec<String> =
            topic_record.fields.iter().map(|leaf| format!("{} {:?}", leaf.path, leaf.content)).collect();
        assert_eq!(fields, ["x Value(Number(3.0))", "y Value(Number(2.0))"]);
        assert!(topic_record.unreadable.is_some());
    }
}
