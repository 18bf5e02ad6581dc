//! What is told about a file of the thesis while it is read.

use shsa_core::knowledge::{Diagnostic, Place, Severity, Text};
use std::collections::BTreeSet;
use std::ops::Range;

/// How many problems are kept: more help nobody.
const MAX_NOTES: usize = 10_000;

/// Collects what is wrong, and what does not come over.
#[derive(Default)]
pub(super) struct Notes {
    pub(super) found: Vec<Diagnostic>,
    /// Starts of texts whose spans do not count in the file.
    pub(super) rewritten: BTreeSet<u32>,
}

impl Notes {
    /// What keeps the file from being used.
    pub(super) fn error(&mut self, place: Place, message: impl Into<String>, help: &str) {
        self.push(Severity::Error, place, None, message.into(), help);
    }

    /// What does not come over.
    pub(super) fn warn(&mut self, text: &Text, message: impl Into<String>, help: &str) {
        self.push(Severity::Warning, text.place, None, message.into(), help);
    }

    /// What does not come over, about a part of a text.
    pub(super) fn inside(&mut self, text: &Text, span: Range<usize>, message: impl Into<String>, help: &str) {
        self.push(Severity::Warning, text.place, Some(span), message.into(), help);
    }

    fn push(
        &mut self,
        severity: Severity,
        place: Place,
        span: Option<Range<usize>>,
        message: String,
        help: &str,
    ) {
        if self.found.len() < MAX_NOTES {
            let help = Some(help.to_owned()).filter(|help| !help.is_empty());
            self.found.push(Diagnostic { severity, place, span, message, help });
        }
    }
}
