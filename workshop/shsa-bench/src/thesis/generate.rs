//! Random trees of variables and relations, as in the experiments of the thesis.

use crate::structure;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use shsa_core::knowledge::{
    IdVec, KnowledgeBase, Properties, Relation, RelationId, Signal, SignalId, Variable, VariableId,
};

/// How many children a node has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Branching {
    /// Always the largest number.
    Complete,
    /// From one to the largest number, uniformly.
    Random,
}

/// The kind of a tree. Nodes at even depth are variables, at odd depth relations; the root is variable 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tree {
    /// The largest number of children of a node.
    pub(super) branch: usize,
    /// The depth of the leaves; even.
    pub(super) depth: usize,
    pub(super) branching: Branching,
    /// The probability that a variable is provided, at depth 1; it rises linearly to 1 at the leaves. `None`: only leaves are
    /// provided.
    pub(super) availability: Option<f64>,
    /// Whether relations have costs, uniform from 1 to 10.
    pub(super) costs: bool,
    /// Whether a relation can be used for each of its variables, and not only from child to parent.
    pub(super) both_ways: bool,
}

impl Tree {
    /// The tree of a seed; the root is not provided. Complexity: O(tree).
    pub(super) fn generate(&self, seed: u64) -> KnowledgeBase {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut parts = Parts::default();
        let mut level = vec![parts.variable(false)];
        for depth in (2..=self.depth).step_by(2) {
            let share = self.share(depth);
            let mut below = Vec::new();
            for output in level {
                for _ in 0..self.children(&mut random) {
                    let children = self.children(&mut random);
                    let inputs: Vec<_> =
                        (0..children).map(|_| parts.variable(random.random_bool(share))).collect();
                    below.extend_from_slice(&inputs);
                    let cost = self.costs.then(|| random.random_range(1.0..10.0));
                    parts.relation(output, inputs, self.both_ways, cost);
                }
            }
            level = below;
        }
        KnowledgeBase::from_parts(parts.variables, parts.relations, parts.signals, IdVec::new())
    }

    /// The probability that a variable is provided: `low + (1 - low) (d - 1) / (D - 1)` at depth d of D, as in the thesis.
    fn share(&self, depth: usize) -> f64 {
        if depth == self.depth {
            return 1.0;
        }
        let share = (depth - 1) as f64 / (self.depth - 1) as f64;
        self.availability.map_or(0.0, |low| low + (1.0 - low) * share)
    }

    fn children(&self, random: &mut ChaCha8Rng) -> usize {
        match self.branching {
            Branching::Complete => self.branch,
            Branching::Random => random.random_range(1..=self.branch),
        }
    }
}

/// The parts of a knowledge base.
#[derive(Default)]
struct Parts {
    variables: IdVec<VariableId, Variable>,
    relations: IdVec<RelationId, Relation>,
    signals: IdVec<SignalId, Signal>,
}

impl Parts {
    fn variable(&mut self, provided: bool) -> VariableId {
        let name = format!("v{}", self.variables.len());
        let id = self.variables.push(structure::variable(name, Properties::default()));
        if provided {
            self.signal(id);
        }
        id
    }

    fn signal(&mut self, variable: VariableId) {
        let name = format!("/{}", self.signals.len());
        self.signals.push(Signal::new(name, variable));
    }

    fn relation(&mut self, output: VariableId, mut inputs: Vec<VariableId>, both: bool, cost: Option<f64>) {
        if both {
            inputs.insert(0, output);
        }
        self.relations.push(Relation {
            name: format!("r{}", self.relations.len()),
            outputs: if both { inputs.clone() } else { vec![output] },
            inputs,
            formulas: Vec::new(),
            condition: None,
            text: String::new(),
            properties: cost.map(|cost| ("cost".to_owned(), cost)).into_iter().collect(),
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shsa_core::knowledge::Id;
    use shsa_core::plan::{Graph, Limits, Options, StopReason, best, exhaustive};

    fn tree(branch: usize, depth: usize) -> Tree {
        let (branching, availability) = (Branching::Complete, Some(0.2));
        Tree { branch, depth, branching, availability, costs: false, both_ways: true }
    }

    /// The number of substitutions and the best utility by dynamic programming, which is exact for trees only.
    fn oracle(knowledge: &KnowledgeBase, variable: VariableId) -> (f64, f64) {
        if knowledge.is_provided(variable) {
            return (1.0, 1.0);
        }
        // The relation towards the root has the lowest number, because its other variables were made first.
        let below =
            |&relation: &RelationId| knowledge.relations()[relation].needs(variable).all(|i| i > variable);
        let mut sum = (0.0, 0.0_f64);
        for relation in knowledge.producers(variable).iter().copied().filter(below) {
            let relation = &knowledge.relations()[relation];
            let inputs: Vec<VariableId> = relation.needs(variable).collect();
            let unprovided = inputs.iter().filter(|&&input| !knowledge.is_provided(input)).count() as f64;
            let cost = relation.properties.get("cost").copied().unwrap_or(1.0);
            let own = (0.3 / inputs.len() as f64 + 0.5 / cost + 0.1 / (unprovided + 1.0) + 0.5) / 1.4;
            let (count, utility) = inputs
                .iter()
                .map(|&input| oracle(knowledge, input))
                .fold((1.0, own), |(count, utility), (c, u)| (count * c, utility * u));
            sum = (sum.0 + count, sum.1.max(utility));
        }
        sum
    }

    #[track_caller]
    fn check(tree: Tree, seed: u64) {
        let knowledge = tree.generate(seed);
        let root = VariableId::from_index(0);
        let (count, utility) = oracle(&knowledge, root);
        let plan = best(&Graph::new(&knowledge), root, &Options::default(), 5_000, Limits::NONE);
        let found = plan.substitutions.first().map(|(_, utility)| *utility).expect("a substitution");
        assert!((found - utility).abs() < 1e-9, "{tree:?} {seed}: {found}, not {utility}");
        if count <= 5_000.0 {
            assert_eq!(plan.substitutions.len() as f64, count, "{tree:?} {seed}");
        }
        if count <= 50.0 {
            let all = exhaustive(&knowledge, root, &Options::default(), Limits::NONE);
            assert_eq!((all.stop, all.substitutions.len() as f64), (StopReason::Complete, count));
        }
    }

    #[test]
    fn searches_find_what_dynamic_programming_finds() {
        for seed in 0..8 {
            for depth in [2, 4, 6, 8] {
                check(tree(2, depth), seed);
                check(Tree { branching: Branching::Random, both_ways: false, ..tree(3, depth) }, seed);
            }
            check(tree(1, 6), seed);
            check(tree(3, 6), seed);
            check(Tree { costs: true, ..tree(3, 4) }, seed);
        }
    }

    #[test]
    fn trees_with_provided_leaves_have_as_many_substitutions_as_the_formula_says() {
        for (depth, count) in [(2, 2), (4, 8), (6, 128), (8, 32_768)] {
            let knowledge = Tree { availability: None, ..tree(2, depth) }.generate(0);
            let nodes = knowledge.variables().len() + knowledge.relations().len();
            assert_eq!(nodes, (1 << (depth + 1)) - 1);
            let graph = Graph::new(&knowledge);
            let root = VariableId::from_index(0);
            let plan = best(&graph, root, &Options::default(), usize::MAX, Limits::NONE);
            assert_eq!((plan.stop, plan.substitutions.len()), (StopReason::Complete, count));
        }
    }

    #[test]
    fn a_seed_makes_one_tree() {
        let provided = |seed| -> Vec<VariableId> {
            tree(3, 4).generate(seed).signals().iter().map(|signal| signal.variable).collect()
        };
        assert_eq!(provided(1), provided(1));
        assert_ne!(provided(1), provided(2));
    }

    #[test]
    fn availability_rises_evenly_to_the_leaves() {
        let knowledge = tree(2, 14).generate(0);
        let mut first = 1;
        for depth in (2..=14).step_by(2) {
            let level = first..first + (1 << depth);
            let provided =
                level.clone().filter(|&at| knowledge.is_provided(VariableId::from_index(at))).count();
            let (share, expected) =
                (provided as f64 / level.len() as f64, 0.2 + 0.8 * (depth - 1) as f64 / 13.0);
            let deviation = (expected * (1.0 - expected) / level.len() as f64).sqrt();
            assert!((share - expected).abs() <= 4.0 * deviation, "{share} at depth {depth}, not {expected}");
            first = level.end;
        }
    }
}
