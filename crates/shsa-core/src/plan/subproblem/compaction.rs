//! Reduces a subproblem to its useful part.

use super::{Choice, ChoiceId, Node, Place, Subproblem};
use crate::knowledge::{Id, IdVec};

/// Copies the useful part of a subproblem, renumbered breadth first.
pub(super) struct Compaction<'a> {
    old: &'a Subproblem,
    new: Subproblem,
    /// The old place of each new one.
    from: IdVec<Place, Place>,
    to: IdVec<Place, Option<Place>>,
}

impl<'a> Compaction<'a> {
    pub(super) fn new(old: &'a Subproblem) -> Self {
        let new = Subproblem {
            scale: old.scale,
            ambiguous: old.ambiguous.clone(),
            tree: old.tree,
            ..Subproblem::default()
        };
        Compaction { old, new, from: IdVec::new(), to: IdVec::filled(old.len(), |_| None) }
    }

    pub(super) fn run(mut self, missing: &IdVec<ChoiceId, u32>) -> Subproblem {
        let useful = |choice: &ChoiceId| missing[*choice] == 0;
        let Some(root) = self.old.nodes.ids().next() else { return self.new };
        if !self.old.choices(root).any(|choice| useful(&choice)) {
            return self.new;
        }
        self.place(root);
        let mut next = 0;
        while next < self.new.len() {
            let place = self.from[Place::from_index(next)];
            let start = self.new.choices.len() as u32;
            for choice in self.old.choices(place).filter(useful) {
                self.copy(choice);
            }
            self.new.nodes[Place::from_index(next)].choices = (start, self.new.choices.len() as u32);
            next += 1;
        }
        self.new
    }

    fn place(&mut self, old: Place) -> Place {
        if let Some(place) = self.to[old] {
            return place;
        }
        let place = self.new.nodes.push(Node::of(self.old.variable(old)));
        self.from.push(old);
        self.to[old] = Some(place);
        place
    }

    fn copy(&mut self, choice: ChoiceId) {
        let start = self.new.inputs.len() as u32;
        for &input in self.old.inputs(choice) {
            let place = self.place(input);
            self.new.inputs.push(place);
        }
        let inputs = (start, self.new.inputs.len() as u32);
        self.new.choices.push(Choice { inputs, ..self.old.choices[choice] });
    }
}
