//! The four operations, and the functions that need no rounding.

use core::ops::{Add, Div, Mul, Neg, Sub};

use super::Interval;
use super::rounding::{add_down, add_up, div_down, div_up, mul_down, mul_up};

impl Neg for Interval {
    type Output = Interval;

    /// `{-x}`; exact.
    #[inline]
    fn neg(self) -> Interval {
        // Subtracting from zero instead of flipping the sign keeps zero positive.
        Interval { lo: 0.0 - self.hi, hi: 0.0 - self.lo }
    }
}

impl Add for Interval {
    type Output = Interval;

    /// `{x + y}`, the tightest bounds.
    #[inline]
    fn add(self, other: Interval) -> Interval {
        // An empty operand gives a lower bound above the upper one, or not-a-number: empty again.
        Interval::new(add_down(self.lo, other.lo), add_up(self.hi, other.hi))
    }
}

impl Sub for Interval {
    type Output = Interval;

    /// `{x - y}`, the tightest bounds.
    #[inline]
    fn sub(self, other: Interval) -> Interval {
        self + -other
    }
}

impl Mul for Interval {
    type Output = Interval;

    /// `{x * y}`, the tightest bounds; `[0, 0]` times anything but empty is `[0, 0]`.
    #[inline]
    fn mul(self, other: Interval) -> Interval {
        if self.is_empty() || other.is_empty() {
            return Interval::EMPTY;
        }
        // Choosing the factors first, instead of a branch for each case, avoids mispredicted branches where signs are mixed.
        let (a, b) = if other.lo >= 0.0 { (self, other) } else { (other, self) };
        if b.lo >= 0.0 {
            mul_by_non_negative(a, b)
        } else if a.hi <= 0.0 {
            -mul_by_non_negative(b, -a)
        } else if b.hi <= 0.0 {
            -mul_by_non_negative(a, -b)
        } else {
            mul_through_zero(a, b)
        }
    }
}

/// `x * y`, for both with negative and positive numbers inside.
///
/// Rare; out of line, as this makes the other cases a quarter faster.
#[inline(never)]
fn mul_through_zero(x: Interval, y: Interval) -> Interval {
    Interval {
        lo: mul_down(x.lo, y.hi).min(mul_down(x.hi, y.lo)),
        hi: mul_up(x.lo, y.lo).max(mul_up(x.hi, y.hi)),
    }
}

/// `x * factor`, for a factor that holds no negative number, both not empty.
#[inline]
fn mul_by_non_negative(x: Interval, factor: Interval) -> Interval {
    let lo = mul_down(x.lo, if x.lo < 0.0 { factor.hi } else { factor.lo });
    let hi = mul_up(x.hi, if x.hi < 0.0 { factor.lo } else { factor.hi });
    Interval { lo, hi }
}

impl Div for Interval {
    type Output = Interval;

    /// `{x / y, y not 0}`, the tightest bounds.
    ///
    /// Through zero: `x / [0, 0]` is empty; `[0, 0] / y` is `[0, 0]`; with zero at one end of `y` and not inside
    /// `x`, the half-line; otherwise every number.
    #[inline]
    fn div(self, other: Interval) -> Interval {
        if self.is_empty() || other.is_empty() {
            Interval::EMPTY
        } else if other.lo > 0.0 {
            div_by_positive(self, other)
        } else if other.hi < 0.0 {
            -div_by_positive(self, -other)
        } else {
            div_through_zero(self, other)
        }
    }
}

/// `x / divisor`, for a divisor above zero, both not empty.
#[inline]
fn div_by_positive(x: Interval, divisor: Interval) -> Interval {
    let lo = div_down(x.lo, if x.lo < 0.0 { divisor.lo } else { divisor.hi });
    let hi = div_up(x.hi, if x.hi < 0.0 { divisor.hi } else { divisor.lo });
    Interval { lo, hi }
}

/// `x / divisor`, for a divisor that holds zero, both not empty.
#[cold]
fn div_through_zero(x: Interval, divisor: Interval) -> Interval {
    if divisor.lo == 0.0 && divisor.hi == 0.0 {
        Interval::EMPTY
    } else if x.lo == 0.0 && x.hi == 0.0 {
        Interval { lo: 0.0, hi: 0.0 }
    } else if divisor.lo == 0.0 {
        div_by_growing_positive(x, divisor.hi)
    } else if divisor.hi == 0.0 {
        -div_by_growing_positive(x, -divisor.lo)
    } else {
        Interval::ENTIRE
    }
}

/// `{x / y, 0 < y <= most}`, for `x` neither empty nor zero alone.
fn div_by_growing_positive(x: Interval, most: f64) -> Interval {
    if x.lo >= 0.0 {
        Interval { lo: div_down(x.lo, most), hi: f64::INFINITY }
    } else if x.hi <= 0.0 {
        Interval { lo: f64::NEG_INFINITY, hi: div_up(x.hi, most) }
    } else {
        Interval::ENTIRE
    }
}

impl Interval {
    /// `{1 / x, x not 0}`, the tightest bounds; through zero as for division.
    #[must_use]
    pub fn recip(self) -> Interval {
        Interval { lo: 1.0, hi: 1.0 } / self
    }

    /// `{|x|}`; exact.
    #[must_use]
    pub fn abs(self) -> Interval {
        // Not-a-number for the empty interval, which gives the empty interval again.
        Interval::new(self.mignitude(), self.magnitude())
    }

    /// `{min(x, y)}`; exact, empty when one is empty.
    #[must_use]
    pub fn min(self, other: Interval) -> Interval {
        self.endwise(other, f64::min)
    }

    /// `{max(x, y)}`; exact, empty when one is empty.
    #[must_use]
    pub fn max(self, other: Interval) -> Interval {
        self.endwise(other, f64::max)
    }

    /// The hull of the largest whole numbers not above `x`.
    #[must_use]
    pub fn floor(self) -> Interval {
        self.stepwise(libm::floor)
    }

    /// The hull of the smallest whole numbers not below `x`.
    #[must_use]
    pub fn ceil(self) -> Interval {
        self.stepwise(libm::ceil)
    }

    /// The hull of the whole numbers nearest to `x`, halves away from zero.
    #[must_use]
    pub fn round(self) -> Interval {
        self.stepwise(libm::round)
    }

    /// The hull of the signs of `x`: -1, 0 or 1.
    #[must_use]
    pub fn sign(self) -> Interval {
        self.stepwise(|x| f64::from(i8::from(x > 0.0) - i8::from(x < 0.0)))
    }

    /// A function that grows with both arguments and needs no rounding.
    #[inline]
    fn endwise(self, other: Interval, f: impl Fn(f64, f64) -> f64) -> Interval {
        if self.is_empty() || other.is_empty() {
            return Interval::EMPTY;
        }
        Interval { lo: f(self.lo, other.lo), hi: f(self.hi, other.hi) }
    }

    /// A function that never falls and needs no rounding.
    #[inline]
    fn stepwise(self, f: impl Fn(f64) -> f64) -> Interval {
        self.endwise(self, |x, _| f(x))
    }
}
