//! ROS 1 bags of version 2.0: the file as a sequence of connections and messages.
//!
//! Format: <http://wiki.ros.org/Bags/Format/2.0>. Chunks are read one after the other, so that the content of a bag without its
//! index (truncated, or never closed) can be read. After damage, reading goes on at the next recognisable chunk. Memory is
//! bounded by the largest chunk; a length counts only as far as the file reaches.

use super::topic::{Body, Fields, Input, Listener, Times, Topic, TopicId};
use super::unpack::{Budget, UNPACKED_MAX};
use super::{Place, RecordingError};
use shsa_core::time::Time;
use shsa_message::ros::{Layout, Types};
use std::collections::BTreeMap;
use std::io::{self, Read, Seek, SeekFrom};
use std::sync::Arc;

/// The first bytes of every bag.
pub(super) const MAGIC: &[u8] = b"#ROSBAG V2.0\n";
/// The longest header that is accepted.
const HEADER_MAX: usize = 1 << 20;
/// The largest chunk that is decompressed, in bytes; the recorder's default is 768 KiB.
const CHUNK_MAX: u64 = 1 << 29;
/// How many bytes one step of the search after damage covers.
const SEARCH_BLOCK: u64 = 1 << 16;
/// Bytes of a record that the search must see to recognise a chunk.
const CHUNK_HEADER_MAX: u64 = 256;

/// The most bytes of padding before the index.
const PADDING_MAX: u64 = 1 << 20;

const OP_MESSAGE: u8 = 2;
const OP_BAG: u8 = 3;
const OP_CHUNK: u8 = 5;
const OP_CONNECTION: u8 = 7;

/// Reports the topics and messages of a bag.
pub(super) fn read(input: &mut dyn Input, listener: &mut dyn Listener) -> Result<(), RecordingError> {
    let mut connections: BTreeMap<u32, TopicId> = BTreeMap::new();
    let walked = walk(input, &mut |event| match event {
        Event::Connection { id, topic, kind, definition } => {
            connections.entry(id).or_insert_with(|| {
                let types = Arc::new(Types::of_bag(kind, definition));
                let fields = Fields::Ros { types, kind: kind.to_owned(), layout: Layout::Packed };
                listener.topic(Topic::new(topic, kind, fields))
            });
        }
        Event::Message { connection, time_ns, data } => {
            if let Some(topic) = connections.get(&connection) {
                listener.message(*topic, Times::at(Time(time_ns)), Body::Bytes(data));
            }
        }
        Event::Damage { offset, problem } => listener.damaged(Place::Offset(offset), problem),
    });
    if let Err(failure) = walked {
        listener.damaged(Place::Whole, format!("reading stopped: {failure}"));
    }
    Ok(())
}

/// The content of a bag, in the order of the file.
#[derive(Clone, Debug, PartialEq)]
enum Event<'a> {
    /// Relates messages of this number to a topic. It comes at least once before the first of them, perhaps again.
    Connection { id: u32, topic: &'a str, kind: &'a str, definition: &'a str },
    /// One message.
    Message { connection: u32, time_ns: i64, data: &'a [u8] },
    /// Something is lost here.
    Damage { offset: u64, problem: String },
}

/// Goes through a bag whose magic was checked.
///
/// # Errors
/// Those of the input.
fn walk(mut input: impl Read + Seek, visit: &mut dyn FnMut(Event<'_>)) -> io::Result<()> {
    let length = input.seek(SeekFrom::End(0))?;
    let mut bag = Bag { input, length, index: 0, budget: Budget::of(length) };
    let start = MAGIC.len() as u64;
    if length <= start {
        visit(Event::Damage { offset: length, problem: "the bag ends before its first record".into() });
        return Ok(());
    }
    bag.read_index(start, visit)?;
    bag.read_records(start, visit)
}

struct Bag<R> {
    input: R,
    length: u64,
    /// Where the index at the end begins; 0 where that is not known.
    index: u64,
    /// What the chunks may unpack to.
    budget: Budget,
}

/// A record whose header was read and whose data was not.
struct Record {
    header: Vec<u8>,
    data_at: u64,
    data_length: u64,
}

impl Record {
    fn end(&self) -> u64 {
        self.data_at + self.data_length
    }
}

impl<R: Read + Seek> Bag<R> {
    /// Up to `length` bytes from an offset, fewer at the end of the file.
    fn bytes(&mut self, offset: u64, length: u64) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        self.input.seek(SeekFrom::Start(offset))?;
        // The buffer grows with the bytes that are there, whatever the length says.
        self.input.by_ref().take(length.min(CHUNK_MAX)).read_to_end(&mut bytes)?;
        Ok(bytes)
    }

    /// The record at an offset; `None` where no record can begin, because its header is invalid.
    fn record(&mut self, offset: u64) -> io::Result<Option<Record>> {
        let Some(length) = number(&self.bytes(offset, 4)?) else { return Ok(None) };
        if length as usize > HEADER_MAX {
            return Ok(None);
        }
        let header = self.bytes(offset + 4, u64::from(length) + 4)?;
        let Some((header, data_length)) = header.split_at_checked(length as usize) else { return Ok(None) };
        let Some(data_length) = number(data_length) else { return Ok(None) };
        let data_at = offset + 8 + u64::from(length);
        let is_sound = Header(header).op().is_some();
        Ok(is_sound.then(|| Record { header: header.into(), data_at, data_length: data_length.into() }))
    }

    /// Reads the connections that the index at the end repeats, as their own records may be damaged.
    fn read_index(&mut self, start: u64, visit: &mut dyn FnMut(Event<'_>)) -> io::Result<()> {
        let Some(head) = self.record(start)? else { return Ok(()) };
        let header = Header(&head.header);
        let index = header.field("index_pos").and_then(long).filter(|_| header.op() == Some(OP_BAG));
        // If the header is damaged, reading the records reports it.
        let Some(mut offset) = index else { return Ok(()) };
        self.index = offset;
        let is_empty = header.field("conn_count").and_then(number) == Some(0);
        let problem = match offset {
            0 => Some("the bag was never closed: it has no index, its end may be lost".into()),
            _ if offset > self.length || offset == self.length && !is_empty => {
                Some(format!("the bag ends here, before its index at byte {offset}"))
            }
            _ => None,
        };
        if let Some(problem) = problem {
            visit(Event::Damage { offset: self.length, problem });
            return Ok(());
        }
        while let Some(record) = self.record(offset)? {
            if Header(&record.header).op() == Some(OP_CONNECTION) {
                let data = self.bytes(record.data_at, record.data_length)?;
                connection(&Header(&record.header), &data, visit);
            }
            offset = record.end();
        }
        Ok(())
    }

    fn read_records(&mut self, start: u64, visit: &mut dyn FnMut(Event<'_>)) -> io::Result<()> {
        let mut offset = start;
        while offset < self.length {
            offset = match self.record(offset)? {
                Some(record) if record.end() <= self.length => {
                    self.visit(&record, visit)?;
                    record.end()
                }
                Some(record) => {
                    let there = self.length.saturating_sub(record.data_at);
                    let problem =
                        format!("a record of {} bytes has only {there} of them", record.data_length);
                    visit(Event::Damage { offset, problem });
                    self.visit(&record, visit)?;
                    self.next_chunk(record.data_at)?
                }
                None if self.is_padding(offset)? => self.index,
                None => {
                    visit(Event::Damage { offset, problem: "no record begins here".into() });
                    self.next_chunk(offset + 1)?
                }
            };
        }
        Ok(())
    }

    /// Whether only zeros or only blanks stand between here and the index.
    fn is_padding(&mut self, offset: u64) -> io::Result<bool> {
        let Some(length) = self.index.checked_sub(offset).filter(|length| (1..=PADDING_MAX).contains(length))
        else {
            return Ok(false);
        };
        let bytes = self.bytes(offset, length)?;
        Ok([0, b' '].iter().any(|padding| bytes.iter().all(|byte| byte == padding)))
    }

    fn visit(&mut self, record: &Record, visit: &mut dyn FnMut(Event<'_>)) -> io::Result<()> {
        let header = Header(&record.header);
        match header.op() {
            Some(OP_CHUNK) => {
                let packed = self.bytes(record.data_at, record.data_length)?;
                let (data, problem) = unpack(&header, packed, &mut self.budget);
                if let Some(problem) = problem {
                    visit(Event::Damage { offset: record.data_at, problem });
                }
                if let Some(lost_at) = walk_chunk(&data, visit) {
                    let left = data.len() - lost_at;
                    let problem = format!("the last {left} unpacked bytes of this chunk are no whole record");
                    visit(Event::Damage { offset: record.data_at, problem });
                }
            }
            Some(OP_CONNECTION) => {
                let data = self.bytes(record.data_at, record.data_length)?;
                connection(&header, &data, visit);
            }
            _ => {}
        }
        Ok(())
    }

    /// The offset of the next record that is a chunk, or the end of the file. One pass over the bytes.
    fn next_chunk(&mut self, from: u64) -> io::Result<u64> {
        let mut offset = from;
        while offset < self.length {
            let block = self.bytes(offset, SEARCH_BLOCK + CHUNK_HEADER_MAX)?;
            let starts = block.len().min(SEARCH_BLOCK as usize);
            if let Some(start) = (0..starts).find(|start| block.get(*start..).is_some_and(is_chunk)) {
                return Ok(offset + start as u64);
            }
            offset += SEARCH_BLOCK;
        }
        Ok(self.length)
    }
}

/// Whether a chunk record begins these bytes.
fn is_chunk(bytes: &[u8]) -> bool {
    let length = number(bytes).map_or(0, |length| length as usize);
    let header = (length < CHUNK_HEADER_MAX as usize).then(|| bytes.get(4..4 + length)).flatten();
    header.is_some_and(|header| {
        Header(header).op() == Some(OP_CHUNK) && Header(header).field("compression").is_some()
    })
}

/// Goes through the records of a chunk; returns where it had to stop, if before the end.
fn walk_chunk(data: &[u8], visit: &mut dyn FnMut(Event<'_>)) -> Option<usize> {
    let mut rest = data;
    while !rest.is_empty() {
        let stopped_at = data.len() - rest.len();
        let Some((header, body, after)) = split_record(rest) else { return Some(stopped_at) };
        let header = Header(header);
        match header.op() {
            Some(OP_MESSAGE) => message(&header, body, visit),
            Some(OP_CONNECTION) => connection(&header, body, visit),
            Some(_) => {}
            None => return Some(stopped_at),
        }
        rest = after;
    }
    None
}

/// The header and the data of the first record of these bytes, and the rest.
fn split_record(bytes: &[u8]) -> Option<(&[u8], &[u8], &[u8])> {
    let (header, rest) = split_sized(bytes)?;
    let (data, rest) = split_sized(rest)?;
    Some((header, data, rest))
}

/// The bytes after a length of four bytes, and the rest.
fn split_sized(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let length = number(bytes)? as usize;
    bytes.get(4..)?.split_at_checked(length)
}

fn message(header: &Header<'_>, data: &[u8], visit: &mut dyn FnMut(Event<'_>)) {
    let connection = header.field("conn").and_then(number);
    let time = header.field("time").and_then(time_ns);
    if let (Some(connection), Some(time_ns)) = (connection, time) {
        visit(Event::Message { connection, time_ns, data });
    }
}

fn connection(header: &Header<'_>, data: &[u8], visit: &mut dyn FnMut(Event<'_>)) {
    let text = |bytes| std::str::from_utf8(bytes).ok();
    let about = Header(data);
    let id = header.field("conn").and_then(number);
    let topic = header.field("topic").and_then(text);
    let kind = about.field("type").and_then(text);
    let definition = about.field("message_definition").and_then(text);
    if let (Some(id), Some(topic), Some(kind), Some(definition)) = (id, topic, kind, definition) {
        visit(Event::Connection { id, topic, kind, definition });
    }
}

/// The decompressed bytes of a chunk, and the problem with them. A truncated chunk gives the bytes before the end. A chunk with a
/// wrong checksum gives none, as the wrong bytes are unknown.
fn unpack(header: &Header<'_>, packed: Vec<u8>, budget: &mut Budget) -> (Vec<u8>, Option<String>) {
    let stated = header.field("size").and_then(number).map_or(UNPACKED_MAX, u64::from);
    let is_packed = header.field("compression") != Some(b"none");
    if is_packed && stated > UNPACKED_MAX {
        let most = UNPACKED_MAX >> 20;
        return (Vec::new(), Some(format!("a chunk of {stated} bytes is larger than {most} MiB, left out")));
    }
    if let Err(problem) = budget.take(if is_packed { stated } else { 0 }) {
        return (Vec::new(), Some(format!("a chunk of {stated} bytes is left out: {problem}")));
    }
    // One byte more than stated: the decompressors compare checksums only when the end is read.
    let limit = stated + 1;
    let mut data = Vec::new();
    let done = match header.field("compression") {
        Some(b"none") => return (packed, None),
        Some(b"bz2") => bzip2::read::BzDecoder::new(&*packed).take(limit).read_to_end(&mut data),
        Some(b"lz4") => lz4_flex::frame::FrameDecoder::new(&*packed).take(limit).read_to_end(&mut data),
        other => {
            let name = String::from_utf8_lossy(other.unwrap_or(b"")).into_owned();
            return (data, Some(format!("a chunk is packed by '{name}', which is not known here")));
        }
    };
    let got = data.len();
    let problem = match done {
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
            Some(format!("only {got} of {stated} bytes of a chunk can be unpacked"))
        }
        Err(error) => {
            data.clear();
            Some(format!("a chunk of {stated} bytes is damaged, left out: {error}"))
        }
        Ok(_) if got as u64 != stated => Some(format!("a chunk of {stated} bytes unpacks to {got}")),
        Ok(_) => None,
    };
    (data, problem)
}

/// The `name=value` fields of a header, each after its length.
struct Header<'a>(&'a [u8]);

impl<'a> Header<'a> {
    fn field(&self, name: &str) -> Option<&'a [u8]> {
        self.fields().find_map(|(known, value)| (known == name.as_bytes()).then_some(value))
    }

    /// The kind of the record; `None` when the header is malformed.
    fn op(&self) -> Option<u8> {
        let whole: usize = self.fields().map(|(name, value)| 4 + name.len() + 1 + value.len()).sum();
        match self.field("op") {
            Some([op]) if whole == self.0.len() => Some(*op),
            _ => None,
        }
    }

    fn fields(&self) -> impl Iterator<Item = (&'a [u8], &'a [u8])> + use<'a> {
        let mut rest = self.0;
        std::iter::from_fn(move || {
            let (field, after) = split_sized(rest)?;
            let equals = field.iter().position(|byte| *byte == b'=')?;
            rest = after;
            Some((field.get(..equals)?, field.get(equals + 1..)?))
        })
    }
}

/// Four bytes at the start, little endian.
fn number(bytes: &[u8]) -> Option<u32> {
    bytes.first_chunk().map(|bytes| u32::from_le_bytes(*bytes))
}

fn long(bytes: &[u8]) -> Option<u64> {
    bytes.first_chunk().map(|bytes| u64::from_le_bytes(*bytes))
}

/// Seconds and nanoseconds, four bytes each.
fn time_ns(bytes: &[u8]) -> Option<i64> {
    let seconds = i64::from(number(bytes)?);
    let nanoseconds = i64::from(number(bytes.get(4..)?)?);
    Some(seconds * 1_000_000_000 + nanoseconds)
}
