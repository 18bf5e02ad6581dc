//! The values of a page, one after the other.

use super::cells::{Cell, Runs};

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

    /// The texts of its own.
    pub(super) fn texts(&self) -> Option<&[Box<str>]> {
        self.texts.as_deref()
    }

    /// Whether all values have passed.
    pub(super) fn is_over(&self) -> bool {
        let count = match &self.content {
            Content::Runs { values, .. } => values.count,
            Content::Numbers(numbers) => numbers.len(),
        };
        self.next >= count
    }

    /// The repetition level of the next value.
    pub(super) fn level(&self) -> u32 {
        self.repeats.get(self.next).copied().unwrap_or(0)
    }

    /// The next value; missing at the end.
    pub(super) fn next(&mut self, dictionary: &[Cell]) -> Cell {
        let at = self.next;
        self.next += 1;
        match &mut self.content {
            Content::Numbers(numbers) => {
                let number = numbers.get(at).and_then(|number| dictionary.get(*number as usize));
                number.copied().unwrap_or(Cell::Missing)
            }
            Content::Runs { values, run, passed } => {
                let (cell, times) = values.list.get(*run).copied().unwrap_or((Cell::Missing, 1));
                *passed += 1;
                if *passed >= times {
                    (*run, *passed) = (*run + 1, 0);
                }
                cell
            }
        }
    }
}
