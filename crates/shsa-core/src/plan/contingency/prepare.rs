//! The request of a table, and its entries for one variable.

use super::super::graph::Options;
use super::super::{Limits, Plan, Requirements};
use crate::knowledge::{SignalId, VariableId};
use alloc::vec::Vec;

/// The scope of a table, and the limits of its preparation.
#[derive(Clone, Debug, PartialEq)]
pub struct Preparation {
    /// The largest number of substitutions in a plan.
    pub count: usize,
    /// Whether to prepare for the loss of any two signals, too.
    pub pairs: bool,
    /// The options of each search; lost signals are forbidden in addition.
    pub options: Options,
    /// The requirements on substitutions. With limits of age and width, every loss needs a search.
    pub requirements: Requirements,
    /// The limits of each search.
    pub limits: Limits,
    /// The limit of visited inputs and decisions for one variable; a running search ends by its own limits.
    pub work_each: u64,
    /// The same limit for all variables together, at the set-up.
    pub work: u64,
}

impl Default for Preparation {
    /// One plan for each single loss; at most about a second a variable and ten for all.
    fn default() -> Self {
        Preparation {
            count: 1,
            pairs: false,
            options: Options::default(),
            requirements: Requirements::default(),
            limits: Limits::default(),
            work_each: 10_000_000,
            work: 100_000_000,
        }
    }
}

/// The options of a search without some signals.
pub(super) fn without(options: &Options, lost: &[SignalId]) -> Options {
    let mut options = options.clone();
    options.forbidden_signals.extend_from_slice(lost);
    options
}

/// The plan after a loss.
#[derive(Clone, Debug)]
pub(super) struct Entry {
    /// Lost signals that can change the plan, ascending.
    pub(super) lost: Vec<SignalId>,
    /// The place of the plan: many losses share one.
    pub(super) plan: usize,
    /// The signals whose loss can change the plan, ascending; after a loss only those that could not before.
    pub(super) matters: Vec<SignalId>,
}

/// The entries of a table for one variable.
#[derive(Clone, Debug, Default)]
pub(super) struct Prepared {
    /// The entries by the lost signals, ascending; the first is without a loss.
    pub(super) entries: Vec<Entry>,
    pub(super) plans: Vec<Plan>,
    /// The signals whose loss, with all that are derived from them, can change the plan, ascending.
    pub(super) events: Vec<SignalId>,
    /// All variables that the searches have read, ascending.
    pub(super) reads: Vec<VariableId>,
    /// Whether no loss was left out by the limit of work.
    pub(super) complete: bool,
    /// The work of the preparation; the largest number when it is not known that less than the limit is enough.
    pub(super) work: u64,
}

impl Prepared {
    fn find(&self, lost: &[SignalId]) -> Option<&Entry> {
        let at = self.entries.binary_search_by(|entry| entry.lost.as_slice().cmp(lost)).ok()?;
        self.entries.get(at)
    }

    pub(super) fn plan(&self, entry: &Entry) -> Option<&Plan> {
        self.plans.get(entry.plan)
    }

    /// The entry of a loss, reduced to the lost signals that matter: first those that matter with nothing lost, then those that
    /// matter after these losses, and so on.
    pub(super) fn project(&self, lost: &[SignalId]) -> Option<&Entry> {
        if lost.len() == 1
            && let Some(entry) = self.find(lost)
        {
            return Some(entry);
        }
        let mut entry = self.entries.first()?;
        loop {
            let all = with(&entry.lost, lost, &entry.matters);
            if all.len() == entry.lost.len() {
                return Some(entry);
            }
            entry = self.find(&all)?;
        }
    }
}

/// The lost signals, and those of `more` that matter, ascending.
pub(super) fn with(lost: &[SignalId], more: &[SignalId], matters: &[SignalId]) -> Vec<SignalId> {
    let matters = |signal: &&SignalId| matters.binary_search(signal).is_ok();
    let mut all: Vec<SignalId> = lost.iter().chain(more.iter().filter(matters)).copied().collect();
    all.sort_unstable();
    all.dedup();
    all
}
