//! Output on the terminal: loads a model and reports its problems, colours, aligned tables, values in units.

use crate::log::{self, Level};
use crate::outcome::{AlreadyReported, Outcome};
use shsa_bridge::Address;
use shsa_core::knowledge::KnowledgeBase;
use shsa_core::unit::nearest;
use shsa_format::text;
use shsa_model::live::{Live, Written};
use shsa_model::{Loaded, Report};
use shsa_recording::Recording;
use shsa_report::{ReportError, Style};
use std::fmt;
use std::io::{IsTerminal, Write, stderr, stdout};
use std::num::NonZeroUsize;
use std::path::Path;

/// The most names that are listed in an error.
const MOST_NAMES: usize = 20;

/// Loads a model; its problems go to standard error.
///
/// # Errors
/// When the model has errors.
pub(crate) fn load_model(path: &Path) -> anyhow::Result<KnowledgeBase> {
    let loaded = load_file(path);
    print_report(&loaded.report);
    if loaded.report.ok() { Ok(loaded.knowledge) } else { Err(AlreadyReported.into()) }
}

/// Reads and checks a model in any form.
#[cfg(feature = "foreign")]
pub(crate) fn load_file(path: &Path) -> Loaded {
    shsa_foreign::load_file(path)
}

/// Reads and checks a model; other forms than ours need the feature `foreign`.
#[cfg(not(feature = "foreign"))]
pub(crate) fn load_file(path: &Path) -> Loaded {
    shsa_model::load_file(path)
}

/// As [`load_model`], for a model that can be changed.
///
/// # Errors
/// When the file cannot be read, or the model has errors.
pub(crate) fn load_live(path: &Path) -> anyhow::Result<Live> {
    let name = path.display().to_string();
    let loaded = shsa_model::read_text(path, "model")
        .and_then(|text| Live::load(Written { name: &name, text: &text }));
    match loaded {
        Ok((live, report)) => {
            print_report(&report);
            Ok(live)
        }
        Err(report) => {
            print_report(&report);
            Err(AlreadyReported.into())
        }
    }
}

/// Prints the problems of a model, if there are any; only `shsa check` prints notes.
pub(crate) fn print_report(report: &Report) {
    let text = report.without_notes().render(colour(stderr().is_terminal()));
    if !text.is_empty() {
        notice(text.trim_end());
    }
}

/// Writes a line to standard error; ignores a closed one.
pub(crate) fn write(line: &str) {
    let _ = writeln!(stderr().lock(), "{line}");
}

/// Tells an information.
pub(crate) fn notice(message: &str) {
    log(Level::Info, message);
}

/// Tells a warning.
pub(crate) fn warn(message: impl fmt::Display) {
    log(Level::Warning, &message.to_string());
}

/// Tells what there is to know of recordings that were read: which files are one, and what is the matter with them.
pub(crate) fn recording(recording: &Recording) {
    recording.joined.iter().for_each(|joined| notice(joined));
    recording.warnings.iter().for_each(warn);
}

/// Tells why there is no result.
pub(crate) fn fail(message: impl fmt::Display) {
    log(Level::Error, &message.to_string());
}

fn log(level: Level, message: &str) {
    log::line(level, &text::decent(message)).iter().for_each(|line| write(line));
}

/// Tells that a bus cannot be reached, with the reason.
pub(crate) fn unreachable(bus: &Address, why: &str) -> Outcome {
    fail(format_args!("{bus} cannot be reached: {why}"));
    Outcome::Unreachable
}

/// Whether to use colours: only on a terminal, unless the user declines them (<https://no-color.org>).
pub(crate) fn colour(terminal: bool) -> bool {
    terminal && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}

/// How texts look on standard output: coloured and wrapped on a terminal only.
pub(crate) fn style() -> Style {
    let terminal = stdout().is_terminal();
    let width = terminal_size::terminal_size().map(|(width, _)| usize::from(width.0));
    Style { colour: colour(terminal), width: width.filter(|_| terminal) }
}

/// The error of a report; problems of a file that it names are printed with their places.
pub(crate) fn report_error(error: ReportError) -> anyhow::Error {
    match error {
        ReportError::Moment(report) => {
            print_report(&report);
            AlreadyReported.into()
        }
        other => other.into(),
    }
}

/// Reads a number that must be positive.
///
/// # Errors
/// When the text is no whole number from 1 on.
pub(crate) fn at_least_one(text: &str) -> Result<NonZeroUsize, String> {
    text.trim().parse().map_err(|_| "expected a whole number from 1 on".to_owned())
}

/// The error for a name that the model lacks, with the nearest name, or all names if there are few.
pub(crate) fn unknown<'a>(what: &str, name: &str, known: impl Iterator<Item = &'a str>) -> anyhow::Error {
    let known: Vec<&str> = known.collect();
    let help = match nearest(name, known.iter().copied()) {
        Some(near) => format!("; did you mean '{near}'?"),
        None if (1..=MOST_NAMES).contains(&known.len()) => format!("; it has {}", known.join(", ")),
        None => String::new(),
    };
    anyhow::anyhow!("the model has no {what} '{name}'{help}")
}
