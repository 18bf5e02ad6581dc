//! The variables and signals of a recording, as the beginning of a model. Comments name what is still open.

use crate::scan::text::rate;
use shsa_core::unit::Unit;
use shsa_lab::naming::{quoted, unique, unit, variable};
use shsa_recording::{FieldInfo, FileInfo, TopicInfo};
use std::collections::BTreeSet;
use std::fmt::Write as _;

pub(super) fn drafted(files: &[FileInfo]) -> String {
    let mut names = BTreeSet::new();
    let mut listed = BTreeSet::new();
    let (mut variables, mut signals) = (String::new(), String::new());
    for topic in files.iter().flat_map(|file| &file.topics) {
        let is_signal = |field: &&FieldInfo| matches!(field.kind, "number" | "list" | "interval");
        for field in topic.fields.iter().filter(is_signal) {
            // Parts of a split recording have the same topics.
            let source = source(topic, field);
            if !listed.insert(source.clone()) {
                continue;
            }
            let name = unique(&variable(&topic.source, &field.path), &mut names);
            let _cannot_fail = writeln!(variables, "  {name}: {}", about(topic, field));
            let rate = topic.rate_hz.map_or(String::new(), |hz| format!(", rate: {}", rate(hz)));
            let sample = field.sample.as_deref().unwrap_or("");
            let source = quoted(&source);
            let line = format!("  {source}: {{ variable: {name}, source: {source}{rate} }}   # as {sample}");
            let _cannot_fail = writeln!(signals, "{line}");
        }
    }
    if signals.is_empty() {
        return "# Nothing in this recording can be a signal.\n".to_owned();
    }
    format!("variables:\n{variables}signals:\n{signals}")
}

/// The source text of a field.
fn source(topic: &TopicInfo, field: &FieldInfo) -> String {
    // The tags of a topic stand behind the field.
    let at = topic.source.find('[').filter(|_| topic.source.contains('='));
    let (name, tags) = topic.source.split_at(at.unwrap_or(topic.source.len()));
    match field.path.as_str() {
        "" => topic.source.clone(),
        path => format!("{name}#{path}{tags}"),
    }
}

/// Shape and unit of a variable; guesses are in a comment.
fn about(topic: &TopicInfo, field: &FieldInfo) -> String {
    let shape = (field.kind == "list").then(|| "shape: vector".to_owned());
    let known = field.unit.as_deref().filter(|unit| Unit::parse(unit).is_ok());
    let parts: Vec<String> =
        shape.into_iter().chain(known.map(|unit| format!("unit: {}", quoted(unit)))).collect();
    let guess = match (known, &field.unit) {
        (Some(_), _) => String::new(),
        (None, Some(listed)) => format!("   # unit: {listed}?"),
        (None, None) => {
            let guessed = unit(&field.path, &topic.name);
            guessed.map_or("   # unit: ?".to_owned(), |unit| format!("   # unit: {unit}?"))
        }
    };
    if parts.is_empty() { format!("{{}}{guess}") } else { format!("{{ {} }}{guess}", parts.join(", ")) }
}
