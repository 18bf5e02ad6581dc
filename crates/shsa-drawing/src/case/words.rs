//! Statements, bounds and evidence in words, in the terms of a safety engineer.

use super::argument::Kind;
use shsa_core::assurance::{Composition, Verdict};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{EvidenceSource, Id, KnowledgeBase, Measure, Watched};
use shsa_core::statement::{Content, Inclusion, Property, Scales, Statement};
use shsa_core::unit::{Dimension, Unit};

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
    let quantity = |value: f64| {
        if unit == "1" { rounded(value).to_string() } else { format!("{} {unit}", rounded(value)) }
    };
    within(range, inclusion, &quantity)
}

/// A range of quantities: `at most 0.5 m`.
fn within(range: Interval, inclusion: Inclusion, quantity: &dyn Fn(f64) -> String) -> String {
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
        EvidenceSource::Attested => return format!("{}, as somebody says", watched.name),
        EvidenceSource::Specification(variable) => {
            let name = &knowledge.variables()[variable].name;
            return format!("{} of {name} holds", Measure::Verdict.name());
        }
        EvidenceSource::Signal(signal, measure) => (knowledge.signals()[signal].name.as_str(), measure),
        EvidenceSource::Source(measure) => ("what serves the need", measure),
    };
    let Some(range) = watched.within else { return format!("{} of {of} healthy", measure.name()) };
    let quantity = |value: f64| quantity(knowledge, watched.source, measure, value);
    format!("{} of {of} {}", measure.name(), within(range, Inclusion::GuaranteeInDemand, &quantity))
}

/// Descriptions of all pieces of evidence of composed contracts, by their numbers.
#[must_use]
pub fn observed(knowledge: &KnowledgeBase, composition: &Composition) -> Vec<String> {
    let count = composition.system().certificates().evidence.len();
    let mut words = vec!["what nobody measures in this flow".to_owned(); count];
    for (id, contract, watched) in composition.evidence(knowledge) {
        let of = &knowledge.contracts().rows()[contract].name;
        words[id.index()] = format!("{} of {of}: {}", watched.name, self::watched(knowledge, watched));
    }
    words
}

/// A bound of evidence: of a signal's values in the unit of its variable, else in SI.
fn quantity(knowledge: &KnowledgeBase, source: EvidenceSource, measure: Measure, value: f64) -> String {
    match (measure, source) {
        (Measure::Rate, _) => format!("{} {}", rounded(value), Dimension::FREQUENCY),
        (Measure::Age, _) => format!("{} {}", rounded(value), Dimension::TIME),
        (Measure::Value | Measure::Width, EvidenceSource::Signal(signal, _)) => {
            let variable = knowledge.signals()[signal].variable;
            let unit = knowledge.variables()[variable].unit.as_ref();
            let shown = |unit: &Unit| match measure {
                Measure::Value => unit.from_si(value),
                _ => value / unit.scale,
            };
            unit.map_or(rounded(value).to_string(), |unit| format!("{} {unit}", rounded(shown(unit))))
        }
        _ => rounded(value).to_string(),
    }
}

/// Without what the way to SI and back has added: 60 degC, not 59.99999999999994; 70 %, not 0.7000000000000001.
fn rounded(value: f64) -> f64 {
    format!("{value:.10e}").parse().unwrap_or(value)
}

/// The kind of a node of an argument, in one word.
#[must_use]
pub const fn kind(kind: Kind) -> &'static str {
    match kind {
        Kind::Goal => "claim",
        Kind::Strategy => "step",
        Kind::Solution => "evidence",
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
