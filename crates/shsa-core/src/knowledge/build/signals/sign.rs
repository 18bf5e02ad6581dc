//! Notes the sign of lopsided errors: here an error is what is added to a reading, in metrology what was added by the sensor.

use super::super::problems::Problems;
use crate::knowledge::Signal;
use crate::knowledge::draft::{Bounds, SignalDraft};
use alloc::format;
use alloc::string::{String, ToString};

/// Which of the keys has been explained in this model: once is enough.
#[derive(Default)]
pub(super) struct Explained {
    value: bool,
    time: bool,
}

impl Explained {
    /// Notes the first lopsided error of values, and that of times.
    pub(super) fn note(&mut self, problems: &mut Problems, draft: &SignalDraft, signal: &Signal) {
        let (lowest, highest) = signal.time_error;
        let of_value = signal.value_error.lo != -signal.value_error.hi;
        let kinds = [
            ("value_error", "a reading", &draft.value_error, of_value, &mut self.value),
            ("time_error", "a time stamp", &draft.time_error, lowest != -highest, &mut self.time),
        ];
        for (key, what, bounds, is_lopsided, explained) in kinds {
            let Some(Bounds::Two(lo, hi)) = bounds.as_ref().filter(|_| is_lopsided && !*explained) else {
                continue;
            };
            *explained = true;
            let (low, high, name) = (&lo.text, &hi.text, &signal.name);
            let message = format!(
                "the lopsided `{key}` of `{name}` is added to {what}: the truth is {what} plus {low} to {high}"
            );
            let help = format!(
                "where {what} minus the truth is meant, as in metrology, write `{key}: [{}, {}]`",
                negated(high),
                negated(low)
            );
            problems.note(lo, message, help);
        }
    }
}

/// A written quantity with the other sign.
fn negated(text: &str) -> String {
    match text.strip_prefix('-') {
        Some(rest) => rest.trim_start().to_string(),
        None if text.trim_start_matches(['0', '.']).trim_start().chars().all(char::is_alphabetic) => {
            text.to_string()
        }
        None => format!("-{}", text.strip_prefix('+').unwrap_or(text)),
    }
}
