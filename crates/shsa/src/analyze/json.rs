//! The analysis as one JSON object.

use super::names::Report;
use serde_json::{Value, json};
use shsa_core::analysis::{Addition, Candidate, Hidden, Limited, Survives, Tolerance, Watch};
use shsa_core::knowledge::SignalId;

/// Numbers of losses are `null` where no loss can take it, or nothing knows it anyway.
pub(super) fn object(report: &Report<'_>) -> Value {
    let (knowledge, analysis) = (report.knowledge, report.analysis);
    let signals: Vec<Value> = knowledge.signals().ids().map(|id| signal(report, id)).collect();
    let needs: Vec<Value> = knowledge
        .needs()
        .enumerate()
        .map(|(id, need)| {
            let tolerance = &analysis.needs[id];
            json!({
                "need": need.signal,
                "variable": report.variable(need.variable),
                "served": tolerance.known,
                "survives": survives(tolerance),
                "exact": tolerance.exact,
                "single_points": report.signals(&tolerance.single_points),
                "taken_by": report.signals(&tolerance.cut),
            })
        })
        .collect();
    let groups: Vec<Vec<&str>> = analysis.faults.groups().iter().map(|group| report.signals(group)).collect();
    json!({
        "signals": signals,
        "needs": needs,
        "comparisons": analysis.comparisons.pairs().len(),
        "watch": { "ways": report.watch.ways, "cost_per_second": report.watch.cost },
        "watched": analysis.watched.iter().map(|watch| watched(report, watch)).collect::<Vec<_>>(),
        "undetectable": report.signals(&report.undetectable()),
        "not_told_apart": groups,
        "unhealed": report.signals(&analysis.unhealed()),
        "additions": analysis.additions.iter().map(|each| addition(report, each)).collect::<Vec<_>>(),
        "structure": report.figures.json(),
        "only_runnable": report.only_runnable,
        "without_formula": report.without_formula(),
        "limited": analysis.limited.iter().map(limited).collect::<Vec<_>>(),
    })
}

fn signal(report: &Report<'_>, id: SignalId) -> Value {
    let analysis = report.analysis;
    let isolable: Vec<&str> = analysis.faults.isolable_from(id).map(|other| report.signal(other)).collect();
    json!({
        "signal": report.signal(id),
        "variable": report.variable(report.knowledge.signals()[id].variable),
        "detectable": analysis.faults.is_detectable(id),
        "shown_by": analysis.faults.shown_by(id),
        "isolable_from": isolable,
        "substitutable": analysis.is_substitutable(id),
        "tolerates": survives(&analysis.signals[id]),
        "exact": analysis.signals[id].exact,
        "needs_lost": report.needs_lost(id),
    })
}

fn watched(report: &Report<'_>, watch: &Watch) -> Value {
    let hidden = |hidden: &Hidden| {
        json!({
            "signal": report.signal(hidden.signal),
            "undetected": hidden.undetected,
            "taken_for": report.signals(&hidden.taken_for),
        })
    };
    json!({
        "variable": report.variable(watch.variable),
        "ways": watch.ways,
        "possible": watch.possible,
        "exact": watch.exact,
        "cost_per_second": watch.cost,
        "hidden": watch.hidden.iter().map(hidden).collect::<Vec<_>>(),
    })
}

fn survives(tolerance: &Tolerance) -> Option<usize> {
    tolerance.survives.filter(|_| tolerance.known)
}

fn addition(report: &Report<'_>, addition: &Addition) -> Value {
    let (kind, variables) = match addition.candidate {
        Candidate::Sensor(variable) => ("sensor", vec![variable]),
        Candidate::Relation(one, other) => ("relation", vec![one, other]),
    };
    let need = |each: &Survives| json!({ "need": report.need(each.need), "from": survives(&each.now), "to": survives(&each.then) });
    json!({
        "kind": kind,
        "variables": variables.iter().map(|&variable| report.variable(variable)).collect::<Vec<_>>(),
        "detectable": report.signals(&addition.detectable),
        "isolable_pairs": addition.isolable_pairs,
        "substitutable": report.signals(&addition.substitutable),
        "survives": addition.survives.iter().map(need).collect::<Vec<_>>(),
    })
}

fn limited(limited: &Limited) -> Value {
    match limited {
        Limited::Ways { variables } => json!({ "what": "ways", "variables": variables }),
        Limited::Skipped { variables } => json!({ "what": "skipped", "variables": variables }),
        Limited::Needs { needs } => json!({ "what": "needs", "needs": needs }),
        Limited::Variables { variables } => json!({ "what": "variables", "variables": variables }),
        Limited::Additions { tried, of } => json!({ "what": "additions", "tried": tried, "of": of }),
    }
}
