//! `shsa maintenance`: what runs say about the next maintenance.

use crate::headings::OUTPUT;
use crate::outcome::Outcome;
use crate::reading::ReadArguments;
use crate::replay::{SourceArguments, drive, read};
use crate::{show, written};
use anyhow::Context;
use shsa_core::engine::Options;
use shsa_format::drive::Run;
use shsa_format::journal;
use shsa_recording::Cuts;
use shsa_report::Source;
use shsa_report::maintenance::Maintenance;
use std::io::{Write, stdout};
use std::path::PathBuf;

/// Arguments of `shsa maintenance`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa maintenance /etc/shsa/model.yaml /var/lib/shsa/journal/model.*

For each signal that was not trusted: how often, for how long, and by how much its replacement shortens the
times in which needs have no spare or no source. For each need: how long it had no spare, and was not served.
What drifts within its errors, and when these end. Each file of a journal, and each session of recordings, is
a run of its own.

Exit status: 1 when there is something to do.")]
pub(crate) struct Arguments {
    /// The knowledge base, YAML or JSON.
    model: PathBuf,
    /// The files of a journal, or recordings, the oldest first; as for `shsa replay`.
    #[arg(required = true, value_name = "JOURNAL")]
    recordings: Vec<PathBuf>,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    source: SourceArguments,
    /// Write a page for the browser, which needs nothing else.
    #[arg(long, value_name = "FILE", help_heading = OUTPUT)]
    report: Option<PathBuf>,
    #[command(flatten)]
    reading: ReadArguments,
}

/// Replays, and reports.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let recordings: Vec<&PathBuf> = arguments.recordings.iter().chain([&arguments.model]).collect();
    let [report] = written::open([arguments.report.as_deref()], &recordings)?;
    let mut runs: Vec<Run> = Vec::new();
    let mut is_degraded = false;
    for source in sources(arguments)? {
        is_degraded |= source.degraded;
        let run = drive(&source.eras, source.span, Options::default(), |run, given| {
            run.give(given);
            run.publications.clear();
            Ok(())
        })?;
        runs.push(run);
    }
    let maintenance = Maintenance::of(&runs).context("there is nothing to replay")?;
    if let Some(mut file) = report {
        let model = arguments.model.file_name().unwrap_or(arguments.model.as_os_str()).to_string_lossy();
        let page = maintenance.page(&model);
        file.write_all(page.as_bytes()).and_then(|()| file.flush()).context("cannot write the page")?;
    }
    let mut output = stdout().lock();
    match arguments.json {
        true => writeln!(output, "{}", maintenance.json())?,
        false => writeln!(output, "{}", maintenance.text(show::style()))?,
    }
    Ok(match (maintenance.is_due(), is_degraded) {
        (_, true) => Outcome::Degraded,
        (true, false) => Outcome::No,
        (false, false) => Outcome::Done,
    })
}

/// Each file of a journal, or the sessions of recordings.
fn sources(arguments: &Arguments) -> anyhow::Result<Vec<Source>> {
    let Arguments { model, recordings, source, reading, .. } = arguments;
    let is_journal = recordings.iter().all(|path| journal::is_journal_file(path));
    let parts: Vec<&[PathBuf]> = if is_journal { recordings.chunks(1).collect() } else { vec![recordings] };
    let mut sources = Vec::new();
    for part in parts {
        sources.extend(read(part, source, reading, &Cuts::default(), show::load_live(model)?)?);
    }
    sources.sort_by_key(|it| {
        it.eras.first().and_then(|era| era.inputs.first()).map(shsa_core::engine::Input::time)
    });
    Ok(sources)
}
