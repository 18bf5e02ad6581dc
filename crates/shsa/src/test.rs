//! `shsa test`: runs stories and reports: what is observed, what is decided and why, what was expected and what was found.

use crate::headings::OUTPUT;
use crate::outcome::{AlreadyReported, Outcome};
use crate::replay::provenance;
use crate::show;
use crate::written;
use anyhow::{Context, bail};
use shsa_format::story::{self, Check, Story};
use shsa_format::words;
use shsa_report::Paint;
use shsa_report::replay::{Provenance, story_page};
use std::io::{IsTerminal, Write, stderr, stdout};
use std::path::{Path, PathBuf};

/// Arguments of `shsa test`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa test stories/01-dead-but-looks-alive.yaml

A story is a model, what is observed, and what must come of it. Each decision is printed with its reason.

Exit status: 1 when an expectation is not met.")]
pub(crate) struct Arguments {
    /// Stories: a model, what is observed, and what must come of it, as YAML.
    #[arg(required = true)]
    stories: Vec<PathBuf>,
    /// Write the page of `shsa replay --report` about a story, with its assurance case.
    #[arg(long, alias = "html", value_name = "FILE", help_heading = OUTPUT)]
    report: Option<PathBuf>,
}

/// Runs every story; the answer is no if an expectation is not met.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    if let Some(path) = &arguments.report {
        let [story] = arguments.stories.as_slice() else { bail!("a report is about one story: name one") };
        written::ensure_free([path.as_path()], &[story])?;
        let bytes = std::fs::read(story).with_context(|| format!("cannot read {}", story.display()))?;
        return run_story(&load(story)?, path, &provenance(story, &bytes));
    }
    let mut is_met = true;
    for path in &arguments.stories {
        is_met &= print_story(&load(path)?)?;
    }
    Ok(if is_met { Outcome::Done } else { Outcome::No })
}

/// Runs a story, and writes the page about it.
fn run_story(story: &Story, path: &Path, made: &Provenance) -> anyhow::Result<Outcome> {
    let is_met = print_story(story)?;
    let page = story_page(story, made)?;
    std::fs::write(path, page).with_context(|| format!("cannot write {}", path.display()))?;
    Ok(if is_met { Outcome::Done } else { Outcome::No })
}

fn load(path: &Path) -> anyhow::Result<Story> {
    let loaded = story::load_file(path);
    let report = loaded.report.render(show::colour(stderr().is_terminal()));
    if !report.is_empty() {
        show::notice(report.trim_end());
    }
    loaded.story.ok_or_else(|| AlreadyReported.into())
}

/// Runs a story and reports it; returns whether all expectations are met.
fn print_story(story: &Story) -> anyhow::Result<bool> {
    let outcome = story.run();
    let mut output = stdout().lock();
    writeln!(output, "{}\n{}\n", story.title, story.why.trim_end())?;
    writeln!(output, "{} observations in {:.0} s", outcome.run.observations, outcome.run.last.seconds())?;
    for event in &outcome.run.events {
        let source =
            event.substitution.as_ref().map(|source| format!(", now from {}", words::served_by(source)));
        let headline = story::headline(&story.knowledge, event);
        writeln!(output, "  {headline}{}: {}", source.unwrap_or_default(), words::reasons(&event.because))?;
    }
    writeln!(output)?;
    for check in &outcome.checks {
        writeln!(output, "{}", check_text(check))?;
    }
    writeln!(output)?;
    Ok(outcome.is_met())
}

fn check_text(check: &Check) -> String {
    let word = if check.met {
        show::style().paint(Paint::Green, "yes")
    } else {
        show::style().paint(Paint::Red, "NO ")
    };
    format!("{word} {}\n      found: {}", check.expected, check.found)
}
