//! `shsa analyze`: what a model can do at all, before anything runs.

mod figures;
mod naming;
mod names;
mod text;
mod json;
mod matrix;
mod page;

pub(crate) use naming::{Names, ways as watched_ways};

use crate::outcome::Outcome;
use crate::show;
use crate::watch::Watching;
use anyhow::Context;
use names::Report;
use shsa_core::analysis::{Options, analyze};
use std::io::{Write, stdout};
use std::path::PathBuf;

/// Arguments of `shsa analyze`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa analyze models/husky.yaml --html husky.html")]
pub(crate) struct Arguments {
    /// The knowledge base, YAML or JSON.
    model: PathBuf,
    /// Count only on relations that have a formula; else those that are structure only count as if they had one.
    #[arg(long)]
    only_runnable: bool,
    /// How many added sensors and relations to list, the most helpful first; 0 tries none.
    #[arg(long, value_name = "N", default_value_t = 10)]
    additions: usize,
    #[command(flatten)]
    watching: Watching,
    /// Write all of it to a page for the browser, which needs nothing else.
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
}

/// Analyses a model; the answer is no when there is a need that nothing serves even while all signals are there.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let knowledge = show::load_model(&arguments.model)?;
    let watch = arguments.watching.budget();
    let mut options = Options { only_runnable: arguments.only_runnable, watch, ..Options::default() };
    if arguments.additions == 0 {
        options.addition_steps = 0;
    }
    let mut analysis = analyze(&knowledge, options);
    analysis.additions.truncate(arguments.additions);
    let title = arguments.model.file_name().unwrap_or(arguments.model.as_os_str()).to_string_lossy();
    let report = Report::new(&knowledge, &analysis, options, &title);
    if let Some(path) = &arguments.html {
        std::fs::write(path, page::page(&report))
            .with_context(|| format!("cannot write {}", path.display()))?;
    }
    let mut output = stdout().lock();
    match arguments.json {
        true => writeln!(output, "{}", json::object(&report))?,
        false => writeln!(output, "{}", text::text(&report))?,
    }
    let unserved = analysis.needs.iter().any(|need| !need.known && need.exact);
    Ok(if unserved { Outcome::No } else { Outcome::Done })
}
