//! The section about a failing environment: its scenarios are the tests `crates/shsa/tests/chaos`, one row each.

use super::markdown::table;
use super::{DOCUMENT, notes};
use crate::command;
use anyhow::{Context, Result, ensure};
use serde::Deserialize;
use std::fs;
use std::path::{Path, PathBuf};

/// The section's title.
pub(super) const TITLE: &str = "Chaos: the world around it breaks";

/// The folder in which the tests write their rows.
const ROWS: &str = "target/chaos";

/// The row of a scenario.
#[derive(Deserialize)]
struct Row {
    scenario: String,
    done: String,
    promised: String,
    seen: String,
}

/// Runs every scenario, one after another, and writes their section; keeps the other sections.
///
/// # Errors
/// When something does not build, a promise is broken, or the text cannot be written.
pub(crate) fn write() -> Result<()> {
    let rows = run().context("the scenarios")?;
    for row in rows.iter().filter(|row| row.seen.starts_with("SKIPPED")) {
        println!("{}: {}", row.scenario, row.seen);
    }
    let text = fs::read_to_string(DOCUMENT).with_context(|| format!("reading {DOCUMENT}"))?;
    fs::write(DOCUMENT, replaced(&text, &section(&rows))).with_context(|| format!("writing {DOCUMENT}"))
}

/// The section of an earlier run, with its title; empty if there is none.
pub(super) fn kept(text: &str) -> &str {
    let title = format!("\n## {TITLE}\n");
    let Some((_, rest)) = text.split_once(&title) else { return "" };
    let begin = text.len() - rest.len() - title.len();
    let end = rest.find("\n## ").map_or(text.len(), |end| text.len() - rest.len() + end);
    text.get(begin..end).unwrap_or_default()
}

fn run() -> Result<Vec<Row>> {
    let folder = std::env::current_dir()?.join(ROWS);
    let _there_may_be_none = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder)?;
    let setting = format!("SHSA_CHAOS_ROWS={}", folder.display());
    let test =
        ["cargo", "test", "--locked", "--package", "shsa", "--test", "chaos", "--", "--test-threads=1"];
    command::run(&[&["env", &*setting], &test[..]].concat())?;
    let rows = rows(&folder)?;
    ensure!(!rows.is_empty(), "no scenario has told anything: `cargo xtask test` installs what they need");
    Ok(rows)
}

/// The rows in the order of their files' names.
fn rows(folder: &Path) -> Result<Vec<Row>> {
    let files = fs::read_dir(folder)?.map(|file| Ok(file?.path())).collect::<Result<Vec<PathBuf>>>();
    let mut files = files?;
    files.sort();
    files.iter().map(|file| Ok(serde_json::from_str(&fs::read_to_string(file)?)?)).collect()
}

fn section(rows: &[Row]) -> String {
    let cells = |row: &Row| [&row.scenario, &row.done, &row.promised, &row.seen].map(Clone::clone).to_vec();
    let rows: Vec<Vec<String>> = rows.iter().map(cells).collect();
    let table = table(&["scenario", "what was done", "promised", "seen"], &rows);
    format!("\n## {TITLE}\n\n{}{table}", notes::CHAOS)
}

/// The text with this section in place of an earlier one, else at its end.
fn replaced(text: &str, section: &str) -> String {
    match kept(text) {
        "" => format!("{text}{section}"),
        before => text.replace(before, section),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_section_takes_the_place_of_the_one_before() {
        let new = format!("\n## {TITLE}\n\nnew\n");
        let once = replaced("# A\n\n## B\n\nb\n", &format!("\n## {TITLE}\n\nold\n"));
        assert_eq!(once, format!("# A\n\n## B\n\nb\n\n## {TITLE}\n\nold\n"));
        assert_eq!(replaced(&once, &new), format!("# A\n\n## B\n\nb\n{new}"));
        let between = format!("{once}\n## C\n\nc\n");
        assert_eq!(replaced(&between, &new), format!("# A\n\n## B\n\nb\n{new}\n## C\n\nc\n"));
        assert_eq!(kept("# A\n"), "");
    }
}
