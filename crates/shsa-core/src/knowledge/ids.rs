//! Dense ids and the vectors that they index.

use crate::expression::Symbol;
use alloc::vec::Vec;
use core::marker::PhantomData;
use core::ops::{Index, IndexMut};

/// An index into the typed vector that made it.
pub trait Id: Copy + Ord {
    /// The id of the element at `index`.
    fn from_index(index: usize) -> Self;
    /// The element's place.
    fn index(self) -> usize;
}

macro_rules! id {
    ($(#[$doc:meta] $vis:vis $name:ident)*) => {$(
        #[$doc]
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        $vis struct $name(u32);

        impl $crate::knowledge::Id for $name {
            fn from_index(index: usize) -> Self {
                $name(u32::try_from(index).unwrap_or(u32::MAX))
            }
            fn index(self) -> usize {
                self.0 as usize
            }
        }
    )*};
}

pub(crate) use id;

id! {
    /// A variable of a knowledge base, in file order.
    pub VariableId
    /// A relation of a knowledge base, in file order.
    pub RelationId
    /// A signal of a knowledge base, in file order.
    pub SignalId
    /// A need of a knowledge base, in file order.
    pub NeedId
    /// A common cause of a knowledge base, in the order in which signals name them.
    pub CauseId
}

impl VariableId {
    /// The symbol that stands for the variable in formulas.
    #[must_use]
    pub fn symbol(self) -> Symbol {
        Symbol(self.0)
    }
}

/// A vector indexed by its own kind of id.
///
/// Only [`IdVec::push`] makes ids, so an id of this vector always finds its element.
#[derive(Clone, Debug, PartialEq)]
pub struct IdVec<I, T> {
    items: Vec<T>,
    kind: PhantomData<I>,
}

impl<I: Id, T> IdVec<I, T> {
    /// An empty vector.
    #[must_use]
    pub const fn new() -> Self {
        IdVec { items: Vec::new(), kind: PhantomData }
    }

    /// One element for each of `count` ids, made by `make`.
    pub fn filled(count: usize, make: impl FnMut(I) -> T) -> Self {
        IdVec { items: (0..count).map(I::from_index).map(make).collect(), kind: PhantomData }
    }

    /// Appends an element and returns its id.
    pub fn push(&mut self, item: T) -> I {
        self.items.push(item);
        I::from_index(self.items.len() - 1)
    }

    /// An empty vector with room for some elements.
    #[must_use]
    pub fn with_capacity(capacity: usize) -> Self {
        IdVec { items: Vec::with_capacity(capacity), kind: PhantomData }
    }

    /// Reserves room for more elements.
    pub fn reserve(&mut self, additional: usize) {
        self.items.reserve(additional);
    }

    /// Removes all elements, and keeps the room.
    pub fn clear(&mut self) {
        self.items.clear();
    }

    /// Removes and returns the last element.
    pub fn pop(&mut self) -> Option<T> {
        self.items.pop()
    }

    /// Keeps the elements whose ids `keep` accepts; elements after a dropped one get other ids.
    pub(super) fn retain(&mut self, mut keep: impl FnMut(I) -> bool) {
        let mut at = 0;
        self.items.retain(|_| {
            at += 1;
            keep(I::from_index(at - 1))
        });
    }

    /// The number of elements.
    #[must_use]
    pub fn len(&self) -> usize {
        self.items.len()
    }

    /// Whether the vector is empty.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.items.is_empty()
    }

    /// All ids, in order.
    pub fn ids(&self) -> impl DoubleEndedIterator<Item = I> + ExactSizeIterator + use<I, T> {
        (0..self.items.len()).map(I::from_index)
    }

    /// All elements, in order.
    pub fn iter(&self) -> core::slice::Iter<'_, T> {
        self.items.iter()
    }

    /// All elements, in order, mutable.
    pub fn iter_mut(&mut self) -> core::slice::IterMut<'_, T> {
        self.items.iter_mut()
    }

    /// Ids with their elements, in order.
    pub fn enumerate(&self) -> impl DoubleEndedIterator<Item = (I, &T)> + Clone {
        self.items.iter().enumerate().map(|(index, item)| (I::from_index(index), item))
    }

    /// The elements of a range of ids; empty for a range beyond the end.
    #[must_use]
    pub fn slice(&self, range: core::ops::Range<usize>) -> &[T] {
        self.items.get(range).unwrap_or_default()
    }

    /// The element of an id that may belong to another vector.
    #[inline]
    #[must_use]
    pub fn find(&self, id: I) -> Option<&T> {
        self.items.get(id.index())
    }
}

impl<I: Id, T> Default for IdVec<I, T> {
    fn default() -> Self {
        IdVec::new()
    }
}

#[expect(
    clippy::indexing_slicing,
    reason = "the one place that indexes: ids are made by the vector they index"
)]
impl<I: Id, T> Index<I> for IdVec<I, T> {
    type Output = T;
    #[inline]
    fn index(&self, id: I) -> &T {
        &self.items[id.index()]
    }
}

#[expect(
    clippy::indexing_slicing,
    reason = "the one place that indexes: ids are made by the vector they index"
)]
impl<I: Id, T> IndexMut<I> for IdVec<I, T> {
    #[inline]
    fn index_mut(&mut self, id: I) -> &mut T {
        &mut self.items[id.index()]
    }
}

impl<'a, I: Id, T> IntoIterator for &'a IdVec<I, T> {
    type Item = &'a T;
    type IntoIter = core::slice::Iter<'a, T>;
    fn into_iter(self) -> Self::IntoIter {
        self.items.iter()
    }
}

impl<I: Id, T> IntoIterator for IdVec<I, T> {
    type Item = T;
    type IntoIter = alloc::vec::IntoIter<T>;
    fn into_iter(self) -> Self::IntoIter {
        self.items.into_iter()
    }
}
