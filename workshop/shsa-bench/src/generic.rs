//! `shsa-bench generic`: the thesis's generic experiments of faults of value and of time, by the published method and by the
//! product's own.
//!
//! Three signals of one variable, whose errors of value and time differ, as in D. Ratasich et al., "A self-healing framework for
//! building resilient cyber-physical systems", and the thesis's chapter 5. The experiments are generated anew for each seed; that
//! the published method answers as the published program did is what `shsa-bench oracle` shows.

use crate::Outcome;
use crate::table::{Table, write_document};
use anyhow::{Context, bail};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use shsa_core::engine::{Engine, EventKind, Input, Options, Output, Ticks, witnesses};
use shsa_core::knowledge::{Id, KnowledgeBase, VariableId};
use shsa_core::monitor::thesis::{ThesisOptions, ThesisRun};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::plan::Graph;
use shsa_core::time::Time;
use shsa_drawing::{Axis, Chart, Point, Scale, Series};
use std::fs;
use std::io::{Write, stdout};
use std::path::{Path, PathBuf};

/// Arguments of `shsa-bench generic`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa-bench generic --seeds 100 --out workshop/measured")]
pub(crate) struct Arguments {
    /// How many runs of each experiment; the plots are of the first one.
    #[arg(long, value_name = "N", default_value_t = 100)]
    seeds: u64,
    /// Write generic.md and its plots there.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// The errors are those of the published experiments; `x` falls by 0.05 a second.
const MODEL: &str = "\
shsa: 1
variables: { x: { max_rate: 0.1 } }
signals:
  a: { variable: x, rate: 1 Hz, value_error: 0.08, time_error: [-500 ms, 500 ms], timeout: none }
  b: { variable: x, rate: 1 Hz, value_error: 0.1, time_error: [-250 ms, 250 ms], timeout: none }
  c: { variable: x, rate: 1 Hz, value_error: 0.15, time_error: [-100 ms, 100 ms], timeout: none }
";

const NAMES: [&str; 3] = ["a", "b", "c"];
/// When in each second a signal is measured.
const PHASES: [f64; 3] = [0.5, 0.65, 0.8];
/// How long a run is, in seconds and in steps of the published method.
const STEPS: usize = 14;

/// A reading, and what is wrong with it.
#[derive(Clone, Copy, Debug)]
struct Reading {
    signal: usize,
    stamp: f64,
    received: f64,
    value: f64,
    is_faulty: bool,
}

/// An experiment.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Experiment {
    /// `a` shows 0 from 2 to 4 s, noise of 0 to 1 is added to `c` from 6 to 8 s.
    Value,
    /// `b` shows 0 and `a` comes 0.6 s late from 2 to 3 s; `a` shows 0 and comes 0.5 s late from 5 to 6 s.
    Time,
}

impl Experiment {
    const ALL: [Experiment; 2] = [Experiment::Value, Experiment::Time];

    fn name(self) -> &'static str {
        match self {
            Experiment::Value => "value",
            Experiment::Time => "time",
        }
    }

    /// The readings in the order of their reception.
    fn readings(self, random: &mut ChaCha8Rng) -> Vec<Reading> {
        let mut all = Vec::new();
        for step in 0..STEPS {
            for (signal, phase) in PHASES.into_iter().enumerate() {
                let stamp = step as f64 + phase;
                let value = 1.8 - 0.05 * (step as f64 + 0.5);
                let right = Reading { signal, stamp, received: stamp, value, is_faulty: false };
                all.push(self.broken(right, random));
            }
        }
        all.sort_by(|one, other| one.received.total_cmp(&other.received));
        all
    }

    fn broken(self, right: Reading, random: &mut ChaCha8Rng) -> Reading {
        let within = |from: f64, to: f64| (from..to).contains(&right.stamp);
        match (self, NAMES.get(right.signal).copied()) {
            (Experiment::Value, Some("a")) if within(2.0, 4.0) => {
                Reading { value: 0.0, is_faulty: true, ..right }
            }
            (Experiment::Value, Some("c")) if within(6.0, 8.0) => {
                Reading { value: right.value + random.random_range(0.0..1.0), is_faulty: true, ..right }
            }
            (Experiment::Time, Some("b")) if within(2.0, 3.0) => {
                Reading { value: 0.0, is_faulty: true, ..right }
            }
            (Experiment::Time, Some("a")) if within(2.0, 3.0) => {
                Reading { received: right.stamp + 0.6, ..right }
            }
            (Experiment::Time, Some("a")) if within(5.0, 6.0) => {
                Reading { value: 0.0, received: right.stamp + 0.5, is_faulty: true, ..right }
            }
            _ => right,
        }
    }
}

/// What a method says at the end of a step.
#[derive(Clone, Debug, Default, PartialEq)]
struct Blamed {
    failed: Vec<usize>,
    /// Single wrong readings of this step, of signals that are trusted as before.
    outliers: Vec<usize>,
    /// One of them may have failed.
    suspects: Vec<usize>,
}

/// # Errors
/// A file that cannot be written.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let knowledge = knowledge()?;
    let mut tables = Vec::new();
    for experiment in Experiment::ALL {
        let mut tallies = [Tally::default(), Tally::default()];
        for seed in 1..=arguments.seeds {
            let readings = experiment.readings(&mut ChaCha8Rng::seed_from_u64(seed));
            let (published, _) = published(&knowledge, &readings);
            let own = own(&knowledge, &readings);
            tallies
                .iter_mut()
                .zip([&published, &own])
                .for_each(|(tally, blamed)| tally.add(&readings, blamed));
        }
        tables.push(table(experiment, arguments.seeds, &tallies));
    }
    tables.iter().try_for_each(|table| writeln!(stdout(), "{table}"))?;
    if let Some(folder) = &arguments.out {
        write(folder, arguments.seeds, &knowledge, &tables)?;
    }
    Ok(Outcome::Done)
}

fn knowledge() -> anyhow::Result<KnowledgeBase> {
    let loaded = shsa_model::load(MODEL, "the generic experiment");
    match loaded.report.ok() {
        true => Ok(loaded.knowledge),
        false => bail!("{}", loaded.report.render(false)),
    }
}

fn observation(knowledge: &KnowledgeBase, reading: &Reading) -> Option<Observation> {
    let signal = knowledge.signal(NAMES.get(reading.signal)?)?;
    let (stamp, received) = (Time::from_seconds(reading.stamp), Time::from_seconds(reading.received));
    Some(Observation { signal, stamp, received, value: RawValue::Number(reading.value) })
}

/// The published method, a step a second: what it blames, and the error of each signal.
fn published(knowledge: &KnowledgeBase, readings: &[Reading]) -> (Vec<Blamed>, Vec<Vec<f64>>) {
    let graph = Graph::new(knowledge);
    let ways = witnesses(knowledge, &graph, VariableId::from_index(0), 8, |_| true).ways;
    let mut run = ThesisRun::new(knowledge, ways, ThesisOptions::default());
    let place = |way: &shsa_core::substitution::Way| way.direct().map_or(0, Id::index);
    let signals: Vec<usize> = run.ways().map(place).collect();
    let (mut blamed, mut errors) = (Vec::new(), Vec::new());
    for step in 1..=STEPS {
        let (from, to) = ((step - 1) as f64, step as f64);
        let new = readings.iter().filter(|reading| reading.received > from && reading.received <= to);
        for observation in new.filter_map(|reading| observation(knowledge, reading)) {
            run.observe(knowledge, &observation);
        }
        let result = run.step(Time::from_seconds(to));
        let failed = result.failed.and_then(|way| signals.get(way).copied());
        blamed.push(Blamed { failed: failed.into_iter().collect(), ..Blamed::default() });
        let mut of_signals = vec![0.0; NAMES.len()];
        for (signal, error) in signals.iter().zip(&result.errors) {
            of_signals.iter_mut().skip(*signal).take(1).for_each(|own| *own = *error);
        }
        errors.push(of_signals);
    }
    (blamed, errors)
}

/// The product's own method: at the end of each second, the signals that have failed or are suspect.
fn own(knowledge: &KnowledgeBase, readings: &[Reading]) -> Vec<Blamed> {
    let mut engine = Engine::new(knowledge.clone(), Options::default());
    let mut blamed = Blamed::default();
    let mut readings = readings.iter().peekable();
    let mut steps = Vec::new();
    for step in 1..=STEPS {
        let end = Time::from_seconds(step as f64);
        while let Some(reading) = readings.next_if(|reading| reading.received <= step as f64) {
            let Some(observation) = observation(knowledge, reading) else { continue };
            engine.pass(Ticks::before(observation.received));
            engine.handle(Input::Observation(observation));
        }
        engine.pass(Ticks::up_to(end));
        while let Some(output) = engine.poll() {
            let Output::Event(event) = output else { continue };
            let Some(signal) = event.signal.map(Id::index) else { continue };
            if event.kind == EventKind::Outlier {
                blamed.outliers.push(signal);
                continue;
            }
            blamed.failed.retain(|known| *known != signal);
            blamed.suspects.retain(|known| *known != signal);
            match event.kind {
                EventKind::Failed => blamed.failed.push(signal),
                EventKind::Suspected => blamed.suspects.push(signal),
                _ => {}
            }
        }
        steps.push(blamed.clone());
        blamed.outliers.clear();
    }
    steps
}

/// How a method did, in steps with a faulty reading and in all others.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    steps: usize,
    faulty: usize,
    named: usize,
    suspected: usize,
    innocent_failed: usize,
    innocent_suspected: usize,
}

impl Tally {
    fn add(&mut self, readings: &[Reading], blamed: &[Blamed]) {
        for (step, blamed) in blamed.iter().enumerate() {
            let (from, to) = (step as f64, step as f64 + 1.0);
            let new = readings.iter().filter(|reading| reading.received > from && reading.received <= to);
            let faulty = new.filter(|reading| reading.is_faulty).map(|reading| reading.signal).next();
            // A signal whose fault is over is kept out for a while.
            let is_innocent = |signal: &usize| {
                !readings.iter().any(|it| it.signal == *signal && it.is_faulty && it.received <= to)
            };
            self.steps += 1;
            let mut named = blamed.failed.iter().chain(&blamed.outliers);
            self.innocent_failed += usize::from(named.clone().any(is_innocent));
            self.innocent_suspected += usize::from(blamed.suspects.iter().any(is_innocent));
            let Some(signal) = faulty else { continue };
            self.faulty += 1;
            let is_named = named.any(|it| *it == signal);
            self.named += usize::from(is_named);
            self.suspected += usize::from(!is_named && blamed.suspects.contains(&signal));
        }
    }

    fn row(&self, name: &str) -> Vec<String> {
        let Tally { steps, faulty, named, suspected, innocent_failed, innocent_suspected } = self;
        vec![
            name.to_owned(),
            format!("{named} of {faulty}"),
            suspected.to_string(),
            (faulty - named - suspected).to_string(),
            format!("{innocent_failed} of {steps}"),
            format!("{innocent_suspected} of {steps}"),
        ]
    }
}

fn table(experiment: Experiment, seeds: u64, tallies: &[Tally; 2]) -> Table {
    let about = match experiment {
        Experiment::Value => {
            "`a` shows 0 from 2 to 4 s; from 6 to 8 s, noise between 0 and 1 is added to `c`, of which less than 0.25 is within the errors of the signals."
        }
        Experiment::Time => {
            "From 2 to 3 s `b` shows 0, and `a` comes 0.6 s late; from 5 to 6 s `a` shows 0 and comes 0.5 s late. A reading that is only late is not counted as faulty."
        }
    };
    let names = ["published method", "own method"];
    Table {
        title: format!("Faults of {}", experiment.name()),
        note: format!("{seeds} runs of {STEPS} s. {about}"),
        head: ["", "named", "suspected", "neither", "innocent, named", "innocent, suspected"]
            .map(str::to_owned)
            .to_vec(),
        rows: names.into_iter().zip(tallies).map(|(name, tally)| tally.row(name)).collect(),
    }
}

const INTRODUCTION: &str = "\
Three signals of one variable `x`, which falls by 0.05 a second from 1.8. Each is measured once a second, `a` with errors of 0.08 and 0.5 s, `b` \
of 0.1 and 0.25 s, `c` of 0.15 and 0.1 s. The published method (SASO 2019) sums up, once a second, how far the intervals of each signal are from \
those of the others, and names the only one with the largest sum; a tie names nobody here, where the published program took one of both. The product's \
own method compares each reading as it comes. A single wrong reading is an outlier: the reading is named, and the signal is trusted as before; two of four are a fault, \
after which the signal is kept out until it has agreed for a while. A reading is wrong when it could not have followed the one before it, or when two others that agree \
with each other contradict it, by what the declared errors and `max_rate` allow. With these, `c` and `b` contradict each other from 0.30 on. Noise between 0.25 and 0.30 is \
what the published method finds beyond that, as it compares readings of different moments as if `x` stood still.\n\n\
In the tables, a step is a second. *named*, *suspected*, *neither*: the steps in which a faulty reading was received, by what had become of its signal at their end; an outlier is named, too. \
*innocent*: all steps in which a signal was blamed that has not been faulty so far.";

fn write(folder: &Path, seeds: u64, knowledge: &KnowledgeBase, tables: &[Table]) -> anyhow::Result<()> {
    let mut plots = String::new();
    for experiment in Experiment::ALL {
        let readings = experiment.readings(&mut ChaCha8Rng::seed_from_u64(1));
        for (what, chart) in [
            ("signals", signals(experiment, &readings)),
            ("errors", errors(experiment, knowledge, &readings)),
        ] {
            let name = format!("generic-{}-{what}.svg", experiment.name());
            let path = folder.join(&name);
            fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
            fs::write(&path, chart.svg()).with_context(|| format!("cannot write {}", path.display()))?;
            plots.push_str(&format!("\n\n![{}]({name})", chart.title));
        }
    }
    let introduction = format!(
        "Written by `shsa-bench generic --seeds {seeds} --out workshop/measured`.\n\n{INTRODUCTION}{plots}"
    );
    write_document(
        folder,
        "generic",
        "The generic experiments of faults of value and time",
        &introduction,
        tables,
    )
}

/// What the signals show, with their errors of value.
fn signals(experiment: Experiment, readings: &[Reading]) -> Chart {
    let errors = [0.08, 0.1, 0.15];
    let series = NAMES.into_iter().zip(errors).enumerate().map(|(signal, (name, error))| {
        let own = readings.iter().filter(|reading| reading.signal == signal);
        let point =
            |it: &Reading| Point { x: it.stamp, low: it.value - error, y: it.value, high: it.value + error };
        Series { name: name.to_owned(), points: own.map(point).collect() }
    });
    let title = format!("Faults of {}: what the signals show", experiment.name());
    chart(title, "value", series.collect())
}

/// The sums of the published method.
fn errors(experiment: Experiment, knowledge: &KnowledgeBase, readings: &[Reading]) -> Chart {
    let (_, errors) = published(knowledge, readings);
    let series = NAMES.into_iter().enumerate().map(|(signal, name)| {
        let point = |(step, errors): (usize, &Vec<f64>)| {
            let y = *errors.get(signal)?;
            Some(Point { x: step as f64 + 1.0, low: y, y, high: y })
        };
        Series { name: name.to_owned(), points: errors.iter().enumerate().filter_map(point).collect() }
    });
    chart(
        format!("Faults of {}: the errors of the published method", experiment.name()),
        "error",
        series.collect(),
    )
}

fn chart(title: String, y: &str, series: Vec<Series>) -> Chart {
    let axis =
        |label: &str, unit: &str| Axis { label: label.into(), unit: unit.into(), scale: Scale::Linear };
    Chart { title, x: axis("time", "s"), y: axis(y, ""), series }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_published_method_answers_as_published() {
        let knowledge = knowledge().unwrap();
        let readings = Experiment::Time.readings(&mut ChaCha8Rng::seed_from_u64(1));
        let (blamed, errors) = published(&knowledge, &readings);
        let named =
            blamed.iter().enumerate().flat_map(|(step, it)| it.failed.iter().map(move |it| (step, *it)));
        assert_eq!(named.collect::<Vec<_>>(), [(5, 0)]);
        // What the author's program gave at these steps.
        for (step, recorded) in [(2, [0.0, 1.425, 1.425]), (5, [2.64, 1.345, 1.295])] {
            assert!(
                errors[step].iter().zip(recorded).all(|(own, its)| (own - its).abs() < 1e-9),
                "{errors:?}"
            );
        }
    }
}
