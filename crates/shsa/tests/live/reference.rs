//! Compares `docs/json.md` with the answers of a run over HTTP.

#[path = "../described/mod.rs"]
mod described;

use crate::running::{Running, TOKEN};
use described::check;
use described::document::Document;
use serde_json::Value;
use std::collections::BTreeSet;

#[test]
fn fields_of_state_health_and_events() {
    let run = Running::start([]);
    run.until("the need is served", |state| {
        state["models"]["rover"]["needs"]["v_dmin"]["published"].as_u64() > Some(3)
    });
    run.order(Some(TOKEN), r#"{"order": "change", "text": "available: { /lidar/scan: false }"}"#);
    run.decision("substituted");
    check("/state", &[run.get("/state").1]);
    check("/health", &[run.get("/health").1]);
    let mut described: BTreeSet<String> =
        Document::read("events.md").section("Fields").named("field").into_iter().collect();
    described.extend(["number", "time_ns", "model"].map(str::to_owned));
    let (_, events) = run.get("/events");
    for event in events.as_array().unwrap().iter().filter_map(Value::as_object) {
        let strange: Vec<&String> = event.keys().filter(|key| !described.contains(*key)).collect();
        assert!(strange.is_empty(), "not described: {strange:?} of {event:?}");
    }
}
