//! The signals of a model on the bus: turns messages into observations.

use crate::error::{Context, RuntimeError, unfit};
use crate::held_back::{HeldBack, Rhythm};
use shsa_bridge::payload::{Reader, Reading, SIZE_LIMIT, Unreadable};
use shsa_bridge::{Clock, Message, Payload, Quality, SourceClock};
use shsa_core::knowledge::{IdVec, KnowledgeBase, SignalId};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::Time;
use shsa_message::source::{Field, Source};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The signals of a model, topic by topic.
#[derive(Debug, Default)]
pub struct Inputs {
    topics: BTreeMap<Arc<str>, Bundle>,
    ends: IdVec<SignalId, End>,
}

/// The fields that are read from one topic.
#[derive(Debug)]
struct Bundle {
    reader: Reader,
    /// The signal of each field of the reader.
    signals: Vec<SignalId>,
    /// A signal reads the level that another instance gives with its values, so that contracts judge its substitutes.
    reads_level: bool,
}

/// The field that tells the level of a value (see [`Provenance`](shsa_bridge::Provenance)).
const LEVEL: &str = "rank";

impl Bundle {
    /// Whether a message is about the signals: a value of their own source, or a substitute whose level is read with it.
    fn takes(&self, quality: Quality) -> bool {
        quality == Quality::Good || self.reads_level && quality == Quality::Substitute
    }
}

/// The state of one signal's messages.
#[derive(Clone, Debug, Default)]
struct End {
    /// A value equal to the one before is no observation.
    only_changes: bool,
    last: Option<RawValue>,
    /// Detects messages held back while the signal was silent.
    rhythm: Rhythm,
    /// Whether its stamps follow steps of our wall clock.
    stamps: SourceClock,
    /// The number of unreadable messages, and the reason for the last one.
    unreadable: u64,
    because: Option<Unreadable>,
}

impl Inputs {
    /// # Errors
    /// When a signal's source names no topic and field.
    pub fn new(knowledge: &KnowledgeBase) -> Result<Inputs, RuntimeError> {
        let mut fields: BTreeMap<Arc<str>, Vec<(Field, SignalId)>> = BTreeMap::new();
        let mut ends = IdVec::filled(knowledge.signals().len(), |_| End::default());
        // A fused signal is computed here, not received.
        for (id, signal) in knowledge.signals().enumerate().filter(|(id, _)| !knowledge.is_computed(*id)) {
            let text = if signal.source.is_empty() { &signal.name } else { &signal.source };
            let source: Source =
                text.parse().map_err(|why| unfit(format!("the source of {}: {why}", signal.name)))?;
            ends[id].only_changes = source.changed;
            if !source.changed {
                ends[id].rhythm = Rhythm::new(signal);
            }
            let (topic, field) = source.on_bus();
            fields.entry(topic).or_default().push((field, id));
        }
        let bundle = |(topic, fields): (Arc<str>, Vec<(Field, SignalId)>)| {
            let (fields, signals): (Vec<_>, Vec<_>) = fields.into_iter().unzip();
            let reader =
                Reader::new(&fields, SIZE_LIMIT).with_context(|| format!("the fields of {topic}"))?;
            let reads_level = fields.iter().any(|field| field.path == LEVEL);
            Ok((topic, Bundle { reader, signals, reads_level }))
        };
        let topics = fields.into_iter().map(bundle).collect::<Result<_, RuntimeError>>()?;
        Ok(Inputs { topics, ends })
    }

    /// Every topic once.
    pub(super) fn topics(&self) -> impl Iterator<Item = &Arc<str>> {
        self.topics.keys()
    }

    /// The number of a signal's unreadable messages, and the reason for the last one.
    pub fn unreadable(&self, signal: SignalId) -> (u64, Option<String>) {
        let end = &self.ends[signal];
        (end.unreadable, end.because.as_ref().map(ToString::to_string))
    }

    /// Signals that returned from a silence with messages held back; each is reported once. O(signals).
    pub(super) fn backlogs(&mut self, now: Time) -> impl Iterator<Item = (SignalId, HeldBack)> {
        let ends = &mut self.ends;
        ends.ids().filter_map(move |signal| Some((signal, ends[signal].rhythm.take_over(now)?)))
    }

    /// The observations in a message. An unreadable field gives an invalid value. Another instance's substitute is no observation
    /// of the signal whose name it takes, unless a signal reads the level that comes with it. Nor is a message without a stamp that
    /// was retained or held back while the signal was silent.
    pub fn read(&mut self, message: &Message, clock: &Clock, mut each: impl FnMut(Observation)) {
        let Some(bundle) = self.topics.get_mut(&message.topic) else { return };
        if message.quality.is_some_and(|quality| !bundle.takes(quality)) {
            return;
        }
        let Bundle { reader, signals, .. } = bundle;
        let ends = &mut self.ends;
        let mut take = |signal: SignalId, reading: Result<Reading, Unreadable>| {
            let (value, stamp) = match reading {
                Ok(Reading { value, stamp }) => (value, stamp),
                Err(because) => {
                    ends[signal].unreadable += 1;
                    ends[signal].because = Some(because);
                    (RawValue::Number(f64::NAN), None)
                }
            };
            let stamp = stamp.or(message.stamp);
            let end = &mut ends[signal];
            let has_waited = stamp.is_none()
                && (end.rhythm.has_waited(message.received, message.retained) || message.retained);
            if end.repeats(&value) || has_waited {
                return;
            }
            let received = message.received;
            let stamp = stamp.map_or(received, |stamp| end.stamps.steady(clock, stamp, received));
            each(Observation { signal, stamp, received: message.received, value });
        };
        match &message.payload {
            // Within one process a topic carries the value itself.
            Payload::Value(value) => {
                let reading = |value: &RawValue| Reading { value: value.clone(), stamp: None };
                signals.iter().for_each(|signal| take(*signal, Ok(reading(value))));
            }
            Payload::Bytes(_) => reader.read(message, |field, reading| {
                if let Some(signal) = signals.get(field) {
                    take(*signal, reading);
                }
            }),
        }
    }
}

impl End {
    /// Whether this value equals the previous one, of a signal of which only changes count.
    fn repeats(&mut self, value: &RawValue) -> bool {
        if !self.only_changes {
            return false;
        }
        let repeats = self.last.as_ref() == Some(value);
        self.last = Some(value.clone());
        repeats
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODEL: &str = "
shsa: 1
variables: { speed: { unit: m/s }, place: { unit: m } }
signals:
  left:  { variable: speed, source: wheels#left@at }
  right: { variable: speed, source: wheels#right }
  where: { variable: place, source: place!changed }
";

    fn inputs() -> (KnowledgeBase, Inputs) {
        let loaded = shsa_model::load(MODEL, "test.yaml");
        assert!(loaded.report.ok(), "{}", loaded.report.render(false));
        let inputs = Inputs::new(&loaded.knowledge).unwrap();
        (loaded.knowledge, inputs)
    }

    /// The observations of a message: signal, stamp, value.
    fn read(knowledge: &KnowledgeBase, inputs: &mut Inputs, topic: &str, payload: &str) -> String {
        let payload = Payload::Bytes(payload.to_owned().into());
        described(knowledge, inputs, &Message::new(topic.into(), Time(70), payload))
    }

    fn described(knowledge: &KnowledgeBase, inputs: &mut Inputs, message: &Message) -> String {
        let mut described = Vec::new();
        inputs.read(message, &Clock::manual(), |observation| {
            let name = &knowledge.signals()[observation.signal].name;
            let RawValue::Number(number) = observation.value else { panic!("only numbers") };
            described.push(format!("{name}@{}={number}", observation.stamp.0));
        });
        described.join(" ")
    }

    #[test]
    fn one_message_may_carry_several_signals() {
        let (knowledge, mut inputs) = inputs();
        assert_eq!(inputs.topics().map(|topic| &**topic).collect::<Vec<_>>(), ["place", "wheels"]);
        let described = read(&knowledge, &mut inputs, "wheels", r#"{"left": 1.5, "right": 2, "at": 1e-7}"#);
        assert_eq!(described, "left@100=1.5 right@70=2");
        assert_eq!(read(&knowledge, &mut inputs, "elsewhere", "1"), "");
    }

    #[test]
    fn substitutes_and_values_of_unknown_age_are_no_evidence() {
        let (knowledge, mut inputs) = inputs();
        let payload = Payload::Bytes(r#"{"left": 1, "right": 2, "at": 1e-7}"#.into());
        let message = Message::new("wheels".into(), Time(70), payload);
        let substitute = Message { quality: Some(Quality::Substitute), ..message.clone() };
        assert_eq!(described(&knowledge, &mut inputs, &substitute), "");
        let good = Message { quality: Some(Quality::Good), ..message.clone() };
        assert_eq!(described(&knowledge, &mut inputs, &good), "left@100=1 right@70=2");
        let kept = Message { retained: true, ..message };
        assert_eq!(described(&knowledge, &mut inputs, &kept), "left@100=1");
    }

    #[test]
    fn a_substitute_counts_where_its_level_is_read() {
        let model = "shsa: 1\nvariables: { speed: { unit: m/s }, level: {} }\n\
            signals: { speed: { variable: speed, source: ahead#value }, level: { variable: level, source: ahead#rank } }\n";
        let loaded = shsa_model::load(model, "test.yaml");
        let (knowledge, mut inputs) = (loaded.knowledge.clone(), Inputs::new(&loaded.knowledge).unwrap());
        let payload = Payload::Bytes(r#"{"value": 20, "rank": 2}"#.into());
        let mut of = |quality| {
            let message = Message::new("ahead".into(), Time(70), payload.clone());
            described(&knowledge, &mut inputs, &Message { quality: Some(quality), ..message })
        };
        assert_eq!(of(Quality::Good), "speed@70=20 level@70=2");
        assert_eq!(of(Quality::Substitute), "speed@70=20 level@70=2");
        // Bounds of what nobody trusts are no value.
        assert_eq!([of(Quality::Uncertain), of(Quality::Bad)], ["", ""]);
    }

    #[test]
    fn a_message_carries_its_own_stamp_in_three_ways() {
        #[track_caller]
        fn check(source: &str, payload: &str, property: Option<Time>, expected: &str) {
            let model = format!(
                "shsa: 1\nvariables: {{ speed: {{ unit: m/s }} }}\n\
                 signals: {{ gnss: {{ variable: speed, source: '{source}' }} }}\n"
            );
            let loaded = shsa_model::load(&model, "test.yaml");
            let mut inputs = Inputs::new(&loaded.knowledge).unwrap();
            let message = Message::new("gnss".into(), Time(70), Payload::Bytes(payload.to_owned().into()));
            let message = Message { stamp: property, ..message };
            assert_eq!(described(&loaded.knowledge, &mut inputs, &message), expected);
        }
        let object = r#"{"value": 20, "stamp_ns": 60, "t": 5}"#;
        check("gnss#value@stamp_ns*1ns", object, None, "gnss@60=20");
        check("gnss#value@t*10ns", object, Some(Time(65)), "gnss@50=20");
        check("gnss", object, None, "gnss@60=20");
        check("gnss", "20", Some(Time(65)), "gnss@65=20");
        check("gnss#value", object, Some(Time(65)), "gnss@65=20");
        // A field that the source does not name is not read.
        check("gnss#value", object, None, "gnss@70=20");
        check("gnss", "20", None, "gnss@70=20");
    }

    #[test]
    fn what_cannot_be_read_is_invalid_and_counted_with_its_reason() {
        let (knowledge, mut inputs) = inputs();
        let described = read(&knowledge, &mut inputs, "wheels", r#"{"left": 1.5, "at": 1e-7}"#);
        assert_eq!(described, "left@100=1.5 right@70=NaN");
        assert_eq!(read(&knowledge, &mut inputs, "wheels", "{"), "left@70=NaN right@70=NaN");
        let right = knowledge.signal("right").unwrap();
        let (count, because) = inputs.unreadable(right);
        assert_eq!(count, 2);
        assert!(because.unwrap().contains("JSON"));
    }

    #[test]
    fn a_repetition_is_no_observation_where_only_changes_count() {
        let (knowledge, mut inputs) = inputs();
        let described = ["3", "3", "4"].map(|payload| read(&knowledge, &mut inputs, "place", payload));
        assert_eq!(described, ["where@70=3", "", "where@70=4"]);
    }
}
