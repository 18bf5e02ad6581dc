//! `shsa monitor`: all ways of knowing a variable, compared over recorded observations.

use crate::outcome::Outcome;
use crate::plan::find_variable;
use crate::replay::{is_journal, wanted};
use crate::show::{self, Paint};
use anyhow::bail;
use serde_json::{Value, json};
use shsa_core::diagnosis::{Judge, JudgeOptions, Verdict};
use shsa_core::engine::{WatchBudget, can_be_watched, witnesses};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{Id, KnowledgeBase, Shape, SignalId, VariableId};
use shsa_core::monitor::thesis::{ThesisOptions, ThesisRun};
use shsa_core::monitor::{self, Monitor, WayIndex};
use shsa_core::observation::Observation;
use shsa_core::plan::Graph;
use shsa_core::substitution::Way;
use shsa_core::time::{Span, Time, Validity};
use shsa_format::event;
use shsa_format::recording::{self, ReadOptions, Recording};
use shsa_format::text::counted;
use shsa_message::span::parse_span;
use std::collections::BTreeMap;
use std::io::{Write, stdout};
use std::num::NonZeroUsize;
use std::path::PathBuf;

/// How many steps are made at most: more are a wrong period, or a wrong time stamp.
const MOST_STEPS: i64 = 10_000_000;

/// Characters of a column of errors.
const WIDTH: usize = 8;

/// Arguments of `shsa monitor`.
#[derive(clap::Args)]
#[command(
    after_help = "Example: shsa monitor models/rover.yaml v_dmin --observations run.jsonl --mode thesis --period 1s"
)]
pub(crate) struct Arguments {
    /// The knowledge base, YAML or JSON.
    model: PathBuf,
    /// The variable in which all ways of knowing are compared.
    variable: String,
    /// The observations: JSON lines, CSV or a ROS 1 bag.
    #[arg(long, value_name = "FILE")]
    observations: PathBuf,
    /// How often a step is made.
    #[arg(long, value_name = "SPAN", default_value = "1s", value_parser = parse_span)]
    period: Span,
    /// Thesis mode: steps whose observations are combined [default: 1].
    #[arg(long, value_name = "N", value_parser = show::at_least_one)]
    buffer: Option<NonZeroUsize>,
    /// Thesis mode: errors over which the average is taken [default: 1].
    #[arg(long, value_name = "N", value_parser = show::at_least_one)]
    average: Option<NonZeroUsize>,
    /// Thesis mode: averages over which the median is taken [default: 1].
    #[arg(long, value_name = "N", value_parser = show::at_least_one)]
    median: Option<NonZeroUsize>,
    /// The method.
    #[arg(long, value_enum, default_value_t = Mode::Default)]
    mode: Mode,
    /// Print one JSON object a step, as lines.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Mode {
    /// The product's: per observation, three-valued, down to the signal.
    Default,
    /// The published method: periodic, all pairs of all outputs.
    Thesis,
}

/// Compares over all complete steps; the answer is no when there is nothing that knows the variable.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let knowledge = show::load_model(&arguments.model)?;
    let variable = find_variable(&knowledge, &arguments.variable)?;
    refuse_vector(&knowledge, variable)?;
    let recording = read(arguments, &knowledge)?;
    let steps = Steps::of(&recording, arguments.period)?;
    let most = WatchBudget::default().ways;
    let runs = |way: &Way| can_be_watched(&knowledge, way);
    let ways = witnesses(&knowledge, &Graph::new(&knowledge), variable, most, runs).ways;
    let mut method: Box<dyn Method> = match arguments.mode {
        Mode::Thesis => Box::new(Thesis::new(&knowledge, ways, arguments)),
        Mode::Default => Box::new(Watching::new(&knowledge, ways)),
    };
    let ways = method.ways();
    match ways.len() {
        0 => {
            show::warn(format_args!("nothing in the model knows {}", arguments.variable));
            return Ok(Outcome::No);
        }
        1 => show::warn(format_args!("{} is known in one way only: nothing to compare", arguments.variable)),
        _ => {}
    }
    let mut printer = Printer::new(&knowledge, variable, arguments, recording.first());
    printer.head(&ways)?;
    step_through(&recording, steps, &mut *method, &mut printer)?;
    printer.foot(&ways)?;
    Ok(if recording.degraded { Outcome::Degraded } else { Outcome::Done })
}

/// Vectors are compared only in the numbers that follow from them.
fn refuse_vector(knowledge: &KnowledgeBase, variable: VariableId) -> anyhow::Result<()> {
    let variable = &knowledge.variables()[variable];
    match variable.shape {
        Shape::Scalar => Ok(()),
        Shape::Vector => bail!("'{}' is a vector; name a number that follows from it", variable.name),
    }
}

fn read(arguments: &Arguments, knowledge: &KnowledgeBase) -> anyhow::Result<Recording> {
    let file = &arguments.observations;
    if is_journal(file) {
        bail!("{} is the journal of a run; `shsa replay` reads it", file.display());
    }
    let set = [arguments.buffer, arguments.average, arguments.median];
    if arguments.mode == Mode::Default && set.iter().any(Option::is_some) {
        show::warn("--buffer, --average and --median are for --mode thesis and change nothing here");
    }
    let recording = recording::read(std::slice::from_ref(file), &wanted(knowledge), &ReadOptions::default())?;
    recording.warnings.iter().for_each(show::warn);
    if recording.samples.is_empty() {
        bail!(
            "none of the model's signals is in the recording; `source` in the model says where each is found"
        );
    }
    Ok(recording)
}

/// The moments at which steps are made: every multiple of the period that is followed by an observation.
#[derive(Clone, Copy)]
struct Steps {
    first: Time,
    period: Span,
}

impl Steps {
    fn of(recording: &Recording, period: Span) -> anyhow::Result<Steps> {
        let start = recording.first().unwrap_or_default();
        let end = recording.samples.last().map_or(start, |sample| sample.received);
        let count = (end - start).0 / period.0;
        if count > MOST_STEPS {
            let seconds = (end - start).seconds();
            bail!(
                "{count} steps in {seconds:.0} s are too many (at most {MOST_STEPS}); give a longer --period"
            );
        }
        let late = start.0.rem_euclid(period.0);
        let wait = if late == 0 { 0 } else { period.0 - late };
        Ok(Steps { first: start + Span(wait), period })
    }
}

fn step_through(
    recording: &Recording,
    steps: Steps,
    method: &mut dyn Method,
    printer: &mut Printer<'_>,
) -> anyhow::Result<()> {
    let mut due = steps.first;
    for sample in &recording.samples {
        while sample.received > due {
            printer.step(&method.step(due))?;
            due = due + steps.period;
        }
        method.observe(&Observation {
            signal: SignalId::from_index(sample.wanted),
            stamp: sample.time,
            received: sample.received,
            value: sample.value.clone(),
        });
    }
    Ok(())
}

/// One output of a way in a step.
struct Output {
    way: usize,
    value: Interval,
    validity: Option<Validity>,
}

/// What a step found.
struct Step {
    time: Time,
    outputs: Vec<Output>,
    errors: Vec<f64>,
    failed: Option<usize>,
    /// Not all combinations of inputs were formed.
    truncated: bool,
    /// Signals that are not healthy, in words.
    verdicts: Vec<(String, &'static str)>,
}

trait Method {
    fn ways(&self) -> Vec<Way>;
    fn observe(&mut self, observation: &Observation);
    fn step(&mut self, time: Time) -> Step;
}

struct Thesis<'a> {
    knowledge: &'a KnowledgeBase,
    run: ThesisRun,
}

impl<'a> Thesis<'a> {
    fn new(knowledge: &'a KnowledgeBase, ways: Vec<Way>, arguments: &Arguments) -> Thesis<'a> {
        let count = |given: Option<NonZeroUsize>| given.map_or(1, NonZeroUsize::get);
        let options = ThesisOptions {
            buffer: count(arguments.buffer),
            average: count(arguments.average),
            median: count(arguments.median),
        };
        Thesis { knowledge, run: ThesisRun::new(knowledge, ways, options) }
    }
}

impl Method for Thesis<'_> {
    fn ways(&self) -> Vec<Way> {
        self.run.ways().cloned().collect()
    }

    fn observe(&mut self, observation: &Observation) {
        self.run.observe(self.knowledge, observation);
    }

    fn step(&mut self, time: Time) -> Step {
        let step = self.run.step(time);
        let output = |output: &shsa_core::monitor::thesis::ThesisOutput| Output {
            way: output.substitution,
            value: output.value,
            validity: output.validity,
        };
        let outputs = step.outputs.iter().map(output).collect();
        Step {
            time,
            outputs,
            errors: step.errors,
            failed: step.failed,
            truncated: step.truncated,
            verdicts: Vec::new(),
        }
    }
}

/// The default monitor with its judge, without a need to serve.
struct Watching<'a> {
    knowledge: &'a KnowledgeBase,
    monitor: Monitor,
    judge: Judge,
    outputs: Vec<Output>,
    now: Option<Time>,
}

impl<'a> Watching<'a> {
    fn new(knowledge: &'a KnowledgeBase, ways: Vec<Way>) -> Watching<'a> {
        let monitor = Monitor::new(knowledge, ways, monitor::Options::default());
        let judge = Judge::new(knowledge, JudgeOptions::default());
        Watching { knowledge, monitor, judge, outputs: Vec::new(), now: None }
    }

    fn settle(&mut self, now: Time) {
        let changed = self.monitor.settle(now);
        if changed || self.judge.next_review().is_some_and(|due| due <= now) {
            self.judge.review(&self.monitor, now);
        }
        let output = |(WayIndex(way), sample): (WayIndex, shsa_core::alignment::Sample)| Output {
            way: way as usize,
            value: sample.value,
            validity: Some(sample.validity),
        };
        self.outputs.extend(self.monitor.fresh().map(output));
    }

    fn verdicts(&self, time: Time) -> Vec<(SignalId, Verdict)> {
        let verdict = |signal| (signal, self.judge.verdict(signal, &self.monitor, time));
        self.knowledge.signals().ids().map(verdict).collect()
    }
}

impl Method for Watching<'_> {
    fn ways(&self) -> Vec<Way> {
        self.monitor.ways().iter().map(|way| way.computation.way().clone()).collect()
    }

    fn observe(&mut self, observation: &Observation) {
        match self.now.replace(observation.received) {
            Some(before) if before < observation.received => self.settle(before),
            _ => {}
        }
        self.monitor.observe(self.knowledge, observation, observation.received);
    }

    fn step(&mut self, time: Time) -> Step {
        self.monitor.pass(time, |_| {});
        self.settle(time);
        let mut errors = vec![0.0; self.monitor.ways().len()];
        for pair in self.monitor.residuals() {
            let (disagreed, compared) = pair.window.counts();
            for way in [pair.way, pair.other] {
                errors[way.0 as usize] += f64::from(disagreed) / f64::from(compared.max(1));
            }
        }
        let verdicts = self.verdicts(time);
        let failed: Vec<SignalId> = verdicts
            .iter()
            .filter(|(_, verdict)| *verdict == Verdict::Failed)
            .map(|(signal, _)| *signal)
            .collect();
        let rests =
            |way: &shsa_core::monitor::WatchedWay| failed.iter().any(|signal| way.rests_on.contains(*signal));
        let failed_ways: Vec<usize> =
            (0..errors.len()).filter(|&way| self.monitor.ways().get(way).is_some_and(rests)).collect();
        let shown = |(signal, verdict): &(SignalId, Verdict)| {
            (
                self.knowledge.signals()[*signal].name.clone(),
                event::verdict(self.monitor.timeouts().absence(*signal), *verdict),
            )
        };
        Step {
            time,
            outputs: std::mem::take(&mut self.outputs),
            errors,
            failed: failed_ways.first().copied().filter(|_| failed_ways.len() == 1),
            truncated: false,
            verdicts: verdicts.iter().map(shown).collect(),
        }
    }
}

/// JSON knows no infinity: it becomes null.
fn finite(value: f64) -> Option<f64> {
    Some(value).filter(|value| value.is_finite())
}

struct Printer<'a> {
    knowledge: &'a KnowledgeBase,
    variable: VariableId,
    mode: Mode,
    json: bool,
    /// What times in text count from.
    start: Time,
    steps: usize,
    /// Whether it was told that combinations were left out.
    truncated: bool,
    /// In how many steps each way was the one that had failed.
    failures: BTreeMap<usize, usize>,
}

impl<'a> Printer<'a> {
    fn new(
        knowledge: &'a KnowledgeBase,
        variable: VariableId,
        arguments: &Arguments,
        start: Option<Time>,
    ) -> Printer<'a> {
        let (mode, json, start) = (arguments.mode, arguments.json, start.unwrap_or_default());
        Printer {
            knowledge,
            variable,
            mode,
            json,
            start,
            steps: 0,
            truncated: false,
            failures: BTreeMap::new(),
        }
    }

    fn head(&self, ways: &[Way]) -> anyhow::Result<()> {
        if self.json {
            return Ok(());
        }
        let mut output = stdout().lock();
        let variable = &self.knowledge.variables()[self.variable];
        writeln!(output, "{} is known in {}:", variable.name, counted(ways.len(), "way"))?;
        for (number, way) in ways.iter().enumerate() {
            writeln!(output, "{number:>4}  {}", way.describe(self.knowledge))?;
        }
        let unit = variable.unit.as_ref().map_or(String::new(), |unit| format!(" in {unit}"));
        match self.mode {
            Mode::Thesis => {
                writeln!(output, "Errors: how far a way is from each other one, summed{unit}.\n")?
            }
            Mode::Default => {
                writeln!(
                    output,
                    "Errors: the share of recent comparisons with each other way that disagree, summed.\n"
                )?;
            }
        }
        let columns: String =
            (0..ways.len()).map(|number| format!("  {:>WIDTH$}", format!("way {number}"))).collect();
        writeln!(output, "{}", show::paint(Paint::Bold, &format!("{:>12}{columns}", "time")))?;
        Ok(())
    }

    fn foot(&self, ways: &[Way]) -> anyhow::Result<()> {
        if self.json {
            return Ok(());
        }
        let mut output = stdout().lock();
        writeln!(output, "\n{}", counted(self.steps, "step"))?;
        for (&number, count) in &self.failures {
            let way = ways.get(number).map_or(String::new(), |way| way.describe(self.knowledge));
            writeln!(output, "way {number} ({way}) failed in {count} of them")?;
        }
        Ok(())
    }

    fn shown(&self, value: f64) -> Option<f64> {
        let unit = self.knowledge.variables()[self.variable].unit.as_ref();
        finite(unit.map_or(value, |unit| unit.from_si(value)))
    }

    fn step(&mut self, step: &Step) -> anyhow::Result<()> {
        self.steps += 1;
        if step.truncated && !std::mem::replace(&mut self.truncated, true) {
            show::warn(
                "too many combinations of observations: errors are of a part of them; a smaller --buffer or --period helps",
            );
        }
        if let Some(failed) = step.failed {
            *self.failures.entry(failed).or_default() += 1;
        }
        let mut output = stdout().lock();
        if self.json {
            writeln!(output, "{}", self.to_json(step))?;
        } else {
            writeln!(output, "{}", self.to_text(step))?;
        }
        Ok(())
    }

    fn to_json(&self, step: &Step) -> Value {
        let outputs: Vec<Value> = step
            .outputs
            .iter()
            .map(|output| {
                json!({
                    "substitution": output.way,
                    "value": [self.shown(output.value.lo()), self.shown(output.value.hi())],
                    "time": output.validity.map(|validity| [validity.from.0, validity.to.0]),
                })
            })
            .collect();
        let mut object = json!({
            "time_ns": step.time.0,
            "outputs": outputs,
            "errors": step.errors.iter().map(|error| finite(self.error(*error))).collect::<Vec<_>>(),
            "failed": step.failed.map_or(-1, |way| i64::try_from(way).unwrap_or(-1)),
        });
        if let (false, Some(object)) = (step.verdicts.is_empty(), object.as_object_mut()) {
            let verdicts: serde_json::Map<String, Value> =
                step.verdicts.iter().map(|(signal, verdict)| (signal.clone(), json!(verdict))).collect();
            object.insert("verdicts".to_owned(), verdicts.into());
        }
        object
    }

    /// An error of thesis mode is a difference of values; of the default mode a number of pairs.
    fn error(&self, error: f64) -> f64 {
        match (self.mode, &self.knowledge.variables()[self.variable].unit) {
            (Mode::Thesis, Some(unit)) => error / unit.scale,
            _ => error,
        }
    }

    fn to_text(&self, step: &Step) -> String {
        let cell = |error: &f64| format!("  {:>WIDTH$.3}", self.error(*error));
        let errors: String = step.errors.iter().map(cell).collect();
        let time = (step.time - self.start).seconds();
        let line = format!("{time:>10.3} s{errors}  {}", self.findings(step).join(", "));
        line.trim_end().to_owned()
    }

    /// Who has failed; of the default mode, every signal that is not healthy.
    fn findings(&self, step: &Step) -> Vec<String> {
        if self.mode == Mode::Thesis {
            let failed = step.failed.map(|way| show::paint(Paint::Red, &format!("way {way} failed")));
            return failed.into_iter().collect();
        }
        let unwell = step.verdicts.iter().filter(|(_, verdict)| *verdict != "healthy");
        unwell.map(|(signal, verdict)| show::paint_verdict(verdict, &format!("{signal} {verdict}"))).collect()
    }
}
