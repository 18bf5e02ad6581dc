//! Checks the common causes of faults that signals share.

use super::problems::Problems;
use super::quantity;
use super::signals::Shares;
use crate::knowledge::draft::Text;
use crate::knowledge::{CAUSE_PRIOR, Cause, CauseId, IdVec, PRIOR, SignalId};
use alloc::collections::BTreeMap;
use alloc::format;
use alloc::vec::Vec;

/// A cause as it is read so far.
struct Declared {
    /// The place that names the cause first.
    at: Text,
    signals: Vec<SignalId>,
    prior: Option<f64>,
}

/// Reads the common causes of signals. Time: O(n log n) in the names.
pub(super) fn build(problems: &mut Problems, shares: &IdVec<SignalId, Shares>) -> IdVec<CauseId, Cause> {
    let mut declared: Vec<Declared> = Vec::new();
    let mut places = BTreeMap::new();
    for (signal, shared) in shares.enumerate() {
        for (cause, prior) in shared {
            let place = *places.entry(cause.text.as_str()).or_insert_with(|| {
                declared.push(Declared { at: cause.clone(), signals: Vec::new(), prior: None });
                declared.len() - 1
            });
            if let Some(known) = declared.get_mut(place) {
                known.share(problems, signal, cause, prior.as_ref());
            }
        }
    }
    let mut causes = IdVec::new();
    for cause in declared {
        causes.push(cause.checked(problems));
    }
    causes
}

impl Declared {
    fn share(&mut self, problems: &mut Problems, signal: SignalId, at: &Text, prior: Option<&Text>) {
        if self.signals.contains(&signal) {
            return problems.error(at, format!("`{}` is given twice", at.text), "keep one");
        }
        self.signals.push(signal);
        let Some(text) = prior else { return };
        let Some(prior) = quantity::number(problems, text) else { return };
        if let Some(sense) = quantity::senseless(PRIOR, prior) {
            return problems.error(text, format!("`{}: {}` makes no sense", at.text, text.text), sense);
        }
        match self.prior {
            Some(before) if before.to_bits() != prior.to_bits() => {
                let message = format!("`{}` has the prior {before} elsewhere", at.text);
                problems.error(text, message, "write the same number everywhere");
            }
            _ => self.prior = Some(prior),
        }
    }

    fn checked(mut self, problems: &mut Problems) -> Cause {
        if self.signals.len() == 1 {
            let message = format!("only one signal shares `{}`", self.at.text);
            problems.warn(&self.at, message, "a common cause is shared by two signals or more");
        }
        self.signals.sort_unstable();
        Cause { name: self.at.text, signals: self.signals, prior: self.prior.unwrap_or(CAUSE_PRIOR) }
    }
}
