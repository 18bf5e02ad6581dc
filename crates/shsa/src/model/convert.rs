//! `shsa model convert`: a knowledge base in another form, or as a drawing.

use crate::outcome::{AlreadyReported, Outcome};
use crate::written::ensure_free;
use crate::{plan, show};
use anyhow::{Context, bail};
use shsa_core::knowledge::{Draft, KnowledgeBase, SignalSet};
use shsa_core::plan::{Graph, Limits, Options, best};
use shsa_drawing::Marks;
use shsa_model::{Loaded, Report, write};
use std::fs;
use std::io::{Write, stdout};
use std::path::PathBuf;

/// Arguments of `shsa model convert`.
#[derive(clap::Args)]
#[command(after_help = HELP)]
pub(crate) struct Arguments {
    /// The knowledge base: YAML, JSON, a file of the thesis's programs (YAML or Prolog), or an ontology in Turtle.
    file: PathBuf,
    /// Where to write; `-` is standard output.
    #[arg(short, long, value_name = "FILE", default_value = "-")]
    output: PathBuf,
    /// What to write; by the ending of the output, else YAML.
    #[arg(long, value_enum)]
    to: Option<Target>,
    /// What is read; found out when it is not given.
    #[arg(long, value_enum)]
    from: Option<Origin>,
    /// In a drawing, mark the best substitution of this variable.
    #[arg(long, value_name = "VARIABLE")]
    mark: Option<String>,
    /// In a drawing, a signal that is lost; may be given several times.
    #[arg(long, value_name = "SIGNAL")]
    lost: Vec<String>,
}

const HELP: &str = "\
Elements that the other form cannot express are reported, and the exit status is 3. Comments are not taken over. A drawing (DOT \
for Graphviz, or SVG) shows the structure only.

Every command reads the files of the thesis's programs, too. Formulas in Python become ours where they can; else the relation is structure only: it can be planned and analysed, not run. The YAML names the property before the element:

  relations:
    turn: { angle: { in: [base, radius], fct: \"atan(base / radius)\", constraint: \"radius > 1\" } }
  properties:
    provided: [base, radius]
    accuracy: { base: 0.9 }
    cost: { turn: 2 }

and the Prolog facts the output first:

  function(angle, turn, [base, radius]).
  implementation(turn, \"angle.v = atan(base.v / radius.v)\").
  itomsOf(base, [\"/base\"]).

An ontology in Turtle uses SOSA and SSN: a sosa:ObservableProperty (schema:unitText, schema:value) is a variable or a constant, a sosa:Sensor \
that sosa:observes it a signal, a sosa:Platform that sosa:hosts several sensors their common cause, and a sosa:Procedure with \
ssn:hasInput and ssn:hasOutput a relation, structure only but for `<urn:shsa:ontology#equation>`. Names are rdfs:label, or ends of IRIs.

Example: shsa model convert models/rover.yaml -o rover.ttl
Example: shsa model convert models/rover.yaml -o rover.svg --mark v_dmin --lost /lidar/scan
Example: shsa model convert facts.pl -o model.yaml";

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Target {
    /// Our form, for people.
    Yaml,
    /// Our form, for programs.
    Json,
    /// Facts of the thesis's programs.
    Prolog,
    /// An ontology by SOSA and SSN.
    Turtle,
    /// A graph for Graphviz.
    Dot,
    /// A drawing.
    Svg,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Origin {
    /// Our form.
    Yaml,
    /// The same as JSON.
    Json,
    /// The YAML of the thesis's programs.
    Thesis,
    /// Their Prolog facts.
    Prolog,
    /// An ontology by SOSA and SSN.
    Turtle,
}

#[cfg(feature = "foreign")]
impl Origin {
    fn form(self) -> shsa_foreign::Form {
        use shsa_foreign::Form;
        match self {
            Origin::Yaml | Origin::Json => Form::Yaml,
            Origin::Thesis => Form::Thesis,
            Origin::Prolog => Form::Prolog,
            Origin::Turtle => Form::Turtle,
        }
    }
}

/// A model in another form.
struct Written {
    text: String,
    /// The elements that the form cannot express.
    losses: Vec<String>,
}

/// Converts; degraded if something is lost, bad input if the knowledge base has errors.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let target = target(arguments)?;
    let is_stdout = arguments.output.as_os_str() == "-";
    if !is_stdout {
        ensure_free([arguments.output.as_path()], &[&arguments.file])?;
    }
    if !matches!(target, Target::Dot | Target::Svg)
        && (arguments.mark.is_some() || !arguments.lost.is_empty())
    {
        bail!("--mark and --lost are for drawings: add --to svg or --to dot");
    }
    let (draft, loaded, losses) = read(arguments)?;
    let written = written(arguments, target, &draft, &loaded.knowledge)?;
    if is_stdout {
        stdout().write_all(written.text.as_bytes())?;
    } else {
        let path = &arguments.output;
        fs::write(path, &written.text).with_context(|| format!("cannot write {}", path.display()))?;
    }
    written.losses.iter().for_each(|loss| show::warn(format_args!("lost: {loss}")));
    Ok(if losses == 0 && written.losses.is_empty() { Outcome::Done } else { Outcome::Degraded })
}

fn target(arguments: &Arguments) -> anyhow::Result<Target> {
    if let Some(target) = arguments.to {
        return Ok(target);
    }
    if arguments.output.as_os_str() == "-" {
        return Ok(Target::Yaml);
    }
    let ending = arguments.output.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    Ok(match ending.as_str() {
        "yaml" | "yml" => Target::Yaml,
        "json" => Target::Json,
        "pl" | "pro" | "plp" | "prolog" => Target::Prolog,
        "ttl" => Target::Turtle,
        "dot" | "gv" => Target::Dot,
        "svg" => Target::Svg,
        _ => bail!("what to write into {} is not clear: say it with --to", arguments.output.display()),
    })
}

/// The draft, the knowledge base, and the number of elements lost; problems go to standard error.
fn read(arguments: &Arguments) -> anyhow::Result<(Draft, Loaded, usize)> {
    let name = arguments.file.display().to_string();
    let text = or_report(shsa_model::read_text(&arguments.file, "model"))?;
    let (draft, loaded, losses) = read_text(&text, &name, arguments.from)?;
    show::print_report(&loaded.report);
    if loaded.report.ok() { Ok((draft, loaded, losses)) } else { Err(AlreadyReported.into()) }
}

#[cfg(feature = "foreign")]
fn read_text(text: &str, name: &str, from: Option<Origin>) -> anyhow::Result<(Draft, Loaded, usize)> {
    let source = or_report(shsa_foreign::read(text, name, from.map(Origin::form)))?;
    let (draft, losses) = (source.draft().clone(), source.losses);
    Ok((draft, source.build(text, name), losses))
}

#[cfg(not(feature = "foreign"))]
fn read_text(text: &str, name: &str, from: Option<Origin>) -> anyhow::Result<(Draft, Loaded, usize)> {
    if matches!(from, Some(Origin::Thesis | Origin::Prolog | Origin::Turtle)) {
        bail!("this program is built without the feature `foreign`");
    }
    let source = or_report(shsa_model::read(text, name))?;
    Ok((source.draft.clone(), source.build(text, name), 0))
}

fn or_report<T>(read: Result<T, Report>) -> anyhow::Result<T> {
    read.map_err(|report| {
        show::print_report(&report);
        AlreadyReported.into()
    })
}

fn written(
    arguments: &Arguments,
    target: Target,
    draft: &Draft,
    knowledge: &KnowledgeBase,
) -> anyhow::Result<Written> {
    let text = match target {
        Target::Yaml => write::yaml(draft),
        Target::Json => write::json(draft),
        Target::Prolog | Target::Turtle => return foreign(target, knowledge),
        Target::Dot => shsa_drawing::dot(knowledge, &marks(arguments, knowledge)?),
        Target::Svg => shsa_drawing::svg(knowledge, &marks(arguments, knowledge)?)?,
    };
    let text = if text.ends_with('\n') { text } else { text + "\n" };
    Ok(Written { text, losses: Vec::new() })
}

/// A model as the facts of the thesis's programs, or as an ontology.
#[cfg(feature = "foreign")]
fn foreign(target: Target, knowledge: &KnowledgeBase) -> anyhow::Result<Written> {
    let written = match target {
        #[cfg(feature = "ontology")]
        Target::Turtle => shsa_foreign::thesis::ontology::write(knowledge)?,
        #[cfg(not(feature = "ontology"))]
        Target::Turtle => bail!("this program is built without the feature `ontology`"),
        _ => shsa_foreign::thesis::prolog::write(knowledge),
    };
    Ok(Written { text: written.text, losses: written.losses })
}

#[cfg(not(feature = "foreign"))]
fn foreign(_: Target, _: &KnowledgeBase) -> anyhow::Result<Written> {
    bail!("this program is built without the feature `foreign`")
}

/// The marks of a drawing: the best substitution without the lost signals, and the lost signals.
fn marks(arguments: &Arguments, knowledge: &KnowledgeBase) -> anyhow::Result<Marks> {
    let forbidden_signals = arguments
        .lost
        .iter()
        .map(|name| plan::find_signal(knowledge, name))
        .collect::<anyhow::Result<Vec<_>>>()?;
    let mut lost = SignalSet::new();
    for &signal in &forbidden_signals {
        lost.insert(signal);
    }
    let Some(name) = &arguments.mark else { return Ok(Marks { chosen: None, lost }) };
    let variable = plan::find_variable(knowledge, name)?;
    let options = Options { forbidden_signals, ..Options::default() };
    let plan = best(&Graph::new(knowledge), variable, &options, 1, Limits::default());
    let chosen = plan.substitutions.into_iter().next().map(|(substitution, _)| substitution);
    if chosen.is_none() {
        show::warn(format_args!("nothing can provide {name}: nothing is marked"));
    }
    Ok(Marks { chosen, lost })
}
