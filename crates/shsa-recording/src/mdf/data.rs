//! The records of a data group: plain (`DT`), compressed (`DZ`), and in lists of these (`DL`, `HL`).

use super::super::unpack::Budget;
use super::block::{Block, Blocks, Unread};
use miniz_oxide::inflate::decompress_to_vec_zlib_with_limit;
use std::collections::BTreeSet;

/// The most listed data blocks that are not yet read.
const WAITING_MAX: usize = 1 << 20;

/// A piece of data, or the place and the description of a loss.
type Piece<'a> = Result<&'a [u8], (u64, String)>;

/// The longest block after decompression, bytes; the standard allows 4 MiB.
const UNPACKED_MAX: u64 = 1 << 24;

/// The size of the pieces in which plain data are read.
const PIECE: u64 = 1 << 20;

/// Hands over the data at a link, piece by piece in their order. Pieces may end within a record. Losses are handed over, too.
pub(super) fn pieces(blocks: &mut Blocks<'_>, link: u64, is_finished: bool, each: &mut dyn FnMut(Piece<'_>)) {
    // Lists link to the next list, and to data; `HL` links to the first list.
    let mut waiting = vec![link];
    let mut passed = BTreeSet::new();
    while let Some(at) = waiting.pop().filter(|at| *at != 0) {
        if !passed.insert(at) {
            each(Err((at, "the links of a list of data lead in a circle".to_owned())));
            continue;
        }
        let block = match blocks.block(at) {
            Ok(block) => block,
            Err(problem) => {
                each(Err((at, problem.to_string())));
                continue;
            }
        };
        match &block.name {
            b"HL" => waiting.push(block.link(0)),
            b"DL" => {
                let (next, data) =
                    block.links.split_first().map_or((0, &[][..]), |(next, data)| (*next, data));
                waiting.extend(Some(next).filter(|next| *next != 0));
                waiting.extend(data.iter().rev().copied().filter(|data| *data != 0));
                if waiting.len() > WAITING_MAX {
                    return each(Err((at, format!("a list of more than {WAITING_MAX} blocks of data"))));
                }
            }
            b"DT" | b"SD" | b"RD" => plain(blocks, &block, is_finished, each),
            b"DZ" => match unpacked(&block, &mut blocks.budget) {
                Ok(bytes) => each(Ok(&bytes)),
                Err((bytes, problem)) => {
                    each(Ok(&bytes));
                    each(Err((at, problem)));
                }
            },
            name => {
                let name = String::from_utf8_lossy(name.as_slice()).into_owned();
                each(Err((at, format!("a block of the kind {name}, whose data are not read here"))));
            }
        }
    }
}

fn plain(blocks: &mut Blocks<'_>, block: &Block, is_finished: bool, each: &mut dyn FnMut(Piece<'_>)) {
    let there = blocks.length - block.at;
    // A recorder that was interrupted has not written the length.
    let length = if !is_finished && block.length == 0 { there } else { block.length };
    let (mut at, end) = (block.at, block.at + length.min(there));
    while at < end {
        match blocks.bytes(at, (end - at).min(PIECE)) {
            Ok(bytes) => {
                at += bytes.len() as u64;
                each(Ok(&bytes));
            }
            Err(problem) => return each(Err((at, problem.to_string()))),
        }
    }
    if length > there && is_finished {
        let problem = Unread::Cut { at: block.at, length, there };
        each(Err((block.at, problem.to_string())));
    }
}

/// The decompressed data; on an error, those before the damage.
fn unpacked(block: &Block, budget: &mut Budget) -> Result<Vec<u8>, (Vec<u8>, String)> {
    let (method, columns) = (block.u8(2), block.u32(4) as usize);
    let (length, packed) = (block.u64(8), block.u64(16));
    if length > UNPACKED_MAX {
        return Err((
            Vec::new(),
            format!("a block unpacks to {length} bytes, of which {UNPACKED_MAX} are allowed"),
        ));
    }
    if let Err(problem) = budget.take(length) {
        return Err((Vec::new(), format!("a block of {length} bytes is left out: {problem}")));
    }
    if method > 1 {
        let how = "Python's asammdf packs it anew: MDF('old.mf4').save('new.mf4', compression=1)";
        return Err((Vec::new(), format!("packed by method {method}, which is not read here; {how}")));
    }
    let packed = usize::try_from(packed).ok().and_then(|packed| block.content.get(24..24 + packed));
    let packed = packed.unwrap_or(block.content.get(24..).unwrap_or_default());
    let bytes = match decompress_to_vec_zlib_with_limit(packed, length as usize) {
        Ok(bytes) => bytes,
        // Data that are still transposed make no record.
        Err(error) if method == 1 => return Err((Vec::new(), format!("a packed block is damaged: {error}"))),
        Err(error) => return Err((error.output.clone(), format!("a packed block is damaged: {error}"))),
    };
    Ok(if method == 1 { turned(&bytes, columns) } else { bytes })
}

/// Transposes columns back into rows; the rest after the last whole row is not transposed. `O(bytes)`.
fn turned(bytes: &[u8], columns: usize) -> Vec<u8> {
    let rows = bytes.len().checked_div(columns).unwrap_or(0);
    let mut turned = Vec::with_capacity(bytes.len());
    for row in 0..rows {
        turned.extend((0..columns).filter_map(|column| bytes.get(column * rows + row)));
    }
    turned.extend_from_slice(bytes.get(rows * columns..).unwrap_or_default());
    turned
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_become_rows() {
        assert_eq!(turned(b"adbecfX", 3), b"abcdefX");
        assert_eq!(turned(b"abc", 0), b"abc");
    }
}
