//! The partial substitution that a search stands at: decisions that can be taken and taken back.

use super::scope::{ChoiceId, Place, Scope, Team};
use super::utility::Weight;
use crate::knowledge::{IdVec, RelationId};
use crate::substitution::Step;
use alloc::vec::Vec;

/// What to restore when a decision is taken back.
#[derive(Clone, Copy, Debug)]
struct Frame {
    places: u32,
    bound: Weight,
    charged: Weight,
    choice: ChoiceId,
}

/// A place that needs another, in a list that belongs to the other.
#[derive(Clone, Copy, Debug)]
struct Link {
    above: Place,
    next: Option<u32>,
}

/// Decisions from the root on, breadth first: the places that are needed, in the order in which they were first
/// needed, of which the first ones are decided.
#[derive(Debug)]
pub(super) struct Trail {
    places: Vec<Place>,
    frames: Vec<Frame>,
    chosen: IdVec<Place, Option<ChoiceId>>,
    needed: IdVec<Place, bool>,
    charged: IdVec<Team, Weight>,
    /// Decided weights, and hopes of what is needed but undecided.
    bound: Weight,
    links: Vec<Link>,
    /// The decided places that need each place; kept only where cycles are possible.
    above: IdVec<Place, Option<u32>>,
    /// The places that the next place is needed for, itself among them.
    over: IdVec<Place, bool>,
    over_list: Vec<Place>,
}

impl Trail {
    /// Before the first decision.
    pub(super) fn new(scope: &Scope) -> Trail {
        let cyclic = if scope.is_cyclic() { scope.len() } else { 0 };
        let mut trail = Trail {
            places: Vec::with_capacity(scope.len().min(64)),
            frames: Vec::with_capacity(scope.len().min(64)),
            chosen: IdVec::filled(scope.len(), |_| None),
            needed: IdVec::filled(scope.len(), |_| false),
            charged: IdVec::filled(scope.teams(), |_| Weight::ZERO),
            bound: Weight::ZERO,
            links: Vec::new(),
            above: IdVec::filled(cyclic, |_| None),
            over: IdVec::filled(cyclic, |_| false),
            over_list: Vec::new(),
        };
        if let Some(root) = scope.root() {
            trail.places.push(root);
            trail.needed[root] = true;
            trail.bound = scope.hope(root);
        }
        trail
    }

    /// What is to be decided next; `None` when nothing is.
    pub(super) fn next(&self) -> Option<Place> {
        self.places.get(self.frames.len()).copied()
    }

    /// No completion weighs less. Of a complete substitution it is the weight.
    pub(super) fn bound(&self) -> Weight {
        self.bound
    }

    /// The decisions, breadth first from the root.
    pub(super) fn decisions(&self) -> Vec<ChoiceId> {
        self.frames.iter().map(|frame| frame.choice).collect()
    }

    /// What [`Trail::bound`] would be after a decision for the next place.
    pub(super) fn bound_after(&self, scope: &Scope, place: Place, choice: ChoiceId) -> Weight {
        let new = scope.inputs(choice).iter().filter(|&&input| !self.needed[input]);
        let hopes = new.map(|&input| scope.hope(input));
        let scale = scope.scale();
        let rest = scale.without(self.bound, scope.hope(place));
        hopes.fold(scale.join(rest, self.extra(scope, choice)), |all, hope| scale.join(all, hope))
    }

    /// What a choice adds: a relation that is used for a second output counts once, with its worse rating.
    fn extra(&self, scope: &Scope, choice: ChoiceId) -> Weight {
        let weight = scope.choice(choice).weight;
        scope.team(choice).map_or(weight, |team| scope.scale().extra(weight, self.charged[team]))
    }

    /// Decides the next place.
    pub(super) fn take(&mut self, scope: &Scope, choice: ChoiceId) {
        let Some(place) = self.next() else { return };
        let team = scope.team(choice);
        self.frames.push(Frame {
            places: self.places.len() as u32,
            bound: self.bound,
            charged: team.map_or(Weight::ZERO, |team| self.charged[team]),
            choice,
        });
        self.bound = self.bound_after(scope, place, choice);
        if let Some(team) = team {
            self.charged[team] = self.charged[team].max(scope.choice(choice).weight);
        }
        self.chosen[place] = Some(choice);
        for &input in scope.inputs(choice) {
            if !core::mem::replace(&mut self.needed[input], true) {
                self.places.push(input);
            }
            if scope.is_cyclic() {
                let next = self.above[input].replace(self.links.len() as u32);
                self.links.push(Link { above: place, next });
            }
        }
    }

    /// Takes back the last decision.
    pub(super) fn back(&mut self, scope: &Scope) {
        let Some(frame) = self.frames.pop() else { return };
        for place in self.places.drain(frame.places as usize..) {
            self.needed[place] = false;
        }
        if let Some(place) = self.next() {
            self.chosen[place] = None;
        }
        if let Some(team) = scope.team(frame.choice) {
            self.charged[team] = frame.charged;
        }
        if scope.is_cyclic() {
            for &input in scope.inputs(frame.choice).iter().rev() {
                self.above[input] = self.links.pop().and_then(|link| link.next);
            }
        }
        self.bound = frame.bound;
    }

    /// Marks everything that `place` is needed for, so that [`Trail::closes_cycle`] can tell.
    pub(super) fn look_up_from(&mut self, scope: &Scope, place: Place) {
        if !scope.is_cyclic() {
            return;
        }
        for marked in self.over_list.drain(..) {
            self.over[marked] = false;
        }
        self.over[place] = true;
        self.over_list.push(place);
        let mut next = 0;
        while let Some(&place) = self.over_list.get(next) {
            let mut link = self.above[place];
            while let Some(&Link { above, next }) = link.and_then(|at| self.links.get(at as usize)) {
                if !core::mem::replace(&mut self.over[above], true) {
                    self.over_list.push(above);
                }
                link = next;
            }
            next += 1;
        }
    }

    /// Whether a choice needs something that the place which was looked up from is needed for.
    pub(super) fn closes_cycle(&self, scope: &Scope, choice: ChoiceId) -> bool {
        scope.is_cyclic() && scope.inputs(choice).iter().any(|&input| self.over[input])
    }

    /// The relations in use, ascending, if another assignment of outputs could use the same ones.
    pub(super) fn ambiguous_relations(&self, scope: &Scope) -> Option<Vec<RelationId>> {
        let relations = || self.frames.iter().filter_map(|frame| scope.choice(frame.choice).relation);
        if !relations().any(|relation| scope.is_ambiguous(relation)) {
            return None;
        }
        let mut relations: Vec<_> = relations().collect();
        relations.sort_unstable();
        relations.dedup();
        Some(relations)
    }

    /// The steps of the substitution, once everything is decided: a depth-first walk that lists a step after all that
    /// it reads.
    pub(super) fn steps(&self, scope: &Scope) -> Vec<Step> {
        let mut steps = Vec::with_capacity(self.frames.len());
        let mut done = IdVec::filled(scope.len(), |_: Place| false);
        let mut stack: Vec<(Place, Option<ChoiceId>, usize)> = Vec::with_capacity(16);
        stack.extend(scope.root().map(|root| (root, self.chosen[root], 0)));
        while let Some((place, choice, at)) = stack.pop() {
            let Some(choice) = choice else { continue };
            if let Some(&input) = scope.inputs(choice).get(at) {
                stack.push((place, Some(choice), at + 1));
                if !done[input] {
                    stack.push((input, self.chosen[input], 0));
                }
                continue;
            }
            let step = |relation| Step { relation, output: scope.variable(place) };
            if !core::mem::replace(&mut done[place], true) {
                steps.extend(scope.choice(choice).relation.map(step));
            }
        }
        steps
    }
}
