//! Relations between signals, found in a recording.
//!
//! `signals (at the moments of each) -> copies -> pairs -> products, sums, gears -> choice (few relations, none of which follows
//! from others)`. Constants are fitted to the first half of the time; forms compete on the next fifth; the rest gives the error
//! of each relation. Simple forms are preferred, and units must match.

mod signal;
mod least_squares;
mod shape;
mod regressors;
mod form;
mod copies;
mod lag;
mod pairs;
mod products;
mod gears;
mod sums;
mod terms;
mod choice;
mod formula;
#[cfg(test)]
mod tests;

pub(crate) use least_squares::solve;

pub use copies::Copied;
pub use shape::{Mode, Relation, Score, Shape};
pub use formula::formula;
pub use signal::Signal;

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

/// Finds relations. Equal signals give equal relations. Time: O(signals^3) in products, with bounded moments each.
#[must_use]
pub fn learn(signals: &[Signal]) -> Learned {
    let seen = Seen::new(signals);
    let (copies, own) = own(&seen);
    let mut choice = choice::Choice::new(signals.len());
    choice.take_pairs(pairs::all(&seen, &own));
    let is_same = |one: usize, other: usize| choice.is_same(one, other);
    let mut larger = products::all(&seen, &own);
    larger.extend(gears::all(&seen, &own));
    larger.extend(sums::all(&seen, &own, &is_same));
    larger.extend(terms::all(&seen, &own, &is_same));
    choice.take_larger(larger);
    Learned { copies, relations: choice.relations() }
}

/// Finds copies, and relations of two among the signals that may have one. Time: O(signals^2), with bounded moments each.
pub(crate) fn learn_pairs(signals: &[Signal], may_relate: &dyn Fn(usize) -> bool) -> Learned {
    let seen = Seen::new(signals);
    let (copies, mut own) = own(&seen);
    own.retain(|signal| may_relate(*signal));
    let mut choice = choice::Choice::new(signals.len());
    choice.take_pairs(pairs::all(&seen, &own));
    Learned { copies, relations: choice.relations() }
}

/// The best relation of two signals, if there is any.
pub(crate) fn between(signals: &[Signal; 2]) -> Option<Relation> {
    pairs::of(&Seen::new(signals), 0, 1)
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

/// What 99.9 % of the errors of a relation do not exceed, in the unit of the left side of its formula.
#[must_use]
pub fn tolerance(signals: &[Signal], relation: &Relation) -> f64 {
    form::tolerance(&Seen::new(signals), relation)
}

/// The unexplained share of a relation in another recording of the same signals, with its constants kept and its offset fitted
/// again; `None` where the recording has no values for it.
#[must_use]
pub fn share_elsewhere(signals: &[Signal], relation: &Relation) -> Option<f64> {
    form::share_elsewhere(&Seen::new(signals), relation)
}
