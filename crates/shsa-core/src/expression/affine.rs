//! Temperatures on a scale with its own zero (`degC`, `degF`) are points: two of them have a difference and no sum.
//!
//! Each value has a *weight*: how many times it contains the zero of such a scale. A temperature has 1, a difference of
//! temperatures 0, `a + b` 2, `(a + b) / 2` 1 again. A value may be used where its weight is the required one; so means and
//! weighted sums are temperatures, and a sum or a multiple is not. A quantity in K may be an absolute temperature or a
//! difference: its weight is 0 or 1, depending on its use.

use super::measure::Measure;
use crate::unit::Dimension;

const TEMPERATURE: Dimension = Dimension::of([0, 0, 0, 0, 1, 0, 0, 0, 0]);

/// The rounding error of a sum of weights: 0.1 + 0.2 + 0.7 is not exactly 1.
const ROUNDING: f64 = 1e-9;

/// How many times a value contains the zero of a temperature scale: at least `lo`, at most `hi` times.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Weight {
    pub(super) lo: f64,
    pub(super) hi: f64,
}

impl Weight {
    /// The weight of everything that is no temperature, and of differences of temperatures.
    pub(super) const DIFFERENCE: Weight = Weight { lo: 0.0, hi: 0.0 };
    /// The weight of a temperature on a scale with its own zero.
    pub(super) const POINT: Weight = Weight { lo: 1.0, hi: 1.0 };
    /// The weight of a quantity in K: an absolute temperature or a difference.
    const EITHER: Weight = Weight { lo: 0.0, hi: 1.0 };
    /// The weight of a value without a unit: it is not checked.
    pub(super) const UNKNOWN: Weight = Weight { lo: f64::NEG_INFINITY, hi: f64::INFINITY };

    /// The weight of a value of this measure when nothing more is known.
    pub(super) fn of(measure: Measure) -> Weight {
        match measure {
            Measure::Unknown => Weight::UNKNOWN,
            Measure::Known(TEMPERATURE) => Weight::EITHER,
            Measure::Zero | Measure::Known(_) => Weight::DIFFERENCE,
        }
    }

    pub(super) fn plus(self, other: Weight) -> Weight {
        Weight { lo: self.lo + other.lo, hi: self.hi + other.hi }
    }

    pub(super) fn times(self, factor: f64) -> Weight {
        let (one, other) = (self.lo * factor, self.hi * factor);
        if one.is_nan() || other.is_nan() {
            return Weight::UNKNOWN;
        }
        Weight { lo: one.min(other), hi: one.max(other) }
    }

    pub(super) fn is_known(self) -> bool {
        self.lo.is_finite() && self.hi.is_finite()
    }

    /// The intersection of two weights; `None` when they exclude each other.
    pub(super) fn and(self, other: Weight) -> Option<Weight> {
        let both = Weight { lo: self.lo.max(other.lo), hi: self.hi.min(other.hi) };
        (both.lo <= both.hi + ROUNDING * (1.0 + both.hi.abs())).then_some(both)
    }

    pub(super) fn may_be(self, weight: Weight) -> bool {
        self.and(weight).is_some()
    }

    /// Whether it is a possible weight of a value: a temperature, or a difference.
    pub(super) fn is_proper(self) -> bool {
        self.may_be(Weight::POINT) || self.may_be(Weight::DIFFERENCE)
    }
}
