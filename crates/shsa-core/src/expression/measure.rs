//! The rules of units: the measure of a formula's node, and which units fit together.

use alloc::format;
use alloc::string::{String, ToString};

use super::problem::{Problem, Severity};
use super::syntax::{Expr, Node};
use crate::unit::Dimension;

/// The unit of a node's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Measure {
    /// The value involves a variable without a unit: it fits everything, and is not checked.
    Unknown,
    /// A literal zero: fits everything.
    Zero,
    /// A known dimension.
    Known(Dimension),
}

pub(super) const PLAIN: Measure = Measure::Known(Dimension::PLAIN);
pub(super) const ANGLE: Measure = Measure::Known(Dimension::ANGLE);

/// A problem without its place: severity, message, help.
#[derive(Debug, PartialEq)]
pub(super) struct Misfit {
    severity: Severity,
    message: String,
    help: String,
}

impl Misfit {
    fn error(message: String, help: String) -> Misfit {
        Misfit { severity: Severity::Error, message, help }
    }

    pub(super) fn at(self, span: core::ops::Range<usize>) -> Problem {
        Problem { severity: self.severity, span, message: self.message, help: Some(self.help) }
    }
}

impl Measure {
    pub(super) fn of(dimension: Option<Dimension>) -> Measure {
        dimension.map_or(Measure::Unknown, Measure::Known)
    }

    pub(super) fn dimension(self) -> Option<Dimension> {
        match self {
            Measure::Known(dimension) => Some(dimension),
            Measure::Zero | Measure::Unknown => None,
        }
    }

    /// Combines two measures through `with`; unknown when one is unknown; an error when an exponent leaves its range.
    pub(super) fn combine(
        self,
        other: Measure,
        with: fn(Dimension, Dimension) -> Option<Dimension>,
    ) -> Result<Measure, Misfit> {
        let (Measure::Known(left), Measure::Known(right)) = (self, other) else {
            return Ok(Measure::Unknown);
        };
        with(left, right).map(Measure::Known).ok_or_else(beyond)
    }

    /// The power `over / under` in lowest terms; `Err` with a warning when the result is no unit.
    pub(super) fn power(self, over: i32, under: i32) -> Result<Measure, Misfit> {
        let Measure::Known(dimension) = self else { return Ok(self) };
        if dimension == Dimension::PLAIN {
            return Ok(self);
        }
        let power = i8::try_from(over).ok().and_then(|over| dimension.power(over)).ok_or_else(beyond)?;
        let root = i8::try_from(under).ok().and_then(|under| power.root(under));
        root.map(Measure::Known).ok_or_else(|| Misfit {
            severity: Severity::Warning,
            message: format!("a root of {power} has no unit; units are not checked from here on"),
            help: "take the root of a product that has one".to_string(),
        })
    }
}

fn beyond() -> Misfit {
    Misfit::error(
        "the exponents of this unit leave their range".to_string(),
        "exponents go up to 127".to_string(),
    )
}

/// The common measure of two sides of `what` (`+`, `=`, `min`, ...), or the misfit.
///
/// A warning comes with the measure to go on with.
pub(super) fn common(what: &str, left: Measure, right: Measure) -> (Measure, Option<Misfit>) {
    let (own, other) = match (left, right) {
        (Measure::Zero, other) | (other, Measure::Zero) => return (other, None),
        (Measure::Unknown, _) | (_, Measure::Unknown) => return (Measure::Unknown, None),
        (Measure::Known(left), Measure::Known(right)) if left == right => {
            return (Measure::Known(left), None);
        }
        (Measure::Known(left), Measure::Known(right)) => (left, right),
    };
    let (is_same_but_angle, rest) = (own.without_angle() == other.without_angle(), own.without_angle());
    if is_same_but_angle && rest != Dimension::PLAIN {
        let difference = i16::from(own.angle()) - i16::from(other.angle());
        return (
            Measure::Known(if own.angle() == 0 { own } else { other }),
            Some(radians(what, own, other, difference)),
        );
    }
    let message = format!("`{what}` of {} and {}", named(own), named(other));
    let help = if is_same_but_angle && own.angle() + other.angle() == 1 {
        "write the number as an angle, such as `3 deg` or `3 rad`; divide the angle by `1 rad` for a plain number".to_string()
    } else {
        "both sides must have the same unit".to_string()
    };
    (Measure::Unknown, Some(Misfit::error(message, help)))
}

/// Warns of a limit without a unit, as in `abs(acceleration) > 0.2`, which is read in SI. Angles are excluded, as degrees are too
/// easily meant.
pub(super) fn bare_limit(left: Measure, right: Measure) -> Option<Misfit> {
    let (Measure::Known(left), Measure::Known(right)) = (left, right) else { return None };
    let dimension = if left == Dimension::PLAIN { right } else { left };
    let is_limit = left == Dimension::PLAIN || right == Dimension::PLAIN;
    (is_limit && left != right && dimension != Dimension::ANGLE).then(|| Misfit {
        severity: Severity::Warning,
        message: format!("a number without a unit is compared with {dimension}, and read in that unit"),
        help: "write its unit behind it".to_string(),
    })
}

/// The warning for units that differ in radians only, which is right in most formulas of turning wheels.
fn radians(what: &str, own: Dimension, other: Dimension, difference: i16) -> Misfit {
    let power =
        if difference.abs() == 1 { "1 rad".to_string() } else { format!("(1 rad)^{}", difference.abs()) };
    let (over, under) = if difference > 0 { ("left", "right") } else { ("right", "left") };
    Misfit {
        severity: Severity::Warning,
        message: format!("`{what}` of {own} and {other}, which differ by radians"),
        help: format!("write `/ {power}` on the {over} side or `* {power}` on the {under} side"),
    }
}

/// The misfit of a measure when `what` takes another measure.
pub(super) fn expect(what: &str, measure: Measure, wanted: Dimension, expression: &Expr) -> Option<Misfit> {
    let Measure::Known(dimension) = measure else { return None };
    if dimension == wanted {
        return None;
    }
    let message = format!("{what} takes {}, not {}", named(wanted), named(dimension));
    let help = match (&expression.node, wanted == Dimension::ANGLE, dimension) {
        (Node::Number(value, _), true, Dimension::PLAIN) => format!("write `{value} deg` or `{value} rad`"),
        (_, true, Dimension::PLAIN) => "multiply by `1 rad` if it is in radians".to_string(),
        (_, false, Dimension::ANGLE) => "divide by `1 rad` for a plain number".to_string(),
        _ if wanted == Dimension::PLAIN => format!("divide by `1 {dimension}` for a plain number"),
        _ => format!("write it in {wanted}"),
    };
    Some(Misfit::error(message, help))
}

fn named(dimension: Dimension) -> String {
    match dimension {
        Dimension::PLAIN => "a plain number".to_string(),
        Dimension::ANGLE => "an angle".to_string(),
        other => other.to_string(),
    }
}
