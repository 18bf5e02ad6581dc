//! Collects the problems of a draft.

use crate::expression::{Problem, Severity};
use crate::knowledge::draft::{Diagnostic, Place, Text};
use crate::unit::nearest;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;

/// At most this many pairs of names are compared to find the nearest name: about a second.
pub(super) const MAX_COMPARISONS: usize = 1_000_000;

/// At most this many problems are kept: more do not help.
const MAX_PROBLEMS: usize = 10_000;

/// All problems found so far.
#[derive(Default)]
pub(super) struct Problems {
    found: Vec<Diagnostic>,
    comparisons: usize,
}

impl Problems {
    /// Adds an error about a whole piece of text.
    pub(super) fn error(
        &mut self,
        at: impl Into<Place>,
        message: impl Into<String>,
        help: impl Into<String>,
    ) {
        self.push(Severity::Error, at.into(), message.into(), help.into());
    }

    /// Reports a name that is printed where it would change what a terminal or a line of a log shows.
    pub(super) fn printable(&mut self, name: &Text) {
        if name.text.chars().any(char::is_control) {
            self.error(
                name,
                "a name with a control character",
                "write it without line breaks, tabs and escape sequences",
            );
        }
    }

    /// Adds a warning about a whole piece of text.
    pub(super) fn warn(&mut self, at: impl Into<Place>, message: impl Into<String>, help: impl Into<String>) {
        self.push(Severity::Warning, at.into(), message.into(), help.into());
    }

    /// Adds a note about a whole piece of text that may be as intended.
    pub(super) fn note(&mut self, at: impl Into<Place>, message: impl Into<String>, help: impl Into<String>) {
        self.push(Severity::Note, at.into(), message.into(), help.into());
    }

    /// Adds a problem inside a piece of text.
    pub(super) fn inside(&mut self, text: &Text, problem: Problem) {
        let Problem { severity, span, message, help } = problem;
        self.keep(Diagnostic { severity, place: text.place, span: Some(span), message, help });
    }

    /// Adds the error of an unknown name, with the nearest of the `count` known names as help.
    pub(super) fn unknown<'a>(
        &mut self,
        name: &Text,
        what: &str,
        count: usize,
        known: impl FnOnce() -> Vec<&'a str>,
        otherwise: &str,
    ) {
        self.comparisons = self.comparisons.saturating_add(count);
        let near = if self.comparisons > MAX_COMPARISONS { None } else { nearest(&name.text, known()) };
        let help = near.map_or_else(|| otherwise.to_string(), |near| format!("did you mean `{near}`?"));
        self.error(name, format!("there is no {what} `{}`", name.text), help);
    }

    /// All problems, in the order of the file.
    pub(super) fn sorted(mut self) -> Vec<Diagnostic> {
        self.found.sort_by_key(|found| (found.place, found.span.as_ref().map(|span| span.start)));
        self.found
    }

    fn push(&mut self, severity: Severity, place: Place, message: String, help: String) {
        let help = Some(help).filter(|help| !help.is_empty());
        self.keep(Diagnostic { severity, place, span: None, message, help });
    }

    fn keep(&mut self, diagnostic: Diagnostic) {
        if self.found.len() < MAX_PROBLEMS {
            self.found.push(diagnostic);
        }
    }
}
