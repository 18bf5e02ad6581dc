//! Ranges, units and statements in words, as conserts-rs and safeTbox write them.

use shsa_core::interval::Interval;
use shsa_core::statement::{Content, FailureMode, Inclusion, Property};
use shsa_core::unit::Unit;

/// Names of units beside their symbols.
const NAMES: [(&str, &str); 22] = [
    ("kilometer", "km"),
    ("kilometre", "km"),
    ("meter", "m"),
    ("metre", "m"),
    ("millimeter", "mm"),
    ("millimetre", "mm"),
    ("second", "s"),
    ("millisecond", "ms"),
    ("microsecond", "us"),
    ("nanosecond", "ns"),
    ("kilometers", "km"),
    ("meters", "m"),
    ("millimeters", "mm"),
    ("seconds", "s"),
    ("milliseconds", "ms"),
    ("microseconds", "us"),
    ("nanoseconds", "ns"),
    ("kilometer per hour", "km/h"),
    ("kilometers per hour", "km/h"),
    ("meter per second", "m/s"),
    ("meters per second", "m/s"),
    ("newton", "N"),
];

/// A unit by its symbol or name; the empty text is the unit of plain numbers.
pub(super) fn unit(text: &str) -> Option<Unit> {
    let text = text.trim();
    let name =
        NAMES.iter().find(|(name, _)| name.eq_ignore_ascii_case(text)).map_or(text, |(_, symbol)| symbol);
    if name.is_empty() { Some(Unit::one()) } else { Unit::parse(name).ok() }
}

/// The range between two bounds, in SI. An excluded bound is moved inwards by more than the rounding tolerance, so that a range
/// that touches the bound is not within.
pub(super) fn range(unit: &Unit, [lo, hi]: [f64; 2], excludes: [bool; 2]) -> Interval {
    let inside = |bound: f64, excluded: bool, sign: f64| {
        let bound = unit.to_si(bound);
        let step = (bound.abs() * 1e-6).max(f64::MIN_POSITIVE);
        if excluded && bound.is_finite() { bound + sign * step } else { bound }
    };
    Interval::new(inside(lo, excludes[0], 1.0), inside(hi, excludes[1], -1.0))
}

/// The failure mode of a safety property of safeTbox.
pub(super) fn failure(name: &str) -> Option<FailureMode> {
    match name {
        "Omission" => Some(FailureMode::Omission),
        "Commission" => Some(FailureMode::Commission),
        "TooEarly" => Some(FailureMode::Early),
        "TooLate" => Some(FailureMode::Late),
        "TooHigh" | "TooLow" | "Value" => Some(FailureMode::Value),
        _ => None,
    }
}

/// The property of a statement in words: `Speed Deviation is bound to <= 2 km/h` is a number of up to 2 km/h, named by the words
/// before the bound; any other statement is true or false. Words after the unit belong to the name, so that statements with other
/// words differ.
pub(super) fn property(words: &str, mode: Option<FailureMode>) -> Property {
    let words = words.trim();
    match bound(words) {
        Some((name, range, unit)) => {
            let (ranges, dimension) = (vec![range], unit.dimension);
            let inclusion = Inclusion::GuaranteeInDemand;
            Property { name, mode, content: Content::Numeric { ranges, dimension, inclusion } }
        }
        None => Property { name: words.to_owned(), mode, content: Content::Binary },
    }
}

/// Name, range and unit of a bound in words.
pub(super) fn bound(words: &str) -> Option<(String, Interval, Unit)> {
    let at = words.find(['<', '>'])?;
    let (name, rest) = words.split_at(at);
    let below = rest.starts_with('<');
    let includes = rest[1..].starts_with('=');
    let rest = rest[1 + usize::from(includes)..].trim_start();
    let end =
        rest.find(|c: char| !(c.is_ascii_digit() || matches!(c, '.' | '-' | '+'))).unwrap_or(rest.len());
    let (number, rest) = rest.split_at(end);
    let number: f64 = number.parse().ok().filter(|number: &f64| number.is_finite())?;
    let rest = rest.trim_start();
    let end = rest.find([' ', ':', ',', ';']).unwrap_or(rest.len());
    let (symbol, after) = rest.split_at(end);
    let (unit, after) = match unit(symbol) {
        Some(unit) => (unit, after),
        None => (Unit::one(), rest),
    };
    let (bounds, excludes) = match below {
        true => ([0.0, number], [false, !includes]),
        false => ([number, f64::INFINITY], [!includes, false]),
    };
    let name = [name.trim(), after.trim()].join(" ").trim().to_owned();
    Some((name, range(&unit, bounds, excludes), unit))
}
