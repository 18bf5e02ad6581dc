//! A diagnosis as one JSON object.

use super::Report;
use serde_json::{Value, json};
use shsa_lab::doctor::{Finding, Kind, Witness};

impl Report<'_> {
    /// One JSON object.
    #[must_use]
    pub fn json(&self) -> Value {
        let diagnosis = self.diagnosis;
        let relations = diagnosis.relations.iter().map(|it| {
            json!({ "signals": self.names(&it.columns), "formula": it.formula, "deviation": it.deviation, "unexplained": it.share })
        });
        let unchecked =
            diagnosis.unchecked.iter().map(|(column, why)| json!({ "signal": self.name(*column), "because": why }));
        json!({
            "signals": self.columns.columns.len(),
            "findings": diagnosis.findings.iter().map(|it| self.finding(it)).collect::<Vec<_>>(),
            "groups": diagnosis.groups.iter().map(|it| self.names(it)).collect::<Vec<_>>(),
            "relations": relations.collect::<Vec<_>>(),
            "unchecked": unchecked.collect::<Vec<_>>(),
            "open": diagnosis.open.iter().map(|(one, other)| self.names(&[*one, *other])).collect::<Vec<_>>(),
        })
    }

    fn finding(&self, finding: &Finding) -> Value {
        let stretch = |(from, to): &(f64, f64)| {
            let (session, from_s) = self.in_session(*from);
            json!({ "session": session, "from_s": from_s, "to_s": from_s + to - from })
        };
        let (kind, amount) = kind(&finding.kind);
        json!({
            "signals": self.names(&finding.signals),
            "named": finding.is_named(),
            "stretches": finding.stretches.iter().map(stretch).collect::<Vec<_>>(),
            "kind": kind,
            "amount": amount,
            "unit": self.unit(finding.in_unit_of).trim(),
            "times_usual": finding.times,
            "text": self.headline(finding),
            "witnesses": finding.witnesses.iter().map(|it| self.witness_json(it)).collect::<Vec<_>>(),
            "cleared": self.names(&finding.cleared),
        })
    }

    fn witness_json(&self, witness: &Witness) -> Value {
        json!({
            "signals": self.names(&witness.columns),
            "formula": witness.formula,
            "off": witness.off,
            "usual": witness.usual,
            "unit": self.unit(witness.target).trim(),
        })
    }
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
