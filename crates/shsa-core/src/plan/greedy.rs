//! A substitution that is quickly found, for when a limit stops the exact search before its first answer.

use super::scope::{ChoiceId, Place, Scope};
use super::utility::Weight;
use crate::knowledge::IdVec;
use alloc::collections::BinaryHeap;
use core::cmp::Reverse;

/// The choice of each place that would be best if nothing could be shared; following them never closes a cycle,
/// since the inputs of each are known before it.
///
/// Knuth's generalisation of Dijkstra's algorithm (1977, doi:10.1016/0020-0190(77)90002-3). Complexity:
/// O(s log s) for s inputs of the scope.
pub(super) fn choices(scope: &Scope) -> IdVec<Place, Option<ChoiceId>> {
    let users = scope.users();
    let outputs = scope.outputs();
    let mut chosen = IdVec::filled(scope.len(), |_| None);
    let mut missing = IdVec::filled(scope.count(), |choice| scope.inputs(choice).len());
    let mut weights: IdVec<ChoiceId, Weight> =
        IdVec::filled(scope.count(), |choice| scope.choice(choice).weight);
    let ready = missing.ids().filter(|&choice| missing[choice] == 0);
    let mut queue: BinaryHeap<_> = ready.map(|choice| Reverse((weights[choice], choice))).collect();
    while let Some(Reverse((weight, choice))) = queue.pop() {
        let place = outputs[choice];
        if chosen[place].is_some() {
            continue;
        }
        chosen[place] = Some(choice);
        for &user in users.row(place) {
            weights[user] = scope.scale().join(weights[user], weight);
            missing[user] -= 1;
            if missing[user] == 0 {
                queue.push(Reverse((weights[user], user)));
            }
        }
    }
    chosen
}
