//! Reads whether the values of a signal stand, and when they have stood for too long.

use super::vectors_have_none;
use crate::knowledge::build::problems::Problems;
use crate::knowledge::build::quantity::{self, Kind};
use crate::knowledge::draft::{SignalDraft, Text};
use crate::knowledge::{Shape, Variable};
use crate::time::Span;
use crate::unit::Unit;
use alloc::format;

pub(super) fn holds(problems: &mut Problems, text: Option<&Text>, variable: Option<&Variable>) -> bool {
    let Some(text) = text else { return false };
    match (text.text.as_str(), variable) {
        ("false", _) => false,
        ("true", Some(variable)) if variable.shape == Shape::Vector => {
            vectors_have_none(problems, "hold", text, variable);
            false
        }
        ("true", _) => true,
        (other, _) => {
            let message = format!("`{other}` does not say whether a value stands until the next one");
            problems.error(text, message, "write `hold: true`, or leave it away");
            false
        }
    }
}

pub(super) fn frozen_after(problems: &mut Problems, text: Option<&Text>) -> Option<Span> {
    let text = text.filter(|text| text.text != "none")?;
    let read = quantity::span(problems, text)?;
    if read == Span::ZERO {
        problems.error(text, "a signal that may never say the same twice", "write a time, or leave it away");
        return None;
    }
    Some(read)
}

pub(super) fn rests_for(problems: &mut Problems, draft: &SignalDraft) -> Option<Span> {
    let text = draft.rests_for.as_ref().filter(|text| text.text != "none")?;
    if draft.rests_at.is_none() {
        problems.error(
            text,
            "`rests_for` says for how long, and not where",
            "add a `rests_at`, or leave it away",
        );
    }
    quantity::span(problems, text)
}

pub(super) fn rests_at(
    problems: &mut Problems,
    draft: &SignalDraft,
    unit: Option<&Unit>,
    variable: Option<&Variable>,
) -> Option<f64> {
    let text = draft.rests_at.as_ref()?;
    if let Some(variable) = variable.filter(|variable| variable.shape == Shape::Vector) {
        vectors_have_none(problems, "rests_at", text, variable);
        return None;
    }
    if draft.frozen_after.as_ref().is_none_or(|limit| limit.text == "none") {
        problems.warn(
            text,
            "`rests_at` is the exception of a rule that is not there",
            "give a `frozen_after`, or leave it away",
        );
    }
    quantity::quantity(problems, text, unit, Kind::Value)
}
