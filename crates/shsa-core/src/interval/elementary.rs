//! Exponential and logarithm, and how functions of `libm` become enclosures.

use super::Interval;

/// All non-negative numbers.
pub(super) const NON_NEGATIVE: Interval = Interval { lo: 0.0, hi: f64::INFINITY };
/// One.
pub(super) const ONE: Interval = Interval { lo: 1.0, hi: 1.0 };

impl Interval {
    /// `{e^x}`; exactly 1 at 0.
    #[must_use]
    pub fn exp(self) -> Interval {
        let at = |x| if x == 0.0 { ONE } else { near(libm::exp(x)) };
        self.increasing(at).intersection(NON_NEGATIVE)
    }

    /// `{ln x, x > 0}`, the natural logarithm; exactly 0 at 1, empty when nothing is above 0.
    #[must_use]
    pub fn ln(self) -> Interval {
        if self.hi <= 0.0 {
            return Interval::EMPTY;
        }
        self.intersection(NON_NEGATIVE).increasing(|x| near_or_zero(libm::log(x)))
    }

    /// The hull of a function that never falls, from its enclosures at the two bounds.
    pub(super) fn increasing(self, at: impl Fn(f64) -> Interval) -> Interval {
        if self.is_empty() {
            return Interval::EMPTY;
        }
        let first = at(self.lo);
        let last = if self.is_point() { first } else { at(self.hi) };
        Interval { lo: first.lo, hi: last.hi }
    }
}

/// The enclosure of a result of `libm`: its error is below one unit in the last place, which is two steps where the exponent
/// changes.
pub(super) fn near(value: f64) -> Interval {
    Interval { lo: value.next_down().next_down(), hi: value.next_up().next_up() }
}

/// The same for a function that returns zero only where it is exactly zero.
pub(super) fn near_or_zero(value: f64) -> Interval {
    if value == 0.0 { Interval { lo: 0.0, hi: 0.0 } } else { near(value) }
}
