//! A layout for Foxglove: the knowledge graph, the needs with their bounds and ways, the verdicts, the decisions.

use super::scene::Scene;
use super::{recorded_ways, topic, way_topic};
use serde_json::{Map, Value, json};
use shsa_core::engine::Engine;

/// The most needs, and the most signals, with a panel or a row of their own.
const MOST_NEEDS: usize = 4;
const MOST_SIGNALS: usize = 24;

/// The layout for what an engine watches.
pub(super) fn layout(engine: &Engine) -> Value {
    let known = engine.knowledge();
    let mut panels = Map::new();
    let mut order = Vec::new();
    if let Some(size) = Scene::size_for(engine) {
        panels.insert("3D!graph".into(), seen_from_above(size));
        order.push("3D!graph".to_owned());
    }
    for (number, need) in known.needs().iter().take(MOST_NEEDS).enumerate() {
        let id = format!("Plot!need{number}");
        let own = topic("needs", &need.signal);
        let bounds = ["lo", "mid", "hi"].map(|field| path(&own, field));
        let ways = recorded_ways(engine).filter(|(_, way)| way.substitution.sink == need.variable);
        let ways = ways.map(|(_, way)| way_topic(known, way));
        let others = ways.flat_map(|way| ["lo", "hi"].map(|field| path(&way, field)));
        let paths: Vec<Value> = bounds.into_iter().chain(others).collect();
        panels.insert(
            id.clone(),
            json!({ "paths": paths, "showLegend": true, "foxglovePanelTitle": need.signal }),
        );
        order.push(id);
    }
    let verdicts: Vec<Value> = known
        .signals()
        .iter()
        .take(MOST_SIGNALS)
        .map(|signal| path(&topic("verdicts", &signal.name), "verdict"))
        .collect();
    panels.insert("StateTransitions!verdicts".into(), json!({ "paths": verdicts, "isSynced": true }));
    panels.insert("RosOut!decisions".into(), json!({ "topicToRender": super::LOG, "minLogLevel": 1 }));
    order.extend(["StateTransitions!verdicts", "RosOut!decisions"].map(str::to_owned));
    json!({
        "configById": panels,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": { "speed": 1 },
        "layout": stacked(&order),
    })
}

/// A view of the whole graph, straight from above.
fn seen_from_above((width, height): (f64, f64)) -> Value {
    // As much as the angle of view of 45 degrees takes in, in a panel that is twice as wide as high.
    let distance = 0.6 * f64::max(height, width / 2.0) / (22.5_f64.to_radians()).tan();
    json!({
        "foxglovePanelTitle": "Knowledge graph",
        "cameraState": {
            "perspective": false, "distance": distance, "phi": 0, "thetaOffset": 0,
            "targetOffset": [width / 2.0, -height / 2.0, 0], "target": [0, 0, 0], "targetOrientation": [0, 0, 0, 1],
            "fovy": 45, "near": 0.5, "far": 5000,
        },
        "followMode": "follow-none",
        "followTf": "shsa",
        "scene": {},
        "transforms": {},
        "topics": { super::GRAPH: { "visible": true } },
        "layers": {},
    })
}

fn path(topic: &str, field: &str) -> Value {
    json!({ "value": format!("{topic}.{field}"), "enabled": true, "timestampMethod": "receiveTime" })
}

/// The panels one below the other.
fn stacked(order: &[String]) -> Value {
    match order {
        [] => Value::Null,
        [last] => json!(last),
        [first, rest @ ..] => json!({
            "direction": "column",
            "first": first,
            "second": stacked(rest),
            "splitPercentage": 100.0 / order.len() as f64,
        }),
    }
}
