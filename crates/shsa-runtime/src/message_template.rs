//! Writes values in the form of a signal's own messages: the last sound message is the template.

use crate::error::{RuntimeError, unfit};
use shsa_bridge::payload::{SIZE_LIMIT, Writer};
use shsa_bridge::{Bridge, Message, Payload, Provenance};
use shsa_core::engine::PublishedValue;
use shsa_core::interval::Interval;
use shsa_core::knowledge::{KnowledgeBase, Scaling, SignalId};
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use shsa_core::unit::Unit;
use shsa_message::source::Source;
use std::sync::Arc;

/// Writes values as messages of one signal.
#[derive(Clone, Debug)]
pub(super) struct MessageTemplate {
    signal: SignalId,
    topic: Arc<str>,
    unit: Option<Unit>,
    scaling: Option<Scaling>,
    writer: Writer,
    pattern: Option<Pattern>,
    /// Whether the type of the messages was advertised.
    is_advertised: bool,
}

/// The form of a signal's messages.
#[derive(Clone, Debug, PartialEq)]
enum Pattern {
    /// Within one process, a message is a value.
    Value,
    /// Bytes, with the type if the transport gives it.
    Bytes(Option<Arc<str>>),
}

impl MessageTemplate {
    /// # Errors
    /// When the signal's source names no topic and field.
    pub(super) fn new(knowledge: &KnowledgeBase, id: SignalId) -> Result<MessageTemplate, RuntimeError> {
        let signal = &knowledge.signals()[id];
        let text = if signal.source.is_empty() { &signal.name } else { &signal.source };
        let source: Source =
            text.parse().map_err(|why| unfit(format!("the source of {}: {why}", signal.name)))?;
        let (topic, field) = source.on_bus();
        let writer = Writer::like(field, SIZE_LIMIT)?;
        Ok(MessageTemplate {
            signal: id,
            topic,
            unit: signal.unit.clone(),
            scaling: signal.scaling,
            writer,
            pattern: None,
            is_advertised: false,
        })
    }

    /// The signal whose messages are copied.
    pub(super) fn signal(&self) -> SignalId {
        self.signal
    }

    /// The topic of the signal's messages.
    pub(super) fn topic(&self) -> &Arc<str> {
        &self.topic
    }

    /// Takes a message with a sound value of the signal as the template.
    pub(super) fn learn(&mut self, message: &Message) {
        self.pattern = Some(match &message.payload {
            Payload::Value(_) => Pattern::Value,
            Payload::Bytes(_) => Pattern::Bytes(message.message_type.clone()),
        });
        self.writer.learn_message(message);
    }

    /// The template after learning a message.
    pub(super) fn taught(mut self, message: &Message) -> MessageTemplate {
        self.learn(message);
        self
    }

    /// Whether there is a message to copy.
    pub(super) fn is_known(&self) -> bool {
        self.pattern.is_some()
    }

    /// The last message; `None` if there is none, or if values are not encoded.
    pub(super) fn remembered(&self) -> Option<Message> {
        let Some(Pattern::Bytes(message_type)) = &self.pattern else { return None };
        let payload = Payload::Bytes(self.writer.pattern()?.clone());
        Some(Message {
            message_type: message_type.clone(),
            ..Message::new(self.topic.clone(), Time(0), payload)
        })
    }

    /// The payload of a value under a topic; `None` if the message's form cannot express the value.
    ///
    /// # Errors
    /// When no message of the signal is known yet, the value does not fit into the message, or the bus refuses its type.
    pub(super) fn message(
        &mut self,
        topic: &str,
        value: &PublishedValue,
        stamp: Time,
        provenance: &Provenance,
        bridge: &mut dyn Bridge,
    ) -> Result<Option<Payload>, String> {
        let value = raw(value, self.unit.as_ref(), self.scaling);
        if self.pattern == Some(Pattern::Value) {
            return Ok(Some(Payload::Value(value)));
        }
        let written = self.writer.write(Some(&value), stamp, provenance).map_err(|why| why.to_string())?;
        if let (false, Some(Pattern::Bytes(Some(message_type)))) = (self.is_advertised, &self.pattern) {
            bridge.advertise(topic, message_type).map_err(|why| why.to_string())?;
            self.is_advertised = true;
        }
        Ok(written.map(Payload::Bytes))
    }
}

/// A value in the unit and with the scaling of the signal.
pub(super) fn raw(value: &PublishedValue, unit: Option<&Unit>, scaling: Option<Scaling>) -> RawValue {
    let in_unit = |value: f64| unit.map_or(value, |unit| unit.from_si(value));
    let shown = |value: f64| scaling.map_or(in_unit(value), |scaling| scaling.reading(in_unit(value)));
    match value {
        PublishedValue::Scalar(value) => {
            let (one, other) = (shown(value.lo()), shown(value.hi()));
            RawValue::Interval { lo: one.min(other), hi: one.max(other) }
        }
        PublishedValue::Vector(elements) => {
            RawValue::Vector(elements.iter().map(|element: &Interval| shown(element.midpoint())).collect())
        }
    }
}
