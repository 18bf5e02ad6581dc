//! `shsa model join` and `shsa model part`: put models of subsystems together, and take a part out of a model.

use super::same::{self, Pair};
use crate::outcome::{AlreadyReported, Outcome};
use crate::show;
use crate::written::ensure_free;
use anyhow::{Context, bail};
use shsa_core::knowledge::{self, Draft};
use shsa_model::live::{self, Written};
use shsa_model::{Report, read_text, write};
use std::ffi::OsStr;
use std::fs;
use std::io::{Write, stdout};
use std::path::PathBuf;

/// Arguments of `shsa model join`.
#[derive(clap::Args)]
#[command(
    after_help = "An entry that several files have alike is taken once; where files contradict each other, both places are reported.

Example: shsa model join chassis.yaml engine.yaml -o car.yaml
  shsa model join ours.yaml supplier.yaml --same velocity=speed -o car.yaml"
)]
pub(crate) struct JoinArguments {
    /// The knowledge bases, YAML or JSON; one part may use a name that only another part describes.
    #[arg(required = true, num_args = 2..)]
    models: Vec<PathBuf>,
    /// Two variables of different models that are the same quantity; units are converted. May be given several times. On a
    /// terminal, likely pairs are asked about; elsewhere they are named.
    #[arg(long, value_name = "NAME=NAME", value_parser = Pair::read)]
    same: Vec<Pair>,
    #[command(flatten)]
    output: Output,
}

/// Arguments of `shsa model part`.
#[derive(clap::Args)]
#[command(after_help = "Example: shsa model part models/husky.yaml path_speed -o speed.yaml")]
pub(crate) struct PartArguments {
    /// The knowledge base, YAML or JSON.
    model: PathBuf,
    /// Variables, relations, signals and needs; what they need to be understood comes along.
    #[arg(required = true)]
    names: Vec<String>,
    #[command(flatten)]
    output: Output,
}

#[derive(clap::Args)]
struct Output {
    /// Where to write, as YAML or, by the ending, JSON; `-` is standard output.
    #[arg(short, long, value_name = "FILE", default_value = "-")]
    output: PathBuf,
}

/// The file extensions that can be written.
const ENDINGS: [&str; 3] = ["yaml", "yml", "json"];

/// Joins; bad input if the models contradict each other, or the whole has errors.
pub(crate) fn join(arguments: &JoinArguments) -> anyhow::Result<Outcome> {
    arguments.output.check(&arguments.models)?;
    let names: Vec<String> = arguments.models.iter().map(|path| path.display().to_string()).collect();
    let texts = arguments.models.iter().map(|path| or_report(read_text(path, "model")));
    let texts = texts.collect::<anyhow::Result<Vec<_>>>()?;
    let parts: Vec<Written> = names.iter().zip(&texts).map(|(name, text)| Written { name, text }).collect();
    let (mut joined, warnings) = or_report(live::join(&parts))?;
    show::print_report(&warnings);
    let drafts = parts.iter().map(|it| or_report(shsa_model::read(it.text, it.name)).map(|read| read.draft));
    let drafts = drafts.collect::<anyhow::Result<Vec<Draft>>>()?;
    let proposed = same::candidates(joined.knowledge(), &drafts, &arguments.same);
    let confirmed = same::confirmed(joined.knowledge(), proposed)?;
    for pair in arguments.same.iter().chain(&confirmed) {
        show::print_report(&or_report(joined.change(Written { name: "--same", text: &pair.change() }))?);
    }
    arguments.output.write(joined.draft())
}

/// Takes a part out.
pub(crate) fn part(arguments: &PartArguments) -> anyhow::Result<Outcome> {
    arguments.output.check(std::slice::from_ref(&arguments.model))?;
    let model = show::load_live(&arguments.model)?;
    let names: Vec<&str> = arguments.names.iter().map(String::as_str).collect();
    match knowledge::part(model.draft(), &names) {
        Ok(part) => arguments.output.write(&part),
        Err(unknown) => bail!("the model has nothing with the name {}", unknown.join(", ")),
    }
}

fn or_report<T>(read: Result<T, Report>) -> anyhow::Result<T> {
    read.map_err(|report| {
        show::print_report(&report);
        AlreadyReported.into()
    })
}

impl Output {
    /// Checks, before anything is read, that the output is none of the models and that its extension is known.
    fn check(&self, models: &[PathBuf]) -> anyhow::Result<()> {
        let shown = self.output.display();
        let ending = self.output.extension().map(|ending| ending.to_string_lossy());
        if let Some(ending) = ending.filter(|ending| !ENDINGS.contains(&ending.as_ref())) {
            bail!(
                "cannot write {shown} as .{ending}: a model with all that it says is YAML or JSON; write it as one of \
                 these, and convert that with `shsa model convert`"
            );
        }
        ensure_free([self.output.as_path()], &models.iter().collect::<Vec<_>>())
    }

    fn write(&self, draft: &Draft) -> anyhow::Result<Outcome> {
        let is_json = self.output.extension() == Some(OsStr::new("json"));
        let text = if is_json { write::json(draft) } else { write::yaml(draft) };
        if self.output.as_os_str() == "-" {
            stdout().write_all(text.as_bytes())?;
        } else {
            fs::write(&self.output, text)
                .with_context(|| format!("cannot write {}", self.output.display()))?;
        }
        Ok(Outcome::Done)
    }
}
