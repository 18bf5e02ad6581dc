//! What is asked of a table, and what it keeps for one variable.

use super::super::graph::Options;
use super::super::{Limits, Plan, Requirements};
use crate::knowledge::{SignalId, VariableId};
use alloc::vec::Vec;

/// What a table is made for, and what making it may cost.
#[derive(Clone, Debug, PartialEq)]
pub struct Preparation {
    /// How many substitutions each plan has at the most.
    pub count: usize,
    /// Prepares for the loss of any two signals, too.
    pub pairs: bool,
    /// Of each search; lost signals are forbidden in addition.
    pub options: Options,
    /// What substitutions must meet. Of age and width, no loss can be told to make no difference without a search.
    pub requirements: Requirements,
    /// Of each search.
    pub limits: Limits,
    /// How many inputs may be looked at and decisions taken for one variable; a search that has begun ends by its own
    /// limits.
    pub work_each: u64,
    /// The same for all variables together, at the set-up.
    pub work: u64,
}

impl Default for Preparation {
    /// The best plan after each single loss; about a second a variable and ten for all, at the most.
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
    /// Signals whose loss can make a difference, ascending.
    pub(super) lost: Vec<SignalId>,
    /// Where the plan stands: many losses share one.
    pub(super) plan: usize,
    /// The signals whose loss can make a difference, ascending; after a loss only those that could not before.
    pub(super) matters: Vec<SignalId>,
}

/// What a table knows of one variable.
#[derive(Clone, Debug, Default)]
pub(super) struct Prepared {
    /// By the lost signals, ascending; the first one is of no loss.
    pub(super) entries: Vec<Entry>,
    pub(super) plans: Vec<Plan>,
    /// The signals whose loss, with all that is derived from them, can make a difference, ascending.
    pub(super) events: Vec<SignalId>,
    /// All variables that the searches have read, ascending.
    pub(super) reads: Vec<VariableId>,
    /// Whether no loss was left out for its work.
    pub(super) complete: bool,
    /// With how much work it is made; the highest number when it is not known that less than all there was is enough.
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

    /// The entry for those of the lost signals that make a difference: first to the variable with nothing lost, then
    /// without what is lost of these.
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

/// Lost signals, and those of some others that matter, ascending.
pub(super) fn with(lost: &[SignalId], more: &[SignalId], matters: &[SignalId]) -> Vec<SignalId> {
    let matters = |signal: &&SignalId| matters.binary_search(signal).is_ok();
    let mut all: Vec<SignalId> = lost.iter().chain(more.iter().filter(matters)).copied().collect();
    all.sort_unstable();
    all.dedup();
    all
}
