//! The file: channels by topic, messages in JSON, times as nanoseconds since 1970 or since the beginning of the recording.

use super::Seekable;
use crate::replay::Provenance;
use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, McapResult, WriteOptions, Writer};
use serde_json::Value;
use shsa_core::time::Time;
use std::borrow::Cow;
use std::collections::BTreeMap;

/// Chunks of this size in bytes: a reader needs so much memory.
const CHUNK: u64 = 1 << 20;

/// The kinds of messages, each with its schema.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// An input of the run, a line of the journal.
    Journal,
    /// A value with its bounds.
    Interval,
    /// A published value of a need.
    Need,
    /// The verdict on a signal.
    Verdict,
    /// A decision with its reasons.
    Decision,
    /// A decision as a line for a log.
    Log,
}

impl Kind {
    /// The name of the schema. Foxglove recognises its own schemas by their names.
    fn name(self) -> &'static str {
        match self {
            Kind::Journal => "shsa.Journal",
            Kind::Interval => "shsa.Interval",
            Kind::Need => "shsa.Need",
            Kind::Verdict => "shsa.Verdict",
            Kind::Decision => "shsa.Decision",
            Kind::Log => "foxglove.Log",
        }
    }

    /// The schema, a JSON Schema.
    fn schema(self) -> String {
        let fields: &[(&str, &str)] = match self {
            Kind::Journal => &[],
            Kind::Interval => &[("lo", "number"), ("mid", "number"), ("hi", "number"), ("width", "number")],
            Kind::Need => &[
                ("lo", "number"),
                ("mid", "number"),
                ("hi", "number"),
                ("width", "number"),
                ("quality", "string"),
                ("source", "string"),
            ],
            Kind::Verdict => &[("verdict", "string"), ("symptom", "string")],
            Kind::Decision => &[
                ("kind", "string"),
                ("signal", "string"),
                ("variable", "string"),
                ("because", "string"),
                ("substitution", "string"),
            ],
            Kind::Log => &[
                ("level", "integer"),
                ("message", "string"),
                ("name", "string"),
                ("file", "string"),
                ("line", "integer"),
            ],
        };
        let number = serde_json::json!({ "type": "integer" });
        let time = serde_json::json!({ "type": "object", "title": "time", "properties": { "sec": number, "nsec": number } });
        let fields =
            fields.iter().map(|(name, kind)| ((*name).to_owned(), serde_json::json!({ "type": kind })));
        let timed = (self == Kind::Log).then(|| ("timestamp".to_owned(), time));
        let properties: serde_json::Map<String, Value> = timed.into_iter().chain(fields).collect();
        serde_json::json!({ "type": "object", "title": self.name(), "properties": properties }).to_string()
    }
}

/// An MCAP file that is being written.
pub(super) struct Channels<W: Seekable> {
    writer: Writer<W>,
    /// By topic: the number of its channel, and of its next message.
    known: BTreeMap<String, (u16, u32)>,
}

impl<W: Seekable> Channels<W> {
    /// Begins a file. Its profile is `shsa`.
    pub(super) fn new(output: W, provenance: &Provenance) -> McapResult<Channels<W>> {
        let options = WriteOptions::new()
            .profile("shsa")
            .library(concat!("shsa ", env!("CARGO_PKG_VERSION")))
            .chunk_size(Some(CHUNK));
        #[cfg(feature = "zstd")]
        let options = options.compression(Some(mcap::Compression::Zstd));
        #[cfg(not(feature = "zstd"))]
        let options = options.compression(None);
        let mut writer = options.create(output)?;
        let Provenance { model, text, hash, command } = provenance;
        let about = [("model", model), ("sha256", hash), ("command", command)];
        writer.write_metadata(&Metadata {
            name: "shsa".to_owned(),
            metadata: about.map(|(name, value)| (name.to_owned(), value.clone())).into(),
        })?;
        writer.attach(&Attachment {
            log_time: 0,
            create_time: 0,
            name: model.clone(),
            media_type: "application/yaml".to_owned(),
            data: Cow::Borrowed(text.as_bytes()),
        })?;
        Ok(Channels { writer, known: BTreeMap::new() })
    }

    /// Writes a message. `about` describes its channel, the first time.
    pub(super) fn write(
        &mut self,
        topic: &str,
        kind: Kind,
        time: Time,
        data: &[u8],
        about: impl FnOnce() -> BTreeMap<String, String>,
    ) -> McapResult<()> {
        if !self.known.contains_key(topic) {
            let schema = self.writer.add_schema(kind.name(), "jsonschema", kind.schema().as_bytes())?;
            let channel = self.writer.add_channel(schema, topic, "json", &about())?;
            self.known.insert(topic.to_owned(), (channel, 0));
        }
        let Some((channel, next)) = self.known.get_mut(topic) else { return Ok(()) };
        let time = u64::try_from(time.0).unwrap_or_default();
        let header =
            MessageHeader { channel_id: *channel, sequence: *next, log_time: time, publish_time: time };
        *next = next.wrapping_add(1);
        self.writer.write_to_known_channel(&header, data)
    }

    /// Ends the chunk, and writes it out.
    pub(super) fn flush(&mut self) -> McapResult<()> {
        self.writer.flush()
    }

    /// Writes an index and ends the file. `layout` is attached.
    pub(super) fn finish(&mut self, layout: &Value) -> McapResult<()> {
        self.writer.attach(&Attachment {
            log_time: 0,
            create_time: 0,
            name: "foxglove-layout.json".to_owned(),
            media_type: "application/json".to_owned(),
            data: Cow::Owned(layout.to_string().into_bytes()),
        })?;
        self.writer.finish().map(|_| ())
    }
}
