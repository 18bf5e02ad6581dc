//! The form of a topic's messages, and the conversion of payloads to it.

use crate::cdr::{Writer, text_message};
use crate::{BridgeError, Outgoing, Payload};
use bytes::Bytes;
use shsa_core::observation::RawValue;
use shsa_message::ros::{Body, Types, full_name};
use std::sync::Arc;

/// The type of texts.
const STRING: &str = "std_msgs/msg/String";

/// The type of a topic's messages, and where in them a value stands.
#[derive(Debug)]
pub(crate) struct Form {
    /// With its full name.
    pub(crate) message_type: String,
    /// `Some` if the type has a field for values.
    writer: Option<Writer>,
}

impl Form {
    /// Messages of this type with values in this field; empty: the field `data`, if there is one.
    ///
    /// # Errors
    /// When a named field does not exist or holds no number.
    pub(crate) fn new(message_type: &str, field: &str, types: Arc<Types>) -> Result<Form, BridgeError> {
        let message_type = full_name(message_type).into_owned();
        let writer = match Writer::new(&message_type, field, types) {
            Err(problem) if !field.is_empty() => return Err(problem),
            writer => writer.ok().filter(|_| message_type != STRING),
        };
        Ok(Form { message_type, writer })
    }

    /// The message for a payload: values are written, CDR is passed on, texts become messages of one text.
    pub(crate) fn encode(&self, message: &Outgoing<'_>) -> Result<Bytes, BridgeError> {
        let (topic, message_type) = (message.topic, &self.message_type);
        let wrong = |what: String| BridgeError::Configuration(format!("topic '{topic}': {what}"));
        match (&message.payload, &self.writer) {
            (Payload::Value(value), Some(writer)) => writer
                .write(value, message.stamp)
                .map_err(|problem| wrong(format!("{message_type}: {problem}"))),
            (Payload::Value(_), None) => {
                Err(wrong(format!("say which field of {message_type} is the value: {message_type}#FIELD")))
            }
            (Payload::Bytes(bytes), _) if is_cdr(bytes) => Ok(bytes.clone()),
            (Payload::Bytes(bytes), _) if message_type == STRING => Ok(text_message(bytes)),
            (Payload::Bytes(_), _) => Err(wrong(format!("these bytes are no message of {message_type}"))),
        }
    }
}

/// The type of a topic whose type is unknown, by the payload to be sent.
pub(crate) fn type_for(topic: &str, payload: &Payload) -> Result<&'static str, BridgeError> {
    match payload {
        Payload::Value(RawValue::Vector(_)) => Ok("std_msgs/msg/Float64MultiArray"),
        Payload::Value(_) => Ok("std_msgs/msg/Float64"),
        Payload::Bytes(bytes) if !is_cdr(bytes) => Ok(STRING),
        Payload::Bytes(_) => {
            let problem = format!("topic '{topic}': advertise it with the type of its messages");
            Err(BridgeError::Configuration(problem))
        }
    }
}

/// Whether bytes begin like a CDR message; no text does.
fn is_cdr(bytes: &[u8]) -> bool {
    Body::cdr(bytes).is_ok()
}
