//! Closed intervals of real numbers with outward rounding; every operation is total.

/// All real numbers from `lo` to `hi`, both included; or no number at all (empty).
///
/// The bounds are never not-a-number: what has no value is the empty interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    lo: f64,
    hi: f64,
}

impl Interval {
    /// No number at all.
    pub const EMPTY: Interval = Interval { lo: f64::INFINITY, hi: f64::NEG_INFINITY };
    /// Every real number.
    pub const ENTIRE: Interval = Interval { lo: f64::NEG_INFINITY, hi: f64::INFINITY };

    /// From `lo` to `hi`; empty when a bound is not a number, when `lo > hi`, or when both are the same infinity.
    #[must_use]
    pub fn new(lo: f64, hi: f64) -> Interval {
        if lo <= hi && lo < f64::INFINITY && hi > f64::NEG_INFINITY {
            Interval { lo, hi }
        } else {
            Interval::EMPTY
        }
    }

    /// Exactly one number; empty for not-a-number and infinities.
    #[must_use]
    pub fn point(value: f64) -> Interval {
        Interval::new(value, value)
    }

    /// The lower bound; positive infinity when empty.
    #[must_use]
    pub fn lo(self) -> f64 {
        self.lo
    }

    /// The upper bound; negative infinity when empty.
    #[must_use]
    pub fn hi(self) -> f64 {
        self.hi
    }

    /// Whether there is no number in it.
    #[must_use]
    pub fn is_empty(self) -> bool {
        self.lo > self.hi
    }

    /// Whether both bounds are finite and there is a number in it.
    #[must_use]
    pub fn is_bounded(self) -> bool {
        self.lo > f64::NEG_INFINITY && self.hi < f64::INFINITY && self.lo <= self.hi
    }

    /// Whether `value` lies in it.
    #[must_use]
    pub fn contains(self, value: f64) -> bool {
        self.lo <= value && value <= self.hi
    }

    /// Whether a number lies in both; touching counts.
    #[must_use]
    pub fn overlaps(self, other: Interval) -> bool {
        !self.intersection(other).is_empty()
    }

    /// The numbers in both.
    #[must_use]
    pub fn intersection(self, other: Interval) -> Interval {
        Interval::new(self.lo.max(other.lo), self.hi.min(other.hi))
    }

    /// The smallest interval that holds both.
    #[must_use]
    pub fn hull(self, other: Interval) -> Interval {
        Interval::new(self.lo.min(other.lo), self.hi.max(other.hi))
    }

    /// `hi - lo`, rounded up; 0 when empty.
    #[must_use]
    pub fn width(self) -> f64 {
        if self.is_empty() { 0.0 } else { (self.hi - self.lo).next_up() }
    }

    /// The middle; not-a-number when empty, a finite number otherwise.
    #[must_use]
    pub fn midpoint(self) -> f64 {
        self.lo / 2.0 + self.hi / 2.0
    }

    /// How far apart the two are: 0 when they overlap, infinite when one is empty.
    #[must_use]
    pub fn distance(self, other: Interval) -> f64 {
        if self.is_empty() || other.is_empty() {
            return f64::INFINITY;
        }
        (other.lo - self.hi).max(self.lo - other.hi).max(0.0)
    }

    /// Grown by `margin` on both sides (rounded outward); unchanged when empty.
    #[must_use]
    pub fn widened(self, margin: f64) -> Interval {
        if self.is_empty() || margin == 0.0 {
            return self;
        }
        Interval::new((self.lo - margin).next_down(), (self.hi + margin).next_up())
    }
}
