//! Descriptions of elements as keys and texts, and which of them differ in meaning.

use crate::expression::parse_quantity;
use crate::knowledge::draft::{
    BodyDraft, Bounds, ContractDraft, DemandDraft, FusionDraft, GuaranteeDraft, NeedDraft, PropertyDrafts,
    RelationDraft, SignalDraft, Text, UtilityDraft, VariableDraft,
};
use crate::unit::Unit;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

/// A key, with its earlier and its later text.
pub(super) type Clash = (&'static str, String, String);

/// The keys and texts of an element; a text is empty where nothing is written.
pub(super) type Fields = Vec<(&'static str, String)>;

/// The keys whose texts differ in meaning.
pub(super) fn different(one: &Fields, other: &Fields, counts: impl Fn(&str, &str) -> bool) -> Vec<Clash> {
    let pairs = one.iter().zip(other);
    pairs
        .filter(|((key, one), (_, other))| counts(one, other) && meaning(key, one) != meaning(key, other))
        .map(|((key, one), (_, other))| (*key, one.clone(), other.clone()))
        .collect()
}

/// A text in a normal form: without blanks, and with numbers and units written alike.
fn meaning(key: &str, words: &str) -> String {
    let one = |word: &str| {
        let word = word.trim();
        if key == "unit"
            && let Ok(unit) = Unit::parse(word)
        {
            return format!("{:?} {} {}", unit.dimension, unit.scale, unit.offset);
        }
        match parse_quantity(word) {
            Ok(read) => match read.unit {
                Some(unit) => format!("{} {:?}", unit.to_si(read.value), unit.dimension),
                None => format!("{}", read.value),
            },
            Err(_) => word.split_whitespace().collect(),
        }
    };
    words.split(',').map(one).collect::<Vec<_>>().join(",")
}

fn words(text: Option<&Text>) -> String {
    text.map_or_else(String::new, |text| text.text.clone())
}

fn bounds(bounds: Option<&Bounds>) -> String {
    match bounds {
        None => String::new(),
        Some(Bounds::One(text)) => text.text.clone(),
        Some(Bounds::Two(lo, hi)) => format!("{}, {}", lo.text, hi.text),
    }
}

/// Names in alphabetical order.
fn list<'t>(names: impl IntoIterator<Item = &'t Text>) -> String {
    let mut names: Vec<&str> = names.into_iter().map(|name| name.text.as_str()).collect();
    names.sort_unstable();
    names.join(", ")
}

fn numbers(properties: &PropertyDrafts) -> String {
    let mut numbers: Vec<String> = properties
        .iter()
        .map(|(name, value)| format!("{}: {}", name.text, meaning("", &value.text)))
        .collect();
    numbers.sort_unstable();
    numbers.join(", ")
}

fn range(range: Option<&(Text, Text)>) -> String {
    range.map_or_else(String::new, |(lo, hi)| format!("{}, {}", lo.text, hi.text))
}

pub(super) fn variable_fields(draft: &VariableDraft) -> Fields {
    [
        ("unit", words(draft.unit.as_ref())),
        ("shape", words(draft.shape.as_ref())),
        ("range", range(draft.range.as_ref())),
        ("max_rate", words(draft.max_rate.as_ref())),
        ("wraps", words(draft.wraps.as_ref())),
        ("properties", numbers(&draft.properties)),
    ]
    .into()
}

pub(super) fn utility_fields(draft: &UtilityDraft) -> Fields {
    let none = PropertyDrafts::new();
    let (name, aggregate, relation, signal, way, defaults) = match draft {
        UtilityDraft::Named(name) => (Some(name), None, None, None, None, &none),
        UtilityDraft::Own { aggregate, relation, signal, way, defaults, .. } => {
            (None, aggregate.as_ref(), relation.as_ref(), signal.as_ref(), way.as_ref(), defaults)
        }
    };
    [
        ("utility", words(name)),
        ("aggregate", words(aggregate)),
        ("relation", words(relation)),
        ("signal", words(signal)),
        ("way", words(way)),
        ("defaults", numbers(defaults)),
    ]
    .into()
}

pub(super) fn constant_fields((_, value): &(Text, Bounds)) -> Fields {
    [("value", bounds(Some(value)))].into()
}

pub(super) fn function_fields((head, body): &(Text, Text)) -> Fields {
    [("head", head.text.clone()), ("formula", body.text.clone())].into()
}

pub(super) fn relation_fields(draft: &RelationDraft) -> Fields {
    let (equation, outputs, inputs) = match &draft.body {
        BodyDraft::Equation(text) => (text.text.clone(), String::new(), String::new()),
        BodyDraft::Structure { outputs, inputs } => (String::new(), list(outputs), list(inputs)),
        BodyDraft::Specification(specification) => (specification.text(), String::new(), String::new()),
    };
    [
        ("equation", equation),
        ("outputs", outputs),
        ("inputs", inputs),
        ("for", list(draft.directions.iter().flatten())),
        ("when", words(draft.condition.as_ref())),
        ("error", bounds(draft.error.as_ref())),
        ("learn", list(&draft.learn)),
        ("properties", numbers(&draft.properties)),
    ]
    .into()
}

pub(super) fn signal_fields(draft: &SignalDraft) -> Fields {
    [
        ("variable", words(draft.variable.as_ref())),
        ("source", words(draft.source.as_ref())),
        ("unit", words(draft.unit.as_ref())),
        ("scale", words(draft.scale.as_ref())),
        ("offset", words(draft.offset.as_ref())),
        ("rate", words(draft.rate.as_ref())),
        ("value_error", bounds(draft.value_error.as_ref())),
        ("change_error", words(draft.change_error.as_ref())),
        ("noise", words(draft.noise.as_ref())),
        ("time_error", bounds(draft.time_error.as_ref())),
        ("delay", words(draft.delay.as_ref())),
        ("mean_over", words(draft.mean_over.as_ref())),
        ("timeout", words(draft.timeout.as_ref())),
        ("range", range(draft.range.as_ref())),
        ("saturates", range(draft.saturates.as_ref())),
        ("max_rate", words(draft.max_rate.as_ref())),
        ("max_delay", words(draft.max_delay.as_ref())),
        ("frozen_after", words(draft.frozen_after.as_ref())),
        ("rests_at", words(draft.rests_at.as_ref())),
        ("rests_for", words(draft.rests_for.as_ref())),
        ("hold", words(draft.hold.as_ref())),
        ("counter", words(draft.counter.as_ref())),
        ("access", words(draft.access.as_ref())),
        ("derived_from", list(&draft.derived_from)),
        ("shares", shares(&draft.shares)),
        ("properties", numbers(&draft.properties)),
    ]
    .into()
}

fn shares(causes: &[(Text, Option<Text>)]) -> String {
    causes.iter().map(|(cause, prior)| format!("{}: {}; ", cause.text, words(prior.as_ref()))).collect()
}

pub(super) fn need_fields(draft: &NeedDraft) -> Fields {
    [
        ("signal", words(draft.signal.as_ref())),
        ("max_age", words(draft.max_age.as_ref())),
        ("max_width", words(draft.max_width.as_ref())),
        ("integrity", words(draft.integrity.as_ref())),
        ("min_rate", words(draft.min_rate.as_ref())),
        ("when_unsure", words(draft.when_unsure.as_ref())),
        ("hold", words(draft.hold.as_ref())),
        ("probation", words(draft.probation.as_ref())),
        ("blend", words(draft.blend.as_ref())),
        ("hysteresis", words(draft.hysteresis.as_ref())),
        ("isolation", words(draft.isolation.as_ref())),
    ]
    .into()
}

pub(super) fn contract_fields(draft: &ContractDraft) -> Fields {
    [
        ("runs_on", words(draft.runs_on.as_ref())),
        ("policy", words(draft.policy.as_ref())),
        ("gives", draft.gives.iter().map(guarantee).collect()),
        ("asks", draft.asks.iter().map(demand).collect()),
        ("evidence", terms(&draft.evidence)),
    ]
    .into()
}

fn guarantee(draft: &GuaranteeDraft) -> String {
    let [of, level, when] = [&draft.of, &draft.level, &draft.when].map(|text| words(text.as_ref()));
    let redundant = list(draft.redundant.iter().flatten());
    format!("{}: {of} {level} {when} {redundant} {}; ", draft.name.text, terms(&draft.properties))
}

fn demand(draft: &DemandDraft) -> String {
    let [of, level] = [&draft.of, &draft.level].map(|text| words(text.as_ref()));
    format!("{}: {of} {level} {}; ", draft.name.text, terms(&draft.properties))
}

fn terms(terms: &PropertyDrafts) -> String {
    terms.iter().map(|(name, bound)| format!("{}: {}; ", name.text, bound.text)).collect()
}

/// All texts of a fusion, in order.
pub(super) fn fusion_fields(draft: &FusionDraft) -> Fields {
    let stated: Vec<String> = draft.words().into_iter().map(|text| text.text).collect();
    Vec::from([("fusion", stated.join(", "))])
}
