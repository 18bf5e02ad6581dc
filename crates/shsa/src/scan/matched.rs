//! Which signals of a model were received, and why others were not.

use super::topic_record::TopicRecord;
use shsa_bridge::{Clock, Message, Quality};
use shsa_core::knowledge::{IdVec, KnowledgeBase, SignalId};
use shsa_core::observation::RawValue;
use shsa_core::unit::nearest;
use shsa_message::path::Path;
use shsa_message::source::Source;
use shsa_runtime::inputs::Inputs;
use std::collections::BTreeMap;
use std::sync::Arc;

/// The signals of a model with their received messages.
pub(super) struct Matched {
    pub(super) knowledge: KnowledgeBase,
    inputs: Inputs,
    ends: IdVec<SignalId, End>,
}

/// The received messages of one signal.
#[derive(Clone, Default)]
pub(super) struct End {
    pub(super) topic: Arc<str>,
    pub(super) path: Path,
    /// The number of messages with the signal's field.
    pub(super) readable: u64,
    pub(super) value: Option<RawValue>,
}

/// A signal that was not received.
pub(super) struct Missing<'a> {
    pub(super) signal: &'a str,
    pub(super) source: &'a str,
    pub(super) because: String,
}

impl Matched {
    /// # Errors
    /// When a signal's source names no topic and field.
    pub(super) fn new(knowledge: KnowledgeBase) -> anyhow::Result<Matched> {
        let inputs = Inputs::new(&knowledge)?;
        let mut ends = IdVec::filled(knowledge.signals().len(), |_| End::default());
        for (id, _) in knowledge.signals().enumerate() {
            if let Ok(source) = source_of(&knowledge, id).parse::<Source>() {
                let (topic, field) = source.on_bus();
                ends[id] = End { topic, path: Path::parse(&field.path)?, ..End::default() };
            }
        }
        Ok(Matched { knowledge, inputs, ends })
    }

    pub(super) fn take(&mut self, message: &Message, clock: &Clock) {
        let Matched { inputs, ends, .. } = self;
        inputs.read(message, clock, |observation| {
            let end = &mut ends[observation.signal];
            end.readable += 1;
            end.value = Some(observation.value);
        });
    }

    /// Every signal with its received messages.
    pub(super) fn signals(&self) -> impl Iterator<Item = (SignalId, &End)> {
        let measured = self.knowledge.signals().ids().filter(|id| !self.knowledge.is_computed(*id));
        measured.map(|id| (id, &self.ends[id]))
    }

    /// The number of messages with a readable value of a signal: unreadable ones are observed as invalid values, and are not
    /// counted.
    pub(super) fn good(&self, id: SignalId) -> u64 {
        self.ends[id].readable.saturating_sub(self.inputs.unreadable(id).0)
    }

    /// The names of the signals that a field carries. A message without encoding has no fields, and carries all signals of its
    /// topic.
    pub(super) fn carried(&self, topic: &str, topic_record: &TopicRecord, path: &str) -> Vec<&str> {
        let path = Path::parse(path).unwrap_or_default();
        let is_field = |end: &End| topic_record.is_value() || end.path.steps == path.steps;
        let is_it = |(_, end): &(SignalId, &End)| *end.topic == *topic && is_field(end);
        self.signals().filter(is_it).map(|(id, _)| &*self.knowledge.signals()[id].name).collect()
    }

    /// The signals that no message carried.
    pub(super) fn missing<'a>(
        &'a self,
        topics: &'a BTreeMap<Arc<str>, TopicRecord>,
    ) -> impl Iterator<Item = Missing<'a>> + 'a {
        self.signals().filter(|(id, _)| self.good(*id) == 0).map(|(id, end)| Missing {
            signal: &self.knowledge.signals()[id].name,
            source: source_of(&self.knowledge, id),
            because: self.because(id, end, topics),
        })
    }

    fn because(&self, id: SignalId, end: &End, topics: &BTreeMap<Arc<str>, TopicRecord>) -> String {
        if let Some(topic_record) = topics.get(&end.topic) {
            return self.inputs.unreadable(id).1.unwrap_or_else(|| not_observed(topic_record));
        }
        let near = nearest(&end.topic, topics.keys().map(|topic| &**topic));
        let meant = near.map_or(String::new(), |near| format!("; did you mean {near}?"));
        format!("nothing on {}{meant}", end.topic)
    }
}

/// Why readable messages are no observations.
fn not_observed(topic_record: &TopicRecord) -> String {
    match topic_record.quality {
        _ if topic_record.count == 0 => "only messages that the bus had kept, of unknown age".to_owned(),
        Some(quality) if quality != Quality::Good => format!("its publisher says {quality}: no evidence"),
        _ => "no message meets its condition".to_owned(),
    }
}

/// The source of a signal; without one, its name.
fn source_of(knowledge: &KnowledgeBase, id: SignalId) -> &str {
    let signal = &knowledge.signals()[id];
    if signal.source.is_empty() { &signal.name } else { &signal.source }
}
