//! Tables of results as Markdown, and the files of a command that writes a document.

use anyhow::Context;
use std::fmt::{self, Display, Formatter};
use std::fs;
use std::path::Path;

/// A table with a heading and a sentence about it.
#[derive(Clone, Debug)]
pub(crate) struct Table {
    pub(crate) title: String,
    pub(crate) note: String,
    pub(crate) head: Vec<String>,
    pub(crate) rows: Vec<Vec<String>>,
}

impl Display for Table {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let rule = "---|".repeat(self.head.len());
        writeln!(f, "## {}\n\n{}\n\n| {} |\n|{rule}", self.title, self.note, self.head.join(" | "))?;
        self.rows.iter().try_for_each(|row| writeln!(f, "| {} |", row.join(" | ")))
    }
}

/// Writes `NAME.md`: a title, the command that repeats it, an introduction and tables.
///
/// # Errors
/// The folder cannot be made, or the file not be written.
pub(crate) fn write_document(
    folder: &Path,
    name: &str,
    title: &str,
    introduction: &str,
    tables: &[Table],
) -> anyhow::Result<()> {
    fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let path = folder.join(format!("{name}.md"));
    let tables: Vec<String> = tables.iter().map(Table::to_string).collect();
    let text = format!("# {title}\n\n{introduction}\n\n{}", tables.join("\n"));
    fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))
}

/// The errors of an estimate over some time.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Errors {
    squares: f64,
    weight: f64,
    greatest: f64,
}

impl Errors {
    /// Adds an error with a weight: its duration, or how often it counts.
    pub(crate) fn add(&mut self, error: f64, weight: f64) {
        self.squares += weight * error * error;
        self.weight += weight;
        // A NaN must not count as a small error.
        self.greatest = if error.is_nan() { f64::NAN } else { self.greatest.max(error.abs()) };
    }

    /// The mean of the squares.
    pub(crate) fn mean_square(&self) -> f64 {
        self.squares / self.weight
    }

    /// The root of the mean of the squares.
    pub(crate) fn rms(&self) -> f64 {
        self.mean_square().sqrt()
    }

    /// The greatest.
    pub(crate) fn greatest(&self) -> f64 {
        self.greatest
    }
}
