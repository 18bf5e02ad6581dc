//! Numbers, quantities, times and errors as they are written in a model, read into SI.

use super::problems::Problems;
use crate::expression::{Quantity, parse_quantity};
use crate::interval::Interval;
use crate::knowledge::draft::{Bounds, Text};
use crate::knowledge::properties::SharedNames;
use crate::knowledge::{ACCURACY, INTEGRITY, PRIOR, Properties, ValueError, integrity_level};
use crate::time::Span;
use crate::unit::{Dimension, Unit};
use alloc::collections::BTreeSet;
use alloc::format;
use alloc::string::{String, ToString};

/// The meaning of a number: a temperature of 20 degC is 293.15 K, a difference of 20 degC is 20 K.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// A value of a variable.
    Value,
    /// A difference of two values.
    Difference,
}

/// Reads a unit.
pub(super) fn unit(problems: &mut Problems, text: &Text) -> Option<Unit> {
    match Unit::parse(&text.text) {
        Ok(unit) => Some(unit),
        Err(error) => {
            let help = error.nearest.map_or_else(
                || "write it like `m/s^2`, `km/h`, `deg`, `degC`, `%`".to_string(),
                |near| format!("did you mean `{near}`?"),
            );
            problems.error(text, error.message, help);
            None
        }
    }
}

/// Reads a unit, or a multiple of one such as `-1 m/s` with its number.
pub(super) fn multiple(problems: &mut Problems, text: &Text) -> Option<(Unit, Option<f64>)> {
    let written = parse_quantity(&text.text).ok().filter(|_| Unit::parse(&text.text).is_err());
    match written {
        Some(Quantity { value, unit: Some(unit) }) => Some((unit, Some(value))),
        _ => Some((unit(problems, text)?, None)),
    }
}

/// Reads a finite number or quantity in this unit, not in SI: `-40`, `-40 degC`, or `5 K` of a signal in degC.
pub(super) fn in_unit(problems: &mut Problems, text: &Text, unit: Option<&Unit>) -> Option<f64> {
    let read = read(problems, text)?;
    let (Some(own), Some(unit)) = (&read.unit, unit) else {
        let si = quantity(problems, text, unit, Kind::Difference)?;
        return Some(if read.unit.is_some() { si } else { read.value });
    };
    let kind = if own.is_affine() { Kind::Value } else { Kind::Difference };
    let si = quantity(problems, text, Some(unit), kind)?;
    Some(if own.is_affine() { unit.from_si(si) } else { si / unit.to_si_difference(1.0) })
}

/// Reads a finite number or quantity into SI; a plain number counts in `unit`.
pub(super) fn quantity(problems: &mut Problems, text: &Text, unit: Option<&Unit>, kind: Kind) -> Option<f64> {
    let read = read(problems, text)?;
    let unit = match (&read.unit, unit) {
        (Some(own), Some(unit)) if own.dimension != unit.dimension => {
            let message = format!("`{}` does not count in `{unit}`", text.text);
            problems.error(
                text,
                message,
                format!("write a number, which counts in `{unit}`, or a unit like it"),
            );
            return None;
        }
        (Some(own), _) => Some(own),
        (None, unit) => unit,
    };
    finite(problems, text, in_si(read.value, unit, kind))
}

/// Reads a finite number or quantity into SI, and returns its dimension.
pub(super) fn dimensioned(problems: &mut Problems, text: &Text, kind: Kind) -> Option<(f64, Dimension)> {
    let read = read(problems, text)?;
    let dimension = read.unit.as_ref().map_or(Dimension::PLAIN, |unit| unit.dimension);
    Some((finite(problems, text, in_si(read.value, read.unit.as_ref(), kind))?, dimension))
}

/// Reads a difference of two values into SI; a plain number counts in `unit`.
pub(super) fn difference(problems: &mut Problems, text: &Text, unit: Option<&Unit>) -> Option<f64> {
    quantity(problems, text, unit, Kind::Difference)
}

/// As [`quantity`], but also accepts `inf` and `-inf`.
pub(super) fn bound(problems: &mut Problems, text: &Text, unit: Option<&Unit>) -> Option<f64> {
    match text.text.as_str() {
        "inf" | ".inf" | "+.inf" => Some(f64::INFINITY),
        "-inf" | "-.inf" => Some(f64::NEG_INFINITY),
        _ => quantity(problems, text, unit, Kind::Value),
    }
}

/// Reads a number without a unit; a percentage counts in hundredths.
pub(super) fn number(problems: &mut Problems, text: &Text) -> Option<f64> {
    let read = read(problems, text)?;
    match &read.unit {
        Some(unit) if unit.dimension != Dimension::PLAIN => {
            problems.error(text, format!("`{}` is no plain number", text.text), "leave the unit away");
            None
        }
        unit => finite(problems, text, in_si(read.value, unit.as_ref(), Kind::Value)),
    }
}

/// Reads a time, such as `300 ms`; only 0 needs no unit.
pub(super) fn signed_span(problems: &mut Problems, text: &Text) -> Option<Span> {
    let read = read(problems, text)?;
    let seconds = match &read.unit {
        Some(unit) if unit.dimension == Dimension::TIME => unit.to_si(read.value),
        None if read.value == 0.0 => 0.0,
        unit => {
            let message = if unit.is_some() { "is no time" } else { "has no unit" };
            problems.error(text, format!("`{}` {message}", text.text), "write a time like `300 ms` or `2 s`");
            return None;
        }
    };
    // Longer times could overflow the nanoseconds of sums.
    if seconds.abs() > 3.2e9 {
        problems.error(text, format!("`{}` is too long", text.text), "a time has at most 100 years");
        return None;
    }
    Some(Span::from_seconds(seconds))
}

/// As [`signed_span`], but rejects negative times.
pub(super) fn span(problems: &mut Problems, text: &Text) -> Option<Span> {
    let span = signed_span(problems, text)?;
    if span < Span::ZERO {
        problems.error(text, format!("`{}` is negative", text.text), "write a time like `300 ms`");
        return None;
    }
    Some(span)
}

/// Reads a frequency, such as `10 Hz`, in 1/s.
pub(super) fn frequency(problems: &mut Problems, text: &Text) -> Option<f64> {
    let read = read(problems, text)?;
    let hertz = match &read.unit {
        Some(unit) if unit.dimension == Dimension::FREQUENCY => unit.to_si(read.value),
        _ => 0.0,
    };
    // The period must be a span of at least a nanosecond and at most a century.
    if !(3e-10..=1e9).contains(&hertz) {
        problems.error(
            text,
            format!("`{}` is no frequency", text.text),
            "write it like `10 Hz` or `2 1/min`",
        );
        return None;
    }
    Some(hertz)
}

/// Reads a value error of a signal with this unit.
pub(super) fn value_error(
    problems: &mut Problems,
    bounds: &Bounds,
    unit: Option<&Unit>,
) -> Option<ValueError> {
    match bounds {
        Bounds::One(text) => plus_minus(problems, text, unit),
        Bounds::Two(lo, hi) => {
            let low = quantity(problems, lo, unit, Kind::Difference);
            let high = quantity(problems, hi, unit, Kind::Difference);
            let (low, high) = ordered(problems, lo, low?, high?)?;
            Some(ValueError { lo: low, hi: high, relative: 0.0 })
        }
    }
}

/// Reads the lowest and highest error of a time stamp.
pub(super) fn time_error(problems: &mut Problems, bounds: &Bounds) -> Option<(Span, Span)> {
    match bounds {
        Bounds::One(text) => span(problems, text).map(|span| (-span, span)),
        Bounds::Two(lo, hi) => {
            let low = signed_span(problems, lo);
            let high = signed_span(problems, hi);
            ordered(problems, lo, low?, high?)
        }
    }
}

/// Reads a constant's value: exact, or between two bounds. The unit of the value is the constant's unit.
pub(super) fn constant(problems: &mut Problems, bounds: &Bounds) -> Option<(Unit, Interval)> {
    let (first, second) = match bounds {
        Bounds::One(text) => (text, None),
        Bounds::Two(lo, hi) => (lo, Some(hi)),
    };
    let unit = read(problems, first)?.unit.unwrap_or_else(Unit::one);
    let low = quantity(problems, first, Some(&unit), Kind::Value)?;
    let high = match second {
        Some(text) => quantity(problems, text, Some(&unit), Kind::Value)?,
        None => low,
    };
    let (low, high) = ordered(problems, first, low, high)?;
    Some((unit, Interval::new(low, high)))
}

/// Reads named numbers, and checks those that are shares or probabilities. (The numbers of a utility are checked with it.)
pub(super) fn properties(
    problems: &mut Problems,
    names: &mut SharedNames,
    drafts: &[(Text, Text)],
) -> Properties {
    let mut taken = BTreeSet::new();
    let mut property = |(name, text): &'_ (Text, Text)| {
        let level = Some(&name.text).filter(|name| *name == INTEGRITY);
        let level = level.and_then(|_| integrity_level(&text.text));
        let value = level.or_else(|| number(problems, text))?;
        if let Some(sense) = senseless(&name.text, value) {
            problems.error(text, format!("`{}: {}` makes no sense", name.text, text.text), sense);
            return None;
        }
        let name_shared = names.share(&name.text);
        if drafts.len() > 1 && !taken.insert(name_shared.clone()) {
            problems.error(name, format!("`{}` is given twice", name.text), "keep one");
        }
        Some((name_shared, value))
    };
    drafts.iter().filter_map(&mut property).collect()
}

/// Why a value is impossible for a property; `None` when it is possible.
pub(in crate::knowledge) fn senseless(name: &str, value: f64) -> Option<&'static str> {
    match name {
        _ if !value.is_finite() => Some("a property is a finite number"),
        ACCURACY if !(0.0..=1.0).contains(&value) => Some("an accuracy lies between 0 and 1"),
        PRIOR if value <= 0.0 || value >= 1.0 => {
            Some("a prior is the probability of a fault, more than 0 and less than 1")
        }
        _ => None,
    }
}

/// Reads `0.15`, `5 cm`, `2 %`, or a sum of an absolute error and a share.
fn plus_minus(problems: &mut Problems, text: &Text, unit: Option<&Unit>) -> Option<ValueError> {
    let (first, second) = match text.text.rsplit_once('+') {
        Some((first, second)) if parse_quantity(&text.text).is_err() => (first, Some(second)),
        _ => (text.text.as_str(), None),
    };
    let (mut margin, mut relative) = (0.0, 0.0);
    for part in [Some(first), second].into_iter().flatten() {
        let part = Text { text: part.trim().to_string(), place: text.place };
        if is_share(&part.text) {
            relative += number(problems, &part)?;
        } else {
            margin += quantity(problems, &part, unit, Kind::Difference)?;
        }
    }
    if margin < 0.0 || !(0.0..1.0).contains(&relative) {
        let help = "write `0.15`, `5 cm`, `2 %`, `0.3 + 1 %`, or the lowest and highest error `[-0.1, 0.2]`";
        problems.error(text, format!("`{}` is no plus-minus error", text.text), help);
        return None;
    }
    Some(ValueError { lo: -margin, hi: margin, relative })
}

fn is_share(text: &str) -> bool {
    text.ends_with('%') || text.ends_with('‰')
}

fn read(problems: &mut Problems, text: &Text) -> Option<Quantity> {
    if let Some(value) = plain_number(&text.text) {
        return Some(Quantity { value, unit: None });
    }
    match parse_quantity(&text.text) {
        Ok(quantity) => Some(quantity),
        Err(problem) => {
            problems.inside(text, problem);
            None
        }
    }
}

/// Reads digits with a point between them, the most frequent form in large models, without the formulas' parser.
fn plain_number(text: &str) -> Option<f64> {
    let bytes = text.as_bytes();
    let ends = bytes.first().zip(bytes.last())?;
    let plain = ends.0.is_ascii_digit() && ends.1.is_ascii_digit();
    let plain = plain && bytes.iter().all(|byte| byte.is_ascii_digit() || *byte == b'.');
    let value = if plain { text.parse().ok()? } else { return None };
    Some(value).filter(|value: &f64| value.is_finite())
}

fn in_si(value: f64, unit: Option<&Unit>, kind: Kind) -> f64 {
    match (unit, kind) {
        (None, _) => value,
        (Some(unit), Kind::Value) => unit.to_si(value),
        (Some(unit), Kind::Difference) => unit.to_si_difference(value),
    }
}

fn finite(problems: &mut Problems, text: &Text, value: f64) -> Option<f64> {
    if value.is_finite() {
        return Some(value);
    }
    problems.error(text, format!("`{}` is too large", text.text), String::new());
    None
}

/// Both bounds, if they are in order.
pub(super) fn ordered<T: PartialOrd>(problems: &mut Problems, at: &Text, lo: T, hi: T) -> Option<(T, T)> {
    if lo <= hi {
        return Some((lo, hi));
    }
    problems.error(at, "the lowest value is above the highest", "write `[lowest, highest]`");
    None
}
