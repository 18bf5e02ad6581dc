//! The records of a data group, one after the other: each belongs to a group of channels.

use super::block::{Block, Blocks};
use super::data;
use std::collections::BTreeMap;

/// How many consecutive records show that reading is in step again.
const CHAIN: usize = 8;

/// How far the reader searches after damage, bytes.
const SEARCH_MAX: usize = 1 << 12;

/// The largest part of a record that waits for the next piece, bytes.
const WAITING_MAX: usize = 1 << 23;

/// The longest record, bytes.
const RECORD_MAX: usize = 1 << 26;

/// How records are told apart in the bytes.
pub(super) struct Layout {
    /// How many bytes before each record give its group.
    pub(super) id_length: usize,
    /// The lengths of records by the numbers of their groups.
    pub(super) lengths: BTreeMap<u64, Length>,
}

/// The length of a group's records.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Length {
    /// So many bytes, with the validity bits.
    Fixed(usize),
    /// Each record has its length in its first four bytes: a value of variable length.
    Variable,
}

/// What is met on the way.
pub(super) enum Met<'a> {
    /// A record of the group of this number.
    Record(u64, &'a [u8]),
    /// A loss at this place.
    Lost(u64, String),
}

impl Length {
    /// Of the records of a channel group.
    pub(super) fn of(block: &Block) -> Length {
        let length = (block.u32(24) as usize).saturating_add(block.u32(28) as usize);
        if block.u16(16) & 1 == 1 { Length::Variable } else { Length::Fixed(length.min(RECORD_MAX)) }
    }
}

impl Layout {
    /// The length of the record that begins here, with its number; `None` where none can begin.
    fn length(&self, bytes: &[u8]) -> Option<usize> {
        match self.lengths.get(&self.id(bytes)?)? {
            Length::Fixed(length) => Some(self.id_length + length).filter(|length| *length > 0),
            Length::Variable => {
                let length = super::super::record::array(bytes, self.id_length).map(u32::from_le_bytes)?;
                Some(self.id_length + 4 + length as usize)
            }
        }
    }

    /// The number of the group; a single group has none.
    fn id(&self, bytes: &[u8]) -> Option<u64> {
        if self.id_length == 0 {
            return self.lengths.keys().next().copied();
        }
        let id = bytes.get(..self.id_length)?;
        Some(id.iter().rev().fold(0, |all, byte| all << 8 | u64::from(*byte)))
    }

    /// Whether records follow each other from here on.
    fn is_way(&self, mut bytes: &[u8]) -> bool {
        (0..CHAIN).all(|_| match self.length(bytes) {
            Some(length) => {
                bytes = bytes.get(length..).unwrap_or_default();
                true
            }
            None => bytes.is_empty(),
        })
    }

    /// Meets the records of the data at a link, and what is lost between them.
    pub(super) fn walk(
        &self,
        data: u64,
        blocks: &mut Blocks<'_>,
        is_finished: bool,
        meet: &mut dyn FnMut(Met<'_>),
    ) {
        let mut left: Vec<u8> = Vec::new();
        data::pieces(blocks, data, is_finished, &mut |piece| match piece {
            Ok(bytes) => {
                self.append(&mut left, bytes, data, meet);
                if left.len() > WAITING_MAX {
                    let problem = format!("a record of more than {} MiB, left out", WAITING_MAX >> 20);
                    meet(Met::Lost(data, problem));
                    left = Vec::new();
                }
            }
            Err((at, problem)) => meet(Met::Lost(at, problem)),
        });
        if !left.is_empty() {
            let problem = format!("the last {} bytes of a data group are no whole record", left.len());
            meet(Met::Lost(data, problem));
        }
    }

    /// Meets the whole records of the bytes that were left and of the next ones; what is no whole record is left.
    fn append(&self, left: &mut Vec<u8>, bytes: &[u8], data: u64, meet: &mut dyn FnMut(Met<'_>)) {
        if left.is_empty() {
            let taken = self.records(bytes, data, meet);
            return left.extend_from_slice(bytes.get(taken..).unwrap_or_default());
        }
        left.extend_from_slice(bytes);
        let taken = self.records(left, data, meet);
        left.drain(..taken);
    }

    /// Meets the whole records of these bytes; returns their length.
    fn records(&self, bytes: &[u8], data: u64, meet: &mut dyn FnMut(Met<'_>)) -> usize {
        let mut at = 0;
        while let Some(rest) = bytes.get(at..).filter(|rest| rest.len() > self.id_length) {
            let Some(length) = self.length(rest) else {
                let searched = rest.len().min(SEARCH_MAX);
                let found = (1..searched).find(|at| rest.get(*at..).is_some_and(|rest| self.is_way(rest)));
                let lost = found.unwrap_or(searched);
                meet(Met::Lost(data, format!("{lost} bytes of a data group are no record")));
                at += lost;
                continue;
            };
            let Some(record) = rest.get(self.id_length..length) else { break };
            if let Some(id) = self.id(rest) {
                meet(Met::Record(id, record));
            }
            at += length;
        }
        at
    }
}
