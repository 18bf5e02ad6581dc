//! The problems of a model, for people (with the source line) and for programs.

use annotate_snippets::{AnnotationKind, Group, Level, Origin, Renderer, Snippet};
use serde::{Serialize, Serializer};
use shsa_core::knowledge::{Diagnostic, Severity};
use std::collections::BTreeSet;
use std::ops::Range;

use super::lines::{Lines, boundary};

/// How much of a long line is kept on each side of a problem, in bytes.
const CONTEXT: usize = 100;
/// The most problems that are shown to people; the rest is counted.
const SHOWN: usize = 100;

/// A problem with its place in a file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Located {
    /// The severity; an error prevents the use of the model.
    #[serde(serialize_with = "severity")]
    pub severity: Severity,
    /// The problem, in one line.
    pub message: String,
    /// The file as the caller named it.
    pub file: String,
    /// The line, counted from 1; 0 when the problem is about the whole file.
    pub line: usize,
    /// The column in characters, counted from 1; 0 when the problem is about the whole file.
    pub column: usize,
    /// The correction, if one is known.
    pub help: Option<String>,
    /// The source line of the problem, or a part of a long one.
    #[serde(skip)]
    pub source_line: String,
    /// The bytes of the problem in `source_line`.
    #[serde(skip)]
    pub span: Range<usize>,
}

impl Located {
    /// A warning about a whole file.
    #[must_use]
    pub fn warning(file: &str, message: String) -> Located {
        Located::of_file(file, Severity::Warning, message)
    }

    /// A note about a whole file.
    #[must_use]
    pub fn note(file: &str, message: String) -> Located {
        Located::of_file(file, Severity::Note, message)
    }

    fn of_file(file: &str, severity: Severity, message: String) -> Located {
        Located {
            severity,
            message,
            file: file.to_owned(),
            line: 0,
            column: 0,
            help: None,
            source_line: String::new(),
            span: 0..0,
        }
    }
}

/// All problems, in file order.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(transparent)]
pub struct Report {
    /// The problems, in file order.
    pub diagnostics: Vec<Located>,
}

impl Report {
    /// Whether there is no error; warnings are allowed.
    #[must_use]
    pub fn ok(&self) -> bool {
        self.diagnostics.iter().all(|found| found.severity != Severity::Error)
    }

    /// The report without notes.
    #[must_use]
    pub fn without_notes(&self) -> Report {
        let matters = |found: &&Located| found.severity > Severity::Note;
        Report { diagnostics: self.diagnostics.iter().filter(matters).cloned().collect() }
    }

    /// The report for people: each problem with its source line, at most a hundred; ends with a line feed. Empty without
    /// problems.
    #[must_use]
    pub fn render(&self, colour: bool) -> String {
        let renderer = if colour { Renderer::styled() } else { Renderer::plain() };
        let mut text = String::new();
        for found in self.diagnostics.iter().take(SHOWN) {
            text += &renderer.render(&[found.group()]);
            text += "\n\n";
        }
        if let Some(more) = self.diagnostics.len().checked_sub(SHOWN).filter(|&more| more > 0) {
            text += &format!("and {more} more\n\n");
        }
        text.truncate(text.trim_end().len() + usize::from(!text.is_empty()));
        text
    }

    /// A report of one error about a whole file.
    #[must_use]
    pub fn whole(file: &str, message: String, help: &str) -> Report {
        let (source_line, span) = (String::new(), 0..0);
        let (severity, help, file) = (Severity::Error, Some(help.to_owned()), file.to_owned());
        let found = Located { severity, message, file, line: 0, column: 0, help, source_line, span };
        Report { diagnostics: vec![found] }
    }

    /// Finds lines and columns. Scalars that start at `rewritten` get no spans.
    #[must_use]
    pub fn locate(file: &str, source: &str, mut found: Vec<Diagnostic>, rewritten: &BTreeSet<u32>) -> Report {
        found.sort_by_key(|diagnostic| (diagnostic.place, diagnostic.span.as_ref().map(|span| span.start)));
        found.dedup();
        let lines = Lines::new(source);
        let locate = |diagnostic: Diagnostic| {
            let narrow = !rewritten.contains(&diagnostic.place.from);
            located(file, &lines, diagnostic, narrow)
        };
        Report { diagnostics: found.into_iter().map(locate).collect() }
    }
}

impl Located {
    fn group(&self) -> Group<'_> {
        let level = match self.severity {
            Severity::Error => Level::ERROR,
            Severity::Warning => Level::WARNING,
            Severity::Note => Level::NOTE,
        };
        let title = level.primary_title(self.message.as_str());
        let group = self.show(Group::with_title(title));
        match &self.help {
            Some(help) => group.element(Level::HELP.message(help.as_str())),
            None => group,
        }
    }

    /// The place of the problem, with the line if there is one.
    fn show<'a>(&'a self, group: Group<'a>) -> Group<'a> {
        let origin = Origin::path(self.file.as_str());
        if self.line == 0 {
            return group.element(origin);
        }
        let mark = AnnotationKind::Primary.span(self.span.clone());
        let snippet = Snippet::source(self.source_line.as_str()).line_start(self.line).annotation(mark);
        let shown = self.source_line.get(..self.span.start).map_or(0, |before| before.chars().count());
        if shown + 1 == self.column {
            return group.element(snippet.path(self.file.as_str()));
        }
        // In a part of a long line, the snippet would count the column from the cut.
        group.element(origin.line(self.line).char_column(self.column)).element(snippet)
    }
}

fn located(file: &str, lines: &Lines, found: Diagnostic, narrow: bool) -> Located {
    let (mut from, mut to) = (found.place.from as usize, found.place.to as usize);
    if let Some(span) = found.span.filter(|_| narrow) {
        (from, to) = ((from + span.start).min(to), (from + span.end).min(to));
    }
    from = from.min(lines.bytes());
    let (start, text) = lines.part(from, CONTEXT, 2 * CONTEXT);
    let begin = boundary(text, from - start);
    let end = boundary(text, to.saturating_sub(start).clamp(begin, begin + CONTEXT));
    let kept = boundary(text, end + CONTEXT);
    Located {
        severity: found.severity,
        message: printable(found.message),
        file: file.to_owned(),
        line: lines.number(from),
        column: lines.column(start + begin),
        help: found.help.map(printable),
        span: begin..end,
        source_line: text[..kept].to_owned(),
    }
}

/// The control characters of a file must not reach the terminal.
fn printable(text: String) -> String {
    text.replace(char::is_control, "\u{fffd}")
}

fn severity<S: Serializer>(severity: &Severity, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(match severity {
        Severity::Error => "error",
        Severity::Warning => "warning",
        Severity::Note => "note",
    })
}
