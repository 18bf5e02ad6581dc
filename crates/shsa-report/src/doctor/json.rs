//! A diagnosis as one JSON object.

use super::Report;
use serde_json::{Value, json};
use shsa_lab::doctor::{Finding, Kind, Witness};

/// One JSON object.
pub(super) fn json(report: &Report<'_>) -> Value {
    let diagnosis = report.diagnosis;
    let relations = diagnosis.relations.iter().map(|it| {
            json!({ "signals": report.names(&it.columns), "formula": it.formula, "deviation": it.deviation, "unexplained": it.share })
        });
    let unchecked = diagnosis
        .unchecked
        .iter()
        .map(|(column, why)| json!({ "signal": report.name(*column), "because": why }));
    json!({
        "signals": report.columns.columns.len(),
        "findings": diagnosis.findings.iter().map(|it| of_finding(report, it)).collect::<Vec<_>>(),
        "groups": diagnosis.groups.iter().map(|it| json!({ "signals": report.names(it) })).collect::<Vec<_>>(),
        "relations": relations.collect::<Vec<_>>(),
        "unchecked": unchecked.collect::<Vec<_>>(),
        "open": diagnosis.open.iter().map(|(one, other)| json!({ "signals": report.names(&[*one, *other]) })).collect::<Vec<_>>(),
    })
}

fn of_finding(report: &Report<'_>, finding: &Finding) -> Value {
    let stretch = |(from, to): &(f64, f64)| {
        let (session, from_s) = report.in_session(*from);
        json!({ "session": session, "from_s": from_s, "to_s": from_s + to - from })
    };
    let (kind, amount) = kind(&finding.kind);
    json!({
        "signals": report.names(&finding.signals),
        "named": finding.is_named(),
        "stretches": finding.stretches.iter().map(stretch).collect::<Vec<_>>(),
        "kind": kind,
        "amount": amount,
        "unit": report.unit(finding.in_unit_of).trim(),
        "times_usual": finding.times,
        "text": report.headline(finding),
        "witnesses": finding.witnesses.iter().map(|it| of_witness(report, it)).collect::<Vec<_>>(),
        "cleared": report.names(&finding.cleared),
    })
}

fn of_witness(report: &Report<'_>, witness: &Witness) -> Value {
    json!({
        "signals": report.names(&witness.columns),
        "formula": witness.formula,
        "off": witness.off,
        "usual": witness.usual,
        "unit": report.unit(witness.target).trim(),
    })
}

/// The word for a kind, and its number.
fn kind(kind: &Kind) -> (&'static str, Option<f64>) {
    match kind {
        Kind::Offset(by) => ("offset", Some(*by)),
        Kind::Scale(factor) => ("scale", Some(*factor)),
        Kind::Drift(rate) => ("drift", Some(*rate)),
        Kind::Frozen(value) => ("frozen", Some(*value)),
        Kind::Noisy(deviation) => ("noisy", Some(*deviation)),
        Kind::Spikes { size, .. } => ("spikes", Some(*size)),
        Kind::Delayed(by) => ("delayed", Some(*by)),
        Kind::Swapped(_) => ("swapped", None),
        Kind::Unit(factor, _, _) => ("unit", Some(*factor)),
        Kind::Silent => ("silent", None),
        Kind::Impossible(_, value) => ("impossible", Some(*value)),
        Kind::Off(by) => ("off", Some(*by)),
    }
}
