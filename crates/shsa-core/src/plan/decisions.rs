//! The partial substitution of a search: decisions that can be made and taken back.

use super::subproblem::{ChoiceId, Place, SharedRelation, Subproblem};
use super::utility::Weight;
use crate::knowledge::{IdVec, RelationId};
use crate::substitution::Step;
use alloc::vec::Vec;

/// The state to restore when a decision is taken back.
#[derive(Clone, Copy, Debug)]
struct Frame {
    places: u32,
    bound: Weight,
    charged: Weight,
    choice: ChoiceId,
}

/// A place that needs another, in the list of the needed place.
#[derive(Clone, Copy, Debug)]
struct Link {
    above: Place,
    next: Option<u32>,
}

/// Decisions breadth first from the root: the needed places, in the order in which they were first needed; the first ones of them
/// are decided.
#[derive(Debug)]
pub(super) struct Decisions {
    places: Vec<Place>,
    frames: Vec<Frame>,
    chosen: IdVec<Place, Option<ChoiceId>>,
    needed: IdVec<Place, bool>,
    charged: IdVec<SharedRelation, Weight>,
    /// The decided weights, and the lower bounds of needed, undecided places.
    bound: Weight,
    links: Vec<Link>,
    /// The decided places that need each place; only where cycles are possible.
    above: IdVec<Place, Option<u32>>,
    /// The places that depend on the next place, including itself.
    over: IdVec<Place, bool>,
    over_list: Vec<Place>,
}

impl Decisions {
    /// The decisions before the first one.
    pub(super) fn new(subproblem: &Subproblem) -> Decisions {
        let cyclic = if subproblem.is_cyclic() { subproblem.len() } else { 0 };
        let mut decisions = Decisions {
            places: Vec::with_capacity(subproblem.len().min(64)),
            frames: Vec::with_capacity(subproblem.len().min(64)),
            chosen: IdVec::filled(subproblem.len(), |_| None),
            needed: IdVec::filled(subproblem.len(), |_| false),
            charged: IdVec::filled(subproblem.shared_relations(), |_| Weight::ZERO),
            bound: Weight::ZERO,
            links: Vec::new(),
            above: IdVec::filled(cyclic, |_| None),
            over: IdVec::filled(cyclic, |_| false),
            over_list: Vec::new(),
        };
        if let Some(root) = subproblem.root() {
            decisions.places.push(root);
            decisions.needed[root] = true;
            decisions.bound = subproblem.lower_bound(root);
        }
        decisions
    }

    /// The next place to decide; `None` when all are decided.
    pub(super) fn next(&self) -> Option<Place> {
        self.places.get(self.frames.len()).copied()
    }

    /// A lower bound of the weight of completions; for a complete substitution its weight.
    pub(super) fn bound(&self) -> Weight {
        self.bound
    }

    /// The decisions, breadth first from the root.
    pub(super) fn decisions(&self) -> Vec<ChoiceId> {
        self.frames.iter().map(|frame| frame.choice).collect()
    }

    /// What [`Decisions::bound`] would be after a decision for the next place.
    pub(super) fn bound_after(&self, subproblem: &Subproblem, place: Place, choice: ChoiceId) -> Weight {
        let new = subproblem.inputs(choice).iter().filter(|&&input| !self.needed[input]);
        let lower_bounds = new.map(|&input| subproblem.lower_bound(input));
        let scale = subproblem.scale();
        let rest = scale.without(self.bound, subproblem.lower_bound(place));
        lower_bounds.fold(scale.join(rest, self.extra(subproblem, choice)), |all, lower_bound| {
            scale.join(all, lower_bound)
        })
    }

    /// The additional weight of a choice: a relation that is used for a second output counts once, with its worse rating.
    fn extra(&self, subproblem: &Subproblem, choice: ChoiceId) -> Weight {
        let weight = subproblem.choice(choice).weight;
        subproblem
            .shared_relation(choice)
            .map_or(weight, |shared_relation| subproblem.scale().extra(weight, self.charged[shared_relation]))
    }

    /// Decides the next place.
    pub(super) fn take(&mut self, subproblem: &Subproblem, choice: ChoiceId) {
        let Some(place) = self.next() else { return };
        let shared_relation = subproblem.shared_relation(choice);
        self.frames.push(Frame {
            places: self.places.len() as u32,
            bound: self.bound,
            charged: shared_relation.map_or(Weight::ZERO, |shared_relation| self.charged[shared_relation]),
            choice,
        });
        self.bound = self.bound_after(subproblem, place, choice);
        if let Some(shared_relation) = shared_relation {
            self.charged[shared_relation] =
                self.charged[shared_relation].max(subproblem.choice(choice).weight);
        }
        self.chosen[place] = Some(choice);
        for &input in subproblem.inputs(choice) {
            if !core::mem::replace(&mut self.needed[input], true) {
                self.places.push(input);
            }
            if subproblem.is_cyclic() {
                let next = self.above[input].replace(self.links.len() as u32);
                self.links.push(Link { above: place, next });
            }
        }
    }

    /// Takes back the last decision.
    pub(super) fn back(&mut self, subproblem: &Subproblem) {
        let Some(frame) = self.frames.pop() else { return };
        for place in self.places.drain(frame.places as usize..) {
            self.needed[place] = false;
        }
        if let Some(place) = self.next() {
            self.chosen[place] = None;
        }
        if let Some(shared_relation) = subproblem.shared_relation(frame.choice) {
            self.charged[shared_relation] = frame.charged;
        }
        if subproblem.is_cyclic() {
            for &input in subproblem.inputs(frame.choice).iter().rev() {
                self.above[input] = self.links.pop().and_then(|link| link.next);
            }
        }
        self.bound = frame.bound;
    }

    /// Marks all places that depend on `place`, for [`Decisions::closes_cycle`].
    pub(super) fn look_up_from(&mut self, subproblem: &Subproblem, place: Place) {
        if !subproblem.is_cyclic() {
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

    /// Whether a choice needs a place that depends on the place of [`Decisions::look_up_from`].
    pub(super) fn closes_cycle(&self, subproblem: &Subproblem, choice: ChoiceId) -> bool {
        subproblem.is_cyclic() && subproblem.inputs(choice).iter().any(|&input| self.over[input])
    }

    /// The used relations, ascending, if another assignment of outputs could use the same ones.
    pub(super) fn ambiguous_relations(&self, subproblem: &Subproblem) -> Option<Vec<RelationId>> {
        let relations = || self.frames.iter().filter_map(|frame| subproblem.choice(frame.choice).relation);
        if !relations().any(|relation| subproblem.is_ambiguous(relation)) {
            return None;
        }
        let mut relations: Vec<_> = relations().collect();
        relations.sort_unstable();
        relations.dedup();
        Some(relations)
    }

    /// The steps of complete decisions: a depth-first walk that lists a step after those that it reads.
    pub(super) fn steps(&self, subproblem: &Subproblem) -> Vec<Step> {
        let mut steps = Vec::with_capacity(self.frames.len());
        let mut done = IdVec::filled(subproblem.len(), |_: Place| false);
        let mut stack: Vec<(Place, Option<ChoiceId>, usize)> = Vec::with_capacity(16);
        stack.extend(subproblem.root().map(|root| (root, self.chosen[root], 0)));
        while let Some((place, choice, at)) = stack.pop() {
            let Some(choice) = choice else { continue };
            if let Some(&input) = subproblem.inputs(choice).get(at) {
                stack.push((place, Some(choice), at + 1));
                if !done[input] {
                    stack.push((input, self.chosen[input], 0));
                }
                continue;
            }
            let step = |relation| Step { relation, output: subproblem.variable(place) };
            if !core::mem::replace(&mut done[place], true) {
                steps.extend(subproblem.choice(choice).relation.map(step));
            }
        }
        steps
    }
}
