//! The encoding of Protocol Buffers: fields with their numbers, read without copying and written one after the other.
//!
//! Format: <https://protobuf.dev/programming-guides/encoding>.

/// The wire types of whole numbers of variable length, of 64 bits, of bytes, and of 32 bits.
pub(crate) const VARINT: u64 = 0;
pub(crate) const FIXED64: u64 = 1;
pub(crate) const BYTES: u64 = 2;
pub(crate) const FIXED32: u64 = 5;

/// The value of a field on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Wire<'a> {
    /// A number of any encoding: its bits.
    Number(u64),
    /// Bytes, a text, a message, or packed numbers.
    Bytes(&'a [u8]),
}

/// Iterates over the fields of a message, each with its number; ends at an invalid one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fields<'a> {
    rest: &'a [u8],
    is_broken: bool,
}

impl<'a> Fields<'a> {
    /// The fields of a message.
    pub(crate) fn of(message: &'a [u8]) -> Fields<'a> {
        Fields { rest: message, is_broken: false }
    }

    /// Whether nothing is left.
    pub(crate) fn is_at_end(&self) -> bool {
        self.rest.is_empty()
    }

    /// Whether it has ended at an invalid field.
    pub(crate) fn is_broken(&self) -> bool {
        self.is_broken
    }

    /// The next whole number of variable length.
    #[inline]
    pub(crate) fn varint(&mut self) -> Option<u64> {
        match self.rest {
            // Most are short.
            [byte, rest @ ..] if *byte < 0x80 => {
                self.rest = rest;
                Some((*byte).into())
            }
            _ => self.long_varint(),
        }
    }

    fn long_varint(&mut self) -> Option<u64> {
        let mut number = 0_u64;
        for index in 0..10 {
            let (byte, rest) = self.rest.split_first()?;
            self.rest = rest;
            number |= u64::from(byte & 0x7f).checked_shl(7 * index).unwrap_or(0);
            if *byte < 0x80 {
                return Some(number);
            }
        }
        None
    }

    /// The next bytes of this number.
    #[inline]
    pub(crate) fn bytes(&mut self, length: usize) -> Option<&'a [u8]> {
        let (own, rest) = self.rest.split_at_checked(length)?;
        self.rest = rest;
        Some(own)
    }

    #[inline]
    fn field(&mut self) -> Option<(u64, Wire<'a>)> {
        let tag = self.varint()?;
        Some((tag >> 3, self.content(tag & 7)?))
    }

    /// The next value of this wire type.
    #[inline]
    pub(crate) fn content(&mut self, wire_type: u64) -> Option<Wire<'a>> {
        Some(match wire_type {
            VARINT => Wire::Number(self.varint()?),
            FIXED64 => Wire::Number(u64::from_le_bytes(*self.bytes(8)?.first_chunk()?)),
            BYTES => {
                let length = usize::try_from(self.varint()?).ok()?;
                Wire::Bytes(self.bytes(length)?)
            }
            FIXED32 => Wire::Number(u32::from_le_bytes(*self.bytes(4)?.first_chunk()?).into()),
            _ => return None,
        })
    }
}

impl<'a> Iterator for Fields<'a> {
    type Item = (u64, Wire<'a>);

    fn next(&mut self) -> Option<(u64, Wire<'a>)> {
        if self.rest.is_empty() || self.is_broken {
            return None;
        }
        let field = self.field();
        self.is_broken = field.is_none();
        field
    }
}

/// Appends a whole number of variable length.
fn put_number(mut number: u64, message: &mut Vec<u8>) {
    while number >= 0x80 {
        message.push((number & 0x7f) as u8 | 0x80);
        number >>= 7;
    }
    message.push(number as u8);
}

/// Appends a field with a whole number of variable length.
pub(crate) fn put_varint(field: u64, number: u64, message: &mut Vec<u8>) {
    put_number(field << 3 | VARINT, message);
    put_number(number, message);
}

/// Appends a field with a number of 64 bits.
pub(crate) fn put_double(field: u64, number: f64, message: &mut Vec<u8>) {
    put_number(field << 3 | FIXED64, message);
    message.extend_from_slice(&number.to_le_bytes());
}

/// Appends a field with bytes, a text or a message.
pub(crate) fn put_bytes(field: u64, bytes: &[u8], message: &mut Vec<u8>) {
    put_number(field << 3 | BYTES, message);
    put_number(bytes.len() as u64, message);
    message.extend_from_slice(bytes);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn what_is_written_is_read() {
        let mut message = Vec::new();
        put_varint(1, 300, &mut message);
        put_bytes(2, b"ab", &mut message);
        put_double(3, 1.5, &mut message);
        put_varint(16, u64::MAX, &mut message);
        let mut fields = Fields::of(&message);
        let expected = [
            (1, Wire::Number(300)),
            (2, Wire::Bytes(b"ab")),
            (3, Wire::Number(1.5_f64.to_bits())),
            (16, Wire::Number(u64::MAX)),
        ];
        assert_eq!(fields.by_ref().collect::<Vec<_>>(), expected);
        assert!(fields.is_at_end() && !fields.is_broken());
    }

    #[test]
    fn an_invalid_field_ends_the_message() {
        for broken in [&b"\x08"[..], b"\x0a\x05ab", b"\x09\x00", b"\x0b\x00", &[0xff; 11]] {
            let mut fields = Fields::of(broken);
            assert_eq!((fields.by_ref().count(), fields.is_broken()), (0, true), "{broken:?}");
        }
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_to_an_end(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            let mut fields = Fields::of(&bytes);
            prop_assert!(fields.by_ref().count() <= bytes.len());
            prop_assert!(fields.is_broken() || fields.is_at_end());
        }
    }
}
