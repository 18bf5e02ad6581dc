//! Decompresses what Parquet calls LZ4, without saying in which of its forms.
//!
//! Hadoop writes pieces, each behind its two sizes; older versions of Arrow a frame or a block. Source:
//! <https://parquet.apache.org/docs/file-format/data-pages/compression/>.

use super::bytes::Bytes;
use lz4_flex::block::decompress_into;
use lz4_flex::frame::FrameDecoder;
use std::io::Read;

/// Decompresses to as many bytes as stated; `None` where no form gives them.
pub(super) fn unpack(packed: &[u8], length: usize) -> Option<Vec<u8>> {
    let mut unpacked = vec![0; length];
    let is_unpacked = pieces(packed, &mut unpacked).is_some()
        || frame(packed, &mut unpacked).is_some()
        || block(packed, &mut unpacked).is_some();
    is_unpacked.then_some(unpacked)
}

/// The size of a piece, and its blocks, each behind its packed size.
fn pieces(packed: &[u8], mut to: &mut [u8]) -> Option<()> {
    let mut packed = Bytes(packed);
    while !packed.0.is_empty() {
        let (mut piece, rest) = to.split_at_mut_checked(size(&mut packed)?)?;
        while !piece.is_empty() {
            let length = size(&mut packed)?;
            let count = decompress_into(packed.take(length)?, piece).ok().filter(|count| *count > 0)?;
            piece = piece.get_mut(count..)?;
        }
        to = rest;
    }
    to.is_empty().then_some(())
}

fn size(packed: &mut Bytes<'_>) -> Option<usize> {
    usize::try_from(u32::from_be_bytes(*packed.take(4)?.first_chunk()?)).ok()
}

fn frame(packed: &[u8], to: &mut [u8]) -> Option<()> {
    let mut decoder = FrameDecoder::new(packed);
    decoder.read_exact(to).ok()?;
    // Nothing is left.
    matches!(decoder.read(&mut [0]), Ok(0)).then_some(())
}

fn block(packed: &[u8], to: &mut [u8]) -> Option<()> {
    decompress_into(packed, to).ok().filter(|count| *count == to.len()).map(|_| ())
}

#[cfg(test)]
mod tests {
    use super::*;
    use lz4_flex::block::compress;
    use lz4_flex::frame::FrameEncoder;
    use proptest::prelude::*;
    use std::io::Write;

    /// Pieces of these sizes at most, of blocks of half of them.
    fn of_hadoop(bytes: &[u8], size: usize) -> Vec<u8> {
        let number = |number: usize| u32::try_from(number).unwrap().to_be_bytes();
        let mut packed = Vec::new();
        for piece in bytes.chunks(size) {
            packed.extend(number(piece.len()));
            for block in piece.chunks(size.div_ceil(2)) {
                let block = compress(block);
                packed.extend(number(block.len()));
                packed.extend(block);
            }
        }
        packed
    }

    proptest! {
        #[test]
        fn all_forms_give_the_same(
            words in prop::collection::vec(prop_oneof![Just(0_u8), any::<u8>()], 1..300),
            size in 1..200_usize,
            cut in any::<prop::sample::Index>(),
        ) {
            let mut frame = FrameEncoder::new(Vec::new());
            frame.write_all(&words).unwrap();
            for packed in [of_hadoop(&words, size), frame.finish().unwrap(), compress(&words)] {
                prop_assert_eq!(unpack(&packed, words.len()), Some(words.clone()));
                prop_assert_eq!(unpack(&packed, words.len() + 1), None);
                let part = &packed[..cut.index(packed.len())];
                prop_assert!(unpack(part, words.len()).is_none_or(|unpacked| unpacked == words));
            }
        }
    }
}
