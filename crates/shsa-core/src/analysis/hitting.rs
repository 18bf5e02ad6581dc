//! The smallest set that meets every one of some sets.
//!
//! Minimum hitting set is NP-hard (Karp 1972, doi:10.1007/978-1-4684-2001-2_9), so the search is counted; it deepens
//! step by step, and what it has proven when its budget ends is a lower bound.

use super::budget::Budget;
use crate::knowledge::{SignalId, SignalSet};
use alloc::collections::BTreeMap;
use alloc::vec::Vec;
use core::cmp::Reverse;

/// A hitting set and what is known about the smallest one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Hitting {
    /// Meets every set; as small as was found.
    pub(super) set: SignalSet,
    /// No hitting set has fewer members.
    pub(super) at_least: usize,
}

impl Hitting {
    /// Whether none is smaller.
    pub(super) fn is_smallest(&self) -> bool {
        self.set.len() <= self.at_least
    }
}

/// The smallest set that meets all of `sets`, of which none may be empty.
///
/// Depth-first with iterative deepening: a set that is not met is branched on member by member, and cut off where
/// more disjoint sets are unmet than members may be added. Complexity: O(w^s) nodes for a smallest set of s members
/// and sets of w, each O(sets), and no more than the budget; then the set is the greedy one.
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

/// Takes the member of most unmet sets, again and again.
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
    /// The smallest first: few branches at the top.
    sets: Vec<&'a SignalSet>,
    budget: &'a mut Budget,
    spent: bool,
}

impl Search<'_> {
    /// How many pairwise disjoint sets are not met: at least as many members are missing.
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

    /// Completes `chosen` with at most `more` members; leaves it as it was when that cannot be done.
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
