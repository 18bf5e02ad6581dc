//! Limits of a search, counted so that runs repeat, and the reasons for its end.

/// The limits of a search. Never time: the same search always ends at the same place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// The largest number of decisions; a decision that is repeated after a jump to another branch counts again.
    pub expansions: u64,
    /// The largest number of partial substitutions kept (16 bytes each, and 32 more for a waiting one).
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

/// The size of a kept answer in [`Limits::states`], from its decisions and sources: four of them take the memory of a state.
pub(super) fn states(decisions: usize) -> usize {
    1 + decisions / 4
}

/// Why a search has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopReason {
    /// There is no further substitution.
    Complete,
    /// The caller has the requested number of answers; there may be more.
    Found(usize),
    /// [`Limits::expansions`] is reached.
    LimitExpansions,
    /// [`Limits::states`] is reached.
    LimitStates,
    /// The utility could rise with additional relations ([`check`](crate::knowledge::Utility::check) tells where), so that no
    /// order of search is right: nothing was searched.
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
