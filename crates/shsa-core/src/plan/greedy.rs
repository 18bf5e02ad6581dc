//! A substitution that is found quickly, for an exact search that a limit ends before its first answer.

use super::subproblem::{ChoiceId, Place, Subproblem};
use super::utility::Weight;
use crate::knowledge::IdVec;
use alloc::collections::BinaryHeap;
use core::cmp::Reverse;

/// The choice of each place that is best if nothing is shared. These choices never form a cycle, since the inputs of each are
/// known before it.
///
/// Knuth's generalisation of Dijkstra's algorithm (1977, doi:10.1016/0020-0190(77)90002-3). Complexity: O(s log s) for s inputs
/// of the subproblem.
pub(super) fn choices(subproblem: &Subproblem) -> IdVec<Place, Option<ChoiceId>> {
    let users = subproblem.users();
    let outputs = subproblem.outputs();
    let mut chosen = IdVec::filled(subproblem.len(), |_| None);
    let mut missing = IdVec::filled(subproblem.count(), |choice| subproblem.inputs(choice).len());
    let mut weights: IdVec<ChoiceId, Weight> =
        IdVec::filled(subproblem.count(), |choice| subproblem.choice(choice).weight);
    let ready = missing.ids().filter(|&choice| missing[choice] == 0);
    let mut queue: BinaryHeap<_> = ready.map(|choice| Reverse((weights[choice], choice))).collect();
    while let Some(Reverse((weight, choice))) = queue.pop() {
        let place = outputs[choice];
        if chosen[place].is_some() {
            continue;
        }
        chosen[place] = Some(choice);
        for &user in users.row(place) {
            weights[user] = subproblem.scale().join(weights[user], weight);
            missing[user] -= 1;
            if missing[user] == 0 {
                queue.push(Reverse((weights[user], user)));
            }
        }
    }
    chosen
}
