//! What an analysis may spend, counted in steps so that runs repeat.

/// Steps that are left: decisions of searches, comparisons of ways, sets looked at.
#[derive(Clone, Copy, Debug)]
pub(super) struct Budget {
    left: u64,
}

impl Budget {
    pub(super) fn new(steps: u64) -> Budget {
        Budget { left: steps }
    }

    /// Spends steps that have been taken; whether there were as many.
    pub(super) fn spend(&mut self, steps: u64) -> bool {
        let enough = self.left >= steps;
        self.left = self.left.saturating_sub(steps);
        enough
    }

    pub(super) fn is_spent(&self) -> bool {
        self.left == 0
    }

    /// As many as are left, but no more than `most`.
    pub(super) fn at_most(&self, most: u64) -> u64 {
        self.left.min(most)
    }
}
