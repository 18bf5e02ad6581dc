//! For which arguments operations have a value.

use super::curve::Curve;
use super::operation::{Binary, Operation, Unary};
use crate::interval::Interval;

/// The smallest positive number.
const LEAST: f64 = f64::from_bits(1);

/// Whether an operation has no value for some of the arguments within these bounds; `curve` is that of a table.
pub(super) fn leaves_out(operation: Operation, first: Interval, second: Interval, curve: Curve<'_>) -> bool {
    let lacks = |domain: Interval| !domain.encloses(first);
    match operation {
        Operation::Unary(Unary::Sqrt) => lacks(Interval::new(0.0, f64::INFINITY)),
        Operation::Unary(Unary::Root(degree)) => degree % 2 == 0 && lacks(Interval::new(0.0, f64::INFINITY)),
        Operation::Unary(Unary::Ln) => lacks(Interval::new(LEAST, f64::INFINITY)),
        Operation::Unary(Unary::Asin | Unary::Acos) => lacks(Interval::new(-1.0, 1.0)),
        Operation::Unary(Unary::Power(exponent)) => exponent < 0 && first.contains(0.0),
        Operation::Binary(Binary::Div) => second.contains(0.0),
        Operation::Binary(Binary::Pow) => {
            first.lo() < 0.0 && second.as_whole().is_none() || first.contains(0.0) && second.lo() < 0.0
        }
        Operation::Binary(Binary::Atan2 | Binary::Bearing) => first.contains(0.0) && second.contains(0.0),
        Operation::Within(constant) => lacks(constant.bounds),
        Operation::Table => lacks(curve.domain()),
        _ => false,
    }
}
