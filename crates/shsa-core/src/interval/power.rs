//! Squares, roots and powers.

use super::Interval;
use super::elementary::{NON_NEGATIVE, ONE, near};
use super::rounding::{mul_down, mul_up, sqrt_down, sqrt_up};

/// Above this (or at zero), a square loses no digits.
const SQUARES_MIN: f64 = 1e-140;
/// Below this, a sum of two squares does not overflow.
const SQUARES_MAX: f64 = 1e150;
/// Factors that bring larger and smaller numbers into this range; powers of two, so that scaling is exact.
const SHRINK: f64 = f64::from_bits((1023 - 600) << 52);
const GROW: f64 = f64::from_bits((1023 + 600) << 52);

impl Interval {
    /// `{x * x}`, the tightest bounds; never below 0.
    #[must_use]
    pub fn sqr(self) -> Interval {
        if self.is_empty() {
            return Interval::EMPTY;
        }
        let size = self.abs();
        Interval { lo: mul_down(size.lo, size.lo), hi: mul_up(size.hi, size.hi) }
    }

    /// `{square root of x, x >= 0}`, the tightest bounds; empty when everything is below 0.
    #[must_use]
    pub fn sqrt(self) -> Interval {
        let inside = self.intersection(NON_NEGATIVE);
        if inside.is_empty() {
            return Interval::EMPTY;
        }
        Interval { lo: sqrt_down(inside.lo), hi: sqrt_up(inside.hi) }
    }

    /// `{square root of (x * x + y * y)}`; no overflow or underflow on the way, exact when every step is.
    #[must_use]
    pub fn hypot(self, other: Interval) -> Interval {
        if self.is_empty() || other.is_empty() {
            return Interval::EMPTY;
        }
        let (a, b) = (self.abs(), other.abs());
        let safe = |x: f64| x == 0.0 || (SQUARES_MIN < x && x < SQUARES_MAX);
        if safe(a.lo) && safe(a.hi) && safe(b.lo) && safe(b.hi) {
            return (a.sqr() + b.sqr()).sqrt();
        }
        Interval { lo: hypot_at(a.lo, b.lo).lo, hi: hypot_at(a.hi, b.hi).hi }
    }

    /// `{x^exponent, x^exponent is defined}` for a whole exponent; even powers are tight through zero.
    ///
    /// `x^0` is 1, also for `x = 0`. A negative exponent is the reciprocal: `[0, 0]` gives empty, zero inside
    /// gives every number for odd exponents. Powers that f64 holds exactly are exact.
    #[must_use]
    pub fn powi(self, exponent: i32) -> Interval {
        let power = self.whole_power(exponent.unsigned_abs());
        if exponent < 0 { power.recip() } else { power }
    }

    fn whole_power(self, exponent: u32) -> Interval {
        if self.is_empty() {
            Interval::EMPTY
        } else if exponent.is_multiple_of(2) {
            let size = self.abs();
            Interval { lo: power_down(size.lo, exponent), hi: power_up(size.hi, exponent) }
        } else {
            let lo =
                if self.lo < 0.0 { -power_up(-self.lo, exponent) } else { power_down(self.lo, exponent) };
            let hi =
                if self.hi < 0.0 { -power_down(-self.hi, exponent) } else { power_up(self.hi, exponent) };
            Interval { lo, hi }
        }
    }

    /// `{x^y}` for real exponents.
    ///
    /// Negative bases have powers where the exponent is a whole number; `0^y` is 0 for `y > 0`, 1 for `y = 0` (as in `powi`;
    /// IEEE 1788-2015 leaves both out) and not defined for `y < 0`.
    #[must_use]
    pub fn powf(self, exponent: Interval) -> Interval {
        if let Some(whole) = exponent.as_whole() {
            return self.powi(whole);
        }
        let base = self.intersection(NON_NEGATIVE);
        let power = if base.is_empty() || exponent.is_empty() {
            Interval::EMPTY
        } else if base.hi == 0.0 {
            power_of_zero(exponent)
        } else {
            power_at_corners(base, exponent).intersection(NON_NEGATIVE)
        };
        if self.lo < 0.0 && !self.is_empty() { power.hull(powers_of_negative(self, exponent)) } else { power }
    }

    /// The whole number (of 32 bits) of a point interval.
    #[must_use]
    pub fn as_whole(self) -> Option<i32> {
        let whole = self.lo as i32;
        (self.is_point() && f64::from(whole) == self.lo).then_some(whole)
    }
}

/// The enclosure of `hypot` at two finite numbers not below 0, or infinity.
fn hypot_at(x: f64, y: f64) -> Interval {
    let most = x.max(y);
    if most == f64::INFINITY {
        return Interval { lo: most, hi: most };
    }
    let (scale, back) = match most {
        _ if most >= SQUARES_MAX => (SHRINK, GROW),
        _ if most <= SQUARES_MIN => (GROW, SHRINK),
        _ => (1.0, 1.0),
    };
    let (x, y) = (Interval::point(x) * Interval::point(scale), Interval::point(y) * Interval::point(scale));
    (x.sqr() + y.sqr()).sqrt() * Interval::point(back)
}

/// `base^exponent` rounded down, for a base not below 0: the better of two lower bounds. The chain of products is exact for small
/// powers, and `libm` is closer for large ones.
fn power_down(base: f64, exponent: u32) -> f64 {
    let chain = product_chain(base, exponent, mul_down);
    if exponent <= 2 { chain } else { chain.max(near(libm::pow(base, f64::from(exponent))).lo) }
}

/// `base^exponent` rounded up, for a base not below 0.
fn power_up(base: f64, exponent: u32) -> f64 {
    let chain = product_chain(base, exponent, mul_up);
    if exponent <= 2 { chain } else { chain.min(near(libm::pow(base, f64::from(exponent))).hi) }
}

/// `base^exponent` by repeated squaring, every product rounded by `mul`. At most 63 products.
fn product_chain(base: f64, mut exponent: u32, mul: impl Fn(f64, f64) -> f64) -> f64 {
    let (mut power, mut square) = (1.0, base);
    while exponent > 0 {
        if exponent % 2 == 1 {
            power = mul(power, square);
        }
        exponent /= 2;
        if exponent > 0 {
            square = mul(square, square);
        }
    }
    power
}

/// `{x^y}` for the negative numbers of a base, and the whole numbers of an exponent of more than one number.
#[cold]
fn powers_of_negative(base: Interval, exponent: Interval) -> Interval {
    let (first, last) = (libm::ceil(exponent.lo), libm::floor(exponent.hi));
    let size = Interval { lo: (-base.hi).max(0.0), hi: -base.lo };
    let is_even = |whole: f64| libm::fmod(whole, 2.0) == 0.0;
    let powers = |parity: bool| {
        let from = if is_even(first) == parity { first } else { first + 1.0 };
        let to = if is_even(last) == parity { last } else { last - 1.0 };
        size.powf(Interval::new(from, to))
    };
    powers(true).hull(-powers(false))
}

fn power_of_zero(exponent: Interval) -> Interval {
    let for_zero = if exponent.contains(0.0) { ONE } else { Interval::EMPTY };
    let for_positive = if exponent.hi > 0.0 { Interval { lo: 0.0, hi: 0.0 } } else { Interval::EMPTY };
    for_zero.hull(for_positive)
}

/// `{x^y}` for a base that holds positive numbers and no negative ones.
///
/// `x^y` rises with `x` where `y >= 0` and with `y` where `x >= 1`, and falls otherwise; so its extremes lie at
/// corners, and the signs of `y` and of `x - 1` tell which.
fn power_at_corners(x: Interval, y: Interval) -> Interval {
    // The exponents that give the least and the greatest power of a number.
    let least_at = |x: f64| if x >= 1.0 { y.lo } else { y.hi };
    let greatest_at = |x: f64| if x >= 1.0 { y.hi } else { y.lo };
    let least = |x: f64| power_at(x, least_at(x)).lo;
    let greatest = |x: f64| power_at(x, greatest_at(x)).hi;
    if y.lo >= 0.0 {
        Interval { lo: least(x.lo), hi: greatest(x.hi) }
    } else if y.hi <= 0.0 {
        Interval { lo: least(x.hi), hi: greatest(x.lo) }
    } else {
        Interval { lo: least(x.lo).min(least(x.hi)), hi: greatest(x.lo).max(greatest(x.hi)) }
    }
}

/// The enclosure of `x^y` at one corner, with the limit where the power is not defined.
fn power_at(x: f64, y: f64) -> Interval {
    // Adding zero turns a negative zero, which has negative powers, into a positive one.
    let value = libm::pow(x + 0.0, y);
    let exact = x == 0.0 || x == 1.0 || y == 0.0 || x.is_infinite();
    if exact { Interval { lo: value, hi: value } } else { near(value) }
}
