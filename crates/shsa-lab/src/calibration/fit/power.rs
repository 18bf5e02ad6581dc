//! Whether the fitted model still detects what the model as it is detects: by how wide both leave what they compare.

use super::exact::Gains;
use super::found::{Calibration, PairFit};
use super::{Fit, Problem, Trial, edit};
use crate::calibration::comparison::{Comparison, Watched};
use crate::calibration::poisson::fewest_expected;
use crate::calibration::session::Session;
use crate::order::median;
use shsa_core::knowledge::Draft;

/// A pair that is left open by more than this many times as much is lost: honest errors of a fit widen a model by less.
const LOST: f64 = 4.0;

/// Half of what two ways leave open, in SI: differences beyond it contradict. 0 where they are never compared.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Open {
    /// With the model as it is.
    pub now: f64,
    /// With the fitted model.
    pub then: f64,
}

impl Open {
    fn is_lost(self) -> bool {
        self.then > LOST * self.now
    }

    fn is_gained(self) -> bool {
        self.now > LOST * self.then
    }
}

/// Notes for each pair how wide its errors are in the fitted model, and what both models leave open.
pub(super) fn tell_pairs(
    fit: &mut Fit<'_>,
    draft: &Draft,
    chosen: &Trial,
    gains: &Gains,
) -> Result<(), Problem> {
    let (now, then) = (open(fit, fit.draft)?, open(fit, draft)?);
    let open = now.into_iter().zip(then).map(|(now, then)| Open { now, then });
    for ((pair, gains), open) in fit.pairs.iter_mut().zip(gains).zip(open) {
        let given = gains.iter().filter_map(|(at, gain)| Some(gain * chosen.errors[*at]?));
        (pair.given, pair.open) = (given.sum(), open);
    }
    Ok(())
}

/// The alarms of a model about healthy recordings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unfaulted {
    /// Their number.
    pub alarms: usize,
    /// The length of the recordings in hours.
    pub hours: f64,
}

/// What each pair leaves open with a model, over all that is fitted.
pub(super) fn open(fit: &Fit<'_>, draft: &Draft) -> Result<Vec<f64>, Problem> {
    let knowledge = edit::built(&edit::ungated(draft.clone()))?;
    let stretches = fit.sessions.iter().flat_map(Session::stretches).map(Vec::as_slice);
    let watched = Watched::over(&knowledge, fit.ways, stretches);
    let half = |all: &Vec<Comparison>| match all.is_empty() {
        true => 0.0,
        false => 0.5 * median(all.iter().map(|it| it.width)),
    };
    Ok(watched.comparisons.iter().map(half).collect())
}

/// The time of sessions in hours.
pub(super) fn hours(sessions: &[Session]) -> f64 {
    sessions.iter().map(|it| it.duration().seconds()).sum::<f64>() / 3600.0
}

impl Calibration {
    /// Why the model should stay as it is, which keeps the promise, too, and detects more; `None` where the fit is better.
    #[must_use]
    pub fn blindness(&self) -> Option<String> {
        let alarms = self.before.alarms + self.before_fitted.alarms;
        let hours = (self.unseen_hours + self.before_fitted.hours).max(1e-9);
        if fewest_expected(alarms) / hours > self.promise.alarms_per_hour {
            return None;
        }
        let compared: Vec<Open> =
            self.pairs.iter().filter(|pair| pair.compared.0 > 0).map(|pair| pair.open).collect();
        let lost = lost(&compared)?;
        Some(format!(
            "the fitted model detects much less, and the model as it is keeps the promise, too, with {alarms} alarms in {hours:.2} h: \
             of {} pairs that are compared, {lost} contradict only beyond more than {LOST} times as much",
            compared.len()
        ))
    }
}

/// The number of pairs that are lost; `None` where no more are lost than gained.
fn lost(pairs: &[Open]) -> Option<usize> {
    let lost = pairs.iter().filter(|it| it.is_lost()).count();
    let gained = pairs.iter().filter(|it| it.is_gained()).count();
    (lost > gained).then_some(lost)
}

impl PairFit {
    /// Whether its two ways contradict only where they are apart by more than a range of values, in SI.
    #[must_use]
    pub fn never_contradicts(&self, range: f64) -> bool {
        self.compared.0 > 0 && range > 0.0 && self.open.then >= range
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn much_wider_is_lost_unless_as_much_is_gained(
            pairs in prop::collection::vec((1e-3..1e3_f64, 0.3..3.0_f64), 0..6), lost_by in 4.1..1e3_f64,
        ) {
            let near = |(now, by): &(f64, f64)| Open { now: *now, then: now * by };
            let mut all: Vec<Open> = pairs.iter().map(near).collect();
            prop_assert_eq!(lost(&all), None);
            all.push(Open { now: 2.0, then: 2.0 * lost_by });
            prop_assert_eq!(lost(&all), Some(1));
            all.push(Open { now: 2.0 * lost_by, then: 2.0 });
            prop_assert_eq!(lost(&all), None);
        }
    }
}
