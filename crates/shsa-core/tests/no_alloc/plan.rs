//! The best substitution on a tree is found without allocation, in the memory of earlier searches.

use crate::plan_support::{drivetrain, first, tree};
use shsa_core::knowledge::{KnowledgeBase, VariableId};
use shsa_core::plan::{BestFirst, Graph, Limits, Options, Plan, Scratch, best};

/// Allocations of 100 searches after the first one.
fn allocations(knowledge: &KnowledgeBase, root: VariableId) -> u64 {
    let (graph, options) = (Graph::new(knowledge), Options::default());
    let (mut scratch, mut plan) = (Scratch::default(), Plan::default());
    let mut search = || {
        let search = &mut BestFirst::with_scratch(&mut scratch, &graph, root, &options, Limits::default());
        plan.refill(search, 1);
    };
    search();
    let counted = allocation_counter::measure(|| (0..100).for_each(|_| search()));
    assert!(!plan.substitutions.is_empty());
    assert_eq!(plan, best(&graph, root, &options, 1, Limits::default()));
    counted.count_total
}

#[test]
fn the_best_substitution_on_a_tree_allocates_nothing() {
    for seed in 0..3 {
        let knowledge = tree(2, 10, Some(0.2), seed);
        assert_eq!(allocations(&knowledge, first(&knowledge)), 0, "seed {seed}");
    }
    let knowledge = drivetrain();
    assert_eq!(allocations(&knowledge, knowledge.variable("steering_angle").unwrap()), 0);
}
