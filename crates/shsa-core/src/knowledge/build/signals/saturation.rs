//! Reads between which readings a signal measures, and what its readings beyond say.

use super::possible;
use crate::interval::Interval;
use crate::knowledge::build::problems::Problems;
use crate::knowledge::draft::SignalDraft;
use crate::knowledge::{Saturation, Variable};
use crate::unit::Unit;
use alloc::format;

pub(super) fn saturation(
    problems: &mut Problems,
    draft: &SignalDraft,
    unit: Option<&Unit>,
    variable: Option<&Variable>,
) -> Option<Saturation> {
    let (lo, hi) = draft.saturates.as_ref()?;
    let variable = variable?;
    if variable.wraps.is_some() {
        let message = format!("`{}` goes round: there is nothing beyond a reading", variable.name);
        problems.error(lo, message, "leave `saturates` away");
        return None;
    }
    let ends = possible(problems, &(lo.clone(), hi.clone()), unit)?;
    if !ends.lo().is_finite() && !ends.hi().is_finite() {
        problems.error(
            lo,
            "this signal saturates nowhere",
            "write the reading at which it does, or leave it away",
        );
        return None;
    }
    let range = variable.range.unwrap_or(Interval::ENTIRE);
    let open = [(lo, ends.lo(), range.lo()), (hi, ends.hi(), range.hi())];
    for (text, end, possible) in open {
        if end.is_finite() && !possible.is_finite() {
            let message = format!("how far `{}` can be beyond this reading is not known", variable.name);
            problems.error(
                text,
                message,
                "give the variable a `range`: readings here say that the value is between",
            );
            return None;
        }
        if end.is_finite() && !range.contains(end) {
            let message = format!("this reading is outside of the `range` of `{}`", variable.name);
            problems.error(text, message, "a reading that saturates leaves a part of the range open");
            return None;
        }
    }
    let beyond = Interval::new(
        if ends.lo().is_finite() { range.lo() } else { ends.lo() },
        if ends.hi().is_finite() { range.hi() } else { ends.hi() },
    );
    Some(Saturation { ends, beyond })
}
