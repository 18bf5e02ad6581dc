//! Closed intervals of real numbers with outward rounding; every operation is total.
//!
//! An interval holds every real number that the true value may be. Operations follow the set-based flavour of
//! IEEE 1788-2015 (DOI 10.1109/IEEESTD.2015.7140721), of which this is a subset without decorations:
//!
//! * **Inclusion**: for every `x` in `X` and `y` in `Y` where the real function `f` is defined, `f(x, y)` lies in
//!   `F(X, Y)`. Numbers where `f` is not defined are left out; when none is left, the result is empty.
//! * **Isotonicity**: a wider argument gives a result that holds the narrower argument's result, up to the few
//!   last digits by which elementary functions are widened.
//! * **Totality**: not-a-number in gives empty out, empty in gives empty out, an overflow gives an infinite bound.
//!
//! `+ - * /`, `sqr`, `sqrt`, `recip` and `width` round each bound to the nearest number outside, so exact results
//! stay exact. `hypot` and `powi` chain such steps. The other elementary functions come from `libm`, whose
//! errors are below one unit in the last place, and widen its result by two (`atan2` by three) such units.
//!
//! The sign of a zero bound carries no meaning.
//!
//! The methods of [`Interval`] are in one file for each kind of operation, as each kind has its own argument why it encloses the
//! true result.

mod rounding;
mod arithmetic;
mod elementary;
mod power;
mod trigonometry;
mod truth;
mod tolerant;
mod course;

pub use course::{Course, Offset};
pub use tolerant::{holding, tolerant};
pub use truth::Truth;

/// All real numbers from `lo` to `hi`, both included; or no number at all (empty).
///
/// The bounds are never not-a-number: a missing value is the empty interval. An infinite bound means "unbounded": infinities
/// themselves are no members.
///
/// ```
/// use shsa_core::interval::Interval;
///
/// let (wheel, gnss) = (Interval::new(13.9, 14.3), Interval::new(14.2, 14.8));
/// assert!(wheel.overlaps(gnss) && !wheel.overlaps(gnss + Interval::new(3.0, 3.0)));
/// assert_eq!(wheel.hull(gnss), Interval::new(13.9, 14.8));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    lo: f64,
    hi: f64,
}

/// The larger of two bounds: unlike [`f64::max`], without a test for not-a-number, which no bound is.
#[inline]
fn larger(one: f64, other: f64) -> f64 {
    if one > other { one } else { other }
}

/// The smaller of two bounds.
#[inline]
fn smaller(one: f64, other: f64) -> f64 {
    if one < other { one } else { other }
}

impl Interval {
    /// The empty interval.
    pub const EMPTY: Interval = Interval { lo: f64::INFINITY, hi: f64::NEG_INFINITY };
    /// Every real number.
    pub const ENTIRE: Interval = Interval { lo: f64::NEG_INFINITY, hi: f64::INFINITY };

    /// From `lo` to `hi`; empty when a bound is not a number, when `lo > hi`, or when both are the same infinity.
    #[inline]
    #[must_use]
    pub const fn new(lo: f64, hi: f64) -> Interval {
        // The most frequent case, with a single test: there is a number between two different bounds.
        if lo < hi || lo == hi && lo > f64::NEG_INFINITY && lo < f64::INFINITY {
            Interval { lo, hi }
        } else {
            Interval::EMPTY
        }
    }

    /// Exactly one number; empty for not-a-number and infinities.
    #[inline]
    #[must_use]
    pub const fn point(value: f64) -> Interval {
        Interval::new(value, value)
    }

    /// The lower bound; positive infinity when empty.
    #[inline]
    #[must_use]
    pub const fn lo(self) -> f64 {
        self.lo
    }

    /// The upper bound; negative infinity when empty.
    #[inline]
    #[must_use]
    pub const fn hi(self) -> f64 {
        self.hi
    }

    /// Whether the interval is empty.
    #[inline]
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.lo > self.hi
    }

    /// Whether both bounds are finite and the interval is not empty.
    #[inline]
    #[must_use]
    pub const fn is_bounded(self) -> bool {
        self.lo > f64::NEG_INFINITY && self.hi < f64::INFINITY && self.lo <= self.hi
    }

    /// Whether the interval holds exactly one number.
    #[inline]
    #[must_use]
    pub const fn is_point(self) -> bool {
        self.lo == self.hi
    }

    /// Whether the interval contains `value`; never true for not-a-number and infinities.
    #[inline]
    #[must_use]
    pub const fn contains(self, value: f64) -> bool {
        self.lo <= value && value <= self.hi && value.is_finite()
    }

    /// Whether the interval contains every number of `other`; true when `other` is empty.
    #[inline]
    #[must_use]
    pub const fn encloses(self, other: Interval) -> bool {
        self.lo <= other.lo && other.hi <= self.hi || other.is_empty()
    }

    /// Whether a number lies in both; touching counts.
    #[inline]
    #[must_use]
    pub fn overlaps(self, other: Interval) -> bool {
        // The bounds of the empty interval are beyond all others.
        larger(self.lo, other.lo) <= smaller(self.hi, other.hi)
    }

    /// The numbers in both intervals.
    #[inline]
    #[must_use]
    pub fn intersection(self, other: Interval) -> Interval {
        Interval::new(larger(self.lo, other.lo), smaller(self.hi, other.hi))
    }

    /// The smallest interval that holds both intervals.
    #[inline]
    #[must_use]
    pub fn hull(self, other: Interval) -> Interval {
        Interval::new(smaller(self.lo, other.lo), larger(self.hi, other.hi))
    }

    /// `hi - lo`, rounded up; 0 when empty, infinite when unbounded.
    #[inline]
    #[must_use]
    pub fn width(self) -> f64 {
        if self.is_empty() { 0.0 } else { rounding::add_up(self.hi, -self.lo) }
    }

    /// The middle, rounded to nearest; not-a-number when empty, otherwise a member of the interval.
    ///
    /// Unbounded on both sides: 0. Unbounded on one side: the largest finite number on that side.
    #[inline]
    #[must_use]
    pub fn midpoint(self) -> f64 {
        let sum = self.lo + self.hi;
        // Halving first would lose the last bit of subnormal bounds; halving last would overflow for huge ones.
        if sum.is_finite() {
            return sum / 2.0;
        }
        if self.is_empty() {
            return f64::NAN;
        }
        if self == Interval::ENTIRE {
            return 0.0;
        }
        (self.lo / 2.0 + self.hi / 2.0).clamp(f64::MIN, f64::MAX)
    }

    /// The largest absolute value (infinite when unbounded); not-a-number when empty.
    #[inline]
    #[must_use]
    pub fn magnitude(self) -> f64 {
        if self.is_empty() { f64::NAN } else { self.hi.max(-self.lo) }
    }

    /// The smallest absolute value; not-a-number when empty.
    #[inline]
    #[must_use]
    pub fn mignitude(self) -> f64 {
        if self.is_empty() { f64::NAN } else { self.lo.max(-self.hi).max(0.0) }
    }

    /// The distance of two intervals, rounded to nearest: 0 when they overlap, infinite when one is empty.
    #[must_use]
    pub fn distance(self, other: Interval) -> f64 {
        if self.is_empty() || other.is_empty() {
            return f64::INFINITY;
        }
        (other.lo - self.hi).max(self.lo - other.hi).max(0.0)
    }

    /// The interval grown by `margin` on both sides (rounded outward); unchanged when empty.
    ///
    /// A negative margin shrinks the interval, finally to empty; a margin that is not a number gives empty.
    #[must_use]
    pub fn widened(self, margin: f64) -> Interval {
        if self.is_empty() {
            return self;
        }
        Interval::new(rounding::add_down(self.lo, -margin), rounding::add_up(self.hi, margin))
    }
}
