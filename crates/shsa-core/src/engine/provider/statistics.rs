//! Statistics of the values published for a need.

use crate::time::Span;

/// Statistics of all values since the beginning.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Statistics {
    /// The number of values.
    pub(super) published: u64,
    /// The longest time between two values.
    pub(super) longest_gap: Span,
    /// The width of the widest value, SI.
    pub(super) widest: f64,
}

impl Statistics {
    /// Counts a value, published `gap` after the one before.
    pub(super) fn count(&mut self, gap: Option<Span>, width: f64) {
        if let Some(gap) = gap {
            self.longest_gap = self.longest_gap.max(gap);
        }
        self.widest = self.widest.max(width);
        self.published += 1;
    }
}
