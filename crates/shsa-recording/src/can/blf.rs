//! BLF, the binary form of Vector's tools: objects, most of them within containers that are compressed by zlib.
//!
//! Layouts as in `python-can` and `vector_blf`. After damage, reading goes on at the next recognisable object. Memory is bounded
//! by the largest container, and all containers together by a [`Budget`].

use super::super::record::array;
use super::super::stamp::of_place;
use super::super::topic::{Input, Listener};
use super::super::unpack::Budget;
use super::super::window::Window;
use super::super::{Place, ReadOptions, RecordingError};
use super::NO_DATE;
use super::bus::{Bus, Frame};
use miniz_oxide::inflate::decompress_to_vec_zlib_with_limit;
use shsa_core::time::{Span, Time};
use shsa_message::stamp::civil;
use std::io::{self, SeekFrom};

/// The first bytes of every file.
pub(in super::super) const MAGIC: &[u8] = b"LOGG";

/// The first bytes of every object.
const OBJECT: &[u8] = b"LOBJ";

/// The length of the base header of an object: the magic, the length and the version of the header, the length of the object, the
/// kind.
const BASE: usize = 16;

/// The header of the file up to the date of its end.
const FILE_HEADER: usize = 72;

/// The largest length of an object that is accepted; recorders write containers of 128 KiB.
const OBJECT_MAX: usize = 1 << 26;

/// The largest container after decompression, bytes.
const UNPACKED_MAX: u64 = 1 << 24;

/// The largest part of an object that waits for the next container, bytes. Frames have less than a hundred.
const WAITING_MAX: usize = 1 << 23;

/// How many bytes one step of the search after damage covers.
const SEARCH_BLOCK: usize = 1 << 16;

const CONTAINER: u32 = 10;
const CAN: [u32; 2] = [1, 86];
const CAN_FD: u32 = 100;
const CAN_FD_64: u32 = 101;

/// The most bytes of a frame.
const DATA_MAX: usize = 64;

/// The flag of a remote frame, which has no data.
const REMOTE: u8 = 0x80;

/// The flag of a remote frame among those of a CAN FD frame.
const REMOTE_FD: u32 = 0x10;

/// The base header of an object.
#[derive(Clone, Copy)]
struct Head {
    header: usize,
    version: u16,
    length: usize,
    kind: u32,
}

impl Head {
    /// The base header that begins here, if one does.
    fn of(bytes: &[u8]) -> Option<Head> {
        let fields = bytes.strip_prefix(OBJECT)?;
        let header = usize::from(u16::from_le_bytes(array(fields, 0)?));
        let version = u16::from_le_bytes(array(fields, 2)?);
        let length = usize::try_from(u32::from_le_bytes(array(fields, 4)?)).ok()?;
        let kind = u32::from_le_bytes(array(fields, 8)?);
        let is_likely =
            (BASE..=OBJECT_MAX).contains(&length) && header >= BASE && header <= length && kind < 1 << 12;
        is_likely.then_some(Head { header, version, length, kind })
    }
}

/// Reads all frames.
pub(in super::super) fn read(
    input: &mut dyn Input,
    options: &ReadOptions,
    listener: &mut dyn Listener,
) -> Result<(), RecordingError> {
    let budget = Budget::of(input.seek(SeekFrom::End(0)).unwrap_or(0));
    let rewound = input.rewind();
    let bus = Bus::new(options, listener)?;
    let mut reader = Reader { bus, start: Time::default(), left: Vec::new(), budget, listener };
    let mut window = Window::new(input);
    let outcome =
        rewound.and_then(|()| reader.begin(&mut window, options)).and_then(|()| reader.objects(&mut window));
    if let Err(failure) = outcome {
        reader.listener.damaged(Place::Offset(window.offset()), format!("reading stopped: {failure}"));
    }
    reader.bus.finish(reader.listener);
    Ok(())
}

struct Reader<'a> {
    bus: Bus,
    /// The date from which times count.
    start: Time,
    /// Decompressed bytes of an object that continues in the next container.
    left: Vec<u8>,
    /// What the containers may unpack to.
    budget: Budget,
    listener: &'a mut dyn Listener,
}

impl Reader<'_> {
    fn begin(&mut self, window: &mut Window<&mut dyn Input>, options: &ReadOptions) -> io::Result<()> {
        let Some(header) = window.exactly(FILE_HEADER)? else {
            self.listener.damaged(Place::Offset(0), "the file ends within its header".into());
            return window.skip(u64::MAX);
        };
        let length = u32::from_le_bytes(array(header, 4).unwrap_or_default());
        let said = match date(header) {
            None => Some(NO_DATE.to_owned()),
            Some(shown) => {
                let (start, said) = of_place(shown, &options.zone);
                self.start = start;
                said
            }
        };
        said.into_iter().for_each(|said| self.listener.note(Place::Whole, said));
        window.skip(u64::from(length).clamp(FILE_HEADER as u64, 1 << 12))
    }

    fn objects(&mut self, window: &mut Window<&mut dyn Input>) -> io::Result<()> {
        loop {
            let ahead = window.ahead(BASE + 3)?;
            if ahead.iter().all(|byte| *byte == 0) && ahead.len() < BASE {
                return Ok(());
            }
            // Objects are aligned to four bytes.
            let padding = (0..4).find(|at| ahead.get(*at..).is_some_and(|rest| rest.starts_with(OBJECT)));
            let head = padding.and_then(|at| Head::of(ahead.get(at..)?).map(|head| (at, head)));
            let offset = window.offset();
            let Some((padding, head)) = head else {
                self.search(window)?;
                continue;
            };
            window.pass(padding);
            let object = window.ahead(head.length)?;
            let there = object.len().min(head.length);
            if let Some(object) = object.get(..there) {
                self.object(head, object, offset);
            }
            if there < head.length {
                let problem =
                    format!("the file ends within an object: {there} of {} bytes are there", head.length);
                self.listener.damaged(Place::Offset(offset), problem);
                return Ok(());
            }
            window.pass(head.length);
        }
    }

    /// Goes to the next object.
    fn search(&mut self, window: &mut Window<&mut dyn Input>) -> io::Result<()> {
        let begin = window.offset();
        window.pass(1);
        loop {
            let ahead = window.ahead(SEARCH_BLOCK + BASE)?;
            let searched = ahead.len().min(SEARCH_BLOCK);
            let found = (0..searched).find(|at| ahead.get(*at..).and_then(Head::of).is_some());
            window.pass(found.unwrap_or(searched));
            if found.is_some() || searched == 0 {
                break;
            }
        }
        let lost = window.offset() - begin;
        self.listener.damaged(Place::Offset(begin), format!("no object begins here: {lost} bytes are lost"));
        Ok(())
    }

    fn object(&mut self, head: Head, object: &[u8], offset: u64) {
        if head.kind != CONTAINER {
            return self.frame(head, object);
        }
        let (method, packed) = (array(object, BASE).map_or(0, u16::from_le_bytes), object.get(BASE + 16..));
        let packed = packed.unwrap_or_default();
        match method {
            0 => self.left.extend_from_slice(packed),
            _ => self.unpack(packed, offset),
        }
        self.unpacked(offset);
    }

    /// Appends what a container unpacks to; of a damaged one the bytes before the damage.
    fn unpack(&mut self, packed: &[u8], offset: u64) {
        let limit = match self.budget.next(UNPACKED_MAX) {
            Ok(limit) => usize::try_from(limit).unwrap_or(usize::MAX),
            Err(problem) => {
                let problem = format!("a container is left out: {problem}");
                return self.listener.damaged(Place::Offset(offset), problem);
            }
        };
        let (bytes, problem) = match decompress_to_vec_zlib_with_limit(packed, limit) {
            Ok(bytes) => (bytes, None),
            Err(error) => {
                let length = error.output.len();
                let problem = format!("a container unpacks to {length} bytes and no further: {error}");
                (error.output, Some(problem))
            }
        };
        // The limit was the rest of the budget.
        drop(self.budget.take(bytes.len() as u64));
        problem.into_iter().for_each(|problem| self.listener.damaged(Place::Offset(offset), problem));
        self.left.extend_from_slice(&bytes);
    }

    /// Reads the objects of a container; the bytes of one that continues in the next container stay.
    fn unpacked(&mut self, offset: u64) {
        let mut bytes = std::mem::take(&mut self.left);
        let mut at = 0;
        while let Some(rest) = bytes.get(at..).filter(|rest| rest.len() >= BASE) {
            let head = (0..8).find_map(|skip| Some((skip, Head::of(rest.get(skip..)?)?)));
            let Some((skip, head)) = head else {
                let next = (1..rest.len()).find(|at| rest.get(*at..).and_then(Head::of).is_some());
                // The last bytes may be the beginning of an object.
                let lost = next.unwrap_or(rest.len() - BASE);
                if next.is_some() || rest.len() >= 2 * BASE {
                    let problem = format!("{lost} unpacked bytes of this container are no object");
                    self.listener.damaged(Place::Offset(offset), problem);
                }
                at += lost;
                if next.is_none() {
                    break;
                }
                continue;
            };
            let Some(object) = rest.get(skip..skip + head.length) else { break };
            self.frame(head, object);
            at += skip + head.length;
        }
        bytes.drain(..at.min(bytes.len()));
        if bytes.len() > WAITING_MAX {
            let problem = format!("an object of more than {} MiB in containers, left out", WAITING_MAX >> 20);
            self.listener.damaged(Place::Offset(offset), problem);
            bytes = Vec::new();
        }
        self.left = bytes;
    }

    /// Reports an object that is a frame.
    fn frame(&mut self, head: Head, object: &[u8]) {
        let content = object.get(head.header..).unwrap_or_default();
        let parsed = match head.kind {
            kind if CAN.contains(&kind) => classic(content),
            CAN_FD => flexible(content),
            CAN_FD_64 => flexible_64(content, head.header),
            _ => return,
        };
        let Some(time) = self.time(head, object) else { return };
        let is_whole = object.len() >= head.length;
        match parsed {
            Some((channel, id, Some(bytes))) if is_whole || bytes.there.len() >= bytes.length => {
                let channel = channel.to_string();
                let (mut filled, length) = ([0; DATA_MAX], bytes.length.min(DATA_MAX));
                filled.iter_mut().zip(bytes.there).for_each(|(to, byte)| *to = *byte);
                let data = filled.get(..length).unwrap_or_default();
                self.bus.report(&Frame { time, channel: &channel, id, data }, self.listener);
            }
            _ => self.bus.pass(),
        }
    }

    /// The time of an object; its flags choose between steps of 10 us and of 1 ns.
    fn time(&self, head: Head, object: &[u8]) -> Option<Time> {
        let flags = u32::from_le_bytes(array(object, BASE)?);
        // Both versions of the header have the time at the same place.
        let steps = u64::from_le_bytes(array(object, BASE + 8)?);
        let step = if flags == 1 { 10_000 } else { 1 };
        let since = i64::try_from(steps).ok()?.checked_mul(step)?;
        (head.version <= 2).then(|| self.start + Span(since))
    }
}

/// The bytes of a frame.
struct Bytes<'a> {
    /// How many bytes the frame had on the bus.
    length: usize,
    /// Those in the object, which recorders may end before the last ones: these are zero.
    there: &'a [u8],
}

/// The channel, the identifier, and the bytes; `None` for those of a remote frame.
type Parsed<'a> = Option<(u16, u32, Option<Bytes<'a>>)>;

/// The first bytes of these, as many as the frame had on the bus, or as there are.
fn bytes(there: Option<&[u8]>, length: usize) -> Option<Bytes<'_>> {
    let there = there?;
    Some(Bytes { length, there: there.get(..length).unwrap_or(there) })
}

/// Channel, flags, length, identifier, 8 bytes.
fn classic(content: &[u8]) -> Parsed<'_> {
    let (flags, length) = (*content.get(2)?, usize::from(*content.get(3)?).min(8));
    let id = u32::from_le_bytes(array(content, 4)?);
    let data = bytes(content.get(8..), length).filter(|_| flags & REMOTE == 0);
    Some((u16::from_le_bytes(array(content, 0)?), id, data))
}

/// Channel, flags, code of the length, identifier, length on the bus, bits, CAN FD flags, number of valid bytes, 64 bytes.
fn flexible(content: &[u8]) -> Parsed<'_> {
    let (flags, length) = (*content.get(2)?, usize::from(*content.get(14)?).min(DATA_MAX));
    let id = u32::from_le_bytes(array(content, 4)?);
    let data = bytes(content.get(20..), length).filter(|_| flags & REMOTE == 0);
    Some((u16::from_le_bytes(array(content, 0)?), id, data))
}

/// Channel, code of the length, number of valid bytes, number of attempts, identifier, length on the bus, flags, .., where in the
/// object further values stand behind the bytes (0 for none), a checksum, the bytes. The content begins after the header.
fn flexible_64(content: &[u8], header: usize) -> Parsed<'_> {
    let (channel, length) = (*content.first()?, usize::from(*content.get(2)?).min(DATA_MAX));
    let id = u32::from_le_bytes(array(content, 4)?);
    let flags = u32::from_le_bytes(array(content, 12)?);
    let end = usize::from(*content.get(35)?).checked_sub(header).filter(|end| *end >= 40);
    let there = end.and_then(|end| content.get(40..end)).or(content.get(40..));
    let data = bytes(there, length).filter(|_| flags & REMOTE_FD == 0);
    Some((channel.into(), id, data))
}

/// The date of the start: year, month, day of the week, day, hour, minute, second, millisecond.
fn date(header: &[u8]) -> Option<Time> {
    let field = |at: usize| array(header, 40 + 2 * at).map(|bytes| i64::from(u16::from_le_bytes(bytes)));
    let (year, month, day) = (field(0)?, field(1)?, field(3)?);
    let of_day_ms = ((field(4)? * 60 + field(5)?) * 60 + field(6)?) * 1_000 + field(7)?;
    civil(year, month, day, of_day_ms * 1_000_000).filter(|_| year > 1970)
}
