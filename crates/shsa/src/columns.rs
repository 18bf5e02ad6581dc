//! How the columns of recordings are found: arguments of `draft` and `learn`.

use crate::reading::ReadArguments;
use crate::show;
use anyhow::Context;
use shsa_lab::drafting::{Columns, Origin};
use std::io::{Write as _, stdout};
use std::path::{Path, PathBuf};

/// How the columns of recordings are found.
#[derive(clap::Args)]
pub(crate) struct ColumnArguments {
    /// Files and folders of any format; files of the same time form one recording.
    #[arg(required = true, value_name = "RECORDING")]
    pub(crate) recordings: Vec<PathBuf>,
    /// A column that tells apart whose values a row holds, such as the number of a station.
    #[arg(long, value_name = "COLUMN")]
    by: Option<String>,
    #[command(flatten)]
    pub(crate) reading: ReadArguments,
}

impl ColumnArguments {
    /// Reads everything that is a number; warnings go to standard error.
    ///
    /// # Errors
    /// When a recording cannot be read, or its rows are those of several sources that nothing tells apart.
    pub(crate) fn read(&self) -> anyhow::Result<Columns> {
        let options = self.reading.options();
        let read = Origin { recordings: self.recordings.clone(), by: self.by.clone(), options }.read()?;
        read.warnings.iter().for_each(show::warn);
        Ok(read)
    }
}

/// The text of a file to write, `-` being standard output.
pub(crate) fn write(path: &Path, text: &str) -> anyhow::Result<()> {
    if path.as_os_str() == "-" {
        stdout().write_all(text.as_bytes())?;
        return Ok(());
    }
    std::fs::write(path, text).with_context(|| format!("cannot write {}", path.display()))
}
