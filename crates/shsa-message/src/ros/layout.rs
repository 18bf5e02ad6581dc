//! The layouts of messages on the wire, and reading of numbers, texts and times.

use super::definition::Primitive;
use crate::MessageError;
use shsa_core::time::Time;

/// The layout of messages on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// ROS 1: fields without gaps, little endian; lists and texts follow a count of four bytes.
    Packed,
    /// ROS 2: XCDR version 1 (OMG DDS-XTypes 1.3, 7.4.1). Every number is aligned to its size, counted from the start of the
    /// body; lists and texts follow a count of four bytes, and a text ends with a zero.
    Cdr,
}

impl Layout {
    /// The alignment of a field of this size.
    pub(super) fn alignment(self, size: usize) -> usize {
        match self {
            Layout::Packed => 1,
            Layout::Cdr => size,
        }
    }

    /// The number of bytes of a message without fields.
    pub(super) fn nothing(self) -> usize {
        match self {
            Layout::Packed => 0,
            Layout::Cdr => 1,
        }
    }
}

/// The content of one message.
#[derive(Clone, Copy, Debug)]
pub struct Body<'a> {
    /// The bytes, without the header of CDR.
    pub bytes: &'a [u8],
    /// Whether the first byte of a number is its highest.
    pub is_big_endian: bool,
    pub(super) layout: Layout,
}

impl<'a> Body<'a> {
    /// The body of a ROS 1 message.
    #[must_use]
    pub fn packed(bytes: &'a [u8]) -> Body<'a> {
        Body { bytes, is_big_endian: false, layout: Layout::Packed }
    }

    /// The body of a CDR message, behind a header of four bytes that gives the byte order.
    ///
    /// # Errors
    /// A missing header, or one of another encoding.
    pub fn cdr(message: &'a [u8]) -> Result<Body<'a>, MessageError> {
        match message.split_first_chunk() {
            Some(([0, order @ (0 | 1), _, _], bytes)) => {
                Ok(Body { bytes, is_big_endian: *order == 0, layout: Layout::Cdr })
            }
            Some(([high, low, ..], _)) => Err(MessageError::NoPlainCdr(u16::from_be_bytes([*high, *low]))),
            None => Err(MessageError::NoCdr(message.len())),
        }
    }

    /// The number at a position, also for ROS 1's times in seconds; `None` past the end.
    #[must_use]
    pub fn number(self, primitive: Primitive, at: usize) -> Option<f64> {
        Some(match primitive {
            Primitive::Bool | Primitive::Byte | Primitive::U8 => u8::from_ne_bytes(self.take(at)?).into(),
            Primitive::I8 => i8::from_ne_bytes(self.take(at)?).into(),
            Primitive::I16 => i16::from_ne_bytes(self.take(at)?).into(),
            Primitive::U16 => u16::from_ne_bytes(self.take(at)?).into(),
            Primitive::I32 => i32::from_ne_bytes(self.take(at)?).into(),
            Primitive::U32 => u32::from_ne_bytes(self.take(at)?).into(),
            Primitive::I64 => i64::from_ne_bytes(self.take(at)?) as f64,
            Primitive::U64 => u64::from_ne_bytes(self.take(at)?) as f64,
            Primitive::F32 => f32::from_ne_bytes(self.take(at)?).into(),
            Primitive::F64 => f64::from_ne_bytes(self.take(at)?),
            Primitive::Time => self.time(at)?.0 as f64 * 1e-9,
            Primitive::Duration => {
                let [seconds, nanoseconds] = [at, at.checked_add(4)?].map(|at| self.take(at));
                f64::from(i32::from_ne_bytes(seconds?)) + f64::from(i32::from_ne_bytes(nanoseconds?)) * 1e-9
            }
        })
    }

    /// The point in time at a position: seconds, unsigned in ROS 1, and nanoseconds. `None` past the end.
    #[must_use]
    pub fn time(self, at: usize) -> Option<Time> {
        let seconds = match self.layout {
            Layout::Packed => i64::from(u32::from_ne_bytes(self.take(at)?)),
            Layout::Cdr => i64::from(i32::from_ne_bytes(self.take(at)?)),
        };
        let nanoseconds = u32::from_ne_bytes(self.take(at.checked_add(4)?)?);
        Some(Time(seconds * 1_000_000_000 + i64::from(nanoseconds)))
    }

    /// The text at a position, in CDR without its closing zero, and the position behind it. `None` when it is incomplete.
    #[must_use]
    pub fn text(self, at: usize) -> Option<(&'a [u8], usize)> {
        let (length, at) = self.counted(at)?;
        let end = at.checked_add(length)?;
        let text = self.bytes.get(at..end)?;
        let shown = match self.layout {
            Layout::Packed => text,
            Layout::Cdr => text.strip_suffix(&[0]).unwrap_or(text),
        };
        Some((shown, end))
    }

    /// A count and the position behind it.
    pub(super) fn counted(self, at: usize) -> Option<(usize, usize)> {
        let at = match self.layout {
            Layout::Packed => at,
            Layout::Cdr => at.checked_next_multiple_of(4)?,
        };
        let count = u32::from_ne_bytes(self.take(at)?);
        Some((count as usize, at + 4))
    }

    /// Bytes in this machine's order.
    fn take<const N: usize>(self, at: usize) -> Option<[u8; N]> {
        let mut bytes: [u8; N] = *self.bytes.get(at..)?.first_chunk()?;
        if self.is_big_endian != cfg!(target_endian = "big") {
            bytes.reverse();
        }
        Some(bytes)
    }
}
