//! The smallest hitting set: a smallest set that meets every one of some sets.
//!
//! Minimum hitting set is NP-hard (Karp 1972, doi:10.1007/978-1-4684-2001-2_9), so the search is counted. It deepens step by
//! step; when its budget ends, the depth proven so far is a lower bound.

use super::budget::Budget;
use crate::knowledge::{SignalId, SignalSet};
use alloc::collections::BTreeMap;
use alloc::vec::Vec;
use core::cmp::Reverse;

/// A hitting set, and a bound for the smallest one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Hitting {
    /// The smallest hitting set found.
    pub(super) set: SignalSet,
    /// No hitting set has fewer members.
    pub(super) at_least: usize,
}

impl Hitting {
    /// Whether the set is proven to be smallest.
    pub(super) fn is_smallest(&self) -> bool {
        self.set.len() <= self.at_least
    }
}

/// The smallest set that meets all of `sets`; none of these may be empty.
///
/// Depth-first with iterative deepening: branches over the members of a set that is not met, and prunes where more disjoint sets
/// are unmet than members may be added. Complexity: O(w^s) nodes for a smallest set of s members and sets of w, each O(sets).
/// When the budget ends first, the result is the greedy set.
pub(super) fn smallest_hitting_set(sets: &[SignalSet], budget: &mut Budget) -> Hitting {
    let greedy = greedy(sets);
    let mut sets: Vec<&SignalSet> = sets.iter().collect();
    sets.sort_by_key(|set| set.len());
    let mut search = Search { sets, budget, spent: false };
    let mut chosen = SignalSet::new();
    let mut size = search.disjoint_unmet(&chosen);
    while size < greedy.len() {
        if search.complete(&mut chosen, size) {
            return Hitting { set: chosen, at_least: size };
        }
        if search.spent {
            return Hitting { set: greedy, at_least: size };
        }
        size += 1;
    }
    Hitting { at_least: greedy.len(), set: greedy }
}

/// Adds the member of most unmet sets until all sets are met.
fn greedy(sets: &[SignalSet]) -> SignalSet {
    let mut chosen = SignalSet::new();
    let mut unmet: Vec<&SignalSet> = sets.iter().collect();
    loop {
        let mut met: BTreeMap<SignalId, usize> = BTreeMap::new();
        for signal in unmet.iter().flat_map(|set| set.iter()) {
            *met.entry(signal).or_default() += 1;
        }
        // Of equals, the first in file order.
        let best = met.iter().max_by_key(|&(signal, count)| (count, Reverse(signal)));
        let Some((&best, _)) = best else { return chosen };
        chosen.insert(best);
        unmet.retain(|set| !set.contains(best));
    }
}

struct Search<'a> {
    /// The sets, the smallest first: few branches at the top.
    sets: Vec<&'a SignalSet>,
    budget: &'a mut Budget,
    spent: bool,
}

impl Search<'_> {
    /// The number of pairwise disjoint unmet sets: a lower bound of the missing members.
    fn disjoint_unmet(&self, chosen: &SignalSet) -> usize {
        let mut covered = chosen.clone();
        let mut count = 0;
        for set in &self.sets {
            if !set.meets(&covered) {
                covered.extend(set);
                count += 1;
            }
        }
        count
    }

    /// Completes `chosen` with at most `more` members; leaves it unchanged when that is impossible.
    fn complete(&mut self, chosen: &mut SignalSet, more: usize) -> bool {
        if !self.budget.spend(self.sets.len() as u64) {
            self.spent = true;
            return false;
        }
        let Some(&unmet) = self.sets.iter().find(|set| !set.meets(chosen)) else { return true };
        if self.disjoint_unmet(chosen) > more {
            return false;
        }
        for signal in unmet.iter() {
            chosen.insert(signal);
            if self.complete(chosen, more - 1) {
                return true;
            }
            chosen.remove(signal);
            if self.spent {
                return false;
            }
        }
        false
    }
}
