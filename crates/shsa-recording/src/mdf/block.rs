//! The blocks of an MDF 4 file: a head, links to other blocks, and content.

use super::super::record::array;
use super::super::topic::Input;
use super::super::unpack::Budget;
use std::io::{self, Read, SeekFrom};

/// The length of a block's head: its name, four empty bytes, its length, the number of its links.
const HEAD: u64 = 24;

/// The longest block that is read whole: definitions are short, and a block of compressed data is not longer.
pub(super) const BLOCK_MAX: u64 = 1 << 26;

/// The most links of a block that are accepted.
const LINKS_MAX: u64 = 1 << 20;

/// The most blocks that are read, as links may form a circle.
const BLOCKS_MAX: usize = 1 << 18;

/// The longest text, bytes.
const TEXT_MAX: u64 = 1 << 12;

/// A block with its content, or, for plain data, with the place of its content.
#[derive(Clone, Debug)]
pub(super) struct Block {
    /// `HD`, `DG`, ..
    pub(super) name: [u8; 2],
    /// The places of the linked blocks; 0 for none.
    pub(super) links: Vec<u64>,
    /// The content after the links; empty for plain data.
    pub(super) content: Vec<u8>,
    /// The place of the content in the file.
    pub(super) at: u64,
    /// The length of the content.
    pub(super) length: u64,
}

impl Block {
    pub(super) fn link(&self, number: usize) -> u64 {
        self.links.get(number).copied().unwrap_or(0)
    }

    pub(super) fn u8(&self, at: usize) -> u8 {
        self.content.get(at).copied().unwrap_or(0)
    }

    pub(super) fn u16(&self, at: usize) -> u16 {
        array(&self.content, at).map_or(0, u16::from_le_bytes)
    }

    pub(super) fn u32(&self, at: usize) -> u32 {
        array(&self.content, at).map_or(0, u32::from_le_bytes)
    }

    pub(super) fn u64(&self, at: usize) -> u64 {
        array(&self.content, at).map_or(0, u64::from_le_bytes)
    }

    pub(super) fn f64(&self, at: usize) -> f64 {
        array(&self.content, at).map_or(0.0, f64::from_le_bytes)
    }
}

/// The blocks of a file.
pub(super) struct Blocks<'a> {
    pub(super) input: &'a mut dyn Input,
    pub(super) length: u64,
    count: usize,
    /// What may be read, and what it may unpack to.
    pub(super) budget: Budget,
}

/// Why a block cannot be read.
#[derive(Debug, thiserror::Error)]
pub(super) enum Unread {
    #[error("{0}")]
    Failed(#[from] io::Error),
    #[error("no block begins at byte {0}")]
    None(u64),
    #[error("the block at byte {at} has {length} bytes, of which {there} are in the file")]
    Cut { at: u64, length: u64, there: u64 },
    #[error("the file has more than {BLOCKS_MAX} blocks, or they lead in a circle")]
    TooMany,
    #[error("{0}")]
    TooMuch(String),
}

impl<'a> Blocks<'a> {
    pub(super) fn new(input: &'a mut dyn Input) -> io::Result<Blocks<'a>> {
        let length = input.seek(SeekFrom::End(0))?;
        Ok(Blocks { input, length, count: 0, budget: Budget::of(length) })
    }

    /// The block at a place; the content of plain data is left in the file.
    pub(super) fn block(&mut self, at: u64) -> Result<Block, Unread> {
        self.count += 1;
        if self.count > BLOCKS_MAX {
            return Err(Unread::TooMany);
        }
        let head = self.bytes(at, HEAD)?;
        let length = array(&head, 8).map_or(0, u64::from_le_bytes);
        let links = array(&head, 16).map_or(0, u64::from_le_bytes);
        let name = match head.as_slice() {
            [b'#', b'#', one, two, ..] if links <= LINKS_MAX => [*one, *two],
            _ => return Err(Unread::None(at)),
        };
        let before = HEAD + 8 * links;
        let there = self.length - at;
        let is_data = matches!(&name, b"DT" | b"SD" | b"RD" | b"DV");
        if length < before || !is_data && length > there {
            return Err(Unread::Cut { at, length, there });
        }
        let bytes = self.bytes(at + HEAD, 8 * links)?;
        let links = bytes.as_chunks::<8>().0.iter().map(|link| u64::from_le_bytes(*link)).collect();
        let content_length = if is_data { 0 } else { (length - before).min(BLOCK_MAX) };
        let content = self.bytes(at + before, content_length)?;
        Ok(Block { name, links, content, at: at + before, length: length - before })
    }

    /// The block at a place, if it has this name.
    pub(super) fn of_name(&mut self, at: u64, name: &[u8; 2]) -> Result<Block, Unread> {
        let block = self.block(at)?;
        if block.name == *name { Ok(block) } else { Err(Unread::None(at)) }
    }

    /// The text at a link, without XML tags; empty where there is none.
    pub(super) fn text(&mut self, at: u64) -> String {
        if at == 0 {
            return String::new();
        }
        let Ok(block) = self.block(at) else { return String::new() };
        let bytes = block.content.split(|byte| *byte == 0).next().unwrap_or_default();
        let text = String::from_utf8_lossy(bytes.get(..TEXT_MAX as usize).unwrap_or(bytes));
        let text = match block.name == *b"MD" {
            true => text
                .split_once("<TX>")
                .and_then(|(_, rest)| rest.split_once("</TX>"))
                .map_or("", |(text, _)| text),
            false => &text,
        };
        text.trim().to_owned()
    }

    /// Bytes of the file; an error where the file ends before, or where links have led to the same bytes too often.
    pub(super) fn bytes(&mut self, at: u64, length: u64) -> Result<Vec<u8>, Unread> {
        let there = self.length.saturating_sub(at);
        if there < length {
            return Err(Unread::Cut { at, length, there });
        }
        self.budget.take(length).map_err(Unread::TooMuch)?;
        let mut bytes = Vec::new();
        self.input.seek(SeekFrom::Start(at))?;
        (&mut *self.input).take(length).read_to_end(&mut bytes)?;
        Ok(bytes)
    }
}
