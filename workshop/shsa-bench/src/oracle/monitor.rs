//! Recorded runs of the published monitor: inputs, outputs, errors and the failed substitution, step by step.

use super::{Compared, TOLERANCE};
use anyhow::{Context, bail};
use serde::Deserialize;
use shsa_core::knowledge::{
    BodyDraft, Bounds, Draft, KnowledgeBase, RelationDraft, Severity, SignalDraft, Text, VariableDraft, build,
};
use shsa_core::monitor::thesis::{ThesisOptions, ThesisOutput, ThesisRun, ThesisStep};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::substitution::{Substitution, Way};
use shsa_core::time::Time;
use std::collections::{BTreeMap, BTreeSet};

/// A file of `shsa-monitor-golden-1`.
#[derive(Deserialize)]
pub(super) struct Experiments {
    experiments: Vec<Experiment>,
}

#[derive(Deserialize)]
struct Experiment {
    name: String,
    signal_order: String,
    buffer_size: usize,
    uncertainty: BTreeMap<String, Uncertainty>,
    substitutions: Vec<Chain>,
    steps: Vec<Step>,
}

#[derive(Deserialize)]
struct Uncertainty {
    verr_low: f64,
    verr_high: f64,
    terr_low: f64,
    terr_high: f64,
}

/// A file of `shsa-monitor-unit-1`.
#[derive(Deserialize)]
pub(super) struct Units {
    cases: Vec<Unit>,
}

#[derive(Deserialize)]
struct Unit {
    label: String,
    model: Functions,
    domain: String,
    options: BTreeMap<String, usize>,
    steps: Vec<Step>,
}

#[derive(Deserialize)]
struct Functions {
    functions: Vec<Function>,
}

#[derive(Deserialize)]
struct Function {
    relation: String,
    out: String,
    #[serde(rename = "in")]
    inputs: Vec<String>,
    meaning: String,
}

#[derive(Deserialize)]
struct Step {
    inputs: Vec<Input>,
    /// The substitutions from this step on; an experiment has one set for all steps.
    #[serde(default)]
    substitutions: Vec<Chain>,
    outputs: Vec<Output>,
    error: Vec<f64>,
    /// The index of the failed substitution; -1 for none.
    failed: i64,
}

#[derive(Deserialize)]
struct Input {
    name: String,
    variable: String,
    v: Recorded,
    t: Option<Recorded>,
}

#[derive(Deserialize)]
struct Output {
    sidx: usize,
    v: Recorded,
    t: Option<Recorded>,
}

/// A number, or an interval as a list of one pair.
#[derive(Clone, Copy, Deserialize)]
#[serde(untagged)]
enum Recorded {
    Number(f64),
    Interval([[f64; 2]; 1]),
}

impl Recorded {
    fn bounds(self) -> [f64; 2] {
        match self {
            Recorded::Number(number) => [number, number],
            Recorded::Interval([bounds]) => bounds,
        }
    }
}

/// A substitution as functions in the order of computation.
#[derive(Clone, Deserialize, PartialEq)]
struct Chain {
    functions: Vec<Link>,
}

#[derive(Clone, Deserialize, PartialEq)]
struct Link {
    out: String,
    /// A relation, or `equals`: the signal carries the variable.
    name: String,
    #[serde(rename = "in")]
    inputs: Vec<String>,
}

/// One recorded run.
struct Case<'a> {
    label: String,
    draft: Draft,
    domain: &'a str,
    options: ThesisOptions,
    /// Nanoseconds in the recorded unit of time.
    time_scale: f64,
    /// Substitutions that hold for all steps; `None`: each step has its own.
    substitutions: Option<&'a [Chain]>,
    steps: &'a [Step],
}

/// Runs all experiments.
///
/// # Errors
/// When a case cannot be run.
pub(super) fn compare_experiments(recorded: &Experiments, compared: &mut Compared) -> anyhow::Result<()> {
    for (number, experiment) in recorded.experiments.iter().enumerate() {
        Case::of_experiment(experiment, number).compare(compared)?;
    }
    Ok(())
}

/// Runs all unit cases.
///
/// # Errors
/// When a case cannot be run.
pub(super) fn compare_units(recorded: &Units, compared: &mut Compared) -> anyhow::Result<()> {
    for unit in &recorded.cases {
        Case::of_unit(unit)?.compare(compared)?;
    }
    Ok(())
}

impl<'a> Case<'a> {
    fn of_experiment(experiment: &'a Experiment, number: usize) -> Case<'a> {
        let Experiment { name, signal_order, buffer_size: buffer, .. } = experiment;
        let bounds = |low: f64, high: f64, unit: &str| {
            Some(Bounds::Two(words(&format!("{low}{unit}")), words(&format!("{high}{unit}"))))
        };
        let signal = |(name, it): (&String, &Uncertainty)| SignalDraft {
            value_error: bounds(it.verr_low, it.verr_high, ""),
            time_error: bounds(it.terr_low, it.terr_high, " ns"),
            ..signal(name, "x")
        };
        let signals = experiment.uncertainty.iter().map(signal).collect();
        Case {
            label: format!("{name}, order {signal_order}, buffer {buffer}, run {number}"),
            draft: Draft { variables: vec![variable("x")], signals, ..Draft::default() },
            domain: "x",
            options: ThesisOptions { buffer: *buffer, ..ThesisOptions::default() },
            time_scale: 1.0,
            substitutions: Some(&experiment.substitutions),
            steps: &experiment.steps,
        }
    }

    fn of_unit(unit: &'a Unit) -> anyhow::Result<Case<'a>> {
        let option = |name: &str| unit.options.get(name).copied().unwrap_or(1);
        Ok(Case {
            label: unit.label.clone(),
            draft: unit_draft(unit)?,
            domain: &unit.domain,
            options: ThesisOptions {
                buffer: option("buffer_size"),
                average: option("average_filter_window_size"),
                median: option("median_filter_window_size"),
            },
            time_scale: 1e9,
            substitutions: None,
            steps: &unit.steps,
        })
    }

    /// Runs all steps. A change of the substitutions starts the monitor anew, as in the published program.
    fn compare(&self, compared: &mut Compared) -> anyhow::Result<()> {
        let knowledge = checked(&self.draft)?;
        let mut running: Option<(&[Chain], ThesisRun)> = None;
        for (number, step) in self.steps.iter().enumerate() {
            let substitutions = self.substitutions.unwrap_or(&step.substitutions);
            let mut run = match running.take() {
                Some((before, run)) if before == substitutions => run,
                _ => {
                    let ways = substitutions.iter().map(|chain| way(&knowledge, self.domain, chain));
                    let ways = ways.collect::<anyhow::Result<Vec<_>>>();
                    ThesisRun::new(&knowledge, ways.with_context(|| self.label.clone())?, self.options)
                }
            };
            for input in &step.inputs {
                self.observe(&mut run, input, number)?;
            }
            let differences = self.differences(step, &run.step(Time(0)));
            let label = |what: String| format!("{}, step {number}: {what}", self.label);
            compared.answer(differences.into_iter().map(label).collect());
            running = Some((substitutions, run));
        }
        Ok(())
    }

    /// An input with bounds of its own on its time is read with a model whose time error has these bounds.
    fn observe(&self, run: &mut ThesisRun, input: &Input, number: usize) -> anyhow::Result<()> {
        let mut draft = self.draft.clone();
        let stamp = match input.t {
            None => Time(number as i64 * 1_000_000_000),
            Some(Recorded::Number(time)) => Time(self.nanoseconds(time)),
            Some(bounds) => {
                let [from, to] = bounds.bounds().map(|bound| self.nanoseconds(bound));
                for signal in &mut draft.signals {
                    signal.time_error = Some(Bounds::Two(words("0 ns"), words(&format!("{} ns", to - from))));
                }
                Time(from)
            }
        };
        let knowledge = checked(&draft)?;
        let value = match input.v {
            Recorded::Number(value) => RawValue::Number(value),
            Recorded::Interval([[lo, hi]]) => RawValue::Interval { lo, hi },
        };
        let signal = knowledge.signal(&input.name).with_context(|| format!("no signal {}", input.name))?;
        run.observe(&knowledge, &Observation { signal, stamp, received: stamp, value });
        Ok(())
    }

    fn nanoseconds(&self, time: f64) -> i64 {
        (time * self.time_scale).round() as i64
    }

    fn differences(&self, recorded: &Step, found: &ThesisStep) -> Vec<String> {
        let count = found.errors.len();
        let mut differences: Vec<String> =
            (0..count).flat_map(|substitution| self.of_outputs(substitution, recorded, found)).collect();
        let close = |(one, other): (&f64, &f64)| (one - other).abs() <= TOLERANCE;
        if recorded.error.len() != count || !recorded.error.iter().zip(&found.errors).all(close) {
            differences.push(format!("errors {:?}, not {:?}", found.errors, recorded.error));
        }
        differences.extend(of_failed(recorded, found));
        differences
    }

    fn of_outputs(&self, substitution: usize, recorded: &Step, found: &ThesisStep) -> Vec<String> {
        let recorded: Vec<&Output> = recorded.outputs.iter().filter(|it| it.sidx == substitution).collect();
        let found: Vec<_> = found.outputs.iter().filter(|it| it.substitution == substitution).collect();
        if recorded.len() != found.len() {
            let (found, recorded) = (found.len(), recorded.len());
            return vec![format!("substitution {substitution} has {found} outputs, not {recorded}")];
        }
        let pairs = recorded.iter().zip(&found);
        let different = pairs.flat_map(|(recorded, found)| self.of_output(recorded, found));
        different.map(|what| format!("substitution {substitution} {what}")).collect()
    }

    fn of_output(&self, recorded: &Output, found: &ThesisOutput) -> Vec<String> {
        let mut differences = Vec::new();
        let [lo, hi] = recorded.v.bounds();
        if (found.value.lo() - lo).abs() > TOLERANCE || (found.value.hi() - hi).abs() > TOLERANCE {
            differences.push(format!("gives {:?}, not {lo}..{hi}", found.value));
        }
        let times = found.validity.map(|validity| [validity.from.0, validity.to.0]);
        match recorded.t {
            None if times.is_none_or(|[from, to]| from == to) => {}
            None => differences.push("has a time".to_owned()),
            Some(bounds) => {
                let bounds = bounds.bounds().map(|bound| self.nanoseconds(bound));
                if times != Some(bounds) {
                    differences.push(format!("is valid in {:?}, not {bounds:?}", found.validity));
                }
            }
        }
        differences
    }
}

/// The difference, if the failed substitution is another one.
fn of_failed(recorded: &Step, found: &ThesisStep) -> Option<String> {
    let failed = usize::try_from(recorded.failed).ok();
    let highest = recorded.error.iter().copied().fold(0.0, f64::max);
    let tied = recorded.error.iter().enumerate().filter(|(_, error)| highest - **error <= TOLERANCE);
    let tied: Vec<usize> = tied.map(|(at, _)| at).collect();
    match (found.failed, failed, &*tied) {
        (one, other, _) if one == other => None,
        (None, Some(named), [one, other]) if tied.contains(&named) => {
            Some(format!("a tie of {one} and {other} names nobody, not {named}"))
        }
        (one, other, _) => Some(format!("{one:?} failed, not {other:?}")),
    }
}

/// Variables, relations and signals of a unit case; the formulas are our own.
fn unit_draft(unit: &Unit) -> anyhow::Result<Draft> {
    let functions = &unit.model.functions;
    let names = functions.iter().flat_map(|function| function.inputs.iter().chain([&function.out]));
    let variables: BTreeSet<&String> = names.collect();
    let relation = |function: &Function| {
        Ok(RelationDraft {
            name: words(&function.relation),
            body: BodyDraft::Equation(words(formula(&function.meaning)?)),
            directions: Some(vec![words(&function.out)]),
            condition: None,
            error: None,
            learn: Vec::new(),
            properties: Vec::new(),
        })
    };
    let inputs = unit.steps.iter().flat_map(|step| &step.inputs);
    let carried: BTreeMap<&str, &str> = inputs.map(|input| (&*input.name, &*input.variable)).collect();
    Ok(Draft {
        variables: variables.into_iter().map(|name| variable(name)).collect(),
        relations: functions.iter().map(relation).collect::<anyhow::Result<_>>()?,
        signals: carried.iter().map(|(name, carries)| signal(name, carries)).collect(),
        ..Draft::default()
    })
}

/// The formula for a unit case's description in words.
fn formula(meaning: &str) -> anyhow::Result<&'static str> {
    Ok(match meaning {
        "x = 2 a" => "x = 2 * a",
        "x = 2 b" => "x = 2 * b",
        "x = 2 c" => "x = 2 * c",
        "x = 0.5 d" => "x = 0.5 * d",
        "x = 0.5 b" => "x = 0.5 * b",
        "c = a + b, t = intersection of the input times" => "c = a + b",
        "x = value of a at the previous execution (first call: the same value)" => "x = previous(a)",
        // A step takes a second here.
        "x = value of a two executions ago; until the queue holds three values: the first value" => {
            "x = delay(a, 2 s)"
        }
        other => bail!("no formula for '{other}'"),
    })
}

/// The way of a recorded substitution: `equals` takes a signal of the variable; all other functions are relations.
fn way(knowledge: &KnowledgeBase, domain: &str, chain: &Chain) -> anyhow::Result<Way> {
    let (mut choice, mut carriers) = (BTreeMap::new(), BTreeMap::new());
    let variable = |name: &str| knowledge.variable(name).with_context(|| format!("no variable {name}"));
    for Link { out, name, inputs } in &chain.functions {
        let output = variable(out)?;
        if name == "equals" {
            carriers.insert(output, inputs.first().and_then(|signal| knowledge.signal(signal)));
            continue;
        }
        let relation = knowledge.relations().enumerate().find(|(_, relation)| relation.name == *name);
        choice.insert(output, relation.with_context(|| format!("no relation {name}"))?.0);
    }
    let substitution = Substitution::from_choice(knowledge, variable(domain)?, &choice);
    let substitution = substitution.with_context(|| format!("no substitution of {domain}"))?;
    let signals = substitution.sources.iter().map(|source| carriers.get(source).copied().flatten()).collect();
    Ok(Way { substitution, signals })
}

fn checked(draft: &Draft) -> anyhow::Result<KnowledgeBase> {
    let (knowledge, problems) = build(draft);
    match problems.into_iter().find(|problem| problem.severity == Severity::Error) {
        Some(error) => bail!("{}", error.message),
        None => Ok(knowledge),
    }
}

fn words(text: &str) -> Text {
    Text { text: text.to_owned(), ..Text::default() }
}

fn variable(name: &str) -> VariableDraft {
    VariableDraft { name: words(name), ..VariableDraft::default() }
}

fn signal(name: &str, variable: &str) -> SignalDraft {
    SignalDraft { name: words(name), variable: Some(words(variable)), ..SignalDraft::default() }
}
