//! The results of a scan as one JSON object.

use super::Scan;
use super::matched::Matched;
use super::topic_record::TopicRecord;
use serde_json::{Value, json};
use shsa_bridge::payload::{Content, Leaf};
use shsa_core::observation::RawValue;

pub(super) fn shown(scan: &Scan) -> String {
    let topics: Vec<Value> =
        scan.topics.iter().map(|(topic, topic_record)| of_topic(topic, topic_record, scan)).collect();
    let mut output = json!({ "bus": scan.bus, "seconds": scan.seconds, "topics": topics });
    if let Some(matched) = &scan.matched {
        output["signals"] = signals(scan, matched);
    }
    output.to_string()
}

fn of_topic(topic: &str, topic_record: &TopicRecord, scan: &Scan) -> Value {
    let fields: Vec<Value> =
        topic_record.fields.iter().map(|leaf| of_field(topic, topic_record, leaf, scan)).collect();
    json!({
        "topic": topic,
        "form": topic_record.form(),
        "messages": topic_record.count,
        "kept": topic_record.kept,
        "rate_hz": topic_record.rate_hz(),
        "longest_gap_s": topic_record.longest_gap_s(),
        "publishers": topic_record.publishers.len(),
        "quality": topic_record.quality.map(|quality| quality.name()),
        "fields": fields,
        "unreadable": topic_record.unreadable.as_ref().map(ToString::to_string),
    })
}

fn of_field(topic: &str, topic_record: &TopicRecord, leaf: &Leaf, scan: &Scan) -> Value {
    let (kind, value) = match &leaf.content {
        Content::Null => ("null", Value::Null),
        Content::Text(text) => ("text", json!(text)),
        Content::Value(value) => of_value(value),
    };
    let mut output = json!({ "path": leaf.path, "kind": kind, "value": value });
    if let Some(matched) = &scan.matched {
        output["signals"] = json!(matched.carried(topic, topic_record, &leaf.path));
    }
    output
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
        let topic_record = scan.topics.get(&end.topic);
        let why = matched.missing(&scan.topics).find(|missing| missing.signal == signal.name);
        json!({
            "signal": signal.name,
            "topic": &*end.topic,
            "messages": matched.good(id),
            "rate_hz": topic_record.and_then(TopicRecord::rate_hz),
            "declared_rate_hz": signal.rate_hz,
            "value": end.value.as_ref().map(|value| of_value(value).1),
            "missing": why.map(|missing| missing.because),
        })
    };
    matched.signals().map(one).collect()
}
