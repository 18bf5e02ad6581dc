//! The second detector: differences change from one comparison to the next by more than the declared errors allow.

use super::{HALF, MEMORY, TrendOptions, approach, smaller};
use crate::time::Span;

/// Scatter shows at once, when there are enough comparisons.
const QUICK: Span = Span::from_millis(1_000);
/// So many comparisons are enough for that.
const FEW: f64 = 16.0;
/// Scatter of so many times the declared noise is beyond it: of white noise the estimate over the 64 comparisons that it goes
/// over at least is never so far off.
pub(super) const BEYOND: f64 = 2.0;
/// The share of the differences' squares that changes from one to the next, from which on they are noise.
const ALTERNATING: f64 = 0.75;

/// How much the differences of two ways scatter, as means over the last second.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scatter {
    /// The variance that is noise beyond the declared errors.
    limit: f64,
    /// Below this it comes near to nothing.
    calm: f64,
    /// The mean of half the squares of the differences' changes (von Neumann), which is their variance when they are
    /// independent.
    pub(super) variance: f64,
    /// The mean of the differences' squares.
    pub(super) square: f64,
}

impl Scatter {
    pub(super) fn new(options: &TrendOptions) -> Scatter {
        let limit = options.scatter * options.scatter;
        Scatter { limit, calm: HALF * limit, variance: 0.0, square: 0.0 }
    }

    /// Takes in a difference and the one before, so many seconds ago.
    // A part of what is done for every comparison: by a hint alone it would be called.
    #[inline(always)]
    pub(super) fn record(&mut self, difference: f64, before: f64, elapsed: f64) {
        let change = difference - before;
        let gain = smaller(elapsed / QUICK.seconds(), 1.0 / FEW) / MEMORY;
        approach(&mut self.variance, 0.5 * change * change, gain);
        approach(&mut self.square, difference * difference, gain);
    }

    /// The variance as a multiple of its limit.
    pub(super) fn nearness(&self) -> f64 {
        self.variance / self.limit
    }

    /// Whether it is far from an alarm.
    #[inline(always)]
    pub(super) fn stays_calm(&self) -> bool {
        self.variance <= self.calm
    }

    /// Whether differences come and go rather than last.
    pub(super) fn alternates(&self) -> bool {
        self.variance > ALTERNATING * self.square
    }
}
