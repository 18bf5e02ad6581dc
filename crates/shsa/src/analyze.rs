//! `shsa analyze`: which faults a model can detect, isolate and heal, before anything runs.

use crate::headings::OUTPUT;
use crate::outcome::Outcome;
use crate::show;
use crate::watch::Watching;
use crate::written;
use anyhow::Context;
use shsa_core::analysis::{Options, analyze_with};
use shsa_core::knowledge::{Draft, KnowledgeBase, Relation, Severity, build};
use shsa_model::live::Written;
use shsa_model::read_text;
use shsa_report::analysis::{Liars, Report};
use std::collections::BTreeSet;
use std::io::{BufWriter, Write, stdout};
use std::path::{Path, PathBuf};

/// Arguments of `shsa analyze`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa analyze models/husky.yaml --html husky.html
         shsa analyze car.yaml --relations relations.yaml

The sensors and relations whose addition would help most are listed, too.")]
pub(crate) struct Arguments {
    /// The knowledge base, YAML or JSON.
    model: PathBuf,
    /// Count only on relations that have a formula; else those that are structure only count as if they had one.
    #[arg(long)]
    only_runnable: bool,
    /// How many added sensors and relations to list, the most helpful first; 0 tries none.
    #[arg(long, value_name = "N", default_value_t = 10)]
    additions: usize,
    /// Relations that the model does not have, as `shsa learn --patch` writes them: each is ranked among the additions.
    #[arg(long, value_name = "FILE")]
    relations: Option<PathBuf>,
    /// How many signals to analyse, in file order; of a larger model the others are left out, with a note. Memory and output
    /// grow with the square of this number.
    #[arg(long, value_name = "N", default_value_t = 4_000)]
    signals: usize,
    /// Count how many signals, and how many common causes, may lie together for each need, and name a coalition that is too large.
    #[arg(long)]
    liars: bool,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    watching: Watching,
    /// Write all of it to a page for the browser, which needs nothing else.
    #[arg(long, alias = "report", value_name = "FILE", help_heading = OUTPUT)]
    html: Option<PathBuf>,
}

/// Analyses a model; the answer is no if nothing serves a need even while all signals are present.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let read: Vec<&PathBuf> = arguments.relations.iter().chain([&arguments.model]).collect();
    written::ensure_free(arguments.html.as_deref(), &read)?;
    let (knowledge, left_out) = part(&arguments.model, arguments.signals)?;
    let watch = arguments.watching.budget();
    let mut options = Options { only_runnable: arguments.only_runnable, watch, ..Options::default() };
    if arguments.additions == 0 {
        options.addition_steps = 0;
    }
    let given = match &arguments.relations {
        Some(path) => given(&arguments.model, path, left_out)?,
        None => Vec::new(),
    };
    let mut analysis = analyze_with(&knowledge, &given, options);
    analysis.additions.truncate(arguments.additions);
    let title = arguments.model.file_name().unwrap_or(arguments.model.as_os_str()).to_string_lossy();
    let liars = arguments.liars.then(|| Liars::of(&knowledge, options));
    let report =
        Report::new(&knowledge, &analysis, options, &title).with_given(&given).with_liars(liars.as_ref());
    if let Some(path) = &arguments.html {
        std::fs::write(path, report.page()).with_context(|| format!("cannot write {}", path.display()))?;
    }
    let mut output = stdout().lock();
    match arguments.json {
        true => {
            let mut output = BufWriter::new(&mut output);
            serde_json::to_writer(&mut output, &report.json(left_out))?;
            writeln!(output)?;
            output.flush()?;
        }
        false => writeln!(output, "{}", report.text(show::style()))?,
    }
    let unserved = analysis.needs.iter().any(|need| !need.known && need.exact);
    Ok(if unserved { Outcome::No } else { Outcome::Done })
}

/// The relations of a change of the model that the model does not have.
fn given(model: &Path, change: &Path, left_out: usize) -> anyhow::Result<Vec<Relation>> {
    anyhow::ensure!(
        left_out == 0,
        "a part of a model has other variables: --relations needs all signals (--signals)"
    );
    let mut live = show::load_live(model)?;
    let own: BTreeSet<String> = live.knowledge().relations().iter().map(|it| it.name.clone()).collect();
    let variables = live.knowledge().variables().len();
    let described = |report: shsa_model::Report| anyhow::anyhow!("{}", report.render(false));
    let text = read_text(change, "relations").map_err(described)?;
    let name = change.display().to_string();
    live.change(Written { name: &name, text: &text }).map_err(described)?;
    let changed = live.knowledge();
    anyhow::ensure!(changed.variables().len() == variables, "{name} has more than relations: variables");
    Ok(changed.relations().iter().filter(|it| !own.contains(&it.name)).cloned().collect())
}

/// The model with at most `most` signals, and the number of signals left out, which is reported first.
fn part(path: &Path, most: usize) -> anyhow::Result<(KnowledgeBase, usize)> {
    let whole = show::load_model(path)?;
    let count = whole.signals().len();
    let left_out = count.saturating_sub(most);
    if left_out == 0 {
        return Ok((whole, 0));
    }
    show::warn(format!(
        "{count} signals, more than {most} (--signals): the last {left_out} are left out, as if they were not there"
    ));
    drop(whole);
    let live = show::load_live(path)?;
    let (knowledge, problems) = build(&without(live.draft(), most));
    match problems.iter().find(|problem| problem.severity == Severity::Error) {
        None => Ok((knowledge, left_out)),
        Some(problem) => {
            anyhow::bail!("without {left_out} of its signals it is no model: {}", problem.message)
        }
    }
}

/// The draft with its first signals only.
fn without(draft: &Draft, most: usize) -> Draft {
    let mut draft = draft.clone();
    draft.signals.truncate(most);
    let known: BTreeSet<String> = draft.signals.iter().map(|signal| signal.name.text.clone()).collect();
    for signal in &mut draft.signals {
        signal.derived_from.retain(|origin| known.contains(&origin.text));
    }
    draft
}
