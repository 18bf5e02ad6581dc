//! How much a search may do, counted so that runs repeat, and why it ended.

/// What a search may spend. Never time: the same search always ends at the same place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// How many decisions may be taken; one that is taken up again after a jump to another branch counts again.
    pub expansions: u64,
    /// How many partial substitutions may be kept (16 bytes each, 32 more while one waits for its turn).
    pub states: usize,
}

impl Limits {
    /// No limits: only for graphs that are known to be small.
    pub const NONE: Limits = Limits { expansions: u64::MAX, states: usize::MAX };
}

impl Default for Limits {
    /// About a tenth of a second and 50 MB at the most.
    fn default() -> Self {
        Limits { expansions: 1_000_000, states: 1_000_000 }
    }
}

/// What an answer that is kept counts in [`Limits::states`], by its decisions and sources: four take as much memory as
/// a state.
pub(super) fn states(decisions: usize) -> usize {
    1 + decisions / 4
}

/// Why a search has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopReason {
    /// There is no further substitution.
    Complete,
    /// The caller has as many as it asked for; there may be more.
    Found(usize),
    /// [`Limits::expansions`] is reached.
    LimitExpansions,
    /// [`Limits::states`] is reached.
    LimitStates,
    /// The utility could rise with more relations ([`check`](crate::knowledge::Utility::check) tells where), so that no
    /// order of search would be right: nothing was searched.
    NotMonotone,
}

impl core::fmt::Display for StopReason {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            StopReason::Complete => "complete",
            StopReason::Found(_) => "found",
            StopReason::LimitExpansions => "limit of expansions",
            StopReason::LimitStates => "limit of states",
            StopReason::NotMonotone => "utility not monotone",
        })
    }
}
