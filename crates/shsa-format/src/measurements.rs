//! The use of the measurements of fusions, as JSON.

use serde_json::{Map, Value, json};
use shsa_core::engine::{Engine, Measurements};

/// By fusion, then by input: the counts of used and of unused measurements.
#[must_use]
pub fn json(engine: &Engine) -> Map<String, Value> {
    let knowledge = engine.knowledge();
    let fusions = knowledge.fusions().iter().enumerate();
    let of_fusion = fusions.map(|(place, fusion)| {
        let inputs = fusion.inputs.iter().enumerate().map(|(input, it)| {
            let name = knowledge.signals()[it.signal].name.clone();
            (name, of_input(engine.measurements(place, input)))
        });
        (fusion.name.clone(), Value::Object(inputs.collect()))
    });
    of_fusion.collect()
}

fn of_input(it: Measurements) -> Value {
    json!({
        "used": it.used,
        "duplicate": it.duplicate,
        "too_late": it.too_late,
        "rejected": it.rejected,
        "masked": it.masked,
        "ahead": it.ahead,
        "restarts": it.restarts,
    })
}
