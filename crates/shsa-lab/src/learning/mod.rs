//! Relations between signals, found in a recording.
//!
//! `signals (at the moments of each) -> copies -> pairs -> products, sums, gears -> choice (few relations, none of which follows
//! from others)`. Constants are fitted to the first half of the time; forms compete on the next fifth; the rest gives the error
//! of each relation. Simple forms are preferred, and units must match.

mod sessions;
mod signal;
mod least_squares;
mod shape;
mod regressors;
mod saturation;
mod form;
mod rounded;
mod copies;
mod lag;
mod pairs;
mod products;
mod gears;
mod sums;
mod rows;
mod terms;
mod tables;
mod choice;
mod formula;
#[cfg(test)]
mod tests;

pub(crate) use least_squares::solve;
pub(crate) use regressors::Regressors;

pub use formula::formula;
pub use shape::{Copied, Mode, Relation, Score, Shape};
pub use signal::Signal;

use crate::LabError;
use crate::campaign::parallel::{Progress, on_all_cores};
use pairs::Forms;
use signal::Seen;

/// The largest share of its target that a relation may leave unexplained.
const MOST_UNEXPLAINED: f64 = 0.1;

/// The share of the error of a simpler form that a more complex form may leave at most.
const WORTH: f64 = 0.75;

/// The share of the error of a parabola in time that a relation may leave at most: two signals that drift are not related.
const BEATS_TIME: f64 = 0.5;

/// The relations of a recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Learned {
    /// Signals that are computed from another one.
    pub copies: Vec<Copied>,
    /// Relations, none of which follows from others.
    pub relations: Vec<Relation>,
}

/// Finds relations, and reports the progress. Equal signals give equal relations. Time: O(signals^3) in products, with bounded moments
/// each; on all cores.
///
/// # Errors
/// When a thread panics.
pub fn learn(signals: &[Signal], progress: &dyn Progress) -> Result<Learned, LabError> {
    learn_sessions(signals, &[], progress)
}

/// As [`learn`], from sessions that meet at these times, in order: constants are fitted to the first half of each, and so on, so that
/// no session is one alone that a part has seen.
///
/// # Errors
/// As [`learn`].
pub fn learn_sessions(
    signals: &[Signal],
    joints: &[f64],
    progress: &dyn Progress,
) -> Result<Learned, LabError> {
    let seen = Seen::over(signals, joints);
    let (copies, own) = own(&seen);
    let mut choice = choice::Choice::new(signals.len());
    choice.take_pairs(pairs(&seen, &own, Forms::All, progress)?);
    let is_same = |one: usize, other: usize| choice.is_same(one, other);
    let of = |at: usize| {
        let mut found = products::of(&seen, &own, own[at]);
        found.extend(gears::of(&seen, &own, own[at]));
        found.extend(sums::of(&seen, &own, own[at], &is_same));
        found.extend(terms::of(&seen, &own, own[at], &is_same));
        found.extend(tables::of(&seen, &own, own[at], &is_same));
        found
    };
    let larger = on_all_cores(own.len(), None, progress, "signals, each as a function of others", of)?;
    choice.take_larger(larger.into_iter().flatten().collect());
    Ok(Learned { copies, relations: choice.relations() })
}

/// Finds copies, and delays, rates and integrals among the signals that may have one. Time: O(signals^2), with bounded moments
/// each.
pub(crate) fn learn_pairs(
    signals: &[Signal],
    joints: &[f64],
    may_relate: &dyn Fn(usize) -> bool,
    progress: &dyn Progress,
) -> Result<Learned, LabError> {
    let seen = Seen::over(signals, joints);
    let (copies, mut own) = own(&seen);
    own.retain(|signal| may_relate(*signal));
    let mut choice = choice::Choice::new(signals.len());
    choice.take_pairs(pairs(&seen, &own, Forms::Motion, progress)?);
    Ok(Learned { copies, relations: choice.relations() })
}

/// The best relation of each pair of some signals.
fn pairs(
    seen: &Seen<'_>,
    signals: &[usize],
    forms: Forms,
    progress: &dyn Progress,
) -> Result<Vec<Relation>, LabError> {
    let later = |at: usize| {
        let others = signals.get(at + 1..).unwrap_or_default().iter();
        others.filter_map(move |other| pairs::of(seen, signals[at], *other, forms))
    };
    // One from the beginning has many others after it and one from the end has few: both together are steps of one size.
    let (count, steps) = (signals.len(), signals.len().div_ceil(2));
    let step = |at: usize| -> (Vec<Relation>, Vec<Relation>) {
        let last = count - 1 - at;
        (later(at).collect(), if last == at { Vec::new() } else { later(last).collect() })
    };
    let found = on_all_cores(steps, None, progress, "pairs of signals, each with all others", step)?;
    let (early, late): (Vec<_>, Vec<_>) = found.into_iter().unzip();
    Ok(early.into_iter().chain(late.into_iter().rev()).flatten().collect())
}

/// Signals that repeat another one.
pub(crate) fn copies_among(signals: &[Signal], joints: &[f64]) -> Vec<Copied> {
    copies::all(&Seen::over(signals, joints))
}

/// The best relation of two signals, if there is any.
pub(crate) fn between(signals: &[Signal; 2], joints: &[f64]) -> Option<Relation> {
    pairs::of(&Seen::over(signals, joints), 0, 1, Forms::Motion)
}

/// Copies, and the signals that move and are no copies.
fn own(seen: &Seen<'_>) -> (Vec<Copied>, Vec<usize>) {
    let copies = copies::all(seen);
    let moves = |signal: &usize| {
        let values = seen.curves[*signal].values();
        values.len() >= 30 && values.iter().any(|it| *it != values[0])
    };
    let is_own = |signal: &usize| copies.iter().all(|copy| copy.signal != *signal);
    let own = (0..seen.signals.len()).filter(is_own).filter(moves).collect();
    (copies, own)
}

/// What 99.9 % of the errors of each relation do not exceed, in the unit of the left side of its formula; over sessions that meet at
/// these times.
#[must_use]
pub fn tolerances(signals: &[Signal], joints: &[f64], relations: &[Relation]) -> Vec<f64> {
    let seen = Seen::over(signals, joints);
    relations.iter().map(|relation| form::tolerance(&seen, relation)).collect()
}

/// The unexplained share of a relation in another recording of the same signals, with its constants kept and its offset fitted
/// again; `None` where the recording has no values for it.
#[must_use]
pub fn share_elsewhere(signals: &[Signal], relation: &Relation) -> Option<f64> {
    form::share_elsewhere(&Seen::new(signals), relation)
}
