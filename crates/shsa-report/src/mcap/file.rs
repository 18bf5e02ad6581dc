//! The file: channels by topic, messages in JSON, times as nanoseconds since 1970 or since the beginning of the recording.

use super::{Message, Seekable, Sink};
use crate::replay::Provenance;
use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, McapResult, WriteOptions, Writer};
use serde_json::Value;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io;

/// Chunks of this size in bytes: a reader needs so much memory.
const CHUNK: u64 = 1 << 20;

/// An MCAP file that is being written.
pub struct McapFile<W: Seekable> {
    writer: Writer<W>,
    /// By topic: the number of its channel, and of its next message.
    known: BTreeMap<String, (u16, u32)>,
}

impl<W: Seekable> McapFile<W> {
    /// Begins a file. Its profile is `shsa`.
    ///
    /// # Errors
    /// Errors of the output.
    pub fn new(output: W, provenance: &Provenance) -> io::Result<McapFile<W>> {
        McapFile::begin(output, provenance).map_err(io::Error::other)
    }

    fn begin(output: W, provenance: &Provenance) -> McapResult<McapFile<W>> {
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
        Ok(McapFile { writer, known: BTreeMap::new() })
    }

    fn put(&mut self, message: &Message<'_>) -> McapResult<()> {
        let Message { topic, kind, time, data, about } = *message;
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

    fn end(&mut self, layout: &Value) -> McapResult<()> {
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

impl<W: Seekable> Sink for McapFile<W> {
    fn write(&mut self, message: &Message<'_>) -> io::Result<()> {
        self.put(message).map_err(io::Error::other)
    }

    /// Ends the chunk, and writes it out.
    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush().map_err(io::Error::other)
    }

    /// Writes an index and ends the file. The layout is attached.
    fn finish(&mut self, layout: &Value) -> io::Result<()> {
        self.end(layout).map_err(io::Error::other)
    }
}
