//! Working memory that searches hand on to each other.

use super::subproblem::{Marks, Reading, Subproblem};
use alloc::boxed::Box;

/// What a search needs while it runs, kept for the next one: of any graph, for any variable.
///
/// A search that begins with the memory of others sets up nothing in the size of the graph, and on trees allocates
/// nothing.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    pub(super) marks: Marks,
    pub(super) subproblem: Subproblem,
    pub(super) reading: Reading,
}

/// The working memory of a search: its own, or lent.
#[derive(Debug)]
pub(super) enum Held<'a> {
    Own(Box<Scratch>),
    Lent(&'a mut Scratch),
}

impl Held<'_> {
    pub(super) fn get(&self) -> &Scratch {
        match self {
            Held::Own(scratch) => scratch,
            Held::Lent(scratch) => scratch,
        }
    }

    pub(super) fn get_mut(&mut self) -> &mut Scratch {
        match self {
            Held::Own(scratch) => scratch,
            Held::Lent(scratch) => scratch,
        }
    }
}
