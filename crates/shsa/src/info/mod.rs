//! `shsa info`: the contents of recordings, and their damage.
//!
//! `files -> inventory of each -> text, JSON, or the signals of a model`

mod signals;
mod text;

use crate::outcome::Outcome;
use crate::reading::ReadArguments;
use crate::{old, show};
use shsa_recording::FileInfo;
use std::io::Write as _;
use std::path::PathBuf;

/// Arguments of `shsa info`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa info drive.mcap
         shsa draft drive.mcap -o model.yaml

`shsa draft` writes a model of what `shsa info` lists.

Exit status: 3 when something of a recording is lost.")]
pub(crate) struct Arguments {
    /// Files and folders of any format; `-` is standard input.
    #[arg(required = true, value_name = "RECORDING")]
    recordings: Vec<PathBuf>,
    /// Write the variables and signals of a model with all that is there.
    #[arg(long, hide = true, conflicts_with = "json")]
    signals: bool,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    reading: ReadArguments,
}

/// Reports the contents of recordings.
///
/// # Errors
/// When a recording cannot be read at all.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    if arguments.signals {
        old::note("shsa info", "--signals", "draft");
    }
    let files = shsa_recording::inventory(&arguments.recordings, &arguments.reading.options())?;
    let output = match (arguments.json, arguments.signals) {
        (true, _) => shsa_report::info::json(&files).to_string(),
        (_, true) => signals::drafted(&files),
        _ => text::shown(&files),
    };
    if !arguments.json {
        files.iter().flat_map(|file| &file.warnings).for_each(show::warn);
    }
    writeln!(std::io::stdout().lock(), "{}", output.trim_end())?;
    Ok(if files.iter().any(|file: &FileInfo| file.degraded) { Outcome::Degraded } else { Outcome::Done })
}
