//! The budget of an analysis, counted in steps so that runs repeat.

/// The remaining steps: decisions of searches, comparisons of ways, visited sets.
#[derive(Clone, Copy, Debug)]
pub(super) struct Budget {
    left: u64,
}

impl Budget {
    pub(super) fn new(steps: u64) -> Budget {
        Budget { left: steps }
    }

    /// Spends steps that have been taken; returns whether the budget was enough.
    pub(super) fn spend(&mut self, steps: u64) -> bool {
        let enough = self.left >= steps;
        self.left = self.left.saturating_sub(steps);
        enough
    }

    pub(super) fn is_spent(&self) -> bool {
        self.left == 0
    }

    /// The remaining steps, at most `most`.
    pub(super) fn at_most(&self, most: u64) -> u64 {
        self.left.min(most)
    }
}
