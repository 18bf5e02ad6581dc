//! What there is to know of a model that was read: its problems, and what cannot be watched or met.

use crate::analysis::{shortened, unconfirmed, unwatched};
use crate::shortfall::unmet;
use serde_json::{Value, json};
use shsa_core::engine::WatchBudget;
use shsa_model::{Loaded, Located};

/// Adds warnings about what cannot be watched or met to the report of a model without errors, and notes on what nothing confirms.
pub fn complete(loaded: &mut Loaded, file: &str) {
    if !loaded.report.ok() {
        return;
    }
    let knowledge = &loaded.knowledge;
    let mut warnings = unwatched(knowledge, WatchBudget::default());
    warnings.extend(shortened(unmet(knowledge)));
    let notes = unconfirmed(knowledge, WatchBudget::default());
    loaded.report.diagnostics.extend(warnings.into_iter().map(|warning| Located::warning(file, warning)));
    loaded.report.diagnostics.extend(notes.into_iter().map(|note| Located::note(file, note)));
}

/// The size of a model and its problems as one JSON object; `docs/json.md` lists the fields.
#[must_use]
pub fn json(loaded: &Loaded) -> Value {
    let knowledge = &loaded.knowledge;
    json!({
        "ok": loaded.report.ok(),
        "variables": knowledge.variables().len(),
        "relations": knowledge.relations().len(),
        "signals": knowledge.signals().len(),
        "needs": knowledge.needs().len(),
        "diagnostics": loaded.report.diagnostics,
    })
}
