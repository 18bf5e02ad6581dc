//! The project's rules that no compiler checks; all violations are reported at once.

mod text;
mod layers;
mod items;
mod crates;
mod budgets;

use crate::workspace::{self, Metadata};
use anyhow::{Context, Result, bail};
use std::fs;

/// The files that may exceed the length, each with its exact length and a reason: the list only shrinks.
const EXCEPTIONS: &str = "workshop/xtask/tidy-exceptions.txt";
/// The types whose `impl`s may be in many files, each with their number and a reason.
const SPREAD: &str = "workshop/xtask/tidy-spread.txt";
/// How many lines of product code there may be, each number with its reason.
const BUDGETS: &str = "workshop/xtask/tidy-budgets.txt";

/// Checks every file and crate of the workspace.
///
/// # Errors
/// When a rule is broken; the text lists every violation, one a line.
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
    problems.extend(files.iter().filter_map(crates::unsafe_code));
    problems.extend(crates::licence_files(&files));
    problems.extend(budgets::problems(&files, &read(BUDGETS)?));
    if !problems.is_empty() {
        bail!("{} broken rules\n{}", problems.len(), problems.join("\n"));
    }
    println!("{} files and {} crates are tidy", files.len(), metadata.members().count());
    Ok(())
}
