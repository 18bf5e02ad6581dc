//! The rules of the house that no compiler holds; every broken one is reported at once.

mod text;
mod layers;
mod items;
mod crates;

use crate::workspace::{self, Metadata};
use anyhow::{Context, Result, bail};
use std::fs;

/// The files that may be too long, each with its exact length and a reason: the list only shrinks.
const EXCEPTIONS: &str = "xtask/tidy-exceptions.txt";
/// The types that may say in many files what they can do, each with how many and a reason.
const SPREAD: &str = "xtask/tidy-spread.txt";

/// Checks every file and crate of the workspace.
///
/// # Errors
/// When a rule is broken; the text lists every place, one a line.
pub(crate) fn check() -> Result<()> {
    let files = workspace::files()?;
    let metadata = Metadata::read()?;
    let read = |path: &str| fs::read_to_string(path).with_context(|| format!("reading {path}"));
    let mut problems = text::lengths(&files, &read(EXCEPTIONS)?);
    problems.extend(files.iter().filter_map(text::head));
    problems.extend(files.iter().flat_map(text::words));
    problems.extend(layers::problems(&files));
    problems.extend(items::problems(&files, &read(SPREAD)?));
    problems.extend(metadata.members().flat_map(crates::arrows));
    problems.extend(files.iter().flat_map(crates::manifest));
    problems.extend(crates::licence_files(&files));
    if !problems.is_empty() {
        bail!("{} broken rules\n{}", problems.len(), problems.join("\n"));
    }
    println!("{} files and {} crates are tidy", files.len(), metadata.members().count());
    Ok(())
}
