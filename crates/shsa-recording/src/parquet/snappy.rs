//! Decompresses Snappy.
//!
//! Format: <https://github.com/google/snappy/blob/main/format_description.txt>.

use super::bytes::Bytes;

/// Decompresses to at most `limit` bytes; `None` where the bytes are no Snappy data.
pub(super) fn unpack(packed: &[u8], limit: usize) -> Option<Vec<u8>> {
    let mut packed = Bytes(packed);
    let length = usize::try_from(packed.varint()?).ok().filter(|length| *length <= limit)?;
    let mut unpacked = Vec::with_capacity(length.min(packed.0.len().saturating_mul(64)));
    while let Some(tag) = packed.byte() {
        match tag & 3 {
            0 => {
                let length = match usize::from(tag >> 2) {
                    short @ 0..60 => short,
                    long => number(packed.take(long - 59)?),
                };
                unpacked.extend_from_slice(packed.take(length.checked_add(1)?)?);
            }
            1 => {
                let back = usize::from(tag >> 5) << 8 | usize::from(packed.byte()?);
                again(&mut unpacked, back, usize::from(tag >> 2 & 7) + 4)?;
            }
            kind => {
                let back = number(packed.take(if kind == 2 { 2 } else { 4 })?);
                again(&mut unpacked, back, usize::from(tag >> 2) + 1)?;
            }
        }
        if unpacked.len() > length {
            return None;
        }
    }
    (unpacked.len() == length).then_some(unpacked)
}

fn number(bytes: &[u8]) -> usize {
    bytes.iter().rev().fold(0, |number, byte| number << 8 | usize::from(*byte))
}

/// Appends `length` bytes from `back` bytes before the end; a longer copy repeats itself.
fn again(unpacked: &mut Vec<u8>, back: usize, length: usize) -> Option<()> {
    let from = unpacked.len().checked_sub(back).filter(|_| back > 0)?;
    let mut left = length;
    while left > 0 {
        // What repeats itself doubles with each copy.
        let taken = left.min(unpacked.len() - from);
        unpacked.extend_from_within(from..from + taken);
        left -= taken;
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_and_repetitions_are_unpacked() {
        // `ab`, then eight bytes from two bytes back.
        let packed = [10, 1 << 2, b'a', b'b', (8 - 4) << 2 | 1, 2];
        assert_eq!(unpack(&packed, 100).unwrap(), b"ababababab");
        assert_eq!(unpack(&packed, 9), None);
        assert_eq!(unpack(&packed[..5], 100), None);
        assert_eq!(unpack(&[10, 1 << 2, b'a', b'b', (8 - 4) << 2 | 1, 3], 100), None);
        assert_eq!(unpack(&[4, 7 << 2 | 2, 1, 0], 100), None);
    }
}
