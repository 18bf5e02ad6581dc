//! Trees: where nothing is shared the best of each place makes the best of all, and is read off.

use super::{Choice, ChoiceId, Place, Scope};
use crate::knowledge::VariableId;
use crate::plan::graph::Graph;
use crate::plan::utility::Weight;
use crate::substitution::{Step, Substitution};
use alloc::vec::Vec;

/// Room for reading off.
#[derive(Clone, Debug, Default)]
pub(in crate::plan) struct Reading {
    open: Vec<Place>,
    steps: Vec<Step>,
    sources: Vec<VariableId>,
}

impl Scope {
    /// As [`Scope::find_hopes`], where the hopes are exact: also the best choice of each place, of equals the first.
    pub(super) fn find_best(&mut self) {
        self.hopes.refill(self.variables.len(), Weight::MAX);
        self.best.refill(self.variables.len(), ChoiceId(0));
        let mut end = self.choices.len();
        for (place, &start) in self.variables.ids().zip(&self.starts).rev() {
            let mut least = (Weight::MAX, ChoiceId(start));
            let choices = self.choices.slice(start as usize..end);
            for (at, choice) in (start..).zip(choices) {
                let inputs = self.needed(choice).iter();
                let weight = inputs.fold(choice.weight, |all, &input| all.plus(self.hopes[input]));
                if weight < least.0 {
                    least = (weight, ChoiceId(at));
                }
            }
            (self.hopes[place], self.best[place]) = least;
            end = start as usize;
        }
    }

    /// Puts the best substitution into the place of another; how many decisions it consists of. Only for a scope that
    /// [is exact](Scope::is_exact) and has a root.
    ///
    /// Complexity: O(s log s) for s inputs of its relations.
    pub(in crate::plan) fn read_off(
        &self,
        graph: &Graph,
        reading: &mut Reading,
        answer: &mut Substitution,
    ) -> u64 {
        let Reading { open, steps, sources } = reading;
        (steps.clear(), sources.clear(), open.clear());
        open.extend(self.variables.ids().next());
        let mut decisions = 0;
        // The last input first, and all from the back to the front: a step comes after those that it reads.
        while let Some(place) = open.pop() {
            decisions += 1;
            let (choice, output) = (&self.choices[self.best[place]], self.variables[place]);
            let Some(relation) = choice.relation else {
                sources.push(output);
                continue;
            };
            steps.push(Step { relation, output });
            let needed = self.needed(choice);
            open.extend_from_slice(needed);
            // What is no place is used as it comes. Both lists have the same order.
            let mut needed = needed.iter().map(|&place| self.variables[place]).peekable();
            let inputs = graph.inputs(relation).iter().copied().filter(|&input| input != output);
            sources.extend(inputs.filter(|&input| needed.next_if_eq(&input).is_none()));
        }
        sources.sort_unstable();
        sources.dedup();
        answer.sink = self.variables[Place(0)];
        answer.steps.clear();
        answer.steps.extend(steps.iter().rev());
        answer.sources.clear();
        answer.sources.extend_from_slice(sources);
        decisions
    }

    /// The places that a choice needs.
    #[inline]
    pub(super) fn needed(&self, choice: &Choice) -> &[Place] {
        self.inputs.get(choice.inputs.0 as usize..choice.inputs.1 as usize).unwrap_or_default()
    }
}
