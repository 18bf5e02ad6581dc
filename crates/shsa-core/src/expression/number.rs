//! The numbers of programs: plain numbers, intervals, and other types with the same operations.

use core::fmt::Debug;

use super::curve::Curve;
use super::operation::{Binary, Comparison, Constant, Unary};
use crate::interval::{Interval, Offset, Truth};
use core::f64::consts::PI;

/// Beyond so many numbers, the bound of what the roundings amount to would need more care.
const MANY: f64 = 1e9;

/// A kind of number that a program can be evaluated over.
///
/// All operations are total; a result without a value is [`Number::MISSING`], and so is any operation on a missing number.
pub trait Number: Copy + Debug + PartialEq {
    /// No value.
    const MISSING: Self;

    /// Whether it stands for all numbers between bounds.
    const IS_INTERVAL: bool = false;

    /// The number for a constant of the formula.
    fn constant(constant: Constant) -> Self;

    /// A number from an input or an operation; missing when it is not finite.
    #[must_use]
    fn admitted(self) -> Self;

    /// Whether the number has no value.
    fn is_missing(self) -> bool;

    /// A function of one number.
    #[must_use]
    fn unary(self, function: Unary) -> Self;

    /// A function of two numbers.
    #[must_use]
    fn binary(self, function: Binary, other: Self) -> Self;

    /// A comparison of two numbers; unknown when one is missing.
    fn compare(self, comparison: Comparison, other: Self) -> Truth;

    /// A number that may be either of two: missing when one is, and over plain numbers unless both are the same.
    #[must_use]
    fn hull(self, other: Self) -> Self;

    /// A number that may be any of these, none of which is missing; over plain numbers missing unless all are the same.
    fn either_of(numbers: impl Iterator<Item = Self>) -> Self;

    /// This number, for a truth between it and another sample: the hull of both over intervals, this one over plain numbers.
    #[must_use]
    fn covering(self, other: Self) -> Self;

    /// The mean over the time from this sample to the next: the hull of both over intervals.
    #[must_use]
    fn between(self, next: Self) -> Self;

    /// The part of the number within the bounds.
    #[must_use]
    fn within(self, bounds: Interval) -> Self;

    /// The number through a table; missing outside of it.
    #[must_use]
    fn along(self, curve: Curve<'_>) -> Self;

    /// The number without a part of its error that others have alike: for differences to these. A plain number has no error.
    #[must_use]
    fn without(self, _offset: Offset) -> Self {
        self
    }

    /// The smallest and the largest possible value; empty when missing.
    fn bounds(self) -> Interval;

    /// The sum of numbers, none of which is missing, each times a weight, which is not negative. Bounds may be wider than those of
    /// the single products and sums, by less than one part in 10^15 for each number.
    #[must_use]
    fn weighted(parts: impl Iterator<Item = (Self, f64)> + Clone) -> Self {
        let part = |(number, weight): (Self, f64)| {
            let bounds = Interval::point(weight);
            number.binary(Binary::Mul, Self::constant(Constant { value: weight, bounds }))
        };
        parts.map(part).reduce(|sum, part| sum.binary(Binary::Add, part)).unwrap_or(Self::MISSING)
    }

    /// The median of numbers none of which is missing; missing for an empty list.
    ///
    /// `scratch` has room for twice as many numbers. Time: n log n.
    fn median(numbers: impl Iterator<Item = Self>, scratch: &mut [f64]) -> Self;
}

impl Number for f64 {
    const MISSING: f64 = f64::NAN;

    fn constant(constant: Constant) -> f64 {
        constant.value
    }

    #[inline]
    fn admitted(self) -> f64 {
        if self.is_finite() { self } else { f64::NAN }
    }

    fn is_missing(self) -> bool {
        self.is_nan()
    }

    #[inline]
    fn unary(self, function: Unary) -> f64 {
        let value = match function {
            Unary::Neg => -self,
            Unary::Abs => self.abs(),
            Unary::Floor => libm::floor(self),
            Unary::Sqr => self * self,
            Unary::Sqrt => libm::sqrt(self),
            Unary::Power(exponent) => power(self, exponent),
            Unary::Root(degree) => root(self, degree),
            Unary::Exp => libm::exp(self),
            Unary::Ln => libm::log(self),
            Unary::Sin => libm::sin(self),
            Unary::Cos => libm::cos(self),
            Unary::Tan => libm::tan(self),
            Unary::Asin => libm::asin(self),
            Unary::Acos => libm::acos(self),
            Unary::Atan => libm::atan(self),
        };
        value.admitted()
    }

    #[inline]
    fn binary(self, function: Binary, other: f64) -> f64 {
        let value = match function {
            Binary::Add => self + other,
            Binary::Sub => self - other,
            Binary::Mul => self * other,
            Binary::Div => self / other,
            // `f64::min` would ignore a missing number
            Binary::Min => {
                if self <= other || self.is_nan() {
                    self
                } else {
                    other
                }
            }
            Binary::Max => {
                if self >= other || self.is_nan() {
                    self
                } else {
                    other
                }
            }
            // pow(1, NaN) and pow(NaN, 0) are numbers
            Binary::Pow if self.is_nan() || other.is_nan() => f64::NAN,
            Binary::Pow => libm::pow(self, other),
            // a zero has no sign here: only a number below zero is below the negative axis
            Binary::Atan2 | Binary::Bearing => {
                if self == 0.0 && other == 0.0 {
                    f64::NAN
                } else {
                    libm::atan2(self + 0.0, other)
                }
            }
            Binary::Hypot if self.is_nan() || other.is_nan() => f64::NAN,
            Binary::Hypot => libm::hypot(self, other),
        };
        value.admitted()
    }

    fn compare(self, comparison: Comparison, other: f64) -> Truth {
        if self.is_nan() || other.is_nan() {
            return Truth::Unknown;
        }
        Truth::from(match comparison {
            Comparison::Less => self < other,
            Comparison::AtMost => self <= other,
            Comparison::Equal => self == other,
        })
    }

    fn hull(self, other: f64) -> f64 {
        if self == other { self } else { f64::NAN }
    }

    fn either_of(mut numbers: impl Iterator<Item = f64>) -> f64 {
        let first = numbers.next().unwrap_or(f64::NAN);
        if numbers.all(|number| number == first) { first } else { f64::NAN }
    }

    fn covering(self, _: f64) -> f64 {
        self
    }

    fn between(self, next: f64) -> f64 {
        self / 2.0 + next / 2.0
    }

    fn within(self, bounds: Interval) -> f64 {
        if bounds.lo() <= self && self <= bounds.hi() { self } else { f64::NAN }
    }

    fn along(self, curve: Curve<'_>) -> f64 {
        curve.segment(self).map_or(f64::NAN, |segment| segment.value(self))
    }

    fn bounds(self) -> Interval {
        Interval::point(self)
    }

    fn median(numbers: impl Iterator<Item = f64>, scratch: &mut [f64]) -> f64 {
        median(numbers, scratch)
    }
}

/// A whole power; powers up to the fourth by products, which are exact more often and always monotone.
fn power(base: f64, exponent: i32) -> f64 {
    match exponent {
        3 => base * base * base,
        4 => (base * base) * (base * base),
        _ if base.is_nan() => f64::NAN,
        _ => libm::pow(base, f64::from(exponent)),
    }
}

fn root(radicand: f64, degree: i32) -> f64 {
    match degree {
        3 => libm::cbrt(radicand),
        _ if degree % 2 != 0 => libm::copysign(libm::pow(radicand.abs(), 1.0 / f64::from(degree)), radicand),
        _ => libm::pow(radicand, 1.0 / f64::from(degree)),
    }
}

impl Number for Interval {
    const MISSING: Interval = Interval::EMPTY;
    const IS_INTERVAL: bool = true;

    fn constant(constant: Constant) -> Interval {
        constant.bounds
    }

    fn admitted(self) -> Interval {
        self
    }

    fn is_missing(self) -> bool {
        self.is_empty()
    }

    fn unary(self, function: Unary) -> Interval {
        match function {
            Unary::Neg => -self,
            Unary::Abs => self.abs(),
            Unary::Floor => self.floor(),
            Unary::Sqr => self.sqr(),
            Unary::Sqrt => self.sqrt(),
            Unary::Power(exponent) => self.powi(exponent),
            Unary::Root(degree) => interval_root(self, degree),
            Unary::Exp => self.exp(),
            Unary::Ln => self.ln(),
            Unary::Sin => self.sin(),
            Unary::Cos => self.cos(),
            Unary::Tan => self.tan(),
            Unary::Asin => self.asin(),
            Unary::Acos => self.acos(),
            Unary::Atan => self.atan(),
        }
    }

    fn binary(self, function: Binary, other: Interval) -> Interval {
        match function {
            Binary::Add => self + other,
            Binary::Sub => self - other,
            Binary::Mul => self * other,
            Binary::Div => self / other,
            Binary::Pow => self.powf(other),
            Binary::Min => self.min(other),
            Binary::Max => self.max(other),
            Binary::Atan2 => self.atan2(other),
            Binary::Bearing => bearing(self, other),
            Binary::Hypot => self.hypot(other),
        }
    }

    fn compare(self, comparison: Comparison, other: Interval) -> Truth {
        match comparison {
            Comparison::Less => self.lt(other),
            Comparison::AtMost => self.le(other),
            Comparison::Equal => Interval::eq(self, other),
        }
    }

    fn hull(self, other: Interval) -> Interval {
        if self.is_empty() || other.is_empty() { Interval::EMPTY } else { Interval::hull(self, other) }
    }

    fn either_of(numbers: impl Iterator<Item = Interval>) -> Interval {
        numbers.fold(Interval::EMPTY, Interval::hull)
    }

    fn covering(self, other: Interval) -> Interval {
        Number::hull(self, other)
    }

    fn between(self, next: Interval) -> Interval {
        Number::hull(self, next)
    }

    fn within(self, bounds: Interval) -> Interval {
        self.intersection(bounds)
    }

    fn along(self, curve: Curve<'_>) -> Interval {
        curve.over(self)
    }

    fn without(self, offset: Offset) -> Interval {
        if self.is_empty() || !offset.is_some() {
            return self;
        }
        let (one, other) = ((self.lo() - offset.lo).next_down(), (self.hi() - offset.hi).next_up());
        // An estimate may be narrower than the errors of values.
        Interval::new(one.min(other), one.max(other))
    }

    fn bounds(self) -> Interval {
        self
    }

    /// Each bound is summed as it comes, then moved outwards by what the roundings can amount to: for n numbers and roundings of
    /// three kinds, of a weight, a product and a sum, no more than `(n + 2) u / (1 - (n + 2) u)` of the sum of their magnitudes, with
    /// `u = 2^-53`; twice that also covers the rounding of that sum.
    /// N. J. Higham, "Accuracy and Stability of Numerical Algorithms", 2002, 4.2, doi:10.1137/1.9780898718027.
    fn weighted(parts: impl Iterator<Item = (Interval, f64)> + Clone) -> Interval {
        let (mut lo, mut hi, mut low, mut high, mut count) = (0.0, 0.0, 0.0, 0.0, 2.0);
        for (number, weight) in parts.clone() {
            let (least, most) = (number.lo() * weight, number.hi() * weight);
            (lo, hi, count) = (lo + least, hi + most, count + 1.0);
            (low, high) = (low + least.abs(), high + most.abs());
        }
        if !(low + high).is_finite() || count > MANY {
            let part = |(number, weight)| number * Interval::point(weight);
            return parts.map(part).fold(Interval::point(0.0), |sum, part| sum + part);
        }
        let share = f64::EPSILON * count;
        Interval::new((lo - share * low).next_down(), (hi + share * high).next_up())
    }

    /// The median is monotone in each of its arguments, so its bounds are the medians of the bounds.
    fn median(numbers: impl Iterator<Item = Interval>, scratch: &mut [f64]) -> Interval {
        let (lows, highs) = scratch.split_at_mut(scratch.len() / 2);
        let mut count = 0;
        for (number, (low, high)) in numbers.zip(lows.iter_mut().zip(highs.iter_mut())) {
            (*low, *high) = (number.lo(), number.hi());
            count += 1;
        }
        let (lo, hi) = (middle(lows, count), middle(highs, count));
        if lo == hi { Interval::point(lo) } else { Interval::new(lo.next_down(), hi.next_up()) }
    }
}

/// The angle of a point, as one continuous range on the circle.
fn bearing(y: Interval, x: Interval) -> Interval {
    let is_cut = x.hi() < 0.0 && y.contains(0.0);
    if is_cut { (-y).atan2(-x) + Interval::new(PI, PI.next_up()) } else { y.atan2(x) }
}

/// Monotone: the root of the non-negative part, and for odd degrees the mirrored root of the rest.
fn interval_root(radicand: Interval, degree: i32) -> Interval {
    let exponent = Interval::point(1.0) / Interval::point(f64::from(degree));
    let root = |part: Interval| part.intersection(Interval::new(0.0, f64::INFINITY)).powf(exponent);
    if degree % 2 == 0 { root(radicand) } else { Interval::hull(root(radicand), -root(-radicand)) }
}

fn median(numbers: impl Iterator<Item = f64>, scratch: &mut [f64]) -> f64 {
    let mut count = 0;
    for (number, place) in numbers.zip(scratch.iter_mut()) {
        *place = number;
        count += 1;
    }
    middle(scratch, count)
}

/// The median of the first `count` numbers; sorts them.
fn middle(numbers: &mut [f64], count: usize) -> f64 {
    let Some(numbers) = numbers.get_mut(..count) else { return f64::NAN };
    numbers.sort_unstable_by(f64::total_cmp);
    let at = |place: usize| numbers.get(place).copied().unwrap_or(f64::NAN);
    match count {
        0 => f64::NAN,
        _ if count % 2 == 1 => at(count / 2),
        _ => at(count / 2 - 1) / 2.0 + at(count / 2) / 2.0,
    }
}
