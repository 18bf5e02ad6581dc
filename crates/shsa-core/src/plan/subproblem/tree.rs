//! Trees: where nothing is shared, the best choices of all places together are the best substitution, which is read off.

use super::{Choice, ChoiceId, Place, Subproblem};
use crate::knowledge::VariableId;
use crate::plan::graph::Graph;
use crate::plan::utility::Weight;
use crate::substitution::{Step, Substitution};
use alloc::vec::Vec;

/// Working memory for reading off.
#[derive(Clone, Debug, Default)]
pub(in crate::plan) struct Reading {
    open: Vec<Place>,
    steps: Vec<Step>,
    sources: Vec<VariableId>,
}

impl Subproblem {
    /// As [`Subproblem::find_hopes`], where the bounds are exact; also finds the best choice of each place, the first of equals.
    pub(super) fn find_best(&mut self) {
        for place in self.nodes.ids().rev() {
            let (start, end) = self.nodes[place].choices;
            let mut least = (Weight::MAX, ChoiceId(start));
            for (at, choice) in (start..end).zip(self.choices.slice(start as usize..end as usize)) {
                let inputs = self.needed(choice).iter();
                let weight =
                    inputs.fold(choice.weight, |all, &input| all.plus(self.nodes[input].lower_bound));
                if weight < least.0 {
                    least = (weight, ChoiceId(at));
                }
            }
            let node = &mut self.nodes[place];
            (node.lower_bound, node.best) = least;
        }
    }

    /// Replaces a substitution by the best one; returns the number of its decisions. Only for a subproblem that [is
    /// exact](Subproblem::is_exact) and has a root.
    ///
    /// Complexity: O(s log s) for s inputs of its relations.
    pub(in crate::plan) fn read_off(
        &self,
        graph: &Graph,
        reading: &mut Reading,
        answer: &mut Substitution,
    ) -> u64 {
        let Reading { open, steps, sources } = reading;
        steps.clear();
        sources.clear();
        open.clear();
        open.push(Place(0));
        let mut decisions = 0;
        // The last input first, and the steps from the back to the front: a step comes after those that it reads.
        while let Some(place) = open.pop() {
            decisions += 1;
            let node = &self.nodes[place];
            let (choice, output) = (&self.choices[node.best], node.variable);
            let Some(relation) = choice.relation else {
                sources.push(output);
                continue;
            };
            steps.push(Step { relation, output });
            let mut needed = self.needed(choice);
            for &input in needed {
                open.push(input);
            }
            // An input without a place is used as provided. Both lists have the same order.
            for &input in graph.inputs(relation).iter().filter(|&&input| input != output) {
                match needed.split_first() {
                    Some((&first, rest)) if self.variable(first) == input => needed = rest,
                    _ => sources.push(input),
                }
            }
        }
        if sources.len() > 1 {
            sources.sort_unstable();
            sources.dedup();
        }
        answer.sink = self.variable(Place(0));
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
