//! `shsa plan`: substitutions for a variable, best first.

mod draw;
mod trace;

use crate::contingency;
use crate::headings::OUTPUT;
use crate::outcome::Outcome;
use crate::requirements::{self, RequirementArguments};
use crate::show;
use anyhow::{anyhow, bail};
use serde_json::{Value, json};
use shsa_core::knowledge::{KnowledgeBase, RelationId, SignalId, VariableId};
use shsa_core::plan::{
    self, Deal, Graph, Limits, Options, Part, Plan, Preparation, Requirements, StopReason, Take,
};
use shsa_format::text::counted;
use shsa_report::shortfall::{Refused, refused};
use shsa_report::substitution::Names;
use std::io::{Write, stdout};
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use trace::Trace;

/// Arguments of `shsa plan`.
#[derive(clap::Args)]
#[command(
    after_help = "Example: shsa plan models/rover.yaml v_dmin --all --exclude /lidar/scan --draw drawings"
)]
pub(crate) struct Arguments {
    /// The knowledge base, YAML or JSON.
    model: PathBuf,
    /// The variable that is to be known.
    #[arg(required_unless_present = "contingency")]
    variable: Option<String>,
    /// How to search.
    #[arg(long, value_enum, default_value_t = Engine::BestFirst)]
    engine: Engine,
    /// How many substitutions to find.
    #[arg(long, value_name = "N", default_value = "1", value_parser = show::at_least_one, conflicts_with = "all")]
    top: NonZeroUsize,
    /// Find all substitutions.
    #[arg(long)]
    all: bool,
    /// A signal that must not be used; may be given several times.
    #[arg(long, value_name = "SIGNAL")]
    exclude: Vec<String>,
    /// Search behind variables that signals carry, too: by what else they can be computed.
    #[arg(long, conflicts_with = "contingency")]
    behind: bool,
    /// After how many decisions the search ends.
    #[arg(long, value_name = "N")]
    limit: Option<u64>,
    /// List the next source for the loss of each signal, for the variable or else for all needs.
    #[arg(long, conflicts_with_all = ["engine", "top", "all", "threads", "why"])]
    contingency: bool,
    /// With --contingency: for any two signals that are lost, too.
    #[arg(long, requires = "contingency")]
    pairs: bool,
    /// How many threads the engines best-first and sh-pgsa may use; the result is the same.
    #[arg(long, value_name = "N", default_value = "1", value_parser = show::at_least_one)]
    threads: NonZeroUsize,
    /// Print the steps of the search too, as a tree; searches by SH-PGSA.
    #[arg(long, conflicts_with_all = ["engine", "threads", "contingency"])]
    trace: bool,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    requirements: RequirementArguments,
    /// Draw the knowledge base with each substitution marked: FOLDER/VARIABLE-1.svg is the best one; at most 100.
    #[arg(long, value_name = "FOLDER", conflicts_with = "contingency", help_heading = OUTPUT)]
    draw: Option<PathBuf>,
}

impl Arguments {
    fn engine(&self) -> Engine {
        if self.trace { Engine::ShPgsa } else { self.engine }
    }
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Engine {
    /// Exact, the best first.
    BestFirst,
    /// The thesis's SH-PGSA: the best first, guided by what is decided.
    ShPgsa,
    /// Ontology-based: the first relations that lead to signals; one answer, perhaps not the best.
    Orr,
    /// Depth first: the first answer, perhaps not the best; with --all or --top the best of all.
    Dfs,
    /// Tries everything: slow, the oracle of the others.
    Exhaustive,
}

impl Engine {
    fn name(self) -> &'static str {
        match self {
            Engine::BestFirst => "best-first",
            Engine::ShPgsa => "sh-pgsa",
            Engine::Orr => "orr",
            Engine::Dfs => "dfs",
            Engine::Exhaustive => "exhaustive",
        }
    }
}

/// Searches; the answer is no if there is no substitution.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let knowledge = show::load_model(&arguments.model)?;
    let forbidden_signals =
        arguments.exclude.iter().map(|name| find_signal(&knowledge, name)).collect::<anyhow::Result<_>>()?;
    let mut options =
        Options { forbidden_signals, substitute_provided: arguments.behind, ..Options::default() };
    if arguments.contingency {
        let preparation = Preparation {
            pairs: arguments.pairs,
            options,
            limits: limits(arguments),
            ..Preparation::default()
        };
        let variable = arguments.variable.as_deref();
        let required =
            |variable, options: &mut Options| arguments.requirements.read(&knowledge, variable, options);
        let answer = contingency::answer(&knowledge, variable, &preparation, required, arguments.json)?;
        writeln!(stdout().lock(), "{answer}")?;
        return Ok(Outcome::Done);
    }
    let variable = find_variable(&knowledge, arguments.variable.as_deref().unwrap_or_default())?;
    let requirements = arguments.requirements.read(&knowledge, variable, &mut options)?;
    if requirements.limits_paths() && arguments.engine() != Engine::BestFirst {
        bail!("latency and width are checked by the engine best-first only");
    }
    let graph = Graph::new(&knowledge);
    let began = Instant::now();
    let mut trace = Trace::default();
    let plan = search(arguments, &knowledge, &graph, variable, &options, &requirements, &mut trace);
    let elapsed = began.elapsed();
    let narrowed = requirements.narrowed(&knowledge, &options);
    let excluded = |signal: SignalId| narrowed.forbidden_signals.contains(&signal);
    let falling_short = arguments
        .requirements
        .asks_why()
        .then(|| refused(&knowledge, &graph, variable, &options, &requirements, limits(arguments)));
    if let Some(folder) = &arguments.draw {
        let count = draw::write(&knowledge, variable, &plan, &options.forbidden_signals, folder)?;
        show::notice(&format!("{} written to {}", counted(count, "drawing"), folder.display()));
    }
    let mut output = stdout().lock();
    if arguments.json {
        let mut answer = to_json(arguments, &knowledge, &plan, elapsed, excluded, falling_short.as_deref());
        if arguments.trace {
            answer["steps"] = trace.to_json(&knowledge);
        }
        writeln!(output, "{answer}")?;
    } else {
        if arguments.trace {
            writeln!(output, "{}\n", trace.to_text(&knowledge))?;
        }
        writeln!(output, "{}", to_text(arguments, &knowledge, &plan, excluded))?;
        if let Some(refused) = falling_short.filter(|refused| !refused.is_empty()) {
            writeln!(output, "\n{}", requirements::table(&knowledge, &refused))?;
        }
    }
    Ok(if plan.substitutions.is_empty() { Outcome::No } else { Outcome::Done })
}

fn limits(arguments: &Arguments) -> Limits {
    let mut limits = Limits::default();
    limits.expansions = arguments.limit.unwrap_or(limits.expansions);
    limits
}

fn search(
    arguments: &Arguments,
    knowledge: &KnowledgeBase,
    graph: &Graph,
    variable: VariableId,
    options: &Options,
    requirements: &Requirements,
    trace: &mut Trace,
) -> Plan {
    let limits = limits(arguments);
    let options = &requirements.narrowed(knowledge, options);
    let count = if arguments.all { usize::MAX } else { arguments.top.get() };
    match arguments.engine() {
        Engine::BestFirst if requirements.limits_paths() => {
            plan::best_meeting(knowledge, graph, variable, options, requirements, count, limits)
        }
        Engine::BestFirst if arguments.threads.get() > 1 => {
            let deal = Deal::among(arguments.threads.get());
            plan::best_in_parts(graph, variable, options, count, limits, deal, at_once)
        }
        Engine::BestFirst => plan::best(graph, variable, options, count, limits),
        Engine::ShPgsa if arguments.trace => {
            plan::property_guided_traced(graph, variable, options, count, limits, &mut |step| {
                trace.take(step)
            })
        }
        Engine::ShPgsa if arguments.threads.get() > 1 => {
            let deal = Deal::among(arguments.threads.get());
            plan::property_guided_in_parts(graph, variable, options, count, limits, deal, at_once)
        }
        Engine::ShPgsa => plan::property_guided(graph, variable, options, count, limits),
        Engine::Orr => plan::ontology(graph, variable, options, limits),
        Engine::Dfs if count == 1 => plan::depth_first(graph, variable, options, Take::First, limits),
        Engine::Dfs => cut(plan::depth_first(graph, variable, options, Take::All, limits), count),
        Engine::Exhaustive => cut(plan::exhaustive(knowledge, variable, options, limits), count),
    }
}

/// Runs each part of a search in a thread of its own.
fn at_once(parts: &mut [Part]) {
    std::thread::scope(|scope| {
        for part in parts {
            scope.spawn(|| part.run());
        }
    });
}

/// The first `count` substitutions of a plan; the rest is included in its bound.
fn cut(mut plan: Plan, count: usize) -> Plan {
    if let Some(&(_, utility)) = plan.substitutions.get(count) {
        plan.bound = plan.bound.max(utility);
        plan.substitutions.truncate(count);
    }
    plan
}

/// The variable with this name; the error suggests the nearest name.
///
/// # Errors
/// When there is no such variable.
pub(crate) fn find_variable(knowledge: &KnowledgeBase, name: &str) -> anyhow::Result<VariableId> {
    let names = || knowledge.variables().iter().map(|variable| variable.name.as_str());
    knowledge.variable(name).ok_or_else(|| match knowledge.signal(name) {
        Some(signal) => {
            let carried = &knowledge.variables()[knowledge.signals()[signal].variable].name;
            anyhow!("'{name}' is a signal; the variable that it carries is '{carried}'")
        }
        None => show::unknown("variable", name, names()),
    })
}

/// The signal with this name; the error suggests the nearest name.
///
/// # Errors
/// When there is no such signal.
pub(crate) fn find_signal(knowledge: &KnowledgeBase, name: &str) -> anyhow::Result<SignalId> {
    let names = || knowledge.signals().iter().map(|signal| signal.name.as_str());
    knowledge.signal(name).ok_or_else(|| show::unknown("signal", name, names()))
}

/// The relation with this name; the error suggests the nearest name.
///
/// # Errors
/// When there is no such relation.
pub(crate) fn find_relation(knowledge: &KnowledgeBase, name: &str) -> anyhow::Result<RelationId> {
    let names = || knowledge.relations().iter().map(|relation| relation.name.as_str());
    let found = knowledge.relations().enumerate().find(|(_, relation)| relation.name == name);
    found.map(|(id, _)| id).ok_or_else(|| show::unknown("relation", name, names()))
}

fn to_json(
    arguments: &Arguments,
    knowledge: &KnowledgeBase,
    plan: &Plan,
    elapsed: Duration,
    excluded: impl Fn(SignalId) -> bool,
    refused: Option<&[Refused]>,
) -> Value {
    let found = plan
        .substitutions
        .iter()
        .map(|(substitution, utility)| Names::of(knowledge, substitution, &excluded).to_json(*utility));
    let mut answer = json!({
        "variable": arguments.variable,
        "engine": arguments.engine().name(),
        "stop": plan.stop.to_string(),
        "expanded": plan.expanded,
        "search_ns": u64::try_from(elapsed.as_nanos()).unwrap_or(u64::MAX),
        "bound": plan.bound,
        "substitutions": found.collect::<Vec<_>>(),
    });
    if let Some(refused) = refused {
        answer["refused"] = refused.iter().map(|refused| refused.to_json(knowledge)).collect();
    }
    answer
}

fn to_text(
    arguments: &Arguments,
    knowledge: &KnowledgeBase,
    plan: &Plan,
    excluded: impl Fn(SignalId) -> bool,
) -> String {
    let decisions = counted(usize::try_from(plan.expanded).unwrap_or(usize::MAX), "decision");
    if plan.substitutions.is_empty() {
        let variable = arguments.variable.as_deref().unwrap_or_default();
        return match plan.stop {
            StopReason::Complete => format!("nothing can provide {variable} (complete, {decisions})"),
            stop => format!("nothing found for {variable} so far ({stop}, {decisions}{})", gap(plan)),
        };
    }
    let mut rows = Vec::new();
    for (substitution, utility) in &plan.substitutions {
        let names = Names::of(knowledge, substitution, &excluded);
        let relations = names.relations_or_own();
        rows.push(vec![format!("{utility:.6}"), relations, names.signals.join(", "), names.formula]);
    }
    let table = show::style().table(&["utility", "relations", "from", "formula (in SI units)"], rows);
    let count = counted(plan.substitutions.len(), "substitution");
    format!("{table}\n\n{count} ({}, {decisions}{})", plan.stop, gap(plan))
}

/// What may be missing after a limit ended the search.
fn gap(plan: &Plan) -> String {
    match plan.stop {
        StopReason::LimitExpansions | StopReason::LimitStates => {
            format!("; what is missing is worth at most {:.6}", plan.bound)
        }
        StopReason::Complete | StopReason::Found(_) | StopReason::NotMonotone => String::new(),
    }
}
