//! A layout for Foxglove: the needs with their bounds and ways, the verdicts, the decisions.

use super::topic;
use serde_json::{Map, Value, json};
use shsa_core::knowledge::KnowledgeBase;

/// The most needs, and the most signals, with a panel or a row of their own.
const MOST_NEEDS: usize = 4;
const MOST_SIGNALS: usize = 24;

/// The layout for a model. `ways` are the topics of the ways of knowing each needed variable, in the order of the needs.
pub(super) fn layout(known: &KnowledgeBase, ways: &[Vec<String>]) -> Value {
    let mut panels = Map::new();
    let mut order = Vec::new();
    for (number, (need, ways)) in known.needs().iter().zip(ways).take(MOST_NEEDS).enumerate() {
        let id = format!("Plot!need{number}");
        let own = topic("needs", &need.signal);
        let bounds = ["lo", "mid", "hi"].map(|field| path(&own, field));
        let others = ways.iter().flat_map(|way| ["lo", "hi"].map(|field| path(way, field)));
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
