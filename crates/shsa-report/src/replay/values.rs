//! The values of needs that a replay publishes, as JSON lines.

use super::Part;
use serde_json::{Value, json};
use shsa_core::assurance::{Admitted, Ground};
use shsa_core::engine::{Publication, PublishedValue};
use shsa_core::interval::Interval;
use shsa_core::knowledge::KnowledgeBase;
use std::io::{self, Write};

/// Writes the values of all needs as JSON lines, in the variables' units; with the session's number if there are several.
///
/// # Errors
/// Errors of the output.
pub fn write_values(parts: &[Part<'_>], mut output: impl Write) -> io::Result<()> {
    for (at, part) in parts.iter().enumerate() {
        let session = (parts.len() > 1).then_some(at + 1);
        for (knowledge, publication) in part.run.publications_with_models(0) {
            write_value(knowledge, publication, session, &mut output)?;
        }
    }
    output.flush()
}

/// Writes one value as a JSON line; with the number of its session, if it is one of several.
///
/// # Errors
/// Errors of the output.
pub fn write_value(
    knowledge: &KnowledgeBase,
    publication: &Publication,
    session: Option<usize>,
    output: &mut impl Write,
) -> io::Result<()> {
    let mut value = value_json(knowledge, publication);
    if let (Some(session), Some(value)) = (session, value.as_object_mut()) {
        value.insert("session".to_owned(), json!(session));
    }
    writeln!(output, "{value}")
}

fn value_json(knowledge: &KnowledgeBase, publication: &Publication) -> Value {
    let need = &knowledge.needs()[publication.need];
    let unit = &knowledge.variables()[need.variable].unit;
    let shown = |value: f64| unit.as_ref().map_or(value, |unit| unit.from_si(value));
    let interval = |value: &Interval| json!({ "lo": shown(value.lo()), "hi": shown(value.hi()) });
    let value = match &publication.value {
        PublishedValue::Scalar(value) => interval(value),
        PublishedValue::Vector(elements) => elements.iter().map(interval).collect(),
    };
    let mut described = json!({
        "signal": need.signal,
        "time_ns": publication.validity.centre().0,
        "received_ns": publication.time.0,
        "value": value,
        "quality": publication.quality.name(),
    });
    let Admitted { ground, level } = publication.admitted;
    if let (true, Some(described)) = (ground != Ground::Undemanded, described.as_object_mut()) {
        described.insert("admitted".to_owned(), json!(ground.name()));
        let written = level.map(|level| knowledge.contracts().scales().written(level));
        described.insert("level".to_owned(), json!(written));
        described.insert("rank".to_owned(), json!(level.map_or(0, |level| level.rank + 1)));
    }
    described
}
