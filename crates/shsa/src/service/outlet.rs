//! An output of a service: `TOPIC`, or `TOPIC#FIELD` for a JSON object with this field.

use anyhow::anyhow;
use shsa_bridge::payload::plain;
use shsa_bridge::{Bridge, Outgoing, Payload, Provenance};
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use shsa_message::source::split_topic;

/// One output.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Outlet {
    topic: String,
    /// The keys from the outermost object to the value.
    path: Vec<String>,
}

impl Outlet {
    /// # Errors
    /// When a text names no topic, or a part of a field is empty.
    pub(super) fn new(text: &str) -> anyhow::Result<Outlet> {
        let (topic, field) = split_topic(text);
        let path: Vec<String> =
            field.into_iter().flat_map(|field| field.split('.')).map(Into::into).collect();
        if topic.is_empty() || path.iter().any(|name| name.is_empty() || name.contains(['[', ']', '@', '#']))
        {
            return Err(anyhow!("the output {text}: write TOPIC or TOPIC#FIELD, as /output#data"));
        }
        Ok(Outlet { topic: topic.to_owned(), path })
    }

    /// Sends a value that was true at a wall-clock time.
    ///
    /// # Errors
    /// Errors of the bus.
    pub(super) fn send(
        &self,
        value: &RawValue,
        stamp: Time,
        provenance: &Provenance,
        bridge: &mut dyn Bridge,
    ) -> anyhow::Result<()> {
        let message = Outgoing::new(&self.topic, stamp, self.payload(value));
        bridge.publish(Outgoing { provenance: Some(provenance), ..message })?;
        Ok(())
    }

    fn payload(&self, value: &RawValue) -> Payload {
        if self.path.is_empty() {
            return Payload::Value(value.clone());
        }
        let enclosed =
            |inner: String, name: &String| format!("{{{}:{inner}}}", serde_json::Value::String(name.clone()));
        Payload::Bytes(self.path.iter().rev().fold(plain(value), enclosed).into_bytes().into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(text: &str, expected: &str) {
        let shown = match Outlet::new(text) {
            Ok(outlet) => match outlet.payload(&RawValue::Number(1.5)) {
                Payload::Bytes(bytes) => format!("{} {}", outlet.topic, String::from_utf8_lossy(&bytes)),
                Payload::Value(value) => format!("{} {value:?}", outlet.topic),
            },
            Err(error) => error.to_string(),
        };
        assert_eq!(shown, expected);
    }

    #[test]
    fn outputs_are_topics_with_or_without_a_field() {
        check("/out", "/out Number(1.5)");
        check("/out#data", "/out {\"data\":1.5}");
        check("/odom#twist.linear.x", "/odom {\"twist\":{\"linear\":{\"x\":1.5}}}");
        let wrong = |text: &str| format!("the output {text}: write TOPIC or TOPIC#FIELD, as /output#data");
        for text in ["", "#data", "/out#", "/out#a..b", "/out#a[0]"] {
            check(text, &wrong(text));
        }
    }
}
