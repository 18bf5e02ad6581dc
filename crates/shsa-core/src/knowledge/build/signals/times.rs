//! Reads the times of a signal: of silence, of a mean, of arrival.

use super::vectors_have_none;
use crate::knowledge::build::problems::Problems;
use crate::knowledge::build::quantity;
use crate::knowledge::draft::{SignalDraft, Text};
use crate::knowledge::signal::usual_timeout;
use crate::knowledge::{Shape, Variable};
use crate::time::Span;

pub(super) fn timeout(problems: &mut Problems, text: Option<&Text>, rate_hz: Option<f64>) -> Option<Span> {
    let usual = rate_hz.map(usual_timeout);
    match text {
        None => usual,
        Some(text) if text.text == "none" => None,
        Some(text) => match quantity::span(problems, text) {
            Some(Span::ZERO) => {
                problems.error(text, "a signal that may never be silent", "write a time, or `timeout: none`");
                usual
            }
            read => read.or(usual),
        },
    }
}

pub(super) fn mean_over(
    problems: &mut Problems,
    draft: &SignalDraft,
    variable: Option<&Variable>,
) -> Option<Span> {
    let text = draft.mean_over.as_ref()?;
    match variable {
        Some(variable) if variable.shape == Shape::Vector => {
            vectors_have_none(problems, "mean_over", text, variable);
            None
        }
        _ => quantity::span(problems, text),
    }
}

/// The declared delay, else the usual delay and the timeout together: after that, nothing waits for a value.
pub(super) fn max_delay(
    problems: &mut Problems,
    text: Option<&Text>,
    usual: Option<(Span, Span)>,
) -> Option<Span> {
    match text {
        None => usual.map(|(delay, timeout)| delay + timeout),
        Some(text) if text.text == "none" => None,
        Some(text) => quantity::span(problems, text),
    }
}
