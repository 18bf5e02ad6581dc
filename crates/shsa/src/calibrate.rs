//! `shsa calibrate`: finds the errors, offsets and delays that healthy recordings need, and writes them as a change of the model.

use crate::headings::{OUTPUT, PARTS};
use crate::model::patch::patched;
use crate::outcome::Outcome;
use crate::progress::{Search, bar};
use crate::reading::ReadArguments;
use crate::show;
use crate::written;
use anyhow::Context;
use shsa_core::knowledge::{SignalId, build};
use shsa_core::time::Span;
use shsa_lab::calibration::{self, Calibration, Options, Parted, calibrate};
use shsa_lab::campaign::{Kind, SearchSpec, Smallest};
use shsa_message::span::parse_span;
use shsa_model::live::Written;
use shsa_recording::moment;
use shsa_report::calibration::Report;
use shsa_report::recorded::wanted;
use std::io::{Write, stdout};
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::str::FromStr;

/// Arguments of `shsa calibrate`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa calibrate models/car.yaml drive/ -o tuned.yaml

The promise is about the whole loop: on other recordings of the same healthy system, at most this many moments an hour at \
which a signal is suspected or failed. The numbers are fitted to the first part of each recording: the scatter of signals and \
relations, and one factor of the scatter for the whole model. The factor is found with the engine itself over surrogate recordings \
(the residuals drawn anew in blocks, with tails beyond the recorded ones). The rest of the recordings, which the fit has not used, \
tests the numbers once.

Calibration fits value errors of signals, errors of the relations that are shown to hold, and delays of signals that are \
compared themselves; time-outs and rates of change only where healthy data exceed them; `frozen_after` of signals that have noise \
of their own in every reading. With a single recording, the difference between recordings is assumed, not measured. A short stretch \
in which one signal leaves all ways that it agrees with elsewhere counts as a fault: it is reported, and not fitted. With --faults \
the smallest fault of each kind is listed with which the whole loop gives an alarm at each of 5 moments.

Exit status 1: on the rest, the fitted numbers do worse than those of the model (then no change is written), or a healthy signal \
fails.")]
pub(crate) struct Arguments {
    /// The knowledge base, YAML or JSON.
    model: PathBuf,
    /// Recordings of a healthy system: files and folders of any format (`shsa help recordings`).
    #[arg(required = true)]
    recordings: Vec<PathBuf>,
    /// False alarms of the whole model that are accepted on data not seen, with 95 % confidence: so many an hour, or such as 2/day, 1/week.
    #[arg(long, alias = "alarms-an-hour", value_name = "PER_HOUR", default_value = "0.5", value_parser = an_hour)]
    false_alarms: f64,
    /// Where the part to fit ends and the part to test on begins; half of the recording when not given.
    #[arg(long, value_name = "TIME", value_parser = moment)]
    split: Option<Span>,
    /// A time with a fault, which is left out, such as 20s..30s; may be given several times.
    #[arg(long, value_name = "FROM..TO", help_heading = PARTS)]
    skip: Vec<Stretch>,
    /// Fit stretches that look like faults, too: where two ways differ by five times as much as at any other time.
    #[arg(long)]
    all: bool,
    /// Find the smallest fault of each kind that the whole loop detects, too, with the fitted numbers and in the part that they are
    /// fitted to, by trial. SPAN is the length of each fault, by default a quarter of that part. This may take minutes.
    #[arg(long, value_name = "SPAN", num_args = 0..=1, require_equals = true, value_parser = parse_span)]
    faults: Option<Option<Span>>,
    /// The longest delay that is searched for.
    #[arg(long, value_name = "SPAN", default_value = "2s", value_parser = parse_span)]
    most_delay: Span,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
    /// Write the model with the fitted numbers in it, and its comments.
    #[arg(short, long, value_name = "FILE", help_heading = OUTPUT)]
    output: Option<PathBuf>,
    /// Write what changes in the model, as `shsa replay --reload` and `shsa model patch` take it, with the evidence.
    #[arg(long, value_name = "FILE", help_heading = OUTPUT)]
    patch: Option<PathBuf>,
    /// Write a page for the browser with all of it; it needs nothing else.
    #[arg(long, alias = "report", value_name = "FILE", help_heading = OUTPUT)]
    html: Option<PathBuf>,
    #[command(flatten)]
    reading: ReadArguments,
}

/// A stretch of a recording, counted from its first observation.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    from: Span,
    to: Span,
}

impl FromStr for Stretch {
    type Err = String;

    fn from_str(text: &str) -> Result<Stretch, String> {
        let (from, to) = text.split_once("..").ok_or("no '..'; write it like 20s..30s")?;
        let (from, to) = (moment(from)?, moment(to)?);
        if from < to { Ok(Stretch { from, to }) } else { Err("it ends before it starts".to_owned()) }
    }
}

/// How often something is in an hour: `0.5`, `2/day`, `1/week`.
fn an_hour(text: &str) -> Result<f64, String> {
    const HOURS: [(&str, f64); 5] =
        [("hour", 1.0), ("day", 24.0), ("week", 168.0), ("month", 730.5), ("year", 8_766.0)];
    let (number, hours) = match text.split_once('/') {
        None => (text, 1.0),
        Some((number, time)) => {
            let known = HOURS.iter().find(|it| it.0 == time.trim());
            let known =
                known.ok_or("expected a number an hour, or one with /hour, /day, /week, /month or /year")?;
            (number.trim(), known.1)
        }
    };
    let number = number.parse::<f64>().ok().filter(|number| number.is_finite() && *number > 0.0);
    number.map(|number| number / hours).ok_or_else(|| "expected a number above 0".to_owned())
}

/// Calibrates; the answer is no if the fitted model does worse than the given one, or a healthy signal fails.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let read: Vec<&PathBuf> = arguments.recordings.iter().chain([&arguments.model]).collect();
    let files = [&arguments.patch, &arguments.output, &arguments.html];
    written::ensure_free(files.into_iter().filter_map(|file| file.as_deref()), &read)?;
    let live = show::load_live(&arguments.model)?;
    let knowledge = live.knowledge();
    let recording =
        shsa_recording::read(&arguments.recordings, &wanted(knowledge), &arguments.reading.options())?;
    show::recording(&recording);
    let skip: Vec<(Span, Span)> = arguments.skip.iter().map(|it| (it.from, it.to)).collect();
    let parted = Parted::of(&recording, arguments.split, &skip)?;
    let bar = bar(calibration::STEPS, "{bar:40} {percent:>3} %  calibrating  {elapsed}");
    let wanted = Options {
        alarms_per_hour: arguments.false_alarms,
        most_delay: arguments.most_delay,
        fits_all: arguments.all,
        threads: std::thread::available_parallelism().map_or(1, NonZeroUsize::get),
        progress: &|| bar.inc(1),
        ..Options::default()
    };
    let found = calibrate(live.draft(), &parted.fitted, &parted.unseen, &wanted)
        .with_context(|| format!("{} cannot be calibrated", arguments.model.display()));
    bar.finish_and_clear();
    let found = found?;
    let smallest = arguments.faults.map(|lasting| smallest(&found, &parted, lasting)).transpose()?;
    let refusal = found.refusal();
    let stays = if refusal.is_none() { found.blindness() } else { None };
    let is_worse = refusal.is_some() || found.after.failed > 0;
    let refusal = refusal.or(stays.clone());
    let report = Report {
        draft: live.draft(),
        knowledge,
        found: &found,
        smallest: smallest.as_ref(),
        firsts: &parted.firsts,
        split: parted.split,
        duration: parted.duration,
        refusal: refusal.as_deref(),
    };
    write(arguments, &report, stays.is_some(), &read)?;
    let text = if arguments.json { report.json().to_string() } else { report.text(show::style()) };
    writeln!(stdout(), "{text}")?;
    Ok(match (is_worse, recording.degraded) {
        (true, _) => Outcome::No,
        (false, true) => Outcome::Degraded,
        (false, false) => Outcome::Done,
    })
}

/// A patch that changes nothing.
const NO_CHANGE: &str = "# The model stays as it is.\n{}\n";

/// Writes the files that are asked for, all or none; those of the fitted numbers only where these are no worse. Where the model
/// `stays` as it is, so do these files.
fn write(arguments: &Arguments, report: &Report<'_>, stays: bool, read: &[&PathBuf]) -> anyhow::Result<()> {
    let fitted = |file: &Option<PathBuf>| file.clone().filter(|_| stays || report.refusal.is_none());
    let (patch, output) = (fitted(&arguments.patch), fitted(&arguments.output));
    let change = if stays { NO_CHANGE.to_owned() } else { report.patch(show::style()) };
    let numbers = Written { name: "the fitted numbers", text: &change };
    let model = output.as_ref().map(|_| patched(&arguments.model, numbers)).transpose()?;
    let title = arguments.model.file_name().unwrap_or(arguments.model.as_os_str()).to_string_lossy();
    let page = arguments.html.as_ref().map(|_| report.page(&title));
    let files = written::open([patch.as_deref(), output.as_deref(), arguments.html.as_deref()], read)?;
    let texts = [change, model.unwrap_or_default(), page.unwrap_or_default()];
    for (file, text) in files.into_iter().zip(texts) {
        let Some(mut file) = file else { continue };
        file.write_all(text.as_bytes())?;
        file.flush()?;
    }
    Ok(())
}

/// The numbers of moments and of seeds with which each fault is tried.
const ONSETS: usize = 5;
const SEEDS: u64 = 3;

/// The smallest detected faults in the fitted part, with the fitted numbers.
fn smallest(found: &Calibration, parted: &Parted<'_>, lasting: Option<Span>) -> anyhow::Result<Smallest> {
    let (knowledge, _) = build(&found.draft);
    let length = Span(parted.split.0 / parted.early.len().max(1) as i64);
    let signals: Vec<SignalId> = knowledge.signals().ids().collect();
    let unhealthy = found.unhealthy.iter().map(|it| (it.from, it.to)).chain(parted.left_out.iter().copied());
    let spec = SearchSpec {
        kinds: &[Kind::Bias, Kind::Noise, Kind::Drift, Kind::Spike, Kind::Delay],
        signals: &signals,
        onsets: ONSETS,
        seeds: SEEDS,
        duration: lasting.unwrap_or(Span(length.0 / 4)),
        unhealthy: unhealthy.collect(),
        threads: None,
        progress: &Search::default(),
    };
    anyhow::ensure!(
        Span::ZERO < spec.duration && spec.duration < length,
        "faults of {} s do not fit into the {} s that are fitted",
        spec.duration.seconds(),
        length.seconds()
    );
    Ok(Smallest::find(&knowledge, &parted.early, &spec)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alarms_are_counted_in_words_people_choose_by() {
        #[track_caller]
        fn check(text: &str, expected: Option<f64>) {
            assert_eq!(an_hour(text).ok(), expected, "{text}");
        }
        check("0.5", Some(0.5));
        check("2/hour", Some(2.0));
        check("1/day", Some(1.0 / 24.0));
        check("1 / week", Some(1.0 / 168.0));
        check("3/year", Some(3.0 / 8_766.0));
        for wrong in ["0", "-1/day", "1/fortnight", "/day", "1/", "inf", "day"] {
            check(wrong, None);
        }
    }
}
