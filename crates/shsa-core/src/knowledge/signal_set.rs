//! Sets of signals as bits.

use super::ids::{Id, SignalId};
use alloc::vec::Vec;

/// A set of signals.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SignalSet {
    words: Vec<u64>,
}

impl SignalSet {
    /// Without signals; equal sets are equal however they were made.
    #[must_use]
    pub const fn new() -> SignalSet {
        SignalSet { words: Vec::new() }
    }

    /// Adds a signal.
    pub fn insert(&mut self, signal: SignalId) {
        let (word, bit) = place(signal);
        if self.words.len() <= word {
            self.words.resize(word + 1, 0);
        }
        if let Some(bits) = self.words.get_mut(word) {
            *bits |= bit;
        }
    }

    /// Takes a signal out.
    pub fn remove(&mut self, signal: SignalId) {
        let (word, bit) = place(signal);
        if let Some(bits) = self.words.get_mut(word) {
            *bits &= !bit;
        }
        while self.words.last() == Some(&0) {
            self.words.pop();
        }
    }

    /// Whether a signal is in it.
    #[must_use]
    pub fn contains(&self, signal: SignalId) -> bool {
        let (word, bit) = place(signal);
        self.words.get(word).is_some_and(|bits| bits & bit != 0)
    }

    /// Whether a signal is in both.
    #[must_use]
    pub fn meets(&self, other: &SignalSet) -> bool {
        self.words.iter().zip(&other.words).any(|(a, b)| a & b != 0)
    }

    /// Whether all signals of `other` are in it.
    #[must_use]
    pub fn covers(&self, other: &SignalSet) -> bool {
        other.iter().all(|signal| self.contains(signal))
    }

    /// Adds all signals of another set.
    pub fn extend(&mut self, other: &SignalSet) {
        other.iter().for_each(|signal| self.insert(signal));
    }

    /// How many signals there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.words.iter().map(|bits| bits.count_ones() as usize).sum()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.words.is_empty()
    }

    /// Its signals, ascending.
    pub fn iter(&self) -> impl Iterator<Item = SignalId> + '_ {
        self.words.iter().enumerate().flat_map(|(word, &bits)| {
            let rest = core::iter::successors(Some(bits), |bits| Some(bits & bits.wrapping_sub(1)));
            rest.take_while(|bits| *bits != 0)
                .map(move |bits| SignalId::from_index(word * 64 + bits.trailing_zeros() as usize))
        })
    }
}

impl FromIterator<SignalId> for SignalSet {
    fn from_iter<T: IntoIterator<Item = SignalId>>(signals: T) -> SignalSet {
        let mut set = SignalSet::new();
        signals.into_iter().for_each(|signal| set.insert(signal));
        set
    }
}

fn place(signal: SignalId) -> (usize, u64) {
    (signal.index() / 64, 1 << (signal.index() % 64))
}
