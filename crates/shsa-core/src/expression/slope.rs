//! Bounds of the derivatives of operations over intervals.

use super::operation::{Binary, Unary};
use crate::interval::Interval;

const ONE: Interval = Interval::new(1.0, 1.0);
const ZERO: Interval = Interval::new(0.0, 0.0);
const UNIT: Interval = Interval::new(-1.0, 1.0);
const SHARE: Interval = Interval::new(0.0, 1.0);
const NOT_NEGATIVE: Interval = Interval::new(0.0, f64::INFINITY);

/// The slopes of a function of one number over an interval that gives `value`: those of all its secants within the interval.
/// `None` where the function is not defined, or jumps, somewhere in the interval.
pub(super) fn of_one(unary: Unary, x: Interval, value: Interval) -> Option<Interval> {
    let point = Interval::point;
    let slope = match unary {
        Unary::Neg => -ONE,
        Unary::Abs if x.lo() >= 0.0 => ONE,
        Unary::Abs if x.hi() <= 0.0 => -ONE,
        Unary::Abs => UNIT,
        Unary::Floor if value.is_point() => ZERO,
        Unary::Floor => return None,
        Unary::Sqr => point(2.0) * x,
        Unary::Sqrt if x.lo() >= 0.0 => steep(point(2.0) * value),
        Unary::Power(exponent) if exponent >= 0 || !x.contains(0.0) => {
            point(f64::from(exponent)) * x.powi(exponent.checked_sub(1)?)
        }
        // Rises everywhere, infinitely at 0.
        Unary::Root(degree) if degree % 2 != 0 || x.lo() >= 0.0 => {
            steep(point(f64::from(degree)) * value.powi(degree.checked_sub(1)?))
        }
        Unary::Exp => value,
        Unary::Ln if x.lo() > 0.0 => x.recip(),
        Unary::Sin => x.cos(),
        Unary::Cos => -x.sin(),
        Unary::Tan if value.is_bounded() => ONE + value.sqr(),
        Unary::Asin if UNIT.encloses(x) => steep((ONE - x.sqr()).sqrt()),
        Unary::Acos if UNIT.encloses(x) => -steep((ONE - x.sqr()).sqrt()),
        Unary::Atan => (ONE + x.sqr()).recip(),
        Unary::Sqrt
        | Unary::Power(_)
        | Unary::Root(_)
        | Unary::Ln
        | Unary::Tan
        | Unary::Asin
        | Unary::Acos => {
            return None;
        }
    };
    (!slope.is_empty()).then_some(slope)
}

/// The reciprocal of what is not negative, unbounded where it may be 0.
fn steep(divisor: Interval) -> Interval {
    let divisor = divisor.intersection(NOT_NEGATIVE);
    if divisor.hi() > 0.0 { divisor.recip() } else { NOT_NEGATIVE }
}

/// The slopes of a function of two numbers by each of them, as [`of_one`].
pub(super) fn of_two(
    binary: Binary,
    x: Interval,
    y: Interval,
    value: Interval,
) -> Option<(Interval, Interval)> {
    let slopes = match binary {
        Binary::Add => (ONE, ONE),
        Binary::Sub => (ONE, -ONE),
        Binary::Mul => (y, x),
        Binary::Div if !y.contains(0.0) => (y.recip(), -(value / y)),
        Binary::Min if x.hi() <= y.lo() => (ONE, ZERO),
        Binary::Min if y.hi() <= x.lo() => (ZERO, ONE),
        Binary::Max if x.lo() >= y.hi() => (ONE, ZERO),
        Binary::Max if y.lo() >= x.hi() => (ZERO, ONE),
        Binary::Min | Binary::Max => (SHARE, SHARE),
        Binary::Pow if x.lo() > 0.0 => (y * x.powf(y - ONE), value * x.ln()),
        // The angle of a point jumps across the negative axis.
        Binary::Atan2 if x.lo() > 0.0 || x.hi() < 0.0 || y.lo() > 0.0 => {
            let square = x.sqr() + y.sqr();
            (y / square, -(x / square))
        }
        Binary::Hypot if value.lo() > 0.0 => ((x / value).intersection(UNIT), (y / value).intersection(UNIT)),
        Binary::Hypot => (UNIT, UNIT),
        Binary::Div | Binary::Pow | Binary::Atan2 | Binary::Bearing => return None,
    };
    (!slopes.0.is_empty() && !slopes.1.is_empty()).then_some(slopes)
}
