//! The combinations of choices in a step of [`property_guided`](super::property_guided()), each made from a lighter one.

use super::choices::Choice;
use super::utility::{Scale, Weight};
use alloc::sync::Arc;
use alloc::vec::Vec;

/// A variable of a step, counted from the first.
pub(super) type Position = u32;

/// The choices of all variables of a step; a combination takes one for each.
#[derive(Clone, Debug)]
pub(super) struct Round {
    scale: Scale,
    /// The choices of each position, lightest first.
    choices: Vec<Arc<[Choice]>>,
    /// The positions with several choices, in the order in which combinations leave the first one.
    turns: Vec<Position>,
}

impl Round {
    pub(super) fn new(scale: Scale, choices: Vec<Arc<[Choice]>>) -> Round {
        let mut round = Round { scale, choices, turns: Vec::new() };
        round.find_turns();
        round
    }

    pub(super) fn positions(&self) -> impl Iterator<Item = Position> + use<> {
        0..self.choices.len() as Position
    }

    pub(super) fn choice(&self, position: Position, index: u32) -> Option<Choice> {
        self.choices.get(position as usize)?.get(index as usize).copied()
    }

    /// A lower bound of the weight of a choice and those after it: for a maximum, a heavier choice may be without a relation.
    pub(super) fn least(&self, position: Position, index: u32) -> Weight {
        let choices = self.choices.get(position as usize).map_or(&[][..], |choices| choices);
        let after = choices.get(index as usize..).unwrap_or_default().iter().map(|choice| choice.least);
        let first = after.clone().next().unwrap_or(Weight::ZERO);
        if self.scale.is_additive() {
            first
        } else {
            after.fold(first, |all, one| self.scale.least(all, one))
        }
    }

    /// The weight of a combination with another choice at one position.
    fn exchanged(&self, weight: Weight, position: Position, old: u32, new: u32) -> Weight {
        let without = self.scale.without(weight, self.least(position, old));
        self.scale.join(without, self.least(position, new))
    }

    /// Orders the positions by the additional weight of the second choice. Among equals, a position comes first if its second
    /// choice is earlier in the file than its first. So each combination follows the combination that it is made from.
    fn find_turns(&mut self) {
        let mut turns: Vec<Position> =
            self.positions().filter(|&position| self.choice(position, 1).is_some()).collect();
        turns.sort_by_key(|&position| {
            let relation = |index| self.choice(position, index).map(|choice| choice.relation);
            let earlier = relation(1) < relation(0);
            let place = if earlier { position } else { Position::MAX - position };
            (self.scale.without(self.least(position, 1), self.least(position, 0)), !earlier, place)
        });
        self.turns = turns;
    }
}

/// A position where a combination does not take the first choice, with its choice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Change {
    pub(super) position: Position,
    pub(super) index: u32,
}

/// A following combination: its changes, its last turn, and its weight.
pub(super) type Following = (Vec<Change>, u32, Weight);

impl Round {
    /// The combinations after one of some changes and weight, which changed the position of `turn` last.
    pub(super) fn following(&self, changes: &[Change], turn: Option<u32>, weight: Weight) -> Vec<Following> {
        let last = turn.and_then(|turn| Some((turn, *self.turns.get(turn as usize)?)));
        if self.scale.is_additive() {
            self.following_by_turns(changes, last, weight)
        } else {
            self.following_anywhere(changes, turn, weight)
        }
    }

    /// A combination takes the next choice at its last changed position, or changes the next position, or changes the next
    /// position in place of the last one.
    fn following_by_turns(
        &self,
        changes: &[Change],
        last: Option<(u32, Position)>,
        weight: Weight,
    ) -> Vec<Following> {
        let mut following = Vec::new();
        let next = last.map_or(0, |(turn, _)| turn + 1);
        let next_position = self.turns.get(next as usize).copied();
        if let Some(position) = next_position {
            following.push((with(changes, position, 1), next, self.exchanged(weight, position, 0, 1)));
        }
        let Some((turn, position)) = last else { return following };
        let index = index_at(changes, position);
        if self.choice(position, index + 1).is_some() {
            let weight = self.exchanged(weight, position, index, index + 1);
            following.push((with(changes, position, index + 1), turn, weight));
        }
        if let (1, Some(next_position)) = (index, next_position) {
            let weight = self.exchanged(self.exchanged(weight, position, 1, 0), next_position, 0, 1);
            following.push((with(&with(changes, position, 0), next_position, 1), next, weight));
        }
        following
    }

    /// With a maximum, the first change is not known: a combination takes the next choice at any position from the last changed
    /// one on.
    fn following_anywhere(&self, changes: &[Change], turn: Option<u32>, weight: Weight) -> Vec<Following> {
        let turns = self.turns.iter().zip(0..).skip(turn.unwrap_or(0) as usize);
        let follows = turns.map(|(&position, turn)| (position, turn, index_at(changes, position)));
        let exist = follows.filter(|&(position, _, index)| self.choice(position, index + 1).is_some());
        let follow = exist.map(|(position, turn, index)| {
            let weight = self.exchanged(weight, position, index, index + 1);
            (with(changes, position, index + 1), turn, weight)
        });
        follow.collect()
    }
}

fn index_at(changes: &[Change], position: Position) -> u32 {
    changes.iter().find(|change| change.position == position).map_or(0, |change| change.index)
}

/// The changes, with the choice `index` at a position.
fn with(changes: &[Change], position: Position, index: u32) -> Vec<Change> {
    let mut changes = changes.to_vec();
    match (changes.binary_search_by_key(&position, |change| change.position), index) {
        (Ok(at), 0) => drop(changes.remove(at)),
        (Ok(at), index) => changes.get_mut(at).into_iter().for_each(|change| change.index = index),
        (Err(_), 0) => {}
        (Err(at), index) => changes.insert(at, Change { position, index }),
    }
    changes
}
