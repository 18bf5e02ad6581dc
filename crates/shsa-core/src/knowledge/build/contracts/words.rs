//! Bounds in words: `at most 0.5 m`, `at least 64 MiB`, `between 5 V and 6 V`, `is 1`, `one of slow or stop`, `covers day and night`, `yes`.

use super::super::problems::Problems;
use super::super::quantity::{self, Kind};
use crate::interval::Interval;
use crate::knowledge::draft::Text;
use crate::statement::{Content, FailureMode, Inclusion, Property};
use crate::unit::{Dimension, Unit, nearest};
use alloc::collections::BTreeSet;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;

/// Examples of bounds, as help after an error.
pub(super) const EXAMPLES: &str = "write `at most 0.5 m`, `at least 64 MiB`, `between 5 V and 6 V`, `one of slow or stop`, `covers day and night` or `yes`";

/// The keys of a statement that are not properties.
const KEYS: [&str; 4] = ["of", "level", "when", "redundant"];

/// The words before the time for which a deviation may go unnoticed.
const UNDETECTED: &str = " undetected for at most ";

/// A bound, in pieces of its text.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Bound<'t> {
    AtMost(&'t str),
    AtLeast(&'t str),
    Between(&'t str, &'t str),
    Is(&'t str),
    OneOf(&'t str),
    Covers(&'t str),
    Yes,
}

impl<'t> Bound<'t> {
    /// Reads the words of a bound; `None` for other words.
    pub(super) fn read(text: &'t str) -> Option<Bound<'t>> {
        let text = text.trim();
        let after =
            |words: &str| text.strip_prefix(words).filter(|rest| rest.starts_with(' ')).map(str::trim);
        if let Some(rest) = after("between") {
            let (low, high) = rest.split_once(" and ")?;
            return Some(Bound::Between(low.trim(), high.trim()));
        }
        let found = after("at most").map(Bound::AtMost);
        let found = found.or_else(|| after("at least").map(Bound::AtLeast));
        let found = found.or_else(|| after("is").map(Bound::Is));
        let found = found.or_else(|| after("one of").map(Bound::OneOf));
        let found = found.or_else(|| after("covers").map(Bound::Covers));
        found.or_else(|| matches!(text, "yes" | "true").then_some(Bound::Yes))
    }
}

/// The failure mode that a property's name stands for.
fn mode(name: &str) -> Option<FailureMode> {
    if name == "error" {
        return Some(FailureMode::Value);
    }
    FailureMode::ALL.into_iter().find(|mode| mode.name() == name)
}

/// Reads a property; an error without a unit counts in the unit of `variable`.
pub(super) fn property(
    problems: &mut Problems,
    (name, text): &(Text, Text),
    variable: Option<&Unit>,
) -> Vec<Property> {
    let (bound, undetected) = match text.text.split_once(UNDETECTED) {
        Some((bound, span)) => (bound.trim_end_matches([',', ' ']), Some(span)),
        None => (text.text.as_str(), None),
    };
    let unit = variable.filter(|_| name.text == "error");
    let Some(content) = content(problems, name, text, bound, unit) else { return Vec::new() };
    let mode = mode(&name.text);
    let first = Property { name: name.text.clone(), mode, content };
    let second = undetected.and_then(|span| {
        let span = quantity::span(problems, &piece(text, span))?;
        let content = Content::Numeric {
            ranges: Vec::from([Interval::new(f64::NEG_INFINITY, span.seconds())]),
            dimension: Dimension::TIME,
            inclusion: Inclusion::GuaranteeInDemand,
        };
        Some(Property { name: format!("{} undetected", name.text), mode, content })
    });
    [Some(first), second].into_iter().flatten().collect()
}

fn content(
    problems: &mut Problems,
    name: &Text,
    text: &Text,
    bound: &str,
    unit: Option<&Unit>,
) -> Option<Content> {
    let Some(bound) = Bound::read(bound) else {
        let near = nearest(&name.text, KEYS).map(|key| format!("did you mean the key `{key}`? Else "));
        let help = format!("{}{EXAMPLES}", near.unwrap_or_default());
        problems.error(text, format!("`{}` is no bound of `{}`", text.text, name.text), help);
        return None;
    };
    let categories = |names: &str, word, inclusion| {
        let names = names.split(',').flat_map(|part| part.split(word)).map(str::trim);
        let covered: BTreeSet<String> = names.filter(|name| !name.is_empty()).map(str::to_string).collect();
        Content::Categorical { covered, inclusion }
    };
    match bound {
        Bound::Yes => Some(Content::Binary),
        Bound::OneOf(names) => Some(categories(names, " or ", Inclusion::GuaranteeInDemand)),
        Bound::Covers(names) => Some(categories(names, " and ", Inclusion::DemandInGuarantee)),
        Bound::AtMost(high) => numeric(problems, name, text, [None, Some(high)], unit),
        Bound::AtLeast(low) => {
            // As a range up to the bound: a guarantee of at least 2 s includes a demand of at least 1.5 s.
            let content = numeric(problems, name, text, [None, Some(low)], unit)?;
            Some(turned(content))
        }
        Bound::Between(low, high) => numeric(problems, name, text, [Some(low), Some(high)], unit),
        Bound::Is(value) => numeric(problems, name, text, [Some(value), Some(value)], unit),
    }
}

fn turned(content: Content) -> Content {
    match content {
        Content::Numeric { ranges, dimension, .. } => {
            Content::Numeric { ranges, dimension, inclusion: Inclusion::DemandInGuarantee }
        }
        other => other,
    }
}

fn numeric(
    problems: &mut Problems,
    name: &Text,
    text: &Text,
    ends: [Option<&str>; 2],
    unit: Option<&Unit>,
) -> Option<Content> {
    let (range, dimension) = range(problems, text, ends, unit, Kind::Difference)?;
    if let Some(mode @ (FailureMode::Omission | FailureMode::Early | FailureMode::Late)) = mode(&name.text)
        && dimension != Dimension::TIME
    {
        let message = format!("`{}` bounds a time: how long `{}` may last", text.text, mode.name());
        problems.error(text, message, "write it like `at most 300 ms`");
        return None;
    }
    let ranges = Vec::from([range]);
    Some(Content::Numeric { ranges, dimension, inclusion: Inclusion::GuaranteeInDemand })
}

/// Reads the ends of a range: both in one dimension, that of `unit` where there is one.
pub(super) fn range(
    problems: &mut Problems,
    text: &Text,
    ends: [Option<&str>; 2],
    unit: Option<&Unit>,
    kind: Kind,
) -> Option<(Interval, Dimension)> {
    let mut end = |end: Option<&str>, open: f64| match (end, unit) {
        (None, _) => Some((open, None)),
        (Some(end), None) => {
            let (value, dimension) = quantity::dimensioned(problems, &piece(text, end), kind)?;
            Some((value, Some(dimension)))
        }
        (Some(end), Some(unit)) => {
            Some((quantity::quantity(problems, &piece(text, end), Some(unit), kind)?, Some(unit.dimension)))
        }
    };
    let [low, high] = ends;
    let (low, low_dimension) = end(low, f64::NEG_INFINITY)?;
    let (high, high_dimension) = end(high, f64::INFINITY)?;
    let dimension = low_dimension.or(high_dimension).unwrap_or(Dimension::PLAIN);
    if low_dimension.is_some_and(|low| high_dimension.is_some_and(|high| low != high)) {
        problems.error(text, "the two ends have different dimensions", "give both the same unit");
        return None;
    }
    let (low, high) = quantity::ordered(problems, text, low, high)?;
    Some((Interval::new(low, high), dimension))
}

/// A piece of a text, reported at the place of the whole.
pub(super) fn piece(text: &Text, part: &str) -> Text {
    Text { text: part.trim().to_string(), place: text.place }
}
