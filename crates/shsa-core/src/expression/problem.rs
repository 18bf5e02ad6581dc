//! Problems of formulas, with their places.

use alloc::borrow::ToOwned;
use alloc::string::String;
use core::fmt;
use core::ops::Range;

/// How far a problem prevents the use of the formula.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Severity {
    /// The formula can be used; the note is for information.
    Note,
    /// The formula can be used, but deserves a look.
    Warning,
    /// The formula cannot be used.
    Error,
}

/// A problem of a formula: found by parsing, checking, solving or compiling it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Whether it forbids to use the formula.
    pub severity: Severity,
    /// The place, in bytes of the formula's text.
    pub span: Range<usize>,
    /// The problem, in one sentence without a full stop.
    pub message: String,
    /// What to do about it.
    pub help: Option<String>,
}

impl Problem {
    /// An error without help.
    #[must_use]
    pub fn error(span: Range<usize>, message: impl Into<String>) -> Problem {
        Problem { severity: Severity::Error, span, message: message.into(), help: None }
    }

    /// A warning without help.
    #[must_use]
    pub fn warning(span: Range<usize>, message: impl Into<String>) -> Problem {
        Problem { severity: Severity::Warning, ..Problem::error(span, message) }
    }

    /// Adds help to a problem.
    #[must_use]
    pub fn with_help(self, help: impl Into<String>) -> Problem {
        Problem { help: Some(help.into()), ..self }
    }

    /// Adds the nearest known name as help, when there is one.
    #[must_use]
    pub(super) fn with_nearest(self, nearest: Option<&str>) -> Problem {
        let help = nearest.map(|name| ["did you mean `", name, "`?"].concat());
        Problem { help: help.or(self.help), ..self }
    }
}

impl fmt::Display for Problem {
    /// `error at 3..5: message (help)`, on one line.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let severity = if self.severity == Severity::Error { "error" } else { "warning" };
        let help = self.help.as_ref().map(|help| [" (", help, ")"].concat());
        let (Range { start, end }, help) = (&self.span, help.unwrap_or_else(|| "".to_owned()));
        write!(f, "{severity} at {start}..{end}: {}{help}", self.message)
    }
}

impl core::error::Error for Problem {}
