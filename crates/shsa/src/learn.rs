//! `shsa learn`: relations between the signals of recordings, as a change of a model.
//!
//! `recordings, perhaps a model -> subject (one series a variable) -> relations -> proposals, tried in the model -> text, JSON,
//! patch`

use crate::columns::{ColumnArguments, names, write};
use crate::headings::OUTPUT;
use crate::model::patch::changed;
use crate::outcome::Outcome;
use crate::progress::Search;
use crate::show;
use crate::written;
use anyhow::{Context, anyhow, bail};
use shsa_lab::learning::learn_sessions;
use shsa_lab::proposal::{Proposal, Proposals, Subject};
use shsa_model::live::Written;
use shsa_model::read_text;
use shsa_report::learning::Report;
use shsa_report::recorded::wanted;
use std::io::{Write, stdout};
use std::path::{Path, PathBuf};

/// Arguments of `shsa learn`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa learn drive/ --model car.yaml -o learned.yaml
         shsa calibrate learned.yaml drive/ -o tuned.yaml
         shsa learn drive/ --model car.yaml --for speed --patch stand_ins.yaml

Searched are sums, products and quotients, polynomials to the third degree, rates and integrals, delays, means and slow followers, \
limits, the larger or smaller of two, and factors or sources that a mode selects. Units must match; other constants carry a unit. Constants are fitted to the \
first half of the time, forms compete on the next fifth, and the rest tells the error. What is explained as well by a simpler \
relation or by time alone is not proposed.

A relation whose only evidence is this recording (a constant with a unit that nothing explains) is marked as \
statistical, and commented out in the patch; it is not in the model of -o. Without a model, the variables are those of `shsa draft` for the same recordings.")]
pub(crate) struct Arguments {
    /// Files and folders of any format; files of the same time form one recording.
    #[arg(required = true, value_name = "RECORDING")]
    recordings: Vec<PathBuf>,
    /// The knowledge base, YAML: its signals are read, and relations that it has are not proposed.
    #[arg(long, value_name = "MODEL", conflicts_with = "by")]
    model: Option<PathBuf>,
    /// Keep the fewest relations with which something stands in for what serves this need: a variable, or the name of a need's
    /// publication.
    #[arg(long = "for", value_name = "NEED", requires = "model")]
    need: Option<String>,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
    /// Write the model with the relations in it, and its comments; without --model, the draft of the recordings.
    #[arg(short, long, value_name = "FILE", help_heading = OUTPUT)]
    output: Option<PathBuf>,
    /// Write the relations as a change of the model, for `shsa model patch`.
    #[arg(long, value_name = "FILE", help_heading = OUTPUT)]
    patch: Option<PathBuf>,
    #[command(flatten)]
    columns: ColumnArguments,
}

/// Learns; the answer is no when nothing was found, or nothing that serves the named need.
///
/// # Errors
/// When a file cannot be read or written, or the recordings have no signal that changes.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let Arguments { recordings, columns, output, patch, .. } = arguments;
    let read: Vec<&PathBuf> = recordings.iter().chain(&arguments.model).collect();
    written::ensure_free(output.iter().chain(patch).map(PathBuf::as_path), &read)?;
    let subject = match &arguments.model {
        Some(model) => of_model(model, recordings, columns)?,
        None => of_draft(recordings, columns)?,
    };
    if subject.signals.iter().all(|signal| signal.points.len() < 2) {
        bail!("none of the signals is in the recording, or none of them has two values");
    }
    let learned = learn_sessions(&subject.signals, &subject.joints, &Search::default())?;
    let mut proposals = Proposals::new(&subject, &learned, &Search::default())?;
    let serving = arguments.need.as_ref().map(|need| proposals.serve(&subject, need)).transpose()?;
    let report =
        Report { subject: &subject, learned: &learned, proposals: &proposals, serving: serving.as_ref() };
    let text = match arguments.json {
        true => report.json().to_string(),
        false => report.text(show::style()),
    };
    writeln!(stdout(), "{text}")?;
    let changes = proposals.all.iter().any(Proposal::is_active);
    write_files(arguments, &subject, &report.patch(), changes)?;
    let is_nothing = match &serving {
        Some(serving) => serving.relations.is_empty(),
        None => proposals.all.is_empty() && subject.equal.is_empty(),
    };
    Ok(match (is_nothing, subject.degraded) {
        (true, _) => Outcome::No,
        (false, true) => Outcome::Degraded,
        (false, false) => Outcome::Done,
    })
}

/// Writes the files that are asked for; a model of which nothing changes as it is.
fn write_files(arguments: &Arguments, subject: &Subject, change: &str, changes: bool) -> anyhow::Result<()> {
    if let Some(path) = &arguments.patch {
        write(path, change)?;
    }
    if let Some(path) = &arguments.output {
        let model = Written { name: &subject.model, text: &subject.text };
        let text = match changes {
            true => changed(model, Written { name: "the relations", text: change })?,
            false => subject.text.clone(),
        };
        write(path, &text)?;
    }
    Ok(())
}

/// The series of the draft that the recordings give.
fn of_draft(recordings: &[PathBuf], columns: &ColumnArguments) -> anyhow::Result<Subject> {
    Ok(Subject::of_draft(&columns.read(recordings)?, &names(recordings).join(", "), &Search::default())?)
}

/// The series of a model's variables.
fn of_model(path: &Path, recordings: &[PathBuf], columns: &ColumnArguments) -> anyhow::Result<Subject> {
    let live = show::load_live(path)?;
    let knowledge = live.knowledge();
    let recording = shsa_recording::read(recordings, &wanted(knowledge), &columns.reading.options())?;
    show::recording(&recording);
    let text = read_text(path, "model")
        .map_err(|report| anyhow!("{}", report.render(false)))
        .with_context(|| format!("{} cannot be read again", path.display()))?;
    let name = path.display().to_string();
    Ok(Subject::of_model(Written { name: &name, text: &text }, knowledge, &recording))
}
