//! `shsa model fmt`: gives models one layout, and keeps their comments.

use crate::outcome::{AlreadyReported, Outcome};
use crate::show;
use anyhow::Context;
use shsa_model::live::Written;
use shsa_model::{Report, layout, read_text};
use std::fs;
use std::io::{IsTerminal, Write, stderr, stdout};
use std::path::{Path, PathBuf};

/// Arguments of `shsa model fmt`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa model fmt --check models/car.yaml

The layout: two blanks for each level, one blank after a comma and a colon, no blanks at the end of a line, no two empty lines in a \
row. Blanks after a line's key stay, as they align values. Comments, the order of entries and line breaks stay, and so does the \
meaning of the model. Only files with changes are written.")]
pub(crate) struct Arguments {
    /// Knowledge bases, YAML or JSON; each is replaced.
    #[arg(required = true)]
    models: Vec<PathBuf>,
    /// Write nothing; print the names of files with another layout, with exit status 1.
    #[arg(long)]
    check: bool,
}

/// Lays out the models, all or none.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let texts: Vec<(&Path, String)> = arguments
        .models
        .iter()
        .map(|model| changed(model))
        .filter_map(Result::transpose)
        .collect::<Result<_, _>>()?;
    for (path, text) in &texts {
        writeln!(stdout().lock(), "{}", path.display())?;
        if !arguments.check {
            fs::write(path, text).with_context(|| format!("writing {}", path.display()))?;
        }
    }
    Ok(if arguments.check && !texts.is_empty() { Outcome::No } else { Outcome::Done })
}

/// A model with its formatted text, if that differs.
fn changed(model: &Path) -> anyhow::Result<Option<(&Path, String)>> {
    let text = read_text(model, "model").map_err(|report| or_report(&report))?;
    let name = model.display().to_string();
    let laid_out =
        layout::laid_out(Written { name: &name, text: &text }).map_err(|report| or_report(&report))?;
    Ok((laid_out != text).then_some((model, laid_out)))
}

fn or_report(report: &Report) -> anyhow::Error {
    // If standard error cannot be written, there is nothing left to do.
    let _ = writeln!(stderr(), "{}", report.render(show::colour(stderr().is_terminal())).trim_end());
    AlreadyReported.into()
}
