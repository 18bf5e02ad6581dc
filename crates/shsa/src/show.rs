//! What is printed for people: loading a model with its problems told, colour, aligned tables, values in units.

use crate::outcome::AlreadyTold;
use shsa_core::diagnosis::Verdict;
use shsa_core::knowledge::KnowledgeBase;
use shsa_core::monitor::Absence;
use shsa_core::unit::nearest;
use shsa_format::model::live::{Live, Written};
use shsa_format::model::{self, Report};
use std::fmt;
use std::io::{IsTerminal, Write, stderr, stdout};
use std::num::NonZeroUsize;
use std::path::Path;

/// More names than these are not listed in an error.
const MOST_NAMES: usize = 20;

/// Loads a model; its problems go to standard error.
///
/// # Errors
/// When the model has errors.
pub(crate) fn load_model(path: &Path) -> anyhow::Result<KnowledgeBase> {
    let loaded = model::load_file(path);
    tell_report(&loaded.report);
    if loaded.report.ok() { Ok(loaded.knowledge) } else { Err(AlreadyTold.into()) }
}

/// As [`load_model`], for a model that may be changed.
///
/// # Errors
/// When the file cannot be read, or the model has errors.
pub(crate) fn load_live(path: &Path) -> anyhow::Result<Live> {
    let name = path.display().to_string();
    let loaded =
        model::read_text(path, "model").and_then(|text| Live::load(Written { name: &name, text: &text }));
    match loaded {
        Ok((live, report)) => {
            tell_report(&report);
            Ok(live)
        }
        Err(report) => {
            tell_report(&report);
            Err(AlreadyTold.into())
        }
    }
}

/// Tells the problems of a model, if there are any; notes are for `shsa check`.
pub(crate) fn tell_report(report: &Report) {
    let text = report.without_notes().render(colour(stderr().is_terminal()));
    if !text.is_empty() {
        tell(text.trim_end());
    }
}

/// Writes a line to standard error; whoever has closed it does not want to know.
pub(crate) fn tell(line: &str) {
    let _ = writeln!(stderr().lock(), "{line}");
}

/// Tells what the user should know though it stops nothing.
pub(crate) fn warn(message: impl fmt::Display) {
    tell(&format!("{} {message}", coloured(Paint::Yellow, "warning:", stderr().is_terminal())));
}

/// Tells why there is no result.
pub(crate) fn fail(message: impl fmt::Display) {
    tell(&format!("{} {message}", coloured(Paint::Red, "error:", stderr().is_terminal())));
}

/// Whether to colour: only on a terminal, and not where the user does not want it (<https://no-color.org>).
pub(crate) fn colour(terminal: bool) -> bool {
    terminal && std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
}

/// A colour of the terminal.
#[derive(Clone, Copy)]
pub(crate) enum Paint {
    Red,
    Green,
    Yellow,
    Bold,
}

/// A text in a colour when standard output is a terminal.
pub(crate) fn paint(paint: Paint, text: &str) -> String {
    coloured(paint, text, stdout().is_terminal())
}

fn coloured(paint: Paint, text: &str, terminal: bool) -> String {
    if !colour(terminal) {
        return text.to_owned();
    }
    let code = match paint {
        Paint::Red => 31,
        Paint::Green => 32,
        Paint::Yellow => 33,
        Paint::Bold => 1,
    };
    format!("\x1b[{code}m{text}\x1b[0m")
}

/// The verdict about a signal in a word; what gives nothing is told before what is believed of it.
pub(crate) fn verdict(absence: Option<Absence>, verdict: Verdict) -> &'static str {
    match (absence, verdict) {
        (Some(Absence::Silent), _) => "silent",
        (Some(Absence::Invalid | Absence::OutOfRange), _) | (None, Verdict::Failed) => "failed",
        (None, Verdict::Unknown) => "unknown",
        (None, Verdict::Healthy) => "healthy",
        (None, Verdict::Suspect) => "suspect",
    }
}

/// A text about a signal in the colour of its verdict.
pub(crate) fn paint_verdict(verdict: &str, text: &str) -> String {
    match verdict {
        "healthy" => paint(Paint::Green, text),
        "failed" | "silent" => paint(Paint::Red, text),
        "suspect" => paint(Paint::Yellow, text),
        _ => text.to_owned(),
    }
}

/// Rows with aligned columns, two spaces between them, below a head; numbers are for the caller to format.
pub(crate) fn table(head: &[&str], mut rows: Vec<Vec<String>>) -> String {
    rows.insert(0, head.iter().map(|cell| paint(Paint::Bold, cell)).collect());
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| {
        rows.iter().filter_map(|row| row.get(column)).map(|cell| shown_width(cell)).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let line = |row: &Vec<String>| {
        let padding = |cell: &str, width: usize| " ".repeat(width.saturating_sub(shown_width(cell)));
        let cells: Vec<String> =
            row.iter().zip(&widths).map(|(cell, &width)| format!("{cell}{}", padding(cell, width))).collect();
        cells.join("  ").trim_end().to_owned()
    };
    rows.iter().map(line).collect::<Vec<_>>().join("\n")
}

/// Characters of a text on the screen: without those that set its colour.
fn shown_width(text: &str) -> usize {
    let mut in_colour = false;
    let shown = |character: &char| {
        let hidden = in_colour || *character == '\x1b';
        in_colour = hidden && *character != 'm';
        !hidden
    };
    text.chars().filter(shown).count()
}

/// `1 need`, `2 needs`.
pub(crate) fn counted(count: usize, one: &str) -> String {
    format!("{count} {one}{}", if count == 1 { "" } else { "s" })
}

/// A time to two or three digits; `unknown` when it is not a number.
pub(crate) fn seconds(value: f64) -> String {
    let (scaled, unit) = match value {
        _ if value.is_nan() => return "unknown".to_owned(),
        _ if value < 1e-6 => (value * 1e9, "ns"),
        _ if value < 1e-3 => (value * 1e6, "us"),
        _ if value < 1.0 => (value * 1e3, "ms"),
        _ => (value, "s"),
    };
    let digits = usize::from(scaled < 9.95);
    format!("{scaled:.digits$} {unit}")
}

/// A text broken between words to the width of the terminal, each line indented; one line when there is none.
pub(crate) fn wrapped(text: &str, indent: usize) -> String {
    let width = terminal_size::terminal_size().map_or(usize::MAX, |(width, _)| usize::from(width.0));
    let room = if stdout().is_terminal() { width.saturating_sub(indent).max(20) } else { usize::MAX };
    let mut lines: Vec<String> = Vec::new();
    for word in text.split(' ') {
        match lines.last_mut().filter(|line| line.chars().count() + 1 + word.chars().count() <= room) {
            Some(line) => *line = format!("{line} {word}"),
            None => lines.push(word.to_owned()),
        }
    }
    let indented: Vec<String> = lines.iter().map(|line| format!("{:indent$}{line}", "")).collect();
    indented.join("\n")
}

/// Reads a number of things of which there must be some.
///
/// # Errors
/// When it is no whole number from 1 on.
pub(crate) fn at_least_one(text: &str) -> Result<NonZeroUsize, String> {
    text.trim().parse().map_err(|_| "expected a whole number from 1 on".to_owned())
}

/// The error that a model does not have this name, with the nearest one or all of the few that it has.
pub(crate) fn unknown<'a>(what: &str, name: &str, known: impl Iterator<Item = &'a str>) -> anyhow::Error {
    let known: Vec<&str> = known.collect();
    let help = match nearest(name, known.iter().copied()) {
        Some(near) => format!("; did you mean '{near}'?"),
        None if (1..=MOST_NAMES).contains(&known.len()) => format!("; it has {}", known.join(", ")),
        None => String::new(),
    };
    anyhow::anyhow!("the model has no {what} '{name}'{help}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_written_for_people() {
        let times = [3.04e-8, 9.99e-6, 1.5e-3, 0.123, 2.0, f64::NAN].map(seconds);
        assert_eq!(times, ["30 ns", "10 us", "1.5 ms", "123 ms", "2.0 s", "unknown"]);
    }
}
