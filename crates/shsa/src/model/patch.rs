//! `shsa model patch`: puts a change of a model into its file, and keeps the comments.

use crate::outcome::{AlreadyReported, Outcome};
use crate::show;
use anyhow::Context;
use shsa_model::live::Written;
use shsa_model::{Report, patch, read_text};
use std::fs;
use std::io::{IsTerminal, Write, stderr, stdout};
use std::path::{Path, PathBuf};

/// Arguments of `shsa model patch`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa model patch models/car.yaml tuned.yaml -o car.yaml

A change is written as for `shsa replay --reload`, and as `shsa calibrate --patch` writes it: its entries are added, or replace \
those of the same name, and null removes. What it does not touch stays as it is: comments, order, layout. The output may be the \
model itself.")]
pub(crate) struct Arguments {
    /// The knowledge base, YAML.
    model: PathBuf,
    /// The change.
    patch: PathBuf,
    /// Where to write the model as it is then; to standard output when not given.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// Writes the changed model; bad input if it would be invalid.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let change_name = arguments.patch.display().to_string();
    let change = Written { name: &change_name, text: &text(&arguments.patch, "change")? };
    let patched = patched(&arguments.model, change)?;
    match &arguments.output {
        Some(file) => fs::write(file, patched).with_context(|| format!("writing {}", file.display()))?,
        None => stdout().write_all(patched.as_bytes())?,
    }
    Ok(Outcome::Done)
}

/// The text of the model in a file with a change put into it.
///
/// # Errors
/// When the file cannot be read, or the model would be invalid; that is reported.
pub(crate) fn patched(model: &Path, change: Written<'_>) -> anyhow::Result<String> {
    let (name, text) = (model.display().to_string(), text(model, "model")?);
    changed(Written { name: &name, text: &text }, change)
}

/// The text of a model with a change put into it.
///
/// # Errors
/// When the model would be invalid; that is reported.
pub(crate) fn changed(model: Written<'_>, change: Written<'_>) -> anyhow::Result<String> {
    patch::patched(model, change).map_err(|report| or_report(&report))
}

fn text(path: &Path, what: &str) -> anyhow::Result<String> {
    read_text(path, what).map_err(|report| or_report(&report))
}

fn or_report(report: &Report) -> anyhow::Error {
    // If standard error cannot be written, there is nothing left to do.
    let _ = writeln!(stderr(), "{}", report.render(show::colour(stderr().is_terminal())).trim_end());
    AlreadyReported.into()
}
