//! Dual numbers: a value and its derivatives in several directions at once.
//!
//! Forward automatic differentiation: a formula evaluated over duals gives its exact derivatives, in one evaluation for each
//! [`WIDTH`] variables (L. B. Rall, "Automatic Differentiation", 1981, doi:10.1007/3-540-10861-0). At a corner of a function
//! (`abs`, `min`, `floor`, `if`), the derivative is that of the branch taken.

use shsa_core::expression::{Binary, Comparison, Constant, Curve, Number, Unary};
use shsa_core::interval::{Interval, Truth};

/// The number of directions of one evaluation.
pub const WIDTH: usize = 8;

/// The largest number of duals in a median; a larger median is missing.
const MEDIAN_MAX: usize = 32;

/// A value and its derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual {
    /// The value; not-a-number is missing.
    pub value: f64,
    /// The derivatives.
    pub slopes: [f64; WIDTH],
}

impl Dual {
    /// A number without derivatives.
    #[must_use]
    pub const fn constant(value: f64) -> Dual {
        Dual { value, slopes: [0.0; WIDTH] }
    }

    /// The variable of a direction; a constant for a direction beyond the last.
    #[must_use]
    pub fn variable(value: f64, direction: usize) -> Dual {
        let mut slopes = [0.0; WIDTH];
        if let Some(slope) = slopes.get_mut(direction) {
            *slope = 1.0;
        }
        Dual { value, slopes }
    }

    /// A function of the dual, by the function's value and derivative.
    #[inline]
    fn through(self, value: f64, slope: f64) -> Dual {
        Dual { value, slopes: self.slopes.map(|own| own * slope) }
    }

    /// A function of two duals, by its value and both derivatives.
    #[inline]
    fn joined(self, other: Dual, value: f64, by_self: f64, by_other: f64) -> Dual {
        let mut slopes = self.slopes;
        for (slope, its) in slopes.iter_mut().zip(&other.slopes) {
            *slope = *slope * by_self + its * by_other;
        }
        Dual { value, slopes }
    }

    /// The dual; missing if its value or a derivative is infinite or not a number.
    fn finite(self) -> Dual {
        let is_finite = self.value.is_finite() && self.slopes.iter().all(|slope| slope.is_finite());
        if is_finite { self } else { Dual::MISSING }
    }

    fn is_constant(&self) -> bool {
        self.slopes.iter().all(|slope| *slope == 0.0)
    }
}

impl Number for Dual {
    const MISSING: Dual = Dual::constant(f64::NAN);

    fn constant(constant: Constant) -> Dual {
        Dual::constant(constant.value)
    }

    fn admitted(self) -> Dual {
        self.finite()
    }

    fn is_missing(self) -> bool {
        self.value.is_nan()
    }

    fn unary(self, function: Unary) -> Dual {
        let x = self.value;
        let value = x.unary(function);
        let slope = match function {
            Unary::Neg => -1.0,
            Unary::Abs => {
                if x < 0.0 {
                    -1.0
                } else {
                    1.0
                }
            }
            Unary::Floor => 0.0,
            Unary::Sqr => 2.0 * x,
            Unary::Sqrt => 0.5 / value,
            Unary::Power(exponent) => f64::from(exponent) * x.unary(Unary::Power(exponent - 1)),
            Unary::Root(degree) => value / (f64::from(degree) * x),
            Unary::Exp => value,
            Unary::Ln => 1.0 / x,
            Unary::Sin => libm::cos(x),
            Unary::Cos => -libm::sin(x),
            Unary::Tan => 1.0 + value * value,
            Unary::Asin => 1.0 / libm::sqrt(1.0 - x * x),
            Unary::Acos => -1.0 / libm::sqrt(1.0 - x * x),
            Unary::Atan => 1.0 / (1.0 + x * x),
        };
        // A constant has no slopes, even where the function has no derivative.
        if self.is_constant() { Dual::constant(value) } else { self.through(value, slope) }
    }

    fn binary(self, function: Binary, other: Dual) -> Dual {
        let (x, y) = (self.value, other.value);
        let value = x.binary(function, y);
        let (by_self, by_other) = match function {
            Binary::Add => (1.0, 1.0),
            Binary::Sub => (1.0, -1.0),
            Binary::Mul => (y, x),
            Binary::Div => (1.0 / y, -value / y),
            Binary::Min => return if x <= y || x.is_nan() { self } else { other },
            Binary::Max => return if x >= y || x.is_nan() { self } else { other },
            Binary::Pow => {
                let by_base = if self.is_constant() { 0.0 } else { y * x.binary(Binary::Pow, y - 1.0) };
                (by_base, if other.is_constant() { 0.0 } else { value * libm::log(x) })
            }
            Binary::Atan2 | Binary::Bearing => {
                let square = x * x + y * y;
                (y / square, -x / square)
            }
            Binary::Hypot if self.is_constant() && other.is_constant() => (0.0, 0.0),
            Binary::Hypot => (x / value, y / value),
        };
        self.joined(other, value, by_self, by_other)
    }

    fn compare(self, comparison: Comparison, other: Dual) -> Truth {
        self.value.compare(comparison, other.value)
    }

    fn hull(self, other: Dual) -> Dual {
        if self.value == other.value { self } else { Dual::MISSING }
    }

    fn either_of(mut numbers: impl Iterator<Item = Dual>) -> Dual {
        let first = numbers.next().unwrap_or(Dual::MISSING);
        if numbers.all(|number| number.value == first.value) { first } else { Dual::MISSING }
    }

    fn covering(self, _: Dual) -> Dual {
        self
    }

    fn between(self, next: Dual) -> Dual {
        self.joined(next, self.value / 2.0 + next.value / 2.0, 0.5, 0.5)
    }

    fn within(self, bounds: Interval) -> Dual {
        if bounds.contains(self.value) { self } else { Dual::MISSING }
    }

    fn along(self, curve: Curve<'_>) -> Dual {
        let segment = curve.segment(self.value);
        segment.map_or(Dual::MISSING, |segment| self.through(segment.value(self.value), segment.slope()))
    }

    fn bounds(self) -> Interval {
        Interval::point(self.value)
    }

    fn median(numbers: impl Iterator<Item = Dual>, _: &mut [f64]) -> Dual {
        let (mut sorted, mut count) = ([Dual::MISSING; MEDIAN_MAX], 0);
        for number in numbers {
            let Some(place) = sorted.get_mut(count) else { return Dual::MISSING };
            *place = number;
            count += 1;
        }
        let Some(sorted) = sorted.get_mut(..count) else { return Dual::MISSING };
        sorted.sort_unstable_by(|one, other| one.value.total_cmp(&other.value));
        let at = |place: usize| sorted.get(place).copied().unwrap_or(Dual::MISSING);
        match count {
            0 => Dual::MISSING,
            _ if count % 2 == 1 => at(count / 2),
            _ => at(count / 2 - 1).between(at(count / 2)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const UNARY: [Unary; 16] = [
        Unary::Neg,
        Unary::Abs,
        Unary::Floor,
        Unary::Sqr,
        Unary::Sqrt,
        Unary::Power(3),
        Unary::Power(-2),
        Unary::Root(3),
        Unary::Exp,
        Unary::Ln,
        Unary::Sin,
        Unary::Cos,
        Unary::Tan,
        Unary::Asin,
        Unary::Acos,
        Unary::Atan,
    ];
    const BINARY: [Binary; 10] = [
        Binary::Add,
        Binary::Sub,
        Binary::Mul,
        Binary::Div,
        Binary::Pow,
        Binary::Min,
        Binary::Max,
        Binary::Atan2,
        Binary::Bearing,
        Binary::Hypot,
    ];

    /// Checks a derivative by a central difference.
    #[track_caller]
    fn check(found: f64, function: impl Fn(f64) -> f64, x: f64) {
        let step = 1e-6;
        let wanted = (function(x + step) - function(x - step)) / (2.0 * step);
        assert!((found - wanted).abs() <= 1e-5 * (1.0 + wanted.abs()), "{found} is not {wanted} at {x}");
    }

    proptest! {
        #[test]
        fn slopes_are_those_of_differences(x in 0.05..0.95_f64, y in 0.05..0.95_f64) {
            prop_assume!((x - y).abs() > 1e-3);
            for function in UNARY {
                let found = Dual::variable(x, 1).unary(function);
                prop_assert_eq!(found.value, x.unary(function));
                prop_assert_eq!(found.slopes[0], 0.0);
                check(found.slopes[1], |x| x.unary(function), x);
            }
            for function in BINARY {
                let found = Dual::variable(x, 0).binary(function, Dual::variable(y, 1));
                prop_assert_eq!(found.value, x.binary(function, y));
                check(found.slopes[0], |x| x.binary(function, y), x);
                check(found.slopes[1], |y| x.binary(function, y), y);
            }
        }
    }

    #[test]
    fn a_corner_without_a_slope_has_no_value_for_a_variable_and_one_for_a_constant() {
        let zero = Dual::constant(0.0);
        assert_eq!(zero.unary(Unary::Sqrt), zero);
        assert!(Dual::variable(0.0, 0).unary(Unary::Sqrt).admitted().is_missing());
        assert_eq!(zero.binary(Binary::Hypot, zero), zero);
        assert!(Dual::constant(1.0).binary(Binary::Div, zero).admitted().is_missing());
    }

    #[test]
    fn the_median_is_that_of_the_values() {
        let numbers = [3.0, 1.0, 2.0].into_iter().zip(0..).map(|(value, place)| Dual::variable(value, place));
        assert_eq!(Dual::median(numbers.clone(), &mut []), Dual::variable(2.0, 2));
        let even = Dual::median(numbers.take(2), &mut []);
        assert_eq!((even.value, even.slopes[0], even.slopes[1]), (2.0, 0.5, 0.5));
    }
}
