//! Many numbers at once: a branch-free formula is evaluated for all of them together.
//!
//! The overhead of a program is then paid once for [`LANES`] numbers, and the arithmetic becomes vector instructions. Every lane
//! has exactly the value that the formula has for its number alone.

use shsa_core::expression::{Binary, Comparison, Constant, Curve, Number, Unary};
use shsa_core::interval::{Interval, Truth};

/// The number of lanes.
pub(crate) const LANES: usize = 16;

/// A number for each lane; not-a-number is missing.
///
/// Only for branch-free programs: a comparison would need one answer for all lanes, so comparisons and functions of sets of
/// numbers have no value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lanes(pub(crate) [f64; LANES]);

impl Lanes {
    #[inline(always)]
    fn map(self, function: impl Fn(f64) -> f64) -> Lanes {
        Lanes(self.0.map(function))
    }

    #[inline(always)]
    fn zip(mut self, other: Lanes, function: impl Fn(f64, f64) -> f64) -> Lanes {
        self.0.iter_mut().zip(other.0).for_each(|(own, its)| *own = function(*own, its));
        self
    }
}

impl Number for Lanes {
    const MISSING: Lanes = Lanes([f64::NAN; LANES]);

    fn constant(constant: Constant) -> Lanes {
        Lanes([constant.value; LANES])
    }

    fn admitted(self) -> Lanes {
        self.map(f64::admitted)
    }

    fn is_missing(self) -> bool {
        self.0.iter().all(|number| number.is_nan())
    }

    // Explicit cases become loops without a branch in them.
    fn unary(self, function: Unary) -> Lanes {
        match function {
            Unary::Neg => self.map(|x| x.unary(Unary::Neg)),
            Unary::Sqr => self.map(|x| x.unary(Unary::Sqr)),
            Unary::Sin => self.map(|x| x.unary(Unary::Sin)),
            Unary::Cos => self.map(|x| x.unary(Unary::Cos)),
            _ => self.map(|x| x.unary(function)),
        }
    }

    fn binary(self, function: Binary, other: Lanes) -> Lanes {
        match function {
            Binary::Add => self.zip(other, |x, y| x.binary(Binary::Add, y)),
            Binary::Sub => self.zip(other, |x, y| x.binary(Binary::Sub, y)),
            Binary::Mul => self.zip(other, |x, y| x.binary(Binary::Mul, y)),
            Binary::Div => self.zip(other, |x, y| x.binary(Binary::Div, y)),
            _ => self.zip(other, |x, y| x.binary(function, y)),
        }
    }

    fn compare(self, _: Comparison, _: Lanes) -> Truth {
        Truth::Unknown
    }

    fn hull(self, _: Lanes) -> Lanes {
        Lanes::MISSING
    }

    fn either_of(_: impl Iterator<Item = Lanes>) -> Lanes {
        Lanes::MISSING
    }

    fn covering(self, other: Lanes) -> Lanes {
        self.zip(other, f64::covering)
    }

    fn between(self, next: Lanes) -> Lanes {
        self.zip(next, f64::between)
    }

    fn within(self, bounds: Interval) -> Lanes {
        self.map(|number| number.within(bounds))
    }

    fn along(self, curve: Curve<'_>) -> Lanes {
        self.map(|number| number.along(curve))
    }

    fn bounds(self) -> Interval {
        Interval::EMPTY
    }

    fn median(_: impl Iterator<Item = Lanes>, _: &mut [f64]) -> Lanes {
        Lanes::MISSING
    }
}
