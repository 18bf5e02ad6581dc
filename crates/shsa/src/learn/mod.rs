//! `shsa learn`: relations between the signals of recordings, as a change of a model.
//!
//! `recordings, perhaps a model -> subject (one series a variable) -> relations -> proposals, tried in the model -> text, JSON,
//! patch`

mod subject;
mod proposal;
mod report;

use crate::columns::{ColumnArguments, write};
use crate::outcome::Outcome;
use crate::replay::written;
use anyhow::bail;
use proposal::Proposals;
use shsa_lab::learning::learn;
use std::io::{Write, stdout};
use std::path::PathBuf;
use subject::Subject;

/// Arguments of `shsa learn`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa learn drive/ --model car.yaml --patch relations.yaml
         shsa patch car.yaml relations.yaml -o car.yaml
         shsa calibrate car.yaml drive/ --patch tuned.yaml

Searched are sums, products and quotients, polynomials to the third degree, rates and integrals, delays, means and slow followers, \
limits, the larger or smaller of two, and factors or sources that a mode selects. Units must match; other constants carry a unit. Constants are fitted to the \
first half of the time, forms compete on the next fifth, and the rest tells the error. What is explained as well by a simpler \
relation or by time alone is not proposed.

A relation whose only evidence is this recording (a constant with a unit that nothing explains) is marked as \
statistical, and commented out in the patch. Without a model, the variables are those of `shsa draft` for the same recordings.")]
pub(crate) struct Arguments {
    #[command(flatten)]
    columns: ColumnArguments,
    /// The knowledge base, YAML: its signals are read, and relations that it has are not proposed.
    #[arg(long, value_name = "MODEL", conflicts_with = "by")]
    model: Option<PathBuf>,
    /// Write the relations as a change of the model, for `shsa patch`.
    #[arg(long, value_name = "FILE")]
    patch: Option<PathBuf>,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

/// Learns; the answer is no when nothing was found.
///
/// # Errors
/// When a file cannot be read or written, or the recordings have no signal that changes.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let read: Vec<&PathBuf> = arguments.columns.recordings.iter().chain(&arguments.model).collect();
    arguments.patch.iter().try_for_each(|path| written::ensure_free(path, &read))?;
    let subject = match &arguments.model {
        Some(model) => Subject::of_model(model, &arguments.columns)?,
        None => Subject::drafted(&arguments.columns)?,
    };
    if subject.signals.iter().all(|signal| signal.points.len() < 2) {
        bail!("none of the signals is in the recording, or none of them has two values");
    }
    let learned = learn(&subject.signals)?;
    let proposals = Proposals::new(&subject, &learned)?;
    let text = match arguments.json {
        true => report::json(&subject, &learned, &proposals).to_string(),
        false => report::text(&subject, &learned, &proposals),
    };
    writeln!(stdout(), "{text}")?;
    if let Some(path) = &arguments.patch {
        write(path, &report::patch(&subject, &proposals))?;
    }
    Ok(match (proposals.all.is_empty() && subject.equal.is_empty(), subject.degraded) {
        (true, _) => Outcome::No,
        (false, true) => Outcome::Degraded,
        (false, false) => Outcome::Done,
    })
}
