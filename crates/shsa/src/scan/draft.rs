//! The first draft of a model: the received variables and signals. It can be loaded; comments name what is still open.

use super::Scan;
use super::text::rate;
use super::topic_record::TopicRecord;
use shsa_bridge::payload::{Content, Leaf, Reader, SIZE_LIMIT};
use shsa_core::observation::RawValue;
use shsa_message::source::{Field, StampField};
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// The usual fields of time stamps.
const STAMPS: [&str; 7] = ["stamp_ns", "stamp", "timestamp", "time", "ts", "t", "header.stamp"];
/// A field counts as a stamp if it differs from the clock by no more than this, nanoseconds.
const STAMP_ERROR: u64 = 3_600_000_000_000;

/// Units by parts of a name.
const UNITS: [(&[&str], &str); 14] = [
    (&["temperature", "temp"], "degC"),
    (&["humidity", "soc", "percent", "level"], "%"),
    (&["pressure"], "hPa"),
    (&["linear", "speed", "velocity"], "m/s"),
    (&["angular", "yaw_rate", "gyro"], "rad/s"),
    (&["accel", "acceleration"], "m/s^2"),
    (&["angle", "yaw", "roll", "pitch", "steering"], "rad"),
    (&["latitude", "longitude", "heading", "lat", "lon"], "deg"),
    (&["distance", "range", "ranges", "altitude", "height", "depth"], "m"),
    (&["voltage", "volt"], "V"),
    (&["current", "amp"], "A"),
    (&["power", "watt"], "W"),
    (&["energy"], "J"),
    (&["frequency"], "Hz"),
];

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

/// A text as YAML, with all characters escaped that need it.
pub(crate) fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
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

/// A variable's name: that of the field, with that of the topic if the former is too general.
pub(crate) fn variable(topic: &str, path: &str) -> String {
    let words = |text: &str| -> Vec<String> {
        let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
        text.split(|c| !is_word(c)).filter(|word| !word.is_empty()).map(str::to_lowercase).collect()
    };
    let name = [words(topic), words(path)].concat().join("_");
    if name.starts_with(|c: char| c.is_ascii_alphabetic()) { name } else { format!("v_{name}") }
}

pub(crate) fn unique(name: &str, names: &mut BTreeSet<String>) -> String {
    let numbered = (2..).map(|number| format!("{name}_{number}"));
    let free = std::iter::once(name.to_owned()).chain(numbered).find(|name| !names.contains(name));
    let free = free.unwrap_or_default();
    names.insert(free.clone());
    free
}

/// The unit suggested by the nearest word in the field's name, else in the topic's.
pub(crate) fn unit(path: &str, topic: &str) -> Option<&'static str> {
    let of = |text: &str| {
        let text = text.to_lowercase();
        let words: Vec<&str> = text.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).collect();
        let suggests = |word: &str, names: &[&str]| {
            names.contains(&word) || word.split('_').any(|part| names.contains(&part))
        };
        words
            .iter()
            .rev()
            .find_map(|word| UNITS.iter().find(|(names, _)| suggests(word, names)).map(|(_, unit)| *unit))
    };
    of(path).or_else(|| of(topic))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_words_and_unique() {
        assert_eq!(variable("/odom", "twist.linear.x"), "odom_twist_linear_x");
        assert_eq!(variable("7/a b", ""), "v_7_a_b");
        let mut names = BTreeSet::new();
        let all: Vec<_> = (0..3).map(|_| unique("a", &mut names)).collect();
        assert_eq!(all, ["a", "a_2", "a_3"]);
    }

    #[test]
    fn units_are_suggested_by_names() {
        assert_eq!(unit("outdoor_temperature", "x"), Some("degC"));
        assert_eq!(unit("twist.linear.x", "odom"), Some("m/s"));
        assert_eq!(unit("value", "house/humidity"), Some("%"));
        assert_eq!(unit("a", "b"), None);
    }
}
