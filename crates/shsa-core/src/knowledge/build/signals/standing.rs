//! Reads whether the values of a signal stand and how far off they may be then, and when they have stood for too long.

use super::vectors_have_none;
use crate::knowledge::build::problems::Problems;
use crate::knowledge::build::quantity::{self, Kind};
use crate::knowledge::draft::{SignalDraft, Text};
use crate::knowledge::{Shape, Variable};
use crate::time::Span;
use crate::unit::Unit;
use alloc::format;

/// Whether the values of a signal stand, and by how much a value may be off before the signal is sent again: 0 where nothing bounds
/// that.
pub(super) fn holds(
    problems: &mut Problems,
    draft: &SignalDraft,
    unit: Option<&Unit>,
    variable: Option<&Variable>,
) -> Option<f64> {
    let text = draft.hold.as_ref().filter(|text| text.text != "false")?;
    if let Some(variable) = variable.filter(|variable| variable.shape == Shape::Vector) {
        vectors_have_none(problems, "hold", text, variable);
        return None;
    }
    if text.text == "true" {
        if draft.timeout.is_none() && variable.is_some_and(|it| it.max_rate.is_some()) && draft.rate.is_none()
        {
            let message =
                format!("the bounds of `{}` grow by `max_rate` until it is sent again", draft.name.text);
            let help = "where it is sent as soon as it has changed by a dead band, write that: `hold: 0.2 K`";
            problems.note(text, message, help);
        }
        return Some(0.0);
    }
    if !text.text.starts_with(|first: char| first.is_ascii_digit() || "+-.".contains(first)) {
        let message = format!("`{}` does not say whether a value stands until the next one", text.text);
        let help = "write `hold: true`, or the change at which the signal is sent again: `hold: 0.2 K`";
        problems.error(text, message, help);
        return None;
    }
    let dead_band = quantity::difference(problems, text, unit)?;
    if dead_band <= 0.0 {
        let help = "write the change at which the signal is sent again, or `hold: true`";
        problems.error(text, "a dead band is above 0", help);
        return None;
    }
    Some(dead_band)
}

/// Whether it only counts up.
pub(super) fn counts(problems: &mut Problems, draft: &SignalDraft, variable: Option<&Variable>) -> bool {
    let Some(text) = draft.counter.as_ref().filter(|text| text.text != "false") else { return false };
    if text.text != "true" {
        let message = format!("`{}` does not say whether `{}` only counts up", text.text, draft.name.text);
        let help = "write `counter: true`; at which number it runs over is the `wraps` of its variable";
        problems.error(text, message, help);
        return false;
    }
    if let Some(variable) = variable.filter(|variable| variable.shape == Shape::Vector) {
        vectors_have_none(problems, "counter", text, variable);
        return false;
    }
    true
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
