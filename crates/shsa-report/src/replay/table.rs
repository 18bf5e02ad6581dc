//! The values and the decisions of a replay as tables, for pandas, Polars and DuckDB.

use super::Part;
use serde_json::{Map, Value};
use shsa_core::assurance::Ground;
use shsa_core::engine::{Event, Publication, PublishedValue};
use shsa_core::interval::Interval;
use shsa_core::knowledge::KnowledgeBase;
use shsa_format::event;
use shsa_format::parquet::ParquetWriter;
use shsa_format::table::{Cell, Kind, Rows};
use std::io::{self, Write};

/// The columns of a table of values.
const VALUES: [(&str, Kind); 11] = [
    ("time", Kind::Time),
    ("received", Kind::Time),
    ("session", Kind::Whole),
    ("signal", Kind::Text),
    ("unit", Kind::Text),
    ("element", Kind::Whole),
    ("lo", Kind::Number),
    ("hi", Kind::Number),
    ("quality", Kind::Text),
    ("admitted", Kind::Text),
    ("level", Kind::Text),
];

/// The columns of a table of decisions; those after the first three are the fields of an event.
const EVENTS: [(&str, Kind); 13] = [
    ("time", Kind::Time),
    ("time_s", Kind::Number),
    ("session", Kind::Whole),
    ("kind", Kind::Text),
    ("signal", Kind::Text),
    ("variable", Kind::Text),
    ("symptom", Kind::Text),
    ("because", Kind::Text),
    ("substitution", Kind::Text),
    ("need", Kind::Text),
    ("relation", Kind::Text),
    ("cause", Kind::Text),
    ("probability", Kind::Number),
];

/// A table of what a replay gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReplayTable {
    /// A row for each published value, and for each element of a list.
    Values,
    /// A row for each decision.
    Events,
}

impl ReplayTable {
    /// Its columns.
    #[must_use]
    pub const fn columns(self) -> &'static [(&'static str, Kind)] {
        match self {
            ReplayTable::Values => &VALUES,
            ReplayTable::Events => &EVENTS,
        }
    }

    /// Gives all its rows, over all sessions.
    ///
    /// # Errors
    /// Errors of the output.
    pub fn write(self, parts: &[Part<'_>], rows: &mut impl Rows) -> io::Result<()> {
        for (at, part) in parts.iter().enumerate() {
            let session = (parts.len() > 1).then_some(at + 1);
            match self {
                ReplayTable::Values => {
                    for (knowledge, publication) in part.run.publications_with_models(0) {
                        write_value(rows, knowledge, publication, session)?;
                    }
                }
                ReplayTable::Events => {
                    for (knowledge, event) in part.run.events_with_models() {
                        write_event(rows, part, session, event, &event::fields(knowledge, event))?;
                    }
                }
            }
        }
        Ok(())
    }
}

/// Writes values of needs as a table of Parquet: a row for each value, and for each element of a list.
pub struct ValueTable<W>(ParquetWriter<W>);

impl<W: Write> ValueTable<W> {
    /// # Errors
    /// Errors of the output.
    pub(super) fn new(output: W) -> io::Result<ValueTable<W>> {
        Ok(ValueTable(ParquetWriter::new(output, &VALUES, &[])?))
    }

    /// # Errors
    /// Errors of the output.
    pub(super) fn write(
        &mut self,
        knowledge: &KnowledgeBase,
        publication: &Publication,
        session: Option<usize>,
    ) -> io::Result<()> {
        write_value(&mut self.0, knowledge, publication, session)
    }

    /// # Errors
    /// Errors of the output.
    pub(super) fn finish(&mut self) -> io::Result<()> {
        self.0.finish()
    }
}

fn write_value(
    rows: &mut impl Rows,
    knowledge: &KnowledgeBase,
    publication: &Publication,
    session: Option<usize>,
) -> io::Result<()> {
    let mut row = |element, value| write_element(rows, knowledge, publication, session, element, value);
    match &publication.value {
        PublishedValue::Scalar(value) => row(None, *value),
        PublishedValue::Vector(elements) => {
            (0..).zip(elements).try_for_each(|(at, value)| row(Some(at), *value))
        }
    }
}

fn write_element(
    rows: &mut impl Rows,
    knowledge: &KnowledgeBase,
    publication: &Publication,
    session: Option<usize>,
    element: Option<i64>,
    value: Interval,
) -> io::Result<()> {
    let need = &knowledge.needs()[publication.need];
    let unit = knowledge.variables()[need.variable].unit.as_ref();
    let shown = |si: f64| Cell::Number(unit.map_or(si, |unit| unit.from_si(si)));
    let admitted = Some(publication.admitted).filter(|it| it.ground != Ground::Undemanded);
    let level = admitted.and_then(|it| it.level);
    let level = level.map(|level| knowledge.contracts().scales().written(level).to_string());
    let unit = unit.map(ToString::to_string);
    rows.row(&[
        Cell::Time(publication.validity.centre()),
        Cell::Time(publication.time),
        whole(session),
        Cell::Text(&need.signal),
        Cell::from(unit.as_deref()),
        element.map_or(Cell::Missing, Cell::Whole),
        shown(value.lo()),
        shown(value.hi()),
        Cell::Text(publication.quality.name()),
        Cell::from(admitted.map(|it| it.ground.name())),
        Cell::from(level.as_deref()),
    ])
}

/// Writes the decisions of all sessions as a table of Parquet.
///
/// # Errors
/// Errors of the output.
pub fn write_event_table(parts: &[Part<'_>], output: impl Write) -> io::Result<()> {
    let mut table = ParquetWriter::new(output, &EVENTS, &[])?;
    ReplayTable::Events.write(parts, &mut table)?;
    table.finish()
}

fn write_event(
    rows: &mut impl Rows,
    part: &Part<'_>,
    session: Option<usize>,
    event: &Event,
    fields: &Map<String, Value>,
) -> io::Result<()> {
    let placed = [Cell::Time(event.time), Cell::Number(part.since(event.time)), whole(session)];
    let cells = EVENTS.iter().skip(placed.len()).map(|(name, _)| match fields.get(*name) {
        Some(Value::String(text)) => Cell::Text(text),
        Some(Value::Number(number)) => number.as_f64().map_or(Cell::Missing, Cell::Number),
        _ => Cell::Missing,
    });
    rows.row(&placed.into_iter().chain(cells).collect::<Vec<_>>())
}

fn whole(number: Option<usize>) -> Cell<'static> {
    number.and_then(|number| number.try_into().ok()).map_or(Cell::Missing, Cell::Whole)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Source;
    use shsa_core::engine::Options;
    use shsa_format::drive::Run;

    /// A table has every field that an event can have: a new field is a new column.
    #[test]
    fn every_field_of_an_event_has_a_column() {
        let story = shsa_format::story::load(
            include_str!("../../../../stories/02-fallback-by-value.yaml"),
            "02.yaml",
            std::path::Path::new("."),
        );
        let source = Source::of_story(&story.story.expect("a story"));
        let run = Run::of(&source.eras, source.span, Options::default(), |run, given| {
            run.give(given);
            Ok::<(), std::convert::Infallible>(())
        })
        .unwrap();
        assert!(!run.events.is_empty());
        for (knowledge, event) in run.events_with_models() {
            for name in event::fields(knowledge, event).keys() {
                assert!(EVENTS.iter().any(|(column, _)| column == name), "no column {name}");
            }
        }
    }
}
