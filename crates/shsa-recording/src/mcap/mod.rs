//! MCAP: messages of any encoding, in chunks or not, with an index or without.
//!
//! Format: <https://mcap.dev/spec>. This reader is an own one, because the library ends at the first damage; here reading goes on
//! with the next recognisable chunk. Memory is bounded by the largest chunk; a length counts only as far as the file reaches.

mod lines;
mod records;
mod schemas;

pub use lines::{has_profile, lines};

use super::topic::{Body, Input, Listener, Times, TopicId};
use super::unpack::{Budget, UNPACKED_MAX, Unpacker};
use super::{Place, ReadOptions, RecordingError};
use records::{
    CHANNEL, CHUNK, Channel, ChunkHead, Cursor, DATA_END, FOOTER, HEAD, LAST, MESSAGE, Message, SCHEMA,
    Schema,
};
use schemas::Schemas;
use shsa_core::time::Time;
use std::collections::BTreeMap;
use std::io::{self, Read, SeekFrom};

/// The first and the last bytes of every file.
pub(super) const MAGIC: &[u8] = b"\x89MCAP0\r\n";
/// Larger records are skipped, bytes.
const RECORD_MAX: u64 = 1 << 28;
/// The longest part of a file for which there is room before it is read, bytes.
const AT_ONCE: u64 = 1 << 20;
/// The step of the search after damage.
const SEARCH_BLOCK: u64 = 1 << 16;

/// Reports the topics and messages of a file.
pub(super) fn read(
    input: &mut dyn Input,
    options: &ReadOptions,
    listener: &mut dyn Listener,
) -> Result<(), RecordingError> {
    let schemas = Schemas::new(&options.messages).map_err(RecordingError::Definitions)?;
    let budget = Budget::of(0);
    let unpacker = Unpacker::default();
    let mut reader = Reader { length: 0, budget, unpacker, input, schemas, channels: BTreeMap::new() };
    if let Err(failure) = reader.run(listener) {
        listener.damaged(Place::Whole, format!("reading stopped: {failure}"));
    }
    Ok(())
}

struct Reader<'i> {
    input: &'i mut dyn Input,
    length: u64,
    /// What the chunks may unpack to.
    budget: Budget,
    unpacker: Unpacker,
    schemas: Schemas,
    channels: BTreeMap<u16, TopicId>,
}

impl Reader<'_> {
    fn run(&mut self, listener: &mut dyn Listener) -> io::Result<()> {
        self.length = self.input.seek(SeekFrom::End(0))?;
        self.budget = Budget::of(self.length);
        let start = MAGIC.len() as u64;
        if self.bytes(0, start)? != MAGIC {
            listener.damaged(Place::Offset(0), "the file does not begin as MCAP does".into());
        }
        if !self.summary(listener)? {
            let problem = "the file ends without its footer: it is cut short, or was never closed";
            listener.damaged(Place::Offset(self.length), problem.into());
        }
        let mut offset = start;
        while offset < self.length {
            match self.record(offset, listener)? {
                Some(next) => offset = next,
                None => return Ok(()),
            }
        }
        Ok(())
    }

    /// Up to `length` bytes from an offset, fewer at the end of the file.
    fn bytes(&mut self, offset: u64, length: u64) -> io::Result<Vec<u8>> {
        // The buffer grows with the bytes that are there, whatever the length says.
        let there = length.min(self.length.saturating_sub(offset)).min(AT_ONCE);
        let mut bytes = Vec::with_capacity(usize::try_from(there).unwrap_or(0));
        self.input.seek(SeekFrom::Start(offset))?;
        Read::take(&mut *self.input, length).read_to_end(&mut bytes)?;
        Ok(bytes)
    }

    /// Kind and length of the record at an offset; `None` where no record can begin.
    fn head(&mut self, offset: u64) -> io::Result<Option<(u8, u64)>> {
        let bytes = self.bytes(offset, HEAD)?;
        let mut at = Cursor(&bytes);
        let head = at.byte().zip(at.u64());
        Ok(head.filter(|(kind, _)| (1..=LAST).contains(kind)))
    }

    /// Reads the schemas and channels that the summary repeats, as their own records may be damaged. Returns whether there is a
    /// footer.
    fn summary(&mut self, listener: &mut dyn Listener) -> io::Result<bool> {
        let footer_size = HEAD + 20;
        let Some(at) = self.length.checked_sub(footer_size + MAGIC.len() as u64) else { return Ok(false) };
        let bytes = self.bytes(at, self.length - at)?;
        let mut footer = Cursor(&bytes);
        let Some((FOOTER, content)) = footer.record().filter(|_| bytes.ends_with(MAGIC)) else {
            return Ok(false);
        };
        let mut offset = Cursor(content).u64().filter(|start| *start > 0).unwrap_or(at);
        while offset < at {
            let Some((kind, length)) = self.head(offset)? else { break };
            if matches!(kind, SCHEMA | CHANNEL) && length <= RECORD_MAX {
                let content = self.bytes(offset + HEAD, length)?;
                self.describe(kind, &content, listener);
            }
            offset = offset.saturating_add(HEAD).saturating_add(length);
        }
        Ok(true)
    }

    /// Reads the record at an offset, or reports the damage; returns where to go on, if anywhere.
    fn record(&mut self, offset: u64, listener: &mut dyn Listener) -> io::Result<Option<u64>> {
        let Some((kind, length)) = self.head(offset)? else {
            listener.damaged(Place::Offset(offset), "no record begins here".into());
            return self.resumed(offset + 1).map(Some);
        };
        if kind == DATA_END || kind == FOOTER {
            return Ok(None);
        }
        let end = offset.saturating_add(HEAD).saturating_add(length);
        if kind == CHUNK {
            return self.chunk(offset, length, listener).map(Some);
        }
        if end > self.length {
            let there = self.length.saturating_sub(offset + HEAD);
            let problem = format!("a record of {length} bytes has only {there} of them");
            listener.damaged(Place::Offset(offset), problem);
            return self.resumed(offset + 1).map(Some);
        }
        match kind {
            SCHEMA | CHANNEL | MESSAGE if length > RECORD_MAX => {
                let problem = format!("a record of {length} bytes is larger than is read; left out");
                listener.damaged(Place::Offset(offset), problem);
            }
            SCHEMA | CHANNEL | MESSAGE => {
                let content = self.bytes(offset + HEAD, length)?;
                if !self.take(kind, &content, listener) {
                    listener.damaged(Place::Offset(offset), "this record makes no sense; left out".into());
                }
            }
            _ => {}
        }
        Ok(Some(end))
    }

    /// Reads a chunk; returns where to go on.
    fn chunk(&mut self, offset: u64, length: u64, listener: &mut dyn Listener) -> io::Result<u64> {
        let content_at = offset + HEAD;
        let there = self.length - content_at.min(self.length);
        let head = ChunkHead::of(&self.bytes(content_at, ChunkHead::SIZE_MAX)?);
        let Some(head) = head.filter(|head| head.size.checked_add(head.packed) == Some(length)) else {
            listener.damaged(Place::Offset(offset), "no record begins here".into());
            return self.resumed(offset + 1);
        };
        let place = Place::Offset(offset);
        if head.unpacked > UNPACKED_MAX || head.packed > UNPACKED_MAX {
            let most = UNPACKED_MAX >> 20;
            let problem = format!("a chunk of {} bytes is larger than {most} MiB, left out", head.unpacked);
            listener.damaged(place, problem);
            return if length > there { self.resumed(offset + 1) } else { Ok(content_at + length) };
        }
        let packed = self.bytes(content_at + head.size, head.packed)?;
        let is_cut = length > there;
        self.records_of_chunk(&head, packed, is_cut, place, listener);
        // The damage of an incomplete chunk has been reported.
        Ok(if is_cut { self.length } else { content_at + length })
    }

    fn records_of_chunk(
        &mut self,
        head: &ChunkHead,
        packed: Vec<u8>,
        is_cut: bool,
        place: Place,
        listener: &mut dyn Listener,
    ) {
        let (bytes, problem) = match head.method.as_str() {
            "" => (packed, None),
            method => {
                if let Err(problem) = self.budget.take(head.unpacked) {
                    let problem = format!("a chunk of {} bytes is left out: {problem}", head.unpacked);
                    return listener.damaged(place, problem);
                }
                let unpacked = self.unpacker.unpack(method, &packed, head.unpacked);
                (unpacked.bytes, unpacked.problem)
            }
        };
        let is_whole = !is_cut && bytes.len() as u64 == head.unpacked;
        if is_whole && head.crc != 0 && crc32fast::hash(&bytes) != head.crc {
            return listener.damaged(place, "the checksum of this chunk is wrong; left out".into());
        }
        if !is_whole && !is_cut {
            let problem = problem.unwrap_or_else(|| format!("it has {} bytes", bytes.len()));
            let problem = format!("a chunk of {} bytes is damaged, left out: {problem}", head.unpacked);
            return listener.damaged(place, problem);
        }
        let (taken, left) = self.walk(&bytes, listener);
        if is_cut {
            let problem = format!(
                "the file ends within this chunk: {taken} messages of it are read, which its checksum cannot tell to be sound"
            );
            listener.damaged(place, problem);
        } else if left > 0 {
            let problem = format!("the last {left} unpacked bytes of this chunk are no whole record");
            listener.damaged(place, problem);
        }
    }

    /// Reads the records of a chunk; returns the number of messages, and of the bytes at the end that are no record.
    fn walk(&mut self, bytes: &[u8], listener: &mut dyn Listener) -> (usize, usize) {
        let (mut at, mut messages) = (Cursor(bytes), 0);
        while let Some((kind, content)) = at.record() {
            messages += usize::from(self.take(kind, content, listener) && kind == MESSAGE);
        }
        (messages, at.0.len())
    }

    /// Reads a record; returns whether it is valid.
    fn take(&mut self, kind: u8, content: &[u8], listener: &mut dyn Listener) -> bool {
        if kind != MESSAGE {
            return self.describe(kind, content, listener);
        }
        let Some(message) = Message::of(content) else { return false };
        let Some(topic) = self.channels.get(&message.channel) else { return false };
        if listener.is_wanted(*topic) {
            let time = |time: u64| Time(i64::try_from(time).unwrap_or(i64::MAX));
            let times = Times {
                received: time(message.logged_ns),
                published: Some(time(message.published_ns)),
                stamp: None,
            };
            listener.message(*topic, times, Body::Bytes(message.data));
        }
        true
    }

    /// Reads a schema or a channel; returns whether it is valid.
    fn describe(&mut self, kind: u8, content: &[u8], listener: &mut dyn Listener) -> bool {
        match kind {
            SCHEMA => Schema::of(content).map(|schema| self.schemas.add(&schema)).is_some(),
            CHANNEL => {
                let Some(channel) = Channel::of(content) else { return false };
                if !self.channels.contains_key(&channel.id) {
                    let topic = self.schemas.topic(&channel);
                    let topic = listener.topic(topic);
                    self.channels.insert(channel.id, topic);
                }
                true
            }
            _ => true,
        }
    }

    /// The offset of the next record that is certainly a chunk or a message, or the end of the file. One pass over the bytes.
    fn resumed(&mut self, from: u64) -> io::Result<u64> {
        let mut offset = from;
        while offset < self.length {
            let block = self.bytes(offset, SEARCH_BLOCK + HEAD + ChunkHead::SIZE_MAX)?;
            let starts = block.len().min(SEARCH_BLOCK as usize);
            for start in 0..starts {
                let Some(bytes) = block.get(start..) else { break };
                let at = offset + start as u64;
                if self.is_chunk(bytes) || self.is_message(at, bytes)? {
                    return Ok(at);
                }
            }
            offset += SEARCH_BLOCK;
        }
        Ok(self.length)
    }

    /// Whether these bytes begin a chunk.
    fn is_chunk(&self, bytes: &[u8]) -> bool {
        let Some((&CHUNK, rest)) = bytes.split_first() else { return false };
        let mut at = Cursor(rest);
        let Some(length) = at.u64() else { return false };
        let is_known = |head: &ChunkHead| {
            ["", "lz4", "zstd"].contains(&head.method.as_str())
                && head.size.checked_add(head.packed) == Some(length)
                && length <= self.length
        };
        ChunkHead::of(at.0).is_some_and(|head| is_known(&head))
    }

    /// Whether a message of a known channel begins here, followed by a record.
    fn is_message(&mut self, offset: u64, bytes: &[u8]) -> io::Result<bool> {
        let Some((&MESSAGE, rest)) = bytes.split_first() else { return Ok(false) };
        let mut at = Cursor(rest);
        let Some(length) = at.u64().filter(|length| (22..=RECORD_MAX).contains(length)) else {
            return Ok(false);
        };
        let end = offset + HEAD + length;
        if end >= self.length || !at.u16().is_some_and(|channel| self.channels.contains_key(&channel)) {
            return Ok(false);
        }
        let next = self.head(end)?;
        Ok(next.is_some_and(|(_, length)| length <= self.length - end))
    }
}
