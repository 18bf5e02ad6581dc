//! The error of a difference of two readings: a quantity, and one for each time between them.

use crate::expression::parse_quantity;
use crate::knowledge::ChangeError;
use crate::knowledge::build::problems::Problems;
use crate::knowledge::build::quantity::{self, Kind};
use crate::knowledge::draft::{SignalDraft, Text};
use crate::unit::Unit;
use alloc::format;
use alloc::string::ToString;

/// Reads `0.3`, `0.3 hPa`, `1 hPa/h`, or a sum of an amount and a drift.
pub(super) fn change_error(
    problems: &mut Problems,
    draft: &SignalDraft,
    unit: Option<&Unit>,
) -> Option<ChangeError> {
    let text = draft.change_error.as_ref()?;
    let a_second = unit.and_then(|unit| Unit::parse(&format!("{unit}/s")).ok());
    let (first, second) = match text.text.rsplit_once('+') {
        Some((first, second)) if parse_quantity(&text.text).is_err() => (first, Some(second)),
        _ => (text.text.as_str(), None),
    };
    let (mut most, mut drift) = (0.0, 0.0);
    for part in [Some(first), second].into_iter().flatten() {
        let part = Text { text: part.trim().to_string(), place: text.place };
        let own = parse_quantity(&part.text).ok().and_then(|read| read.unit);
        let is_drift = own.zip(a_second.as_ref()).is_some_and(|(own, rate)| own.dimension == rate.dimension);
        match is_drift {
            true => drift += quantity::quantity(problems, &part, a_second.as_ref(), Kind::Difference)?,
            false => most += quantity::difference(problems, &part, unit)?,
        }
    }
    if most < 0.0 || drift < 0.0 {
        let help = "write `0.3 hPa`, or with a drift `0.3 hPa + 1 hPa/h`";
        problems.error(text, format!("`{}` is no error of a difference", text.text), help);
        return None;
    }
    if draft.value_error.is_none() {
        let message = "`change_error` is the part of `value_error` in which two readings differ";
        problems.error(text, message, "give the `value_error`, of which most is an offset");
        return None;
    }
    Some(ChangeError { most, drift })
}
