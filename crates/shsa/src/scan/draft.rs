//! The first draft of a model: the received variables and signals. It can be loaded; comments name what is still open.

use super::Scan;
use super::text::rate;
use super::topic_record::TopicRecord;
use shsa_bridge::payload::{Content, Leaf, Reader, SIZE_LIMIT};
use shsa_core::observation::RawValue;
use shsa_lab::naming::{quoted, unique, unit, variable};
use shsa_message::source::{Field, StampField};
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// The usual fields of time stamps.
const STAMPS: [&str; 7] = ["stamp_ns", "stamp", "timestamp", "time", "ts", "t", "header.stamp"];
/// A field counts as a stamp if it differs from the clock by no more than this, nanoseconds.
const STAMP_ERROR: u64 = 3_600_000_000_000;

pub(super) fn drafted(scan: &Scan) -> String {
    let mut names = BTreeSet::new();
    let (mut variables, mut signals) = (String::new(), String::new());
    for (topic, topic_record) in &scan.topics {
        let stamp = stamp_of(topic_record);
        let is_signal = |leaf: &&Leaf| {
            let is_stamp =
                stamp.is_some_and(|stamp| leaf.path == stamp || leaf.path.starts_with(&format!("{stamp}.")));
            let is_known = scan
                .matched
                .as_ref()
                .is_some_and(|known| !known.carried(topic, topic_record, &leaf.path).is_empty());
            matches!(leaf.content, Content::Value(_)) && !is_stamp && !is_known
        };
        for leaf in topic_record.fields.iter().filter(is_signal) {
            let name = unique(&variable(topic, &leaf.path), &mut names);
            let shape = if matches!(leaf.content, Content::Value(RawValue::Vector(_))) {
                " shape: vector "
            } else {
                ""
            };
            let guessed =
                unit(&leaf.path, topic).map_or("# unit: ?".to_owned(), |unit| format!("# unit: {unit}?"));
            let _cannot_fail = writeln!(variables, "  {name}: {{{shape}}}   {guessed}");
            let _cannot_fail = writeln!(signals, "{}", signal(topic, topic_record, leaf, stamp, &name));
        }
    }
    let (bus, seconds) = (&scan.bus, scan.seconds);
    let head = format!(
        "# Drafted by `shsa scan` from {seconds} s of {bus}.\n# To be done: units, value_error and timeout of the signals, relations, needs; \
         one variable for the signals that tell the same.\nshsa: 1\n"
    );
    if signals.is_empty() {
        return format!("{head}# Nothing new was heard.\nvariables: {{}}\n");
    }
    format!("{head}variables:\n{variables}signals:\n{signals}")
}

fn signal(
    topic: &str,
    topic_record: &TopicRecord,
    leaf: &Leaf,
    stamp: Option<&str>,
    variable: &str,
) -> String {
    let name = if leaf.path.is_empty() { topic.to_owned() } else { format!("{topic}#{}", leaf.path) };
    let source = quoted(&stamp.map_or_else(|| name.clone(), |stamp| format!("{name}@{stamp}")));
    let name = quoted(&name);
    let rate = topic_record.rate_hz().map_or(String::new(), |hz| format!(", rate: {}", rate(hz)));
    let last = match &leaf.content {
        Content::Value(RawValue::Number(number)) => format!("   # last {number}"),
        Content::Value(RawValue::Vector(values)) => format!("   # {} elements", values.len()),
        _ => String::new(),
    };
    format!("  {name}: {{ variable: {variable}, source: {source}{rate} }}{last}")
}

/// The field with the stamp of a topic's messages.
fn stamp_of(topic_record: &TopicRecord) -> Option<&'static str> {
    let message = topic_record.last_message.as_ref()?;
    STAMPS.into_iter().find(|stamp| {
        let value = topic_record.fields.iter().find(|leaf| matches!(leaf.content, Content::Value(_)));
        let path = value.map(|leaf| leaf.path.clone()).unwrap_or_default();
        let field = Field { path, stamp: Some(StampField { path: (*stamp).to_owned(), step: None }) };
        let Ok(mut reader) = Reader::new(&[field], SIZE_LIMIT) else { return false };
        let mut is_near = false;
        reader.read(message, |_, reading| {
            let stamp = reading.ok().and_then(|reading| reading.stamp);
            is_near = stamp.is_some_and(|stamp| stamp.0.abs_diff(message.received.0) < STAMP_ERROR);
        });
        is_near
    })
}
