//! The problems and warnings of a file of the thesis.

use shsa_core::knowledge::{Diagnostic, Place, Severity, Text};
use std::collections::BTreeSet;
use std::ops::Range;

/// The most problems that are kept; more do not help the user.
const MAX_NOTES: usize = 10_000;

/// Collects errors, and warnings about parts that are not converted.
#[derive(Default)]
pub(super) struct Notes {
    pub(super) found: Vec<Diagnostic>,
    /// The starts of texts whose spans do not count in the file.
    pub(super) rewritten: BTreeSet<u32>,
}

impl Notes {
    /// An error, which prevents the use of the file.
    pub(super) fn error(&mut self, place: Place, message: impl Into<String>, help: &str) {
        self.push(Severity::Error, place, None, message.into(), help);
    }

    /// A warning about a part that is not converted.
    pub(super) fn warn(&mut self, text: &Text, message: impl Into<String>, help: &str) {
        self.push(Severity::Warning, text.place, None, message.into(), help);
    }

    /// A warning about a part of a text that is not converted.
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
