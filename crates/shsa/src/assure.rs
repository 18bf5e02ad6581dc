//! `shsa assure`: what contracts allow, before anything runs or at one moment: who may serve each need, at which level, and why
//! not at a higher one.

use crate::headings::OUTPUT;
use crate::outcome::{AlreadyReported, Outcome};
use crate::reading::ReadArguments;
use crate::replay::{SourceArguments, recorded};
use crate::show;
use crate::written::ensure_free;
use anyhow::{Context, bail};
use shsa_core::assurance::Certificates;
use shsa_drawing::case::gsn::INDEX;
use shsa_model::read_text;
use shsa_report::assurance::{CertificateReport, Claim, ModelReport, WrittenMoment, modules};
use shsa_report::replay::CasesOverTime;
use std::io::{Write, stdout};
use std::path::{Path, PathBuf};

/// Ends the help.
const EXAMPLES: &str = "\
Example: shsa assure models/stop.yaml
  shsa assure models/stop.yaml --with evidence.yaml
  shsa assure models/stop.yaml --format gsn -o case
  shsa assure models/stop.yaml --over drive.csv --inject bias=2:/lidar@20s..
  shsa assure leader.model follower.model

The evidence of a moment, by owner of a contract and name of the evidence; evidence without an entry is unknown:
  /lidar: { fresh: 40 ms, sound: true }
  computer: { spare: [18 %, 22 %] }

Files of conserts-rs (YAML) or safeTbox (.model) are recognised; several of them are composed, in any order.";

/// What is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// For people.
    Text,
    /// One JSON object.
    Json,
    /// The assurance case in the YAML of gsn2x, a module a need.
    Gsn,
    /// The assurance case as a drawing, one a need.
    Svg,
    /// Facts and rules for SWI-Prolog, a program a need.
    Prolog,
    /// The assurance case as a page for the browser, which needs nothing else.
    Html,
}

/// Arguments of `shsa assure`.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// The knowledge base; or certificates of conserts-rs or safeTbox.
    #[arg(required = true, value_name = "MODEL")]
    models: Vec<PathBuf>,
    /// What is observed at one moment; when left away, all is as it should be.
    #[arg(long, value_name = "FILE")]
    with: Option<PathBuf>,
    /// Recordings of one session: how each claim and each piece of evidence stood, and when; as text, JSON or GSN.
    #[arg(long, value_name = "RECORDING", num_args = 1.., conflicts_with = "with")]
    over: Vec<PathBuf>,
    /// How it is written.
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    source: SourceArguments,
    /// Where it is written: a file, or a folder for a case of GSN, SVG or Prolog, one file a need.
    #[arg(short, long = "output", alias = "out", value_name = "PATH", help_heading = OUTPUT)]
    out: Option<PathBuf>,
    #[command(flatten)]
    reading: ReadArguments,
}

/// Composes contracts. The answer is no if a need cannot get what it asks, or a certificate gives no guarantee or lacks a demand.
pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<Outcome> {
    let format = if arguments.json { Format::Json } else { arguments.format };
    let moment = arguments.with.as_deref().map(read_moment).transpose()?;
    let [first, ..] = arguments.models.as_slice() else { bail!("name a model") };
    // A folder may have to be made.
    let is_there = arguments.out.as_deref().filter(|path| path.exists());
    ensure_free(is_there, &arguments.models.iter().chain(&arguments.over).collect::<Vec<_>>())?;
    let text = read(first)?;
    if !arguments.over.is_empty() {
        return over(arguments, format, first);
    }
    if arguments.source.changes() {
        bail!("faults and reloads are of recordings: add --over RECORDING");
    }
    if is_certificate(&text) {
        let names = arguments.models.iter().map(|path| path.display().to_string());
        let title = names.collect::<Vec<_>>().join(", ");
        let certificates = certificates(&arguments.models)?;
        let report =
            CertificateReport::new(certificates, title, moment.as_ref()).map_err(show::report_error)?;
        match format {
            Format::Text => written(arguments, &report.text(show::style()))?,
            Format::Json => written(arguments, &format!("{}\n", report.json()))?,
            Format::Html => written(arguments, &report.page())?,
            Format::Gsn | Format::Svg | Format::Prolog => {
                cases(arguments, format, &report.claims(), report.index())?
            }
        }
        return Ok(if report.is_given() { Outcome::Done } else { Outcome::No });
    }
    if arguments.models.len() > 1 {
        bail!("several models are put together by `shsa model join` first");
    }
    let knowledge = show::load_model(first)?;
    let title = first.file_name().unwrap_or(first.as_os_str()).to_string_lossy().into_owned();
    let report = ModelReport::new(&knowledge, title, moment.as_ref()).map_err(show::report_error)?;
    match format {
        Format::Text => written(arguments, &report.text(show::style()))?,
        Format::Json => written(arguments, &format!("{}\n", report.json()))?,
        Format::Html => written(arguments, &report.page())?,
        Format::Gsn | Format::Svg | Format::Prolog => {
            cases(arguments, format, &report.claims(), report.index())?
        }
    }
    Ok(if report.is_given() { Outcome::Done } else { Outcome::No })
}

/// Tells the cases over recordings.
fn over(arguments: &Arguments, format: Format, model: &Path) -> anyhow::Result<Outcome> {
    let (recorder, run) = recorded(model, &arguments.over, &arguments.source, &arguments.reading)?;
    let title = model.file_name().unwrap_or(model.as_os_str()).to_string_lossy();
    let cases = CasesOverTime::new(&recorder, &run, &title);
    match format {
        Format::Text => written(arguments, &cases.text())?,
        Format::Json => written(arguments, &format!("{}\n", cases.json()))?,
        Format::Gsn => into_files(arguments, cases.gsn(), Some(cases.index()), "gsn.yaml")?,
        Format::Html => bail!("`shsa replay --report` writes the page over a recording"),
        Format::Svg | Format::Prolog => bail!("over a recording there is text, json and gsn"),
    }
    Ok(if cases.is_given() { Outcome::Done } else { Outcome::No })
}

/// Writes the assurance cases, one a claim; in GSN with the module over them.
fn cases(arguments: &Arguments, format: Format, claims: &[Claim<'_>], index: String) -> anyhow::Result<()> {
    match format {
        Format::Svg => {
            let drawn = |claim: &Claim<'_>, _: &str| Ok(shsa_drawing::argument(&claim.argument())? + "\n");
            into_files(arguments, each(claims, drawn)?, None, "svg")
        }
        Format::Prolog => into_files(arguments, each(claims, |claim, _| Ok(claim.prolog()))?, None, "pl"),
        _ => {
            let modules = each(claims, |claim, module| Ok(claim.gsn(module)))?;
            into_files(arguments, modules, Some(index), "gsn.yaml")
        }
    }
}

/// Reads certificates, and composes them.
#[cfg(feature = "foreign")]
fn certificates(paths: &[PathBuf]) -> anyhow::Result<Certificates> {
    use shsa_foreign::conserts;
    let mut files: Vec<Certificates> = Vec::new();
    for path in paths {
        let name = path.display().to_string();
        let (certificates, report) = conserts::read(&read(path)?, &name);
        show::print_report(&report);
        if !report.ok() {
            return Err(AlreadyReported.into());
        }
        files.push(certificates);
    }
    Ok(conserts::compose(files))
}

/// As a program without the reader of certificates does.
#[cfg(not(feature = "foreign"))]
fn certificates(_: &[PathBuf]) -> anyhow::Result<Certificates> {
    bail!("these are certificates of another program: this one is built without the feature `foreign`")
}

/// A text for each claim, with the name of its module.
fn each(
    claims: &[Claim<'_>],
    write: impl Fn(&Claim<'_>, &str) -> anyhow::Result<String>,
) -> anyhow::Result<Vec<(String, String)>> {
    let texts = claims.iter().zip(modules(claims)).map(|(claim, module)| {
        let text = write(claim, &module)?;
        Ok((module, text))
    });
    texts.collect()
}

/// Writes each text into a file of its name, and the index beside them: into a folder, or to the output or the named file if there
/// is only one text. A new path without an ending is a folder.
fn into_files(
    arguments: &Arguments,
    mut texts: Vec<(String, String)>,
    index: Option<String>,
    ending: &str,
) -> anyhow::Result<()> {
    let is_folder = |path: &PathBuf| path.is_dir() || path.extension().is_none() && !path.exists();
    let folder = match (texts.as_slice(), &arguments.out) {
        ([], _) => bail!("nothing is demanded: there is no case to write"),
        (_, Some(folder)) if is_folder(folder) => folder,
        ([(_, text)], _) => return written(arguments, text),
        (_, None) => bail!("{} files are written: name a folder with -o", texts.len()),
        (_, Some(file)) => {
            bail!("{} files are written: {} names a single file", texts.len(), file.display())
        }
    };
    std::fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    texts.extend(index.map(|text| (INDEX.to_owned(), text)));
    for (name, text) in &texts {
        let path = folder.join(format!("{name}.{ending}"));
        std::fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(())
}

fn written(arguments: &Arguments, text: &str) -> anyhow::Result<()> {
    match &arguments.out {
        Some(path) => std::fs::write(path, text).with_context(|| format!("cannot write {}", path.display())),
        None => Ok(stdout().lock().write_all(text.as_bytes())?),
    }
}

/// The text of a file; prints the problem with it.
fn read(path: &Path) -> anyhow::Result<String> {
    read_text(path, "model").map_err(|report| {
        show::print_report(&report);
        AlreadyReported.into()
    })
}

fn read_moment(path: &Path) -> anyhow::Result<WrittenMoment> {
    WrittenMoment::read(read(path)?, &path.display().to_string()).map_err(show::report_error)
}

/// Whether a text is a certificate and not a model: XML, or YAML with the keys of a certificate.
fn is_certificate(text: &str) -> bool {
    let begins = |line: &str| {
        ["guarantees:", "demands:", "evidence:", "tree_propagations:"].iter().any(|key| line.starts_with(key))
    };
    text.trim_start().starts_with('<') || text.lines().any(begins)
}
