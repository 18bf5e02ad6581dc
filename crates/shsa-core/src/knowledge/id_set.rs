//! Sets of ids as bits.

use super::ids::{Id, RelationId, SignalId};
use alloc::vec::Vec;
use core::marker::PhantomData;

/// A set of elements of one kind, by id.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct IdSet<I> {
    /// The last word is never 0.
    words: Vec<u64>,
    kind: PhantomData<I>,
}

/// A set of signals.
pub type SignalSet = IdSet<SignalId>;

/// A set of relations.
pub type RelationSet = IdSet<RelationId>;

impl<I: Id> IdSet<I> {
    /// The empty set; equal sets have equal words, however they were made.
    #[must_use]
    pub const fn new() -> IdSet<I> {
        IdSet { words: Vec::new(), kind: PhantomData }
    }

    /// Adds an element; returns whether it was new.
    pub fn insert(&mut self, id: I) -> bool {
        let (word, bit) = place(id);
        if self.words.len() <= word {
            self.words.resize(word + 1, 0);
        }
        let Some(bits) = self.words.get_mut(word) else { return false };
        let is_new = *bits & bit == 0;
        *bits |= bit;
        is_new
    }

    /// Removes an element.
    pub fn remove(&mut self, id: I) {
        let (word, bit) = place(id);
        if let Some(bits) = self.words.get_mut(word) {
            *bits &= !bit;
        }
        self.trim();
    }

    /// Keeps the last word from being 0.
    fn trim(&mut self) {
        while self.words.last() == Some(&0) {
            self.words.pop();
        }
    }

    /// Whether the set contains an element.
    #[must_use]
    pub fn contains(&self, id: I) -> bool {
        let (word, bit) = place(id);
        self.words.get(word).is_some_and(|bits| bits & bit != 0)
    }

    /// Whether two sets have an element in common.
    #[must_use]
    pub fn meets(&self, other: &IdSet<I>) -> bool {
        self.words.iter().zip(&other.words).any(|(a, b)| a & b != 0)
    }

    /// Whether the set contains all elements of `other`.
    #[must_use]
    pub fn covers(&self, other: &IdSet<I>) -> bool {
        other.iter().all(|id| self.contains(id))
    }

    /// Adds all elements of another set.
    pub fn extend(&mut self, other: &IdSet<I>) {
        if self.words.len() < other.words.len() {
            self.words.resize(other.words.len(), 0);
        }
        for (bits, more) in self.words.iter_mut().zip(&other.words) {
            *bits |= more;
        }
    }

    /// Keeps the elements of both sets.
    pub fn intersect(&mut self, other: &IdSet<I>) {
        self.words.truncate(other.words.len());
        for (bits, kept) in self.words.iter_mut().zip(&other.words) {
            *bits &= kept;
        }
        self.trim();
    }

    /// The number of elements that are not in another set.
    #[must_use]
    pub fn count_outside(&self, other: &IdSet<I>) -> usize {
        let others = other.words.iter().chain(core::iter::repeat(&0));
        self.words.iter().zip(others).map(|(bits, others)| (bits & !others).count_ones() as usize).sum()
    }

    /// The elements of exactly one of two sets.
    #[must_use]
    pub fn difference(&self, other: &IdSet<I>) -> IdSet<I> {
        let (long, short) = if self.words.len() < other.words.len() { (other, self) } else { (self, other) };
        let mut apart = long.clone();
        for (bits, others) in apart.words.iter_mut().zip(&short.words) {
            *bits ^= others;
        }
        apart.trim();
        apart
    }

    /// The number of elements.
    #[must_use]
    pub fn len(&self) -> usize {
        self.words.iter().map(|bits| bits.count_ones() as usize).sum()
    }

    /// Whether the set is empty.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.words.is_empty()
    }

    /// The elements, ascending.
    pub fn iter(&self) -> impl Iterator<Item = I> + '_ {
        self.iter_from(0)
    }

    /// The elements from an index on, ascending.
    pub fn iter_from(&self, start: usize) -> impl Iterator<Item = I> + '_ {
        let first = start / 64;
        let words = self.words.iter().enumerate().skip(first);
        words.flat_map(move |(word, &bits)| {
            let bits = if word == first { bits & (u64::MAX << (start % 64)) } else { bits };
            let rest = core::iter::successors(Some(bits), |bits| Some(bits & bits.wrapping_sub(1)));
            rest.take_while(|bits| *bits != 0)
                .map(move |bits| I::from_index(word * 64 + bits.trailing_zeros() as usize))
        })
    }
}

impl<I: Id> Default for IdSet<I> {
    fn default() -> Self {
        IdSet::new()
    }
}

impl<I: Id> FromIterator<I> for IdSet<I> {
    fn from_iter<T: IntoIterator<Item = I>>(ids: T) -> IdSet<I> {
        let mut set = IdSet::new();
        ids.into_iter().for_each(|id| _ = set.insert(id));
        set
    }
}

fn place<I: Id>(id: I) -> (usize, u64) {
    (id.index() / 64, 1 << (id.index() % 64))
}
