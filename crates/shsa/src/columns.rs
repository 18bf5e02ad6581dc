//! How the columns of recordings are found: arguments of `doctor`, `draft` and `learn`.

use crate::headings::READING;
use crate::reading::ReadArguments;
use crate::show;
use anyhow::Context;
use shsa_lab::drafting::{Columns, Origin};
use std::io::{Write as _, stdout};
use std::path::{Path, PathBuf};

/// How the columns of recordings are found.
#[derive(clap::Args)]
pub(crate) struct ColumnArguments {
    /// A column that tells apart whose values a row holds, such as the number of a station.
    #[arg(long, value_name = "COLUMN", help_heading = READING)]
    by: Option<String>,
    #[command(flatten)]
    pub(crate) reading: ReadArguments,
}

impl ColumnArguments {
    /// Reads everything that is a number; warnings go to standard error.
    ///
    /// # Errors
    /// When a recording cannot be read, or its rows are those of several sources that nothing tells apart.
    pub(crate) fn read(&self, recordings: &[PathBuf]) -> anyhow::Result<Columns> {
        let options = self.reading.options();
        let read = Origin { recordings: recordings.to_vec(), by: self.by.clone(), options }.read()?;
        read.warnings.iter().for_each(show::warn);
        Ok(read)
    }
}

/// The names of recordings, in their order.
pub(crate) fn names(recordings: &[PathBuf]) -> Vec<String> {
    recordings.iter().map(|path| path.display().to_string()).collect()
}

/// The text of a file to write, `-` being standard output.
pub(crate) fn write(path: &Path, text: &str) -> anyhow::Result<()> {
    if path.as_os_str() == "-" {
        stdout().write_all(text.as_bytes())?;
        return Ok(());
    }
    std::fs::write(path, text).with_context(|| format!("cannot write {}", path.display()))
}
