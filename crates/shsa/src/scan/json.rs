//! The results of a scan as one JSON object.

use super::Scan;
use super::heard::Heard;
use super::matched::Matched;
use serde_json::{Value, json};
use shsa_bridge::payload::{Content, Leaf};
use shsa_core::observation::RawValue;

pub(super) fn shown(scan: &Scan) -> String {
    let topics: Vec<Value> = scan.topics.iter().map(|(topic, heard)| of_topic(topic, heard, scan)).collect();
    let mut told = json!({ "bus": scan.bus, "seconds": scan.seconds, "topics": topics });
    if let Some(matched) = &scan.matched {
        told["signals"] = signals(scan, matched);
    }
    told.to_string()
}

fn of_topic(topic: &str, heard: &Heard, scan: &Scan) -> Value {
    let fields: Vec<Value> = heard.fields.iter().map(|leaf| of_field(topic, heard, leaf, scan)).collect();
    json!({
        "topic": topic,
        "form": heard.form(),
        "messages": heard.count,
        "kept": heard.kept,
        "rate_hz": heard.rate_hz(),
        "longest_gap_s": heard.longest_gap_s(),
        "publishers": heard.publishers.len(),
        "quality": heard.quality.map(|quality| quality.name()),
        "fields": fields,
        "unreadable": heard.unreadable.as_ref().map(ToString::to_string),
    })
}

fn of_field(topic: &str, heard: &Heard, leaf: &Leaf, scan: &Scan) -> Value {
    let (kind, value) = match &leaf.content {
        Content::Null => ("null", Value::Null),
        Content::Text(text) => ("text", json!(text)),
        Content::Value(value) => of_value(value),
    };
    let mut told = json!({ "path": leaf.path, "kind": kind, "value": value });
    if let Some(matched) = &scan.matched {
        told["signals"] = json!(matched.carried(topic, heard, &leaf.path));
    }
    told
}

fn of_value(value: &RawValue) -> (&'static str, Value) {
    match value {
        RawValue::Number(number) => ("number", json!(number)),
        RawValue::Interval { lo, hi } => ("interval", json!({ "lo": lo, "hi": hi })),
        RawValue::Vector(values) => ("list", json!(values)),
    }
}

fn signals(scan: &Scan, matched: &Matched) -> Value {
    let one = |(id, end): (_, &super::matched::End)| {
        let signal = &matched.knowledge.signals()[id];
        let heard = scan.topics.get(&end.topic);
        let why = matched.missing(&scan.topics).find(|missing| missing.signal == signal.name);
        json!({
            "signal": signal.name,
            "topic": &*end.topic,
            "messages": matched.good(id),
            "rate_hz": heard.and_then(Heard::rate_hz),
            "declared_rate_hz": signal.rate_hz,
            "value": end.value.as_ref().map(|value| of_value(value).1),
            "missing": why.map(|missing| missing.because),
        })
    };
    matched.signals().map(one).collect()
}
