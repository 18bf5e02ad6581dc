//! The publications of one topic, and the conversion of payloads to messages of its type.

use super::name::WireType;
use crate::cdr::{Writer, text_message};
use crate::{BridgeError, Outgoing, Payload};
use ::zenoh::pubsub::Publisher;
use bytes::Bytes;
use shsa_core::observation::RawValue;
use shsa_message::ros::Body;

/// The type of texts.
pub(super) const STRING: &str = "std_msgs/msg/String";

/// A topic that is published.
#[derive(Debug)]
pub(super) struct Outlet {
    /// `Some` from the first message on.
    pub(super) publisher: Option<Publisher<'static>>,
    pub(super) wire_type: WireType,
    pub(super) message_type: String,
    /// `Some` if the type has a field for values.
    pub(super) writer: Option<Writer>,
    /// The number of the last message.
    pub(super) sequence: i64,
}

impl Outlet {
    /// The message for a payload: values are written, CDR is passed on, texts become messages of one text.
    pub(super) fn encode(&self, message: &Outgoing<'_>) -> Result<Bytes, BridgeError> {
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
pub(super) fn type_for(topic: &str, payload: &Payload) -> Result<&'static str, BridgeError> {
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
