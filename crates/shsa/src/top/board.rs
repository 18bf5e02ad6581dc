//! The rows of an instance, as they were last sent.

use super::stream::Part;
use serde_json::{Map, Value};
use std::collections::{BTreeMap, VecDeque};
use std::time::{Duration, Instant};

/// The most decisions that are kept.
const MOST_DECISIONS: usize = 200;

/// The rows of all models of an instance, with the newest decisions.
#[derive(Default)]
pub(super) struct Board {
    head: Value,
    models: BTreeMap<String, BTreeMap<String, Map<String, Value>>>,
    decisions: VecDeque<Value>,
    received: Option<Instant>,
}

impl Board {
    /// Puts the rows of a part in their places. A row that is null is gone.
    pub(super) fn take(&mut self, part: Part) {
        let Part { is_whole, mut content } = part;
        self.received = Some(Instant::now());
        if is_whole {
            self.models.clear();
            self.decisions.clear();
        }
        self.head = content["head"].take();
        if let Value::Array(events) = content["events"].take() {
            self.decisions.extend(events);
        }
        while self.decisions.len() > MOST_DECISIONS {
            self.decisions.pop_front();
        }
        let Value::Object(models) = content["models"].take() else { return };
        for (model, tables) in models {
            let known = self.models.entry(model).or_default();
            let Value::Object(tables) = tables else { continue };
            for (name, rows) in tables {
                if let Value::Object(rows) = rows {
                    put(known.entry(name).or_default(), rows);
                }
            }
        }
    }

    /// Name, version, time and connection of the instance.
    pub(super) fn head(&self) -> &Value {
        &self.head
    }

    /// The time since the last part.
    pub(super) fn age(&self) -> Option<Duration> {
        self.received.map(|received| received.elapsed())
    }

    /// Whether the losses that each need survives are there; an instance computes them beside its work.
    pub(super) fn is_complete(&self) -> bool {
        self.models().all(|model| {
            self.rows(model, "needs").all(|(need, _)| self.row(model, "tolerance", need).is_some())
        })
    }

    /// The names of the models.
    pub(super) fn models(&self) -> impl Iterator<Item = &str> {
        self.models.keys().map(String::as_str)
    }

    /// The rows of a table of a model, by name.
    pub(super) fn rows(&self, model: &str, table: &str) -> impl Iterator<Item = (&str, &Value)> {
        let rows = self.models.get(model).and_then(|tables| tables.get(table));
        rows.into_iter().flatten().map(|(name, row)| (name.as_str(), row))
    }

    /// A row of a table of a model.
    pub(super) fn row(&self, model: &str, table: &str, name: &str) -> Option<&Value> {
        self.models.get(model)?.get(table)?.get(name)
    }

    /// The decisions, the newest first.
    pub(super) fn decisions(&self) -> impl Iterator<Item = &Value> {
        self.decisions.iter().rev()
    }
}

fn put(known: &mut Map<String, Value>, rows: Map<String, Value>) {
    for (key, row) in rows {
        if row.is_null() {
            known.remove(&key);
        } else {
            known.insert(key, row);
        }
    }
}
