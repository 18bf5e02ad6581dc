//! Statements, bounds and evidence in words, in the terms of a safety engineer.

use shsa_core::assurance::Verdict;
use shsa_core::interval::Interval;
use shsa_core::knowledge::{EvidenceSource, KnowledgeBase, Measure, Watched};
use shsa_core::statement::{Content, Inclusion, Property, Scales, Statement};
use shsa_core::unit::Dimension;

/// A statement: its bounds, then its level; `as it is` when it has neither.
#[must_use]
pub fn statement(scales: &Scales, statement: &Statement) -> String {
    let properties = statement.properties.iter().map(property);
    let level = statement.level.map(|level| scales.written(level));
    let words: Vec<String> = properties.chain(level).collect();
    if words.is_empty() { "as it is".to_owned() } else { words.join(", ") }
}

fn property(property: &Property) -> String {
    let name = &property.name;
    let listed = |covered: &std::collections::BTreeSet<String>, word: &str| {
        covered.iter().map(String::as_str).collect::<Vec<_>>().join(word)
    };
    match &property.content {
        Content::Binary => name.clone(),
        Content::Categorical { covered, inclusion: Inclusion::GuaranteeInDemand } => {
            format!("{name} one of {}", listed(covered, " or "))
        }
        Content::Categorical { covered, inclusion: Inclusion::DemandInGuarantee } => {
            format!("{name} covers {}", listed(covered, " and "))
        }
        Content::Numeric { ranges, dimension, inclusion } => {
            let range = |range: &Interval| bounds(*range, *dimension, *inclusion);
            format!("{name} {}", ranges.iter().map(range).collect::<Vec<_>>().join(" or "))
        }
    }
}

/// A range in SI: `at most 0.5 m`.
fn bounds(range: Interval, dimension: Dimension, inclusion: Inclusion) -> String {
    let unit = dimension.to_string();
    let quantity = |value: f64| if unit == "1" { format!("{value}") } else { format!("{value} {unit}") };
    match (range.lo(), range.hi()) {
        (lo, hi) if lo == f64::NEG_INFINITY && inclusion == Inclusion::DemandInGuarantee => {
            format!("at least {}", quantity(hi))
        }
        (lo, hi) if lo == f64::NEG_INFINITY => format!("at most {}", quantity(hi)),
        (lo, hi) if hi == f64::INFINITY => format!("at least {}", quantity(lo)),
        (lo, hi) if lo == hi => format!("is {}", quantity(lo)),
        (lo, hi) => format!("between {} and {}", quantity(lo), quantity(hi)),
    }
}

/// The observed value and its bounds: `age of /lidar at most 0.3 s`.
#[must_use]
pub fn watched(knowledge: &KnowledgeBase, watched: &Watched) -> String {
    let (of, measure) = match watched.source {
        EvidenceSource::Told => return format!("{}, as somebody says", watched.name),
        EvidenceSource::Signal(signal, measure) => (knowledge.signals()[signal].name.as_str(), measure),
        EvidenceSource::Source(measure) => ("what serves the need", measure),
    };
    let Some(range) = watched.within else { return format!("{} of {of} healthy", measure.name()) };
    let dimension = dimension(knowledge, watched.source, measure);
    format!("{} of {of} {}", measure.name(), bounds(range, dimension, Inclusion::GuaranteeInDemand))
}

fn dimension(knowledge: &KnowledgeBase, source: EvidenceSource, measure: Measure) -> Dimension {
    match (measure, source) {
        (Measure::Rate, _) => Dimension::FREQUENCY,
        (Measure::Age, _) => Dimension::TIME,
        (Measure::Value | Measure::Width, EvidenceSource::Signal(signal, _)) => {
            let variable = knowledge.signals()[signal].variable;
            let unit = knowledge.variables()[variable].unit.as_ref();
            unit.map_or(Dimension::PLAIN, |unit| unit.dimension)
        }
        _ => Dimension::PLAIN,
    }
}

/// A verdict in one word, as in files and pages.
#[must_use]
pub const fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Holds => "given",
        Verdict::Open => "open",
        Verdict::Circular => "circular",
        Verdict::Refused => "refused",
    }
}
