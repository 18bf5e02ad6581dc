//! The part of a graph that a search from one root can reach and use, renumbered densely, with lower bounds of weights.

mod visit;
mod compaction;
mod tree;

pub(super) use tree::Reading;
pub(super) use visit::{Marks, Rules};

use super::graph::View;
use super::utility::{Scale, Weight};
use crate::knowledge::{Id, IdVec, RelationId, VariableId};
use alloc::collections::BTreeMap;
use alloc::vec::Vec;
use compaction::Compaction;
use visit::Visit;

macro_rules! local_id {
    ($(#[$doc:meta] $name:ident)*) => {$(
        #[$doc]
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub(super) struct $name(u32);

        impl Id for $name {
            fn from_index(index: usize) -> Self {
                $name(index as u32)
            }
            fn index(self) -> usize {
                self.0 as usize
            }
        }
    )*};
}

local_id! {
    /// A variable that must be decided when a substitution needs it; the root is the first.
    Place
    /// One way of knowing the variable of a place.
    ChoiceId
    /// A relation that a substitution may use for several outputs, and that counts once then.
    SharedRelation
}

/// A relation above a place, or the place's own signals.
#[derive(Clone, Copy, Debug)]
pub(super) struct Choice {
    /// `None`: the variable is provided, and used as provided.
    pub(super) relation: Option<RelationId>,
    /// The weight, if the relation is not used already.
    pub(super) weight: Weight,
    /// The bounds of its inputs.
    inputs: (u32, u32),
}

/// A variable that must be decided.
#[derive(Clone, Copy, Debug)]
struct Node {
    /// A lower bound of the weight of knowing the variable, whatever else is known.
    lower_bound: Weight,
    variable: VariableId,
    /// The bounds of its choices.
    choices: (u32, u32),
    /// The best choice, where the lower bounds are exact.
    best: ChoiceId,
}

impl Node {
    /// The node before its choices are known.
    fn of(variable: VariableId) -> Node {
        Node { lower_bound: Weight::ZERO, variable, choices: (0, 0), best: ChoiceId(0) }
    }
}

/// The room for places and choices from the start.
const ROOM: usize = 64;

/// Places and choices; the root is the first place.
#[derive(Clone, Debug, Default)]
pub(super) struct Subproblem {
    scale: Scale,
    nodes: IdVec<Place, Node>,
    choices: IdVec<ChoiceId, Choice>,
    inputs: Vec<Place>,
    /// The shared relation of each choice, where one exists: its relation may be used for another output at the same time.
    shared_relations: IdVec<ChoiceId, Option<SharedRelation>>,
    shared_relation_count: usize,
    /// Relations that may produce another variable of the subproblem, ascending.
    ambiguous: Vec<RelationId>,
    tree: bool,
    cyclic: bool,
}

impl Subproblem {
    /// Finds the part that is reachable from `root` and useful. Complexity: O(size of that part).
    pub(super) fn find(&mut self, view: &View, root: VariableId, rules: Rules, marks: &mut Marks) {
        if !Visit::new(view, root, rules, marks, self, true).run() {
            Visit::new(view, root, rules, marks, self, false).run();
            // In a tree, the lower bounds tell which part is useful.
            self.drop_useless();
            self.cyclic = self.has_cycle();
        }
        self.find_shared_relations(view);
        if self.is_exact() { self.find_best() } else { self.find_lower_bounds() }
    }

    /// Clears everything, and keeps the room.
    fn clear(&mut self, scale: Scale) {
        let Subproblem { nodes, choices, inputs, shared_relations, ambiguous, .. } = self;
        nodes.clear();
        choices.clear();
        inputs.clear();
        shared_relations.clear();
        ambiguous.clear();
        nodes.reserve(ROOM);
        choices.reserve(ROOM);
        inputs.reserve(ROOM);
        (self.scale, self.shared_relation_count, self.tree, self.cyclic) = (scale, 0, true, false);
    }

    /// How weights are joined.
    pub(super) fn scale(&self) -> Scale {
        self.scale
    }

    /// The root; `None` when it cannot be provided.
    pub(super) fn root(&self) -> Option<Place> {
        self.nodes.ids().next().filter(|&root| !self.lower_bound(root).is_impossible())
    }

    /// The number of places.
    pub(super) fn len(&self) -> usize {
        self.nodes.len()
    }

    /// The number of choices.
    pub(super) fn count(&self) -> usize {
        self.choices.len()
    }

    /// The number of shared relations.
    pub(super) fn shared_relations(&self) -> usize {
        self.shared_relation_count
    }

    /// Whether some choices make a variable depend on itself.
    pub(super) fn is_cyclic(&self) -> bool {
        self.cyclic
    }

    /// Whether the best choices of all places together are the best substitution.
    pub(super) fn is_exact(&self) -> bool {
        self.tree && self.shared_relation_count == 0 && self.scale.is_additive()
    }

    /// All places, the root first.
    pub(super) fn places(&self) -> impl DoubleEndedIterator<Item = Place> + use<> {
        self.nodes.ids()
    }

    /// The variable of a place.
    pub(super) fn variable(&self, place: Place) -> VariableId {
        self.nodes[place].variable
    }

    /// A lower bound of the weight of knowing a place, whatever else is known.
    pub(super) fn lower_bound(&self, place: Place) -> Weight {
        self.nodes[place].lower_bound
    }

    /// The choices of a place: its own signals first, then relations in file order.
    pub(super) fn choices(&self, place: Place) -> impl DoubleEndedIterator<Item = ChoiceId> + use<> {
        let (start, end) = self.nodes[place].choices;
        (start..end).map(ChoiceId)
    }

    /// The choice of an id.
    pub(super) fn choice(&self, choice: ChoiceId) -> &Choice {
        &self.choices[choice]
    }

    /// The shared relation of a choice, where its relation may be used for another output at the same time.
    pub(super) fn shared_relation(&self, choice: ChoiceId) -> Option<SharedRelation> {
        self.shared_relations.find(choice).copied().flatten()
    }

    /// Whether another assignment of outputs could use the same relations.
    pub(super) fn is_ambiguous(&self, relation: RelationId) -> bool {
        self.ambiguous.binary_search(&relation).is_ok()
    }

    /// The places that a choice needs, in the order of their variables.
    pub(super) fn inputs(&self, choice: ChoiceId) -> &[Place] {
        self.needed(&self.choices[choice])
    }

    /// Removes choices that cannot be completed, and places that nothing needs any more.
    fn drop_useless(&mut self) {
        let missing = self.missing();
        if missing.iter().any(|&missing| missing > 0) {
            *self = Compaction::new(self).run(&missing);
        }
    }

    /// For each choice, how many of its inputs cannot be known in any way, by counting forward from the provided ones.
    fn missing(&self) -> IdVec<ChoiceId, u32> {
        let mut missing = IdVec::filled(self.choices.len(), |choice| self.inputs(choice).len() as u32);
        let output = self.outputs();
        let users = self.users();
        let mut known = IdVec::filled(self.len(), |_: Place| false);
        let mut complete: Vec<ChoiceId> = missing.ids().filter(|&choice| missing[choice] == 0).collect();
        while let Some(choice) = complete.pop() {
            let place = output[choice];
            if core::mem::replace(&mut known[place], true) {
                continue;
            }
            for &user in users.row(place) {
                missing[user] -= 1;
                if missing[user] == 0 {
                    complete.push(user);
                }
            }
        }
        missing
    }

    /// The place of each choice.
    pub(super) fn outputs(&self) -> IdVec<ChoiceId, Place> {
        let mut outputs = IdVec::new();
        for place in self.nodes.ids() {
            for _ in self.choices(place) {
                outputs.push(place);
            }
        }
        outputs
    }

    /// The choices that need each place.
    pub(super) fn users(&self) -> Users {
        let mut starts = alloc::vec![0_u32; self.len() + 1];
        for input in &self.inputs {
            if let Some(start) = starts.get_mut(input.index()) {
                *start += 1;
            }
        }
        let mut end = 0;
        for start in &mut starts {
            end += *start;
            *start = end;
        }
        let mut users = Users { choices: alloc::vec![ChoiceId(0); self.inputs.len()], starts };
        for choice in self.choices.ids() {
            for &input in self.inputs(choice) {
                users.put(input, choice);
            }
        }
        users
    }

    /// Numbers the relations that may be used twice in one substitution.
    fn find_shared_relations(&mut self, view: &View) {
        if self.ambiguous.is_empty() {
            return;
        }
        let mut counts: BTreeMap<RelationId, u32> =
            self.ambiguous.iter().map(|&relation| (relation, 0)).collect();
        for relation in self.choices.iter().filter_map(|choice| choice.relation) {
            counts.entry(relation).and_modify(|count| *count += 1);
        }
        self.ambiguous.retain(|relation| counts.get(relation).is_some_and(|&count| count > 1));
        let shared = self.ambiguous.iter().filter(|&&relation| !view.graph().is_exclusive(relation));
        let shared_relations: BTreeMap<RelationId, SharedRelation> =
            shared.enumerate().map(|(at, &relation)| (relation, SharedRelation::from_index(at))).collect();
        self.shared_relation_count = shared_relations.len();
        if self.shared_relation_count > 0 {
            let shared_relation = |choice| {
                self.choices[choice].relation.and_then(|relation| shared_relations.get(&relation).copied())
            };
            self.shared_relations = IdVec::filled(self.choices.len(), shared_relation);
        }
    }

    /// Whether some place can depend on itself: tested by removing places that only removed places need.
    fn has_cycle(&self) -> bool {
        let mut needed = IdVec::filled(self.len(), |_: Place| 0_u32);
        for &input in &self.inputs {
            needed[input] += 1;
        }
        let mut free: Vec<Place> = self.nodes.ids().filter(|&place| needed[place] == 0).collect();
        let mut removed = 0;
        while let Some(place) = free.pop() {
            removed += 1;
            for &input in self.choices(place).flat_map(|choice| self.inputs(choice)) {
                needed[input] -= 1;
                if needed[input] == 0 {
                    free.push(input);
                }
            }
        }
        removed < self.len()
    }

    /// Computes lower bounds, from the last places to the root.
    ///
    /// The lower bound of a place adds up only places that no other place can need. So the lower bounds of different undecided
    /// places never count the same relation, nor a relation that is decided already, and their sum is a lower bound of the
    /// remaining weight. Where nothing is shared, the bound is exact. A relation that may also serve another output may be
    /// counted there, so it counts as nothing here.
    fn find_lower_bounds(&mut self) {
        let private = if self.tree { IdVec::new() } else { self.private() };
        for place in self.nodes.ids().rev() {
            let lower_bound = |choice| {
                let own = self.shared_relation(choice).map_or(self.choices[choice].weight, |_| Weight::ZERO);
                let is_private = |input: &&Place| self.tree || private[**input];
                let inputs = self.inputs(choice).iter().filter(is_private);
                inputs.fold(own, |all, &input| self.scale.join(all, self.lower_bound(input)))
            };
            let lower_bounds = self.choices(place).map(lower_bound);
            self.nodes[place].lower_bound =
                lower_bounds.fold(Weight::MAX, |least, lower_bound| self.scale.least(least, lower_bound));
        }
    }

    /// The places that only one variable can need. Such a place follows the place of that variable.
    fn private(&self) -> IdVec<Place, bool> {
        let mut private = IdVec::filled(self.len(), |_| true);
        let mut above: IdVec<Place, Option<Place>> = IdVec::filled(self.len(), |_| None);
        for place in self.nodes.ids() {
            for &input in self.choices(place).flat_map(|choice| self.inputs(choice)) {
                private[input] &= above[input].is_none_or(|above| above == place);
                above[input] = Some(place);
            }
        }
        private
    }
}

/// The choices that need each place.
#[derive(Debug)]
pub(super) struct Users {
    /// The start of each place's list, once it is complete.
    starts: Vec<u32>,
    choices: Vec<ChoiceId>,
}

impl Users {
    /// Adds an entry to a place's list, from the back.
    fn put(&mut self, place: Place, choice: ChoiceId) {
        if let Some(start) = self.starts.get_mut(place.index()) {
            *start -= 1;
            if let Some(slot) = self.choices.get_mut(*start as usize) {
                *slot = choice;
            }
        }
    }

    /// The choices that need a place.
    pub(super) fn row(&self, place: Place) -> &[ChoiceId] {
        let bound = |index: usize| self.starts.get(index).map_or(0, |&start| start as usize);
        self.choices.get(bound(place.index())..bound(place.index() + 1)).unwrap_or_default()
    }
}
