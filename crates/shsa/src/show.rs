//! What is printed for people: loading a model with its problems told, colour, aligned tables, values in units.

use crate::outcome::AlreadyTold;
use shsa_core::knowledge::KnowledgeBase;
use shsa_format::model;
use std::io::{IsTerminal, stderr, stdout};
use std::path::Path;

/// Loads a model; its problems go to standard error.
///
/// # Errors
/// When the model has errors.
pub(crate) fn load_model(path: &Path) -> anyhow::Result<KnowledgeBase> {
    let loaded = model::load_file(path);
    let report = loaded.report.render(colour(stderr().is_terminal()));
    if !report.is_empty() {
        eprintln!("{report}");
    }
    if loaded.report.ok() { Ok(loaded.knowledge) } else { Err(AlreadyTold.into()) }
}

/// Whether to colour: only on a terminal, and not where the user does not want it (<https://no-color.org>).
pub(crate) fn colour(terminal: bool) -> bool {
    terminal && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}

/// A colour of the terminal.
#[derive(Clone, Copy)]
pub(crate) enum Paint {
    Red,
    Green,
    Yellow,
}

/// A text in a colour when standard output is a terminal.
pub(crate) fn paint(paint: Paint, text: &str) -> String {
    if !colour(stdout().is_terminal()) {
        return text.to_owned();
    }
    let code = match paint {
        Paint::Red => 31,
        Paint::Green => 32,
        Paint::Yellow => 33,
    };
    format!("\x1b[{code}m{text}\x1b[0m")
}

/// Rows with aligned columns, two spaces between them; numbers are for the caller to format.
pub(crate) fn table(rows: &[Vec<String>]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| {
        rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let line = |row: &Vec<String>| {
        let cells: Vec<String> =
            row.iter().zip(&widths).map(|(cell, &width)| format!("{cell:<width$}")).collect();
        cells.join("  ").trim_end().to_owned()
    };
    rows.iter().map(line).collect::<Vec<_>>().join("\n")
}

/// The known name nearest to what was written, for help; `None` when none is near.
pub(crate) fn nearest<'a>(written: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    known
        .map(|name| (distance(written, name), name))
        .filter(|(distance, name)| *distance <= 1 + name.chars().count() / 3)
        .min()
        .map(|(_, name)| name)
}

/// Edit distance (Levenshtein 1966), in one row.
fn distance(one: &str, other: &str) -> usize {
    let other: Vec<char> = other.chars().collect();
    let mut row: Vec<usize> = (0..=other.len()).collect();
    for (i, a) in one.chars().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], i + 1);
        for (j, &b) in other.iter().enumerate() {
            let replaced = diagonal + usize::from(a != b);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(row[j + 1] + 1);
        }
    }
    row.last().copied().unwrap_or(0)
}
