//! `shsa calibrate`: errors, offsets and delays that healthy recordings need, as a change of the model.

mod patch;
mod report;

use crate::campaign::grid::Kind;
use crate::campaign::smallest::{Smallest, Wish};
use crate::outcome::Outcome;
use crate::replay::{wanted, written};
use crate::show;
use anyhow::{Context, bail};
use shsa_core::knowledge::{Id, SignalId, build};
use shsa_core::observation::Observation;
use shsa_core::time::{Span, Time};
use shsa_estimate::{Calibration, Options, calibrate};
use shsa_format::fault::moment;
use shsa_format::recording::{self, ReadOptions, Recording, parse_span};
use std::io::{Write, stdout};
use std::path::PathBuf;
use std::str::FromStr;

/// Arguments of `shsa calibrate`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa calibrate models/car.yaml drive/ --patch tuned.yaml

Everything is compared as `shsa replay` compares it. The numbers are fitted to the first part of the recording and tested
on the rest, which they have not seen. What is fitted: the value errors of signals that are compared themselves, the errors of
the relations that compute the others, what both are off by all the time, delays of signals; and, where smaller faults are
seen with them, errors of time and shares such as `2 %`. What is not: ranges and rates of change, which are shown and
left to you. A short stretch in which one signal leaves all that it agrees with is taken for a fault, told, and not fitted.
With --faults it is also said how large a fault must be, by kind, so that the whole loop gives an alarm at each of 5 moments.
Exit status 1: with the fitted numbers, a healthy signal is still called failed in the rest.")]
pub(crate) struct Arguments {
    /// The knowledge base, YAML or JSON.
    model: PathBuf,
    /// Recordings of a healthy system: CSV, JSON lines, ROS 1 bags, folders of them.
    #[arg(required = true)]
    recordings: Vec<PathBuf>,
    /// False conflicts of one pair of ways an hour that are accepted.
    #[arg(long, value_name = "PER_HOUR", default_value = "1", value_parser = above_zero)]
    false_alarms: f64,
    /// Where the part to fit ends and the part to test on begins; half of the recording when not given.
    #[arg(long, value_name = "TIME", value_parser = moment)]
    split: Option<Span>,
    /// A time that is not healthy and is left out, such as 20s..30s; may be given several times.
    #[arg(long, value_name = "FROM..TO")]
    skip: Vec<Stretch>,
    /// Fit stretches that look like faults, too: where one of two ways leaves the other by five times as much as ever else.
    #[arg(long)]
    all: bool,
    /// Find the smallest fault of each kind that the whole loop sees, too, with the fitted numbers and in the part that they are
    /// fitted to, by trying; each lasts so long, a quarter of that part when no time is given. This may take minutes.
    #[arg(long, value_name = "SPAN", num_args = 0..=1, require_equals = true, value_parser = parse_span)]
    faults: Option<Option<Span>>,
    /// The longest delay that is searched for.
    #[arg(long, value_name = "SPAN", default_value = "2s", value_parser = parse_span)]
    most_delay: Span,
    /// Write what changes in the model, as `shsa replay --reload` takes it, with the evidence.
    #[arg(long, value_name = "FILE")]
    patch: Option<PathBuf>,
    /// The column with the time, where a CSV file's header does not tell.
    #[arg(long, value_name = "NAME")]
    time_column: Option<String>,
    /// What one step of the time column is: s, ms, us, ns or a span such as 5s.
    #[arg(long, value_name = "UNIT", value_parser = parse_span)]
    time_unit: Option<Span>,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
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

fn above_zero(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|number| number.is_finite() && *number > 0.0);
    number.ok_or_else(|| "expected a number above 0".to_owned())
}

/// Calibrates; the answer is no when the fitted model calls a healthy signal failed.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let live = show::load_live(&arguments.model)?;
    let read: Vec<&PathBuf> = arguments.recordings.iter().chain([&arguments.model]).collect();
    let knowledge = live.knowledge();
    let options = ReadOptions { time_column: arguments.time_column.clone(), time_scale: arguments.time_unit };
    let recording = recording::read(&arguments.recordings, &wanted(knowledge), &options)?;
    recording.warnings.iter().for_each(show::warn);
    let (Some(first), Some(last)) = (recording.first(), recording.samples.last()) else {
        bail!(
            "none of the model's signals is in the recording; `source` in the model says where each is found"
        );
    };
    anyhow::ensure!(
        recording.sessions.len() == 1,
        "these are {} sessions; calibrate on one recording",
        recording.sessions.len()
    );
    let duration = last.received - first;
    let split = arguments.split.unwrap_or(Span(duration.0 / 2));
    anyhow::ensure!(
        Span::ZERO < split && split < duration,
        "the split at {} s lies outside of the recording of {} s",
        split.seconds(),
        duration.seconds()
    );
    let observations = observations(&recording);
    let left_out = |it: &Stretch| (first + it.from, first + it.to);
    let wanted = Options {
        false_alarms_per_hour: arguments.false_alarms,
        most_delay: arguments.most_delay,
        left_out: arguments.skip.iter().map(left_out).collect(),
        fits_all: arguments.all,
        ..Options::default()
    };
    let [patch] = written::open([arguments.patch.as_deref()], &read)?;
    let found = calibrate(live.draft(), &observations, first + split, &wanted)
        .with_context(|| format!("{} cannot be calibrated", arguments.model.display()))?;
    let smallest = arguments
        .faults
        .map(|lasting| smallest(&found, &recording, first + split, &wanted.left_out, lasting))
        .transpose()?;
    let smallest = smallest.as_ref();
    let report =
        report::Report { draft: live.draft(), knowledge, found: &found, smallest, first, split, duration };
    if let Some(mut patch) = patch {
        patch.write_all(patch::text(&report, arguments.false_alarms).as_bytes())?;
        patch.flush()?;
    }
    let text = if arguments.json { report.to_json().to_string() } else { report.to_text() };
    writeln!(stdout(), "{text}")?;
    Ok(match (found.after.failed, recording.degraded) {
        (1.., _) => Outcome::No,
        (0, true) => Outcome::Degraded,
        (0, false) => Outcome::Done,
    })
}

/// Moments and seeds at which each fault is tried.
const ONSETS: usize = 5;
const SEEDS: u64 = 3;

/// The smallest faults that are seen before the split, with the fitted numbers.
fn smallest(
    found: &Calibration,
    recording: &Recording,
    split: Time,
    left_out: &[(Time, Time)],
    lasting: Option<Span>,
) -> anyhow::Result<Smallest> {
    let (knowledge, _) = build(&found.draft);
    let is_early = |sample: &&recording::Sample| sample.received < split;
    let early: Vec<_> = recording.samples.iter().take_while(is_early).cloned().collect();
    let length = recording.first().map_or(Span::ZERO, |first| split - first);
    let signals: Vec<SignalId> = knowledge.signals().ids().collect();
    let unhealthy = found.unhealthy.iter().map(|it| (it.from, it.to)).chain(left_out.iter().copied());
    let wish = Wish {
        kinds: &[Kind::Bias, Kind::Noise, Kind::Drift, Kind::Spike, Kind::Delay],
        signals: &signals,
        onsets: ONSETS,
        seeds: SEEDS,
        duration: lasting.unwrap_or(Span(length.0 / 4)),
        unhealthy: unhealthy.collect(),
        threads: None,
    };
    anyhow::ensure!(
        Span::ZERO < wish.duration && wish.duration < length,
        "faults of {} s do not fit into the {} s that are fitted",
        wish.duration.seconds(),
        length.seconds()
    );
    Smallest::find(&knowledge, &early, &wish)
}

fn observations(recording: &Recording) -> Vec<Observation> {
    let observation = |sample: &recording::Sample| Observation {
        signal: SignalId::from_index(sample.wanted),
        stamp: sample.time,
        received: sample.received,
        value: sample.value.clone(),
    };
    recording.samples.iter().map(observation).collect()
}
