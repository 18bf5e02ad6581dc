//! `shsa monitor`: all ways of knowing a variable, compared over recorded observations.

use crate::outcome::Outcome;
use crate::plan::find_variable;
use crate::show;
use serde_json::{Value, json};
use shsa_core::diagnosis::{Judge, JudgeOptions, Verdict};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{Id, KnowledgeBase, SignalId, VariableId};
use shsa_core::monitor::thesis::{ThesisOptions, ThesisRun};
use shsa_core::monitor::{Debounce, Monitor, WayIndex};
use shsa_core::observation::Observation;
use shsa_core::plan::{self, Graph, Limits, Options, Utility};
use shsa_core::substitution::Way;
use shsa_core::time::{Span, Time, Validity};
use shsa_format::recording::{self, ReadOptions, Recording, Wanted, parse_span};
use std::io::{Write, stdout};
use std::path::PathBuf;

/// How many ways of knowing are compared at most.
const MOST_WAYS: usize = 64;

/// Arguments of `shsa monitor`.
#[derive(clap::Args)]
#[command(
    after_help = "Example: shsa monitor models/rover.yaml dmin --observations run.jsonl --mode thesis --period 1s"
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
    /// Thesis mode: steps whose observations are combined.
    #[arg(long, value_name = "N", default_value_t = 1)]
    buffer: usize,
    /// Thesis mode: errors over which the average is taken.
    #[arg(long, value_name = "N", default_value_t = 1)]
    average: usize,
    /// Thesis mode: averages over which the median is taken.
    #[arg(long, value_name = "N", default_value_t = 1)]
    median: usize,
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

/// Compares over all complete steps.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let knowledge = show::load_model(&arguments.model)?;
    let variable = find_variable(&knowledge, &arguments.variable)?;
    let wanted: Vec<Wanted> = knowledge
        .signals()
        .iter()
        .map(|signal| Wanted::new(signal.name.clone(), signal.source.clone()))
        .collect();
    let paths = [arguments.observations.clone()];
    let recording = recording::read(&paths, &wanted, &ReadOptions::default())?;
    recording.warnings.iter().for_each(|warning| eprintln!("warning: {warning}"));
    let ways = ways(&knowledge, variable);
    let mut method: Box<dyn Method> = match arguments.mode {
        Mode::Thesis => Box::new(Thesis::new(&knowledge, ways, arguments)),
        Mode::Default => Box::new(Watching::new(&knowledge, ways)),
    };
    let mut printer = Printer { knowledge: &knowledge, variable, json: arguments.json };
    printer.head(&method.ways())?;
    step_through(&recording, arguments.period, &mut *method, &mut printer)?;
    Ok(if recording.degraded { Outcome::Degraded } else { Outcome::Done })
}

fn ways(knowledge: &KnowledgeBase, variable: VariableId) -> Vec<Way> {
    let graph = Graph::new(knowledge, Utility::Norm);
    let plan = plan::best(&graph, variable, &Options::default(), MOST_WAYS, Limits::default());
    plan.substitutions
        .iter()
        .flat_map(|(substitution, _)| Way::choices(knowledge, substitution, |_| true, MOST_WAYS))
        .take(MOST_WAYS)
        .collect()
}

/// Makes a step at every multiple of the period that is followed by an observation.
fn step_through(
    recording: &Recording,
    period: Span,
    method: &mut dyn Method,
    printer: &mut Printer<'_>,
) -> anyhow::Result<()> {
    let Some(first) = recording.first() else { return Ok(()) };
    let period_ns = period.0.max(1);
    let mut due = Time(first.0.div_euclid(period_ns).saturating_mul(period_ns));
    if due < first {
        due = due + Span(period_ns);
    }
    for sample in &recording.samples {
        while sample.received > due {
            printer.step(&method.step(due))?;
            due = due + Span(period_ns);
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
        let options =
            ThesisOptions { buffer: arguments.buffer, average: arguments.average, median: arguments.median };
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
        Step { time, outputs, errors: step.errors, failed: step.failed, verdicts: Vec::new() }
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
        let monitor = Monitor::new(knowledge, ways, Debounce::default());
        let judge = Judge::new(knowledge, JudgeOptions::default());
        Watching { knowledge, monitor, judge, outputs: Vec::new(), now: None }
    }

    fn settle(&mut self, now: Time) {
        let changed = self.monitor.settle(now);
        if changed || self.judge.next_review().is_some_and(|due| due <= now) {
            self.judge.review(&self.monitor, now);
        }
        let output = |&(WayIndex(way), sample): &(WayIndex, shsa_core::alignment::Sample)| Output {
            way: way as usize,
            value: sample.value,
            validity: Some(sample.validity),
        };
        self.outputs.extend(self.monitor.fresh().iter().map(output));
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
        for pair in self.monitor.pairs() {
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
            (self.knowledge.signals()[*signal].name.clone(), verdict_name(*verdict))
        };
        Step {
            time,
            outputs: std::mem::take(&mut self.outputs),
            errors,
            failed: failed_ways.first().copied().filter(|_| failed_ways.len() == 1),
            verdicts: verdicts.iter().map(shown).collect(),
        }
    }
}

fn verdict_name(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Unknown => "unknown",
        Verdict::Healthy => "healthy",
        Verdict::Suspect => "suspect",
        Verdict::Failed => "failed",
    }
}

struct Printer<'a> {
    knowledge: &'a KnowledgeBase,
    variable: VariableId,
    json: bool,
}

impl Printer<'_> {
    fn head(&mut self, ways: &[Way]) -> anyhow::Result<()> {
        if !self.json {
            let mut output = stdout().lock();
            for (number, way) in ways.iter().enumerate() {
                writeln!(output, "way {number}: {}", way.describe(self.knowledge))?;
            }
            writeln!(output)?;
        }
        Ok(())
    }

    fn shown(&self, value: f64) -> Option<f64> {
        let unit = self.knowledge.variables()[self.variable].unit.as_ref();
        Some(unit.map_or(value, |unit| unit.from_si(value))).filter(|value| value.is_finite())
    }

    fn step(&mut self, step: &Step) -> anyhow::Result<()> {
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
            "errors": step.errors.iter().map(|error| self.error(step, *error)).collect::<Vec<_>>(),
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
    fn error(&self, step: &Step, error: f64) -> Option<f64> {
        if !step.verdicts.is_empty() {
            return Some(error);
        }
        let unit = self.knowledge.variables()[self.variable].unit.as_ref();
        Some(unit.map_or(error, |unit| error / unit.scale)).filter(|error| error.is_finite())
    }

    fn to_text(&self, step: &Step) -> String {
        let errors: Vec<String> = step
            .errors
            .iter()
            .map(|error| self.error(step, *error).map_or("none".to_owned(), |error| format!("{error:.3}")))
            .collect();
        let unwell: Vec<String> = step
            .verdicts
            .iter()
            .filter(|(_, verdict)| *verdict != "healthy")
            .map(|(signal, verdict)| format!("{signal} {verdict}"))
            .collect();
        let failed = step.failed.map_or("-".to_owned(), |way| way.to_string());
        format!(
            "{:>10.3} s  errors {}  failed {failed}  {}",
            step.time.seconds(),
            errors.join(" "),
            unwell.join(", ")
        )
    }
}
