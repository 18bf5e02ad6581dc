//! The report as JSON.

use super::Maintenance;
use serde_json::{Value, json};
use shsa_core::engine::EventKind;
use shsa_format::comparisons::Noted;

/// The report as a JSON object; times are in seconds.
pub(super) fn object(report: &Maintenance) -> Value {
    let signals = report.signals.iter().map(|it| {
        let episodes = it.episodes.iter().map(|episode| {
            json!({
                "kind": episode.worst.name(),
                "from_ns": episode.from.0,
                "lasted_s": episode.length.seconds(),
                "is_open": episode.is_open,
                "because": episode.because,
            })
        });
        json!({
            "name": it.name,
            "now": it.now(),
            "failed": it.count(EventKind::Failed),
            "suspected": it.count(EventKind::Suspected),
            "silent": it.count(EventKind::Silent),
            "not_trusted_s": it.away.seconds(),
            "restores_s": it.restores.seconds(),
            "episodes": episodes.collect::<Vec<_>>(),
        })
    });
    let needs = report.needs.iter().map(|it| {
        json!({
            "name": it.name,
            "survives": it.redundancy.survives,
            "without_a_spare_s": it.redundancy.bare.seconds(),
            "not_served_s": it.unserved.seconds(),
        })
    });
    let ageing = report.ageing.iter();
    json!({
        "is_due": report.is_due(),
        "watched_s": report.watched.seconds(),
        "signals": signals.collect::<Vec<_>>(),
        "needs": needs.collect::<Vec<_>>(),
        "ageing": ageing.map(|(relation, because)| json!({ "relation": relation, "because": because })).collect::<Vec<_>>(),
        "notes": report.notes.iter().map(Noted::json).collect::<Vec<_>>(),
        "left_out": report.left_out,
    })
}
