//! Sets of equations that a search has found, and its remaining limits.

use super::EquationSet;
use super::redundant::Row;
use super::search::{Progress, Search};
use crate::knowledge::Id;
use crate::plan::{Limits, StopReason};
use alloc::vec::Vec;

/// Sets of equations that a search has found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Sets {
    /// The sets, each once; fewest equations first, then by file order.
    pub sets: Vec<EquationSet>,
    /// The reason for the end: after a limit, the sets are right but incomplete.
    pub stop: StopReason,
    /// The number of visited edges.
    pub expanded: u64,
}

/// The sets found so far, and the remaining limits.
pub(super) struct Found {
    pub(super) limits: Limits,
    pub(super) sets: Vec<EquationSet>,
    pub(super) stop: StopReason,
    pub(super) expanded: u64,
}

impl Found {
    pub(super) fn new(limits: Limits) -> Self {
        Found { limits, sets: Vec::new(), stop: StopReason::Complete, expanded: 0 }
    }

    /// Adds all sets of one connected part, unless a limit stops it.
    pub(super) fn gather(
        &mut self,
        search: &mut Search<'_>,
        mut set: impl FnMut(&mut Search<'_>, Vec<Row>) -> EquationSet,
    ) {
        while self.stop == StopReason::Complete {
            // Storing a set counts, too, so that the limit of expansions also limits the memory.
            match search.advance(self.limits.expansions.saturating_sub(self.expanded)) {
                Progress::Done => break,
                Progress::Limited => self.stop = StopReason::LimitExpansions,
                Progress::Found(_) if self.sets.len() >= self.limits.states => {
                    self.stop = StopReason::LimitStates;
                }
                Progress::Found(rows) => {
                    let set = set(search, rows);
                    self.expanded += set.iter().last().map_or(0, |last| last.index() as u64 / 8);
                    self.sets.push(set);
                }
            }
        }
        self.expanded += search.visits();
    }

    pub(super) fn finished(mut self) -> Sets {
        self.sets.sort_by(|a, b| a.len().cmp(&b.len()).then_with(|| a.iter().cmp(b.iter())));
        Sets { sets: self.sets, stop: self.stop, expanded: self.expanded }
    }
}
