//! Compares printed objects with the tables of `docs/json.md`.

#[allow(dead_code, reason = "the tests of the formats use all of it")]
#[path = "../../../shsa-format/tests/all/reference/document.rs"]
pub(crate) mod document;

use document::{Document, code};
use serde_json::Value;
use std::collections::BTreeSet;

/// The rows of a section of `docs/json.md`: the parts of a path, and the condition of the field.
pub(crate) fn rows(section: &str) -> Vec<(Vec<String>, String)> {
    let rows = Document::read("json.md").section(section).rows("field");
    rows.iter().map(|row| (parts(&code(&row[0]).remove(0)), row[2].clone())).collect()
}

/// `a[].b.*` as `a`, `[]`, `b`, `*`.
fn parts(path: &str) -> Vec<String> {
    path.replace("[]", ".[]").split('.').map(str::to_owned).collect()
}

/// The paths of all values within a value.
fn walk(value: &Value, path: &[String], found: &mut BTreeSet<Vec<String>>) {
    let below = |name: &str| [path, &[name.to_owned()]].concat();
    let children: Vec<(Vec<String>, &Value)> = match value {
        Value::Object(fields) => fields.iter().map(|(name, value)| (below(name), value)).collect(),
        Value::Array(items) => items.iter().map(|value| (below("[]"), value)).collect(),
        _ => Vec::new(),
    };
    for (path, value) in children {
        walk(value, &path, found);
        found.insert(path);
    }
}

fn matches(row: &[String], path: &[String]) -> bool {
    row.len() == path.len() && row.iter().zip(path).all(|(part, name)| part == "*" || part == name)
}

/// Checks that every printed field is described, and that every unconditional field was printed.
#[track_caller]
pub(crate) fn check(section: &str, printed: &[Value]) {
    let rows = rows(section);
    let mut found = BTreeSet::new();
    printed.iter().for_each(|value| walk(value, &[], &mut found));
    for path in &found {
        let is_reported = |path: &[String]| rows.iter().any(|(row, _)| matches(row, path));
        // The elements of a list need no row if the list has one, nor does an object whose fields have rows.
        let is_element = path.last().is_some_and(|last| last == "[]") && is_reported(&path[..path.len() - 1]);
        let has_parts =
            rows.iter().any(|(row, _)| row.len() > path.len() && matches(&row[..path.len()], path));
        assert!(is_reported(path) || is_element || has_parts, "{section}: not described: {}", path.join("."));
    }
    for (row, _) in rows.iter().filter(|(_, comes)| comes.is_empty()) {
        // A field of the elements of a list or mapping must exist when there are such elements.
        let free = row.iter().rposition(|part| part == "[]" || part == "*").map_or(0, |at| at + 1);
        let is_there = |path: &[String]| path.is_empty() || found.iter().any(|found| matches(path, found));
        assert!(!is_there(&row[..free]) || is_there(row), "{section}: has not come: {}", row.join("."));
    }
}
