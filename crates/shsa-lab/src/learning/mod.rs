//! Relations between signals, found in a recording.
//!
//! `signals (at the moments of each) -> copies -> pairs -> products, sums, gears -> choice (few, none of which says what others
//! do)`. Numbers are fitted to the first half of the time; forms compete on the next fifth; the rest tells how wrong each is.
//! Simple forms come first, and units have to come out.

mod signal;
mod least_squares;
mod form;
mod copies;
mod lag;
mod pairs;
mod products;
mod gears;
mod sums;
mod choice;
mod formula;
#[cfg(test)]
mod tests;

pub use copies::Copied;
pub use form::{Relation, Score, Shape};
pub use formula::formula;
pub use signal::Signal;

use signal::Seen;

/// No relation leaves more than this share of what its target does.
const MOST_UNEXPLAINED: f64 = 0.1;

/// A more complex form has to leave no more than this share of what a simpler one leaves.
const WORTH: f64 = 0.75;

/// A relation has to leave no more than this share of what a parabola of time leaves: two that drift are not related.
const BEATS_TIME: f64 = 0.5;

/// What was found in a recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Learned {
    /// Signals that are computed from another.
    pub copies: Vec<Copied>,
    /// Relations, none of which follows from others.
    pub relations: Vec<Relation>,
}

/// Finds relations. The same signals give the same relations. Time: O(signals^3) in products, with bounded moments each.
#[must_use]
pub fn learn(signals: &[Signal]) -> Learned {
    let seen = Seen::new(signals);
    let copies = copies::all(&seen);
    let moves = |signal: &usize| {
        let values = seen.curves[*signal].values();
        values.len() >= 30 && values.iter().any(|it| *it != values[0])
    };
    let own: Vec<usize> = (0..signals.len())
        .filter(|signal| copies.iter().all(|copy| copy.signal != *signal))
        .filter(moves)
        .collect();
    let mut pairs = Vec::new();
    for (at, &one) in own.iter().enumerate() {
        pairs.extend(own[at + 1..].iter().filter_map(|other| pairs::of(&seen, one, *other)));
    }
    let mut choice = choice::Choice::new(signals.len());
    choice.take_pairs(pairs);
    let is_same = |one: usize, other: usize| choice.is_same(one, other);
    let mut larger = products::all(&seen, &own);
    larger.extend(gears::all(&seen, &own));
    larger.extend(sums::all(&seen, &own, &is_same));
    choice.take_larger(larger);
    Learned { copies, relations: choice.relations() }
}

/// What a relation leaves unexplained of another recording of the same signals, with its numbers kept and its offset freed;
/// `None` where the recording says nothing about it.
#[must_use]
pub fn share_elsewhere(signals: &[Signal], relation: &Relation) -> Option<f64> {
    form::share_elsewhere(&Seen::new(signals), relation)
}
