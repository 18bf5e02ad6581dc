//! The report of a model as JSON.

use super::model::{ModelReport, Need};
use serde_json::{Value, json};
use shsa_core::assurance::{EvidenceId, Lacking, Leaf};
use shsa_drawing::case::{gsn, words};

pub(super) fn json(report: &ModelReport<'_>) -> Value {
    json!({
        "model": report.title,
        "given": report.is_given(),
        "needs": report.needs.iter().map(|need| of_need(report, need)).collect::<Vec<_>>(),
    })
}

fn of_need(report: &ModelReport<'_>, need: &Need) -> Value {
    let serving = need.served.and_then(|at| need.now.get(at));
    let losses = need.prospect.losses.iter().map(|(signal, left)| {
        let candidacy = left.and_then(|at| need.prospect.ways.get(at));
        let level = candidacy.and_then(|it| report.level(it.without(report.knowledge, &[*signal]).level));
        json!({
            "signal": report.knowledge.signals()[*signal].name,
            "way": candidacy.map(|candidacy| candidacy.way.describe(report.knowledge)),
            "level": level,
        })
    });
    json!({
        "need": need.name,
        "given": need.served.is_some(),
        "level": serving.and_then(|(_, assessment)| report.level(assessment.level)),
        "way": need.served.map(|at| need.prospect.ways[at].way.describe(report.knowledge)),
        "ways": (0..need.prospect.ways.len()).map(|at| of_way(report, need, at)).collect::<Vec<_>>(),
        "losses": losses.collect::<Vec<_>>(),
        "complete": need.prospect.is_complete,
        "case": report.claim(need).map(|claim| gsn::json(&claim.argument(), &claim.name, &[])),
    })
}

fn of_way(report: &ModelReport<'_>, need: &Need, at: usize) -> Value {
    let (candidacy, (_, assessment)) = (&need.prospect.ways[at], &need.now[at]);
    let name = |id: &EvidenceId| report.evidence(candidacy, *id);
    let sets = candidacy.conditions.sets.iter();
    json!({
        "way": candidacy.way.describe(report.knowledge),
        "utility": candidacy.utility,
        "verdict": words::verdict(assessment.verdict),
        "level": report.level(assessment.level),
        "gives": report.mode(candidacy, assessment),
        "conditions": sets.map(|set| set.iter().map(name).collect::<Vec<_>>()).collect::<Vec<_>>(),
        "weak": candidacy.weak.iter().map(name).collect::<Vec<_>>(),
        "lacks": need.why(at).iter().map(|set| set.iter().map(lacking).collect()).collect::<Vec<Vec<_>>>(),
    })
}

fn lacking(leaf: &Lacking) -> Value {
    let what = if matches!(leaf.leaf, Leaf::Demand(_)) { "demand" } else { "evidence" };
    json!({ "of": leaf.subject, what: leaf.name })
}
