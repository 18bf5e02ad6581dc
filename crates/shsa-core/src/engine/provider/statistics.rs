//! What has gone out for a need, in numbers.

use crate::time::Span;

/// Of all values since the beginning.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Statistics {
    /// How many.
    pub(super) published: u64,
    /// The longest time between two.
    pub(super) longest_gap: Span,
    /// The widest, SI.
    pub(super) widest: f64,
}

impl Statistics {
    /// One more goes out, so long after the one before.
    pub(super) fn count(&mut self, gap: Option<Span>, width: f64) {
        if let Some(gap) = gap {
            self.longest_gap = self.longest_gap.max(gap);
        }
        self.widest = self.widest.max(width);
        self.published += 1;
    }
}
