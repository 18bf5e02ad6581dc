//! The records of an MCAP file: the content of each kind.

/// A schema: the definition of a message type.
pub(super) const SCHEMA: u8 = 3;
/// A channel: the messages of one publisher of a topic.
pub(super) const CHANNEL: u8 = 4;
/// A message.
pub(super) const MESSAGE: u8 = 5;
/// A chunk of records, possibly compressed.
pub(super) const CHUNK: u8 = 6;
/// The last kind that the format defines.
pub(super) const LAST: u8 = 15;
/// The end of the data.
pub(super) const DATA_END: u8 = 15;
/// The place of the summary.
pub(super) const FOOTER: u8 = 2;
/// Kind and length.
pub(super) const HEAD: u64 = 9;

/// Goes through the fields of a record; every step returns `None` after the end of the record.
#[derive(Clone, Copy)]
pub(super) struct Cursor<'a>(pub(super) &'a [u8]);

impl<'a> Cursor<'a> {
    pub(super) fn bytes(&mut self, length: usize) -> Option<&'a [u8]> {
        let (own, rest) = self.0.split_at_checked(length)?;
        self.0 = rest;
        Some(own)
    }

    pub(super) fn byte(&mut self) -> Option<u8> {
        Some(*self.bytes(1)?.first()?)
    }

    pub(super) fn u16(&mut self) -> Option<u16> {
        self.bytes(2)?.first_chunk().map(|bytes| u16::from_le_bytes(*bytes))
    }

    pub(super) fn u32(&mut self) -> Option<u32> {
        self.bytes(4)?.first_chunk().map(|bytes| u32::from_le_bytes(*bytes))
    }

    pub(super) fn u64(&mut self) -> Option<u64> {
        self.bytes(8)?.first_chunk().map(|bytes| u64::from_le_bytes(*bytes))
    }

    /// The bytes after a length of four bytes.
    pub(super) fn sized(&mut self) -> Option<&'a [u8]> {
        let length = self.u32()?;
        self.bytes(length as usize)
    }

    pub(super) fn text(&mut self) -> Option<&'a str> {
        std::str::from_utf8(self.sized()?).ok()
    }

    /// A whole record: its kind and its content.
    pub(super) fn record(&mut self) -> Option<(u8, &'a [u8])> {
        let mut ahead = *self;
        let kind = ahead.byte().filter(|kind| (1..=LAST).contains(kind))?;
        let length = ahead.u64()?;
        let content = ahead.bytes(usize::try_from(length).ok()?)?;
        *self = ahead;
        Some((kind, content))
    }
}

/// A schema.
pub(super) struct Schema<'a> {
    pub(super) id: u16,
    pub(super) name: &'a str,
    pub(super) encoding: &'a str,
    pub(super) data: &'a [u8],
}

impl<'a> Schema<'a> {
    pub(super) fn of(content: &'a [u8]) -> Option<Schema<'a>> {
        let mut at = Cursor(content);
        Some(Schema { id: at.u16()?, name: at.text()?, encoding: at.text()?, data: at.sized()? })
    }
}

/// A channel.
pub(super) struct Channel<'a> {
    pub(super) id: u16,
    pub(super) schema: u16,
    pub(super) topic: &'a str,
    pub(super) encoding: &'a str,
}

impl<'a> Channel<'a> {
    pub(super) fn of(content: &'a [u8]) -> Option<Channel<'a>> {
        let mut at = Cursor(content);
        Some(Channel { id: at.u16()?, schema: at.u16()?, topic: at.text()?, encoding: at.text()? })
    }
}

/// A message.
pub(super) struct Message<'a> {
    pub(super) channel: u16,
    pub(super) logged_ns: u64,
    pub(super) published_ns: u64,
    pub(super) data: &'a [u8],
}

impl<'a> Message<'a> {
    pub(super) fn of(content: &'a [u8]) -> Option<Message<'a>> {
        let mut at = Cursor(content);
        let channel = at.u16()?;
        at.u32()?;
        Some(Message { channel, logged_ns: at.u64()?, published_ns: at.u64()?, data: at.0 })
    }
}

/// The head of a chunk, before its compressed records.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct ChunkHead {
    /// The size of the records after decompression.
    pub(super) unpacked: u64,
    /// The CRC-32 of the records; 0 where it was not computed.
    pub(super) crc: u32,
    /// The method of compression; empty for none.
    pub(super) method: String,
    /// The size of the compressed records.
    pub(super) packed: u64,
    /// The size of this head.
    pub(super) size: u64,
}

impl ChunkHead {
    /// The longest head with a known method.
    pub(super) const SIZE_MAX: u64 = 8 + 8 + 8 + 4 + 4 + 32 + 8;

    pub(super) fn of(content: &[u8]) -> Option<ChunkHead> {
        let mut at = Cursor(content);
        let (start, end) = (at.u64()?, at.u64()?);
        let (unpacked, crc) = (at.u64()?, at.u32()?);
        let method = at.text().filter(|method| method.len() <= 32)?.to_owned();
        let packed = at.u64()?;
        let size = (content.len() - at.0.len()) as u64;
        (start <= end).then_some(ChunkHead { unpacked, crc, method, packed, size })
    }
}
