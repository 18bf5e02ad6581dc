//! `shsa campaign`: a grid of faults on recordings, and how many of them are found, named and healed: its arguments and its
//! output.

use crate::headings::{FAULTS, OUTPUT, PARTS};
use crate::outcome::Outcome;
use crate::plan::find_signal;
use crate::progress::Search;
use crate::reading::ReadArguments;
use crate::replay::{CutArguments, only};
use crate::written;
use crate::{old, show};
use anyhow::{Context, anyhow, bail};
use serde_json::Value;
use shsa_core::knowledge::{KnowledgeBase, SignalId};
use shsa_core::time::Span;
use shsa_format::journal::is_journal_file;
use shsa_lab::campaign::{
    self, AmountSpec, Baseline, Campaign, Comparison, Detectable, Grid, GridSpec, HalfSpec, Recorded,
    calibrated, check_settings, instead, measure, settings,
};
use shsa_message::span::parse_span;
use shsa_model::live::{Live, Written};
use shsa_recording::{Recording, Sample, Session};
use shsa_report::campaign as report;
use shsa_report::recorded::wanted;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::{BufWriter, Write, stdout};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// Arguments of `shsa campaign`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa campaign models/car.yaml drive/ --html campaign.html

Amounts are multiples of the declared errors: of the value error of a value of median size; for a delay of the time error and the \
mean time between values. Where a signal declares no error, because its tolerance is that of a relation, 2 times is its smallest bias \
that is detected in the recording. Faults begin at N onsets, evenly distributed over all sessions together (`shsa replay --help` \
describes sessions). A run whose signal is accused before its fault counts like any other. The shares are printed with the faults \
that are left out.

With --compare the exit status is 1 when in any cell fewer faults are detected or isolated, more signals are blamed wrongly, more \
alarms are false, or more needs are unmet than in the stored campaign.")]
pub(crate) struct Arguments {
    /// The knowledge base, YAML or JSON.
    model: PathBuf,
    /// Files and folders of any format (`shsa help recordings`).
    #[arg(required = true)]
    recordings: Vec<PathBuf>,
    /// A change of the model to begin with, as `shsa replay --reload` takes it; may be given several times, in their order.
    #[arg(long, value_name = "FILE")]
    patch: Vec<PathBuf>,
    /// Kinds of faults; all when not given.
    #[arg(long, value_name = "KIND,..", value_delimiter = ',', help_heading = FAULTS)]
    kinds: Vec<Kind>,
    /// Amounts, as multiples of the declared error.
    #[arg(long, value_name = "X,..", value_delimiter = ',', default_value = "2,4,8", value_parser = multiple, help_heading = FAULTS)]
    amounts: Vec<f64>,
    /// Amounts are F times (2 when not given) the smallest fault of each kind and signal that gives an alarm at every onset in
    /// the first half of the recording, on which the model is calibrated; faults begin in the second. A drift reaches 3 times
    /// the smallest bias at least.
    #[arg(long, value_name = "F", num_args = 0..=1, default_missing_value = "2", require_equals = true,
        value_parser = multiple, conflicts_with = "amounts", help_heading = FAULTS)]
    detectable: Option<f64>,
    /// Signals to break; all of the model when not given.
    #[arg(long, value_name = "SIGNAL,..", value_delimiter = ',', help_heading = FAULTS)]
    signals: Vec<String>,
    /// How many moments each fault begins at.
    #[arg(long, value_name = "N", default_value = "3", value_parser = show::at_least_one, help_heading = FAULTS)]
    onsets: NonZeroUsize,
    /// How many seeds each fault with chance in it is run with: noise, spike.
    #[arg(long, value_name = "N", default_value = "1", value_parser = show::at_least_one, help_heading = FAULTS)]
    seeds: NonZeroUsize,
    /// How long a fault lasts, such as 10s; a quarter of the recording when not given.
    #[arg(long, value_name = "SPAN", value_parser = parse_span, help_heading = FAULTS)]
    duration: Option<Span>,
    /// How many threads; as many as there are cores when not given. The results are the same.
    #[arg(long, value_name = "N", value_parser = show::at_least_one)]
    threads: Option<NonZeroUsize>,
    /// An earlier campaign, written with -o, to compare with.
    #[arg(long, value_name = "FILE")]
    compare: Option<PathBuf>,
    /// Print one JSON object instead of text: `--json -`.
    #[arg(long, value_name = "-")]
    json: Option<PathBuf>,
    /// Only the session of this number, where there are several; they are counted from 1.
    #[arg(long, value_name = "NUMBER", value_parser = show::at_least_one, help_heading = PARTS)]
    session: Option<NonZeroUsize>,
    #[command(flatten)]
    cut: CutArguments,
    /// Write the campaign as one JSON object, which --compare reads.
    #[arg(short, long, value_name = "FILE", help_heading = OUTPUT)]
    output: Option<PathBuf>,
    /// Write a page for the browser with heat maps.
    #[arg(long, alias = "report", value_name = "FILE", help_heading = OUTPUT)]
    html: Option<PathBuf>,
    /// Write the figures by kind, and every miss with the replay that shows it, as Markdown.
    #[arg(long, value_name = "FILE", help_heading = OUTPUT)]
    markdown: Option<PathBuf>,
    #[command(flatten)]
    reading: ReadArguments,
}

/// A kind of fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Kind {
    /// The value stays.
    Stuck,
    /// The amount is added.
    Bias,
    /// Nothing comes.
    Drop,
    /// Up to plus or minus the amount is added.
    Noise,
    /// More and more is added, the amount at the fault's end.
    Drift,
    /// The amount is added to one value in ten.
    Spike,
    /// Values are multiplied: the one of median size is off by the amount.
    Scale,
    /// Values come later, by the amount.
    Delay,
    /// The last value before the fault plus the amount comes instead.
    Spoof,
}

impl From<Kind> for campaign::Kind {
    fn from(kind: Kind) -> campaign::Kind {
        match kind {
            Kind::Stuck => campaign::Kind::Stuck,
            Kind::Bias => campaign::Kind::Bias,
            Kind::Drop => campaign::Kind::Drop,
            Kind::Noise => campaign::Kind::Noise,
            Kind::Drift => campaign::Kind::Drift,
            Kind::Spike => campaign::Kind::Spike,
            Kind::Scale => campaign::Kind::Scale,
            Kind::Delay => campaign::Kind::Delay,
            Kind::Spoof => campaign::Kind::Spoof,
        }
    }
}

fn multiple(text: &str) -> Result<f64, String> {
    let number = text.trim().parse::<f64>().ok().filter(|number| number.is_finite() && *number != 0.0);
    number.ok_or_else(|| "expected a number other than 0, such as 4".to_owned())
}

/// Runs the grid and reports; the answer is no if the result is worse than that of the compared campaign.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let mut live = show::load_live(&arguments.model)?;
    arguments.patch.iter().try_for_each(|path| patch(&mut live, path))?;
    let before = arguments.compare.as_deref().map(stored).transpose()?;
    let signals = signals(arguments, live.knowledge())?;
    let recording = read(arguments, live.knowledge())?;
    let sessions: Vec<Recorded<'_>> =
        recording.by_session().map(|(session, samples)| recorded(session, samples)).collect();
    let kinds: Vec<campaign::Kind> = arguments.kinds.iter().map(|&kind| kind.into()).collect();
    let (kinds, seeds) = (distinct(&kinds, &campaign::Kind::ALL), arguments.seeds.get() as u64);
    let bar = Search::default();
    let search = HalfSpec {
        kinds: &kinds,
        signals: &signals,
        onsets: arguments.onsets.get(),
        seeds,
        duration: arguments.duration,
        threads: arguments.threads,
        progress: &bar,
    };
    let calibrated = arguments.detectable.map(|_| calibrated(&live, &sessions, &search)).transpose()?;
    let (knowledge, detectable) = match &calibrated {
        Some((knowledge, detectable)) => (knowledge, Some(detectable)),
        None => (live.knowledge(), None),
    };
    let instead = match detectable {
        Some(_) => BTreeMap::new(),
        None => amounts_instead(arguments, knowledge, &sessions, &signals)?,
    };
    let spec = GridSpec {
        kinds: &kinds,
        instead: &instead,
        multiples: &arguments.detectable.map_or_else(|| distinct(&arguments.amounts, &[]), |by| vec![by]),
        signals: &signals,
        onsets: arguments.onsets.get(),
        seeds,
        duration: arguments.duration,
        detectable,
    };
    let grid = Grid::new(knowledge, &sessions, &spec)?;
    grid.left_out.iter().for_each(|reason| show::warn(format_args!("left out: {reason}")));
    let baselines: Option<Vec<Baseline<'_>>> =
        sessions.iter().map(|it| Baseline::new(knowledge, it.origin, it.samples)).collect();
    let baselines = baselines.ok_or_else(|| anyhow!("nothing recorded"))?;
    if let Some(before) = &before {
        check_settings(before, &settings(&baselines, &grid, seeds))?;
    }
    let files = files(arguments)?;
    let results = measure(&baselines, &grid, arguments.threads, &bar)?;
    let campaign = Campaign { baselines: &baselines, knowledge, grid: &grid, seeds, results };
    let mut object = campaign.to_json();
    let comparison = before.map(|before| Comparison::new(&before, &object)).transpose()?;
    if let (Some(object), Some(comparison)) = (object.as_object_mut(), &comparison) {
        object.insert("comparison".to_owned(), comparison.to_json());
    }
    print_results(
        arguments,
        files,
        &Results { campaign: &campaign, object, comparison: comparison.as_ref(), detectable },
    )?;
    Ok(match comparison.is_some_and(|comparison| comparison.is_worse()) {
        true => Outcome::No,
        false if recording.degraded => Outcome::Degraded,
        false => Outcome::Done,
    })
}

/// The files to write: JSON, page, Markdown.
type Files = [Option<BufWriter<File>>; 3];

/// Opens the output files before anything is run.
fn files(arguments: &Arguments) -> anyhow::Result<Files> {
    let models = [&arguments.model].into_iter().chain(&arguments.patch);
    let read: Vec<&PathBuf> = arguments.recordings.iter().chain(models).chain(&arguments.compare).collect();
    let json = arguments.json.as_deref().filter(|path| !is_printed(path));
    if json.is_some() && arguments.output.is_some() {
        bail!("one file for the JSON is enough: leave out --json FILE");
    }
    if json.is_some() {
        old::note("shsa campaign", "--json FILE", "campaign -o FILE");
    }
    written::open(
        [arguments.output.as_deref().or(json), arguments.html.as_deref(), arguments.markdown.as_deref()],
        &read,
    )
}

/// Whether the JSON is written to standard output.
fn is_printed(path: &Path) -> bool {
    path == Path::new("-")
}

/// A campaign with its results.
struct Results<'a> {
    campaign: &'a Campaign<'a>,
    object: Value,
    comparison: Option<&'a Comparison>,
    detectable: Option<&'a Detectable>,
}

fn print_results(
    arguments: &Arguments,
    [json, html, markdown]: Files,
    found: &Results<'_>,
) -> anyhow::Result<()> {
    let Results { campaign, object, comparison, detectable } = found;
    if let Some(mut file) = json {
        writeln!(file, "{object}")?;
        file.flush()?;
    }
    if let Some(mut file) = html {
        let title = arguments.model.file_name().unwrap_or_default().to_string_lossy();
        file.write_all(report::page(campaign, &title, *comparison).as_bytes())?;
        file.flush()?;
    }
    if let Some(mut file) = markdown {
        let title = arguments.model.file_stem().unwrap_or_default().to_string_lossy();
        let text = report::markdown(campaign, &title, &command(arguments), *detectable);
        file.write_all(text.as_bytes())?;
        file.flush()?;
    }
    let mut output = stdout().lock();
    match arguments.json.as_deref().is_some_and(is_printed) {
        true => writeln!(output, "{object}")?,
        false => writeln!(output, "{}", report::text(campaign, *comparison, show::style()))?,
    }
    Ok(())
}

/// The command that repeats the campaign.
fn command(arguments: &Arguments) -> String {
    let mut text = format!("shsa campaign {}", arguments.model.display());
    for recording in &arguments.recordings {
        let _ = write!(text, " {}", recording.display());
    }
    for patch in &arguments.patch {
        let _ = write!(text, " --patch {}", patch.display());
    }
    text += &arguments.cut.shown();
    match arguments.detectable {
        Some(by) => text += &format!(" --detectable={by}"),
        None => {
            let amounts: Vec<String> = arguments.amounts.iter().map(f64::to_string).collect();
            text += &format!(" --amounts={}", amounts.join(","));
        }
    }
    if !arguments.kinds.is_empty() {
        let kinds: Vec<&str> =
            arguments.kinds.iter().map(|&kind| campaign::Kind::from(kind).name()).collect();
        text += &format!(" --kinds {}", kinds.join(","));
    }
    if !arguments.signals.is_empty() {
        text += &format!(" --signals {}", arguments.signals.join(","));
    }
    if let Some(duration) = arguments.duration {
        text += &format!(" --duration {}s", duration.seconds());
    }
    text + &format!(" --onsets {} --seeds {} --markdown FILE", arguments.onsets, arguments.seeds)
}

/// The given values without repetitions, in order; the default if none is given.
fn distinct<T: Copy + PartialEq>(given: &[T], default: &[T]) -> Vec<T> {
    let mut once: Vec<T> = Vec::new();
    for one in if given.is_empty() { default } else { given } {
        if !once.contains(one) {
            once.push(*one);
        }
    }
    once
}

fn signals(arguments: &Arguments, knowledge: &KnowledgeBase) -> anyhow::Result<Vec<SignalId>> {
    let named: Vec<SignalId> =
        arguments.signals.iter().map(|name| find_signal(knowledge, name)).collect::<anyhow::Result<_>>()?;
    let all: Vec<SignalId> = knowledge.signals().ids().collect();
    Ok(distinct(&named, &all))
}

fn read(arguments: &Arguments, knowledge: &KnowledgeBase) -> anyhow::Result<Recording> {
    if let Some(journal) = arguments.recordings.iter().find(|path| is_journal_file(path)) {
        bail!("{} is a journal; faults can be injected into recordings only", journal.display());
    }
    let mut recording = arguments.reading.read(&arguments.recordings, &wanted(knowledge))?;
    recording.cut(&arguments.cut.cuts()).iter().for_each(show::warn);
    only(&mut recording.sessions, arguments.session)?;
    Ok(recording)
}

fn recorded<'a>(session: &Session, samples: &'a [Sample]) -> Recorded<'a> {
    Recorded { origin: session.origin, samples }
}

/// Applies a change of the model.
fn patch(live: &mut Live, path: &Path) -> anyhow::Result<()> {
    let name = path.display().to_string();
    let text = std::fs::read_to_string(path).with_context(|| format!("{name} cannot be read"))?;
    match live.change(Written { name: &name, text: &text }) {
        Ok(report) => show::print_report(&report),
        Err(report) => {
            show::print_report(&report);
            bail!("{name} has errors");
        }
    }
    Ok(())
}

/// The amounts for signals without a declared value error.
fn amounts_instead(
    arguments: &Arguments,
    knowledge: &KnowledgeBase,
    sessions: &[Recorded<'_>],
    signals: &[SignalId],
) -> anyhow::Result<BTreeMap<SignalId, f64>> {
    let spec = AmountSpec {
        signals,
        onsets: arguments.onsets.get(),
        duration: arguments.duration,
        threads: arguments.threads,
        progress: &Search::default(),
    };
    Ok(instead(knowledge, sessions, &spec)?)
}

/// Reads a campaign that was written with `-o`.
///
/// # Errors
/// When the file cannot be read or is no campaign.
fn stored(path: &Path) -> anyhow::Result<Value> {
    let shown = path.display();
    let text = fs::read_to_string(path).with_context(|| format!("{shown} cannot be read"))?;
    let stored: Value = serde_json::from_str(&text).with_context(|| format!("{shown} is no JSON"))?;
    if !(stored["settings"].is_object() && stored["cells"].is_array()) {
        bail!("{shown} is no campaign; write one with: shsa campaign MODEL RECORDING -o {shown}");
    }
    Ok(stored)
}
