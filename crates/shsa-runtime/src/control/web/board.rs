//! The rows that the pages show, each with the number of the look that has changed it. A reader gets the rows that have changed
//! since its last look.

use crate::profile;
use crate::view::{Look, SIGNALS};
use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;
use tokio::time::Instant;

/// How many decisions are kept for pages that are opened later.
const EVENTS: usize = 200;

/// The tables of which a look updates only some rows.
const IN_TURN: [&str; 4] = ["signals", "readings", profile::TABLES[0], profile::TABLES[1]];

/// A table of a model.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Table {
    model: String,
    name: String,
}

/// A row of a table; a removed row is null.
#[derive(Debug)]
struct Row {
    value: Value,
    /// The number of the look that has changed the row.
    changed: u64,
}

/// The content of all pages.
#[derive(Debug, Default)]
pub(super) struct Board {
    /// The time of the last look at the run.
    looked: Option<Instant>,
    /// The number of that look, from 1.
    number: u64,
    /// The values above all tables.
    head: Map<String, Value>,
    tables: BTreeMap<Table, BTreeMap<String, Row>>,
    /// The version of each model.
    versions: BTreeMap<String, u64>,
    /// The latest decisions, each with the number of the look that has brought it.
    events: VecDeque<(u64, Value)>,
    /// The number of the next decision.
    since: Option<u64>,
    /// The first signal of the next look.
    from: usize,
    /// How many looks there were.
    looks: u64,
}

impl Board {
    /// The number of the latest look.
    pub(super) fn number(&self) -> u64 {
        self.number
    }

    /// Whether the last look at the run is older than `age`.
    pub(super) fn is_older_than(&self, age: Duration) -> bool {
        self.looked.is_none_or(|looked| looked.elapsed() >= age)
    }

    /// The next look at the run.
    pub(super) fn look(&self) -> Look {
        Look { since: self.since, from: self.from, turn: self.looks }
    }

    /// The names of the models.
    pub(super) fn models(&self) -> impl Iterator<Item = &str> {
        self.versions.keys().map(String::as_str)
    }

    /// The version of a model.
    pub(super) fn version(&self, model: &str) -> Option<u64> {
        self.versions.get(model).copied()
    }

    /// Adds the result of a look; returns whether there was a decision.
    pub(super) fn take(&mut self, seen: Value) -> bool {
        let Value::Object(mut head) = seen else { return false };
        self.looked = Some(Instant::now());
        self.number += 1;
        self.looks += 1;
        let next = head.remove("next_event").and_then(|next| next.as_u64());
        let has_news = std::mem::replace(&mut self.since, next) != next;
        if let Some(Value::Array(events)) = head.remove("events") {
            self.events.extend(events.into_iter().map(|event| (self.number, event)));
            let surplus = self.events.len().saturating_sub(EVENTS);
            self.events.drain(..surplus);
        }
        let mut count = 0;
        if let Some(Value::Object(models)) = head.remove("models") {
            for (model, mut seen) in models {
                let number = |key| seen.get(key).and_then(Value::as_u64).unwrap_or(0);
                count = number("count").max(count);
                self.follow(&model, number("version"));
                if let Some(Value::Object(tables)) = seen.get_mut("tables").map(Value::take) {
                    tables.into_iter().for_each(|(name, rows)| self.fill(&model, &name, rows));
                }
            }
        }
        self.from = self.from.saturating_add(SIGNALS);
        if self.from as u64 >= count {
            self.from = 0;
        }
        self.head = head;
        has_news
    }

    /// Drops the rows of an earlier version of a model.
    fn follow(&mut self, model: &str, version: u64) {
        if self.versions.insert(model.to_owned(), version).is_none_or(|before| before == version) {
            return;
        }
        let rows = self.tables.iter_mut().filter(|(table, _)| table.model == model);
        rows.flat_map(|(_, rows)| rows.values_mut()).for_each(|row| row.change(Value::Null, self.number));
    }

    /// Adds rows that follow from the run without being a part of it.
    pub(super) fn add(&mut self, model: &str, name: &str, rows: Value) {
        self.number += 1;
        self.fill(model, name, rows);
    }

    /// Adds rows of a table. O(rows log rows).
    fn fill(&mut self, model: &str, name: &str, rows: Value) {
        let Value::Object(mut news) = rows else { return };
        let table = Table { model: model.to_owned(), name: name.to_owned() };
        let is_whole = !IN_TURN.contains(&name);
        let rows = self.tables.entry(table).or_default();
        for (name, row) in rows.iter_mut() {
            match news.remove(name) {
                Some(value) => row.change(value, self.number),
                None if is_whole => row.change(Value::Null, self.number),
                None => {}
            }
        }
        let added = news.into_iter().map(|(name, value)| (name, Row { value, changed: self.number }));
        rows.extend(added);
    }

    /// The rows of a table.
    pub(super) fn rows(&self, model: &str, name: &str) -> impl Iterator<Item = (&str, &Value)> {
        let table = Table { model: model.to_owned(), name: name.to_owned() };
        let rows = self.tables.get(&table).into_iter().flatten();
        rows.filter(|(_, row)| !row.value.is_null()).map(|(name, row)| (name.as_str(), &row.value))
    }

    /// The changes since a look; everything for a new reader. O(rows).
    pub(super) fn part(&self, seen: Option<u64>) -> Value {
        let mut models: Map<String, Value> = Map::new();
        let is_news = |row: &&Row| match seen {
            Some(seen) => row.changed > seen,
            None => !row.value.is_null(),
        };
        for (Table { model, name }, rows) in &self.tables {
            let changed = rows.iter().filter(|(_, row)| is_news(row));
            let changed: Map<String, Value> =
                changed.map(|(name, row)| (name.clone(), row.value.clone())).collect();
            let tables = models.entry(model.clone()).or_insert_with(|| json!({}));
            if let Some(tables) = tables.as_object_mut().filter(|_| !changed.is_empty()) {
                tables.insert(name.clone(), Value::Object(changed));
            }
        }
        let events = self.events.iter().filter(|(look, _)| seen.is_none_or(|seen| *look > seen));
        let events: Vec<&Value> = events.map(|(_, event)| event).collect();
        json!({ "head": self.head, "models": models, "events": events })
    }
}

impl Row {
    fn change(&mut self, value: Value, look: u64) {
        if self.value != value {
            *self = Row { value, changed: look };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The result of a look at a run with one model, two needs and some signals.
    fn seen(next_event: u64, signals: &[(&str, &str)], value: f64) -> Value {
        let signals: Map<String, Value> = signals
            .iter()
            .map(|(name, verdict)| ((*name).to_owned(), json!({ "verdict": verdict })))
            .collect();
        json!({
            "time_ns": value,
            "next_event": next_event,
            "events": [],
            "models": { "m": { "version": 1, "count": 600, "tables": {
                "values": { "a": [value, value], "b": [1.0, 1.0] },
                "signals": signals,
            } } },
        })
    }

    fn rows(part: &Value) -> Vec<String> {
        let tables = part["models"]["m"].as_object().unwrap();
        let names = |(table, rows): (&String, &Value)| {
            let rows = rows.as_object().unwrap().iter();
            rows.map(|(name, row)| format!("{table}/{name}={row}")).collect::<Vec<_>>()
        };
        tables.iter().flat_map(names).collect()
    }

    #[test]
    fn a_reader_gets_the_changes_since_its_last_look() {
        let mut board = Board::default();
        assert!(board.take(seen(3, &[("s", "healthy")], 0.5)));
        assert_eq!(rows(&board.part(None)).len(), 3);
        let quick = board.number();
        board.take(seen(3, &[("t", "healthy")], 0.5));
        assert_eq!(rows(&board.part(Some(quick))), [r#"signals/t={"verdict":"healthy"}"#]);
        let slow = quick;
        assert!(board.take(seen(4, &[("s", "failed")], 0.7)));
        // The slow reader gets the latest row of each, and no earlier ones.
        let missed = rows(&board.part(Some(slow)));
        assert_eq!(missed.len(), 3, "{missed:?}");
        assert!(missed.contains(&"values/a=[0.7,0.7]".to_owned()), "{missed:?}");
        assert!(rows(&board.part(Some(board.number()))).is_empty());
    }

    #[test]
    fn signals_come_in_turn_and_begin_again() {
        let mut board = Board::default();
        let turns: Vec<usize> = (0..5)
            .map(|_| {
                let from = board.look().from;
                board.take(seen(0, &[], 0.0));
                from
            })
            .collect();
        assert_eq!(turns, [0, SIGNALS, 2 * SIGNALS, 0, SIGNALS]);
    }

    #[test]
    fn rows_of_another_version_go_unless_they_come_again() {
        let mut board = Board::default();
        board.take(seen(0, &[("s", "healthy"), ("t", "healthy")], 0.0));
        let before = board.number();
        let mut changed = seen(1, &[("t", "healthy")], 0.0);
        changed["models"]["m"]["version"] = json!(2);
        changed["models"]["m"]["tables"]["values"].as_object_mut().unwrap().remove("b");
        board.take(changed);
        let rendered = rows(&board.part(Some(before)));
        assert!(
            rendered.contains(&"signals/s=null".to_owned()) && rendered.contains(&"values/b=null".to_owned()),
            "{rendered:?}"
        );
        assert!(!rows(&board.part(None)).iter().any(|row| row.contains("null")));
    }

    #[test]
    fn decisions_are_reported_once_and_only_the_latest_are_kept() {
        let mut board = Board::default();
        let mut look = seen(300, &[], 0.0);
        look["events"] = (0..300).map(|number| json!({ "number": number })).collect();
        board.take(look);
        let part = board.part(None);
        assert_eq!(part["events"].as_array().unwrap().len(), EVENTS);
        assert_eq!(part["events"][0]["number"], 100);
        assert!(board.part(Some(board.number()))["events"].as_array().unwrap().is_empty());
    }
}
