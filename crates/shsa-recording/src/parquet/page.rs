//! The values of a page, one after the other.

use super::bytes::Bytes;
use super::cells::{Cell, Runs};
use super::description::Column;
use super::encoding::plain_numbers;
use std::iter::repeat_n;

/// The values of a page that are left.
#[derive(Default)]
pub(super) struct Page {
    content: Content,
    /// The texts of a page without a dictionary.
    texts: Option<Vec<Box<str>>>,
    /// The repetition level of each value, where the column is a list.
    repeats: Vec<u32>,
    /// The index of the next value.
    next: usize,
}

/// What a page has.
enum Content {
    /// Values; those of the run of the next value that have passed.
    Runs { values: Runs<Cell>, run: usize, passed: u32 },
    /// The numbers of values in the dictionary, which has all of them.
    Numbers(Vec<u32>),
    /// So many values as they are stored, all of the same width.
    Plain { bytes: Vec<u8>, width: usize, count: usize },
}

impl Default for Content {
    fn default() -> Content {
        Content::Runs { values: Runs::default(), run: 0, passed: 0 }
    }
}

impl Page {
    /// A page of values that are missing.
    pub(super) fn lost(count: usize) -> Page {
        let mut values = Runs::default();
        values.push(Cell::Missing, count);
        Page { content: Content::Runs { values, run: 0, passed: 0 }, ..Page::default() }
    }

    /// A page of values, with their texts where these are not in the dictionary, and the repetition levels of a list.
    pub(super) fn of(mut values: Runs<Cell>, texts: Option<Vec<Box<str>>>, repeats: Vec<u32>) -> Page {
        values.list.shrink_to_fit();
        Page { content: Content::Runs { values, run: 0, passed: 0 }, texts, repeats, next: 0 }
    }

    /// A page of values that the dictionary has under these numbers.
    pub(super) fn of_dictionary(numbers: Vec<u32>) -> Page {
        Page { content: Content::Numbers(numbers), ..Page::default() }
    }

    /// A page of values that are stored one after the other, each in as many bytes.
    pub(super) fn of_plain(bytes: Vec<u8>, width: usize) -> Page {
        let count = bytes.len() / width.max(1);
        Page { content: Content::Plain { bytes, width, count }, ..Page::default() }
    }

    /// The texts of its own.
    pub(super) fn texts(&self) -> Option<&[Box<str>]> {
        self.texts.as_deref()
    }

    /// The number of values that have not passed.
    pub(super) fn left(&self) -> usize {
        let count = match &self.content {
            Content::Runs { values, .. } => values.count,
            Content::Numbers(numbers) => numbers.len(),
            Content::Plain { count, .. } => *count,
        };
        count.saturating_sub(self.next)
    }

    /// The repetition level of the next value.
    pub(super) fn level(&self) -> u32 {
        self.repeats.get(self.next).copied().unwrap_or(0)
    }

    /// Appends the next so many values, of which there are as many.
    pub(super) fn pass(&mut self, count: usize, column: &Column, dictionary: &[Cell], cells: &mut Vec<Cell>) {
        let at = self.next;
        self.next += count;
        match &mut self.content {
            Content::Numbers(numbers) => {
                let known = |number: &u32| dictionary.get(*number as usize).copied().unwrap_or(Cell::Missing);
                cells.extend(numbers.get(at..at + count).unwrap_or_default().iter().map(known));
            }
            Content::Plain { bytes, width, .. } => {
                let rest = bytes.get(at * *width..).unwrap_or_default();
                // A page has as many bytes as its values take.
                let _all = plain_numbers(&mut Bytes(rest), column, count, cells);
            }
            Content::Runs { values, run, passed } => {
                let mut missing = count;
                while let Some((cell, times)) = values.list.get(*run).filter(|_| missing > 0) {
                    let taken = (times - *passed).min(u32::try_from(missing).unwrap_or(u32::MAX));
                    cells.extend(repeat_n(*cell, taken as usize));
                    missing -= taken as usize;
                    *passed += taken;
                    if *passed >= *times {
                        (*run, *passed) = (*run + 1, 0);
                    }
                }
            }
        }
    }
}
