//! `shsa-bench thesis`: the experiments and case studies of the thesis, with all searches over the same graphs.
//!
//! D. Ratasich, "Self-Healing Cyber-Physical Systems", TU Wien 2019, chapters 6 and 7.

mod document;
mod experiment;
mod generate;
mod measure;
mod published;
mod record;
mod report;
mod charts;
mod visit;

use crate::Outcome;
use anyhow::Context;
use experiment::{Case, Experiment};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use measure::measure;
use record::Record;
use shsa_core::plan::Limits;
use std::fs;
use std::io::{IsTerminal, Write, stderr, stdout};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// Arguments of `shsa-bench thesis`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa-bench thesis --experiment ex1,rover --seeds 3")]
pub(crate) struct Arguments {
    /// Which experiments; all of them when not given.
    #[arg(long, value_name = "NAME,..", value_enum, value_delimiter = ',')]
    experiment: Vec<Experiment>,
    /// How many random graphs of each kind, with the seeds 0, 1, and so on.
    #[arg(long, value_name = "N", default_value = "100", value_parser = at_least_one)]
    seeds: NonZeroUsize,
    /// After how many decisions, and how many kept states, a search is stopped.
    #[arg(long, value_name = "N", default_value = "1000000", value_parser = at_least_one)]
    limit: NonZeroUsize,
    /// Besides, find all answers with so many threads, by the searches that can run in parts.
    #[arg(long, value_name = "N", default_value = "1", value_parser = at_least_one)]
    threads: NonZeroUsize,
    /// Write experiments.md, its plots and the raw results there.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print a JSON object for each measurement instead of tables.
    #[arg(long)]
    json: bool,
}

/// Reads a number of things of which there must be some.
fn at_least_one(text: &str) -> Result<NonZeroUsize, String> {
    text.trim().parse().map_err(|_| "expected a whole number from 1 on".to_owned())
}

/// Measures all graphs of the experiments asked for.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let limit = arguments.limit.get();
    let limits = Limits { expansions: limit as u64, states: limit };
    let cases = experiment::cases(&arguments.experiment, arguments.seeds.get());
    let progress = progress(cases.iter().map(Case::effort).sum());
    let mut records = Vec::new();
    for case in &cases {
        progress.set_message(case.to_string());
        let measured = measure(case, limits, arguments.threads.get())?;
        progress.inc(case.effort());
        if arguments.json {
            measured.iter().try_for_each(|record| writeln!(stdout().lock(), "{}", record.to_json()))?;
        }
        records.extend(measured);
    }
    progress.finish_and_clear();
    if !arguments.json {
        writeln!(stdout().lock(), "{}", report::text(&records))?;
    }
    if let Some(folder) = &arguments.out {
        write(folder, arguments, &records)?;
    }
    Ok(Outcome::Done)
}

/// Writes `experiments.md`, its plots and the raw results.
fn write(folder: &Path, arguments: &Arguments, records: &[Record]) -> anyhow::Result<()> {
    fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let put = |name: &str, text: String| {
        let path = folder.join(name);
        fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))
    };
    for (name, chart) in charts::charts(records) {
        put(&name, chart.svg())?;
    }
    put("experiments.jsonl", records.iter().map(|record| format!("{}\n", record.to_json())).collect())?;
    put("experiments.md", document::markdown(arguments, records))
}

fn progress(length: u64) -> ProgressBar {
    let target =
        if stderr().is_terminal() { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
    let bar = ProgressBar::with_draw_target(Some(length), target);
    let style = ProgressStyle::with_template("{bar:40} {percent:>3} %  {msg}");
    bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}
