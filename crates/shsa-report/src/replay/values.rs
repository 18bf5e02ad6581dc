//! The values of needs that a replay publishes, as JSON lines or as a table.

use super::Part;
use super::table::ValueTable;
use serde_json::{Value, json};
use shsa_core::assurance::{Admitted, Ground};
use shsa_core::engine::{Publication, PublishedValue};
use shsa_core::interval::Interval;
use shsa_core::knowledge::KnowledgeBase;
use shsa_format::words;
use std::io::{self, Write};

/// Writes the values of needs, in the variables' units.
pub enum ValueWriter<W> {
    /// As JSON lines.
    Lines(W),
    /// As a table of Parquet.
    Table(ValueTable<W>),
}

impl<W: Write> ValueWriter<W> {
    /// Writes a table of Parquet, or JSON lines.
    ///
    /// # Errors
    /// Errors of the output.
    pub fn new(output: W, is_table: bool) -> io::Result<ValueWriter<W>> {
        Ok(if is_table { ValueWriter::Table(ValueTable::new(output)?) } else { ValueWriter::Lines(output) })
    }

    /// Writes the values of all needs; with the session's number if there are several.
    ///
    /// # Errors
    /// Errors of the output.
    pub fn write_all(&mut self, parts: &[Part<'_>]) -> io::Result<()> {
        for (at, part) in parts.iter().enumerate() {
            let session = (parts.len() > 1).then_some(at + 1);
            for (knowledge, publication) in part.run.publications_with_models(0) {
                self.write(knowledge, publication, session)?;
            }
        }
        Ok(())
    }

    /// Writes one value; with the number of its session, if it is one of several.
    ///
    /// # Errors
    /// Errors of the output.
    pub fn write(
        &mut self,
        knowledge: &KnowledgeBase,
        publication: &Publication,
        session: Option<usize>,
    ) -> io::Result<()> {
        let output = match self {
            ValueWriter::Table(table) => return table.write(knowledge, publication, session),
            ValueWriter::Lines(output) => output,
        };
        let mut value = value_json(knowledge, publication);
        if let (Some(session), Some(value)) = (session, value.as_object_mut()) {
            value.insert("session".to_owned(), json!(session));
        }
        writeln!(output, "{value}")
    }

    /// Ends the output.
    ///
    /// # Errors
    /// Errors of the output.
    pub fn finish(&mut self) -> io::Result<()> {
        match self {
            ValueWriter::Lines(output) => output.flush(),
            ValueWriter::Table(table) => table.finish(),
        }
    }
}

/// A value as one JSON object.
#[must_use]
pub fn value_json(knowledge: &KnowledgeBase, publication: &Publication) -> Value {
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
        "source": words::served_by(&publication.source),
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
