//! `shsa doctor`: what is wrong in a recording, without a model.

use crate::columns::{ColumnArguments, names, write};
use crate::headings::OUTPUT;
use crate::outcome::Outcome;
use crate::progress::Search;
use crate::show;
use crate::written;
use shsa_lab::doctor::examine;
use shsa_report::doctor::Report;
use std::io::{Write, stdout};
use std::path::PathBuf;

/// Arguments of `shsa doctor`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa doctor drive/ --html drive.html
         shsa doctor hall.csv -o hall.yaml
         shsa doctor motes.csv --by mote_id --time-column reading --time-unit 5s

It finds out which signals measure the same and what implies what, how well they agree most of the time, and where they do not. No \
part of the recording needs to be healthy: faults in up to a fifth of the time spoil no fit. A stretch is a finding where it stands \
far outside of what the same relation does in the remaining time. The signal is named where others agree with each other; where only \
one other knows it, both are told.

Exit status: 0 nothing was found, 1 something was, 2 the recording cannot be read.")]
pub(crate) struct Arguments {
    /// Files and folders of any format; files of the same time form one recording.
    #[arg(required = true, value_name = "RECORDING")]
    recordings: Vec<PathBuf>,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
    /// Write the model that was found out, ready to edit; `-` is standard output.
    #[arg(short, long, value_name = "FILE", help_heading = OUTPUT)]
    output: Option<PathBuf>,
    /// Write a page for the browser with all of it, and a picture of each finding; it needs nothing else.
    #[arg(long, alias = "report", value_name = "FILE", help_heading = OUTPUT)]
    html: Option<PathBuf>,
    #[command(flatten)]
    columns: ColumnArguments,
}

/// Examines recordings; the answer is no if something is wrong.
///
/// # Errors
/// When a recording cannot be read, or nothing in it can be a signal.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let recordings = &arguments.recordings;
    let files = [&arguments.output, &arguments.html];
    let read: Vec<&PathBuf> = recordings.iter().collect();
    written::ensure_free(files.into_iter().filter_map(|file| file.as_deref()), &read)?;
    let mut columns = arguments.columns.read(recordings)?;
    let warned = columns.warnings.len();
    let names = names(recordings).join(", ");
    let diagnosis = examine(&mut columns, &names, &Search::default())?;
    columns.warnings[warned..].iter().for_each(show::warn);
    let report = Report { columns: &columns, diagnosis: &diagnosis };
    if let Some(path) = &arguments.output {
        write(path, &diagnosis.model)?;
    }
    if let Some(path) = &arguments.html {
        write(path, &report.page(&names))?;
    }
    let text = if arguments.json { report.json().to_string() } else { report.text(show::style()) };
    writeln!(stdout(), "{text}")?;
    Ok(match (diagnosis.findings.is_empty(), columns.degraded) {
        (false, _) => Outcome::No,
        (true, true) => Outcome::Degraded,
        (true, false) => Outcome::Done,
    })
}
