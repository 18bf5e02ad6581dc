//! `shsa draft`: the first model of a system, from its recordings alone.

use crate::columns::{ColumnArguments, write};
use crate::outcome::Outcome;
use crate::progress::Search;
use crate::show;
use crate::written;
use anyhow::bail;
use shsa_lab::drafting::{checked_text, draft};
use std::path::PathBuf;

/// Arguments of `shsa draft`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa draft drive/ -o car.yaml
         shsa calibrate car.yaml drive/ --patch tuned.yaml
         shsa patch car.yaml tuned.yaml -o car.yaml

Each number that can be a signal is one. Signals that measure the same share a variable: their values are equal but for an offset \
and a delay; or their names differ by a number only, and their values are near. Comments give the figure for each decision. What \
is not certain is commented out: guessed units, candidates of relations, ranges of what drifts. The file is valid as it is; \
`shsa calibrate` then fits the tolerances, and `shsa learn` finds relations.

Rows of several sources in one table: shsa draft motes.csv --by mote_id --time-column reading --time-unit 5s")]
pub(crate) struct Arguments {
    #[command(flatten)]
    columns: ColumnArguments,
    /// Where to write the model; `-` is standard output.
    #[arg(short, long, value_name = "FILE", default_value = "-")]
    output: PathBuf,
}

/// Drafts a model.
///
/// # Errors
/// When a recording cannot be read, or nothing in it can be a signal.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let recordings: Vec<&PathBuf> = arguments.columns.recordings.iter().collect();
    written::ensure_free([arguments.output.as_path()], &recordings)?;
    let mut read = arguments.columns.read()?;
    let told = read.warnings.len();
    let mut drafted = draft(&read.columns, &read.joints, &Search::default())?;
    if drafted.groups.is_empty() {
        bail!("nothing in the recording can be a signal: it has no number that changes");
    }
    let names: Vec<String> =
        arguments.columns.recordings.iter().map(|path| path.display().to_string()).collect();
    let text = checked_text(&mut read, &mut drafted, &names.join(", "))?;
    read.warnings[told..].iter().for_each(show::warn);
    write(&arguments.output, &text)?;
    Ok(if read.degraded { Outcome::Degraded } else { Outcome::Done })
}
