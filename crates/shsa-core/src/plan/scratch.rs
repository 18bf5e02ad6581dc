//! Working memory that searches pass on.

use super::subproblem::{Marks, Reading, Subproblem};
use alloc::boxed::Box;

/// The working memory of searches: for any graph and any variable.
///
/// A search with used memory sets up nothing in the size of the graph, and allocates nothing on trees.
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
