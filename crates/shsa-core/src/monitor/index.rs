//! Indices of ways and pairs by signal and variable, and of the pairs that may accuse a signal.

use super::{Residual, WatchedWay, WayIndex};
use crate::knowledge::{IdVec, KnowledgeBase, SignalId, VariableId};
use alloc::vec::Vec;

/// Places in the monitor's lists, so that a query costs only its results.
#[derive(Debug, Default)]
pub(super) struct Index {
    /// The pairs that rest on a signal, ascending.
    of_signal: IdVec<SignalId, Vec<u32>>,
    /// The ways of knowing a variable, ascending.
    of_variable: IdVec<VariableId, Vec<WayIndex>>,
    /// The pairs with a recent disagreement or a trend, ascending.
    restless: Vec<u32>,
}

impl Index {
    /// An index with room for every pair, so that nothing is allocated later. O(signals + variables + signals of all pairs).
    pub(super) fn new(knowledge: &KnowledgeBase, ways: &[WatchedWay], pairs: &[Residual]) -> Index {
        let mut of_signal = IdVec::filled(knowledge.signals().len(), |_: SignalId| Vec::new());
        for (at, pair) in pairs.iter().enumerate() {
            pair.signals.iter().for_each(|signal| of_signal[signal].push(number(at)));
        }
        let mut of_variable = IdVec::filled(knowledge.variables().len(), |_: VariableId| Vec::new());
        for (at, way) in ways.iter().enumerate().filter(|(_, way)| !way.is_range()) {
            of_variable[way.variable()].push(WayIndex(number(at)));
        }
        let mut index = Index { of_signal, of_variable, restless: Vec::with_capacity(pairs.len()) };
        index.renew(pairs);
        index
    }

    /// Updates the restless pairs from all pairs.
    pub(super) fn renew(&mut self, pairs: &[Residual]) {
        self.restless.clear();
        let restless = pairs.iter().enumerate().filter(|(_, pair)| pair.is_restless());
        self.restless.extend(restless.map(|(at, _)| number(at)));
    }

    /// Notes that a pair has become restless, or calm. O(log n + n) for n restless pairs.
    pub(super) fn note(&mut self, pair: u32, is_restless: bool) {
        match self.restless.binary_search(&pair) {
            Ok(at) if !is_restless => drop(self.restless.remove(at)),
            Err(at) if is_restless => self.restless.insert(at, pair),
            _ => {}
        }
    }

    pub(super) fn of_signal(&self, signal: SignalId) -> &[u32] {
        &self.of_signal[signal]
    }

    pub(super) fn of_variable(&self, variable: VariableId) -> &[WayIndex] {
        &self.of_variable[variable]
    }

    pub(super) fn restless(&self) -> &[u32] {
        &self.restless
    }
}

fn number(at: usize) -> u32 {
    u32::try_from(at).unwrap_or(u32::MAX)
}
