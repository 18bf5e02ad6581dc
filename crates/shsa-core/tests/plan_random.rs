//! The exact search against the oracle, on random knowledge bases.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::indexing_slicing,
    reason = "tests may fail loudly"
)]

mod plan_support;

use plan_support::{Kind, NORM, Random, check_sound, question, random, utility};
use shsa_core::knowledge::{KnowledgeBase, VariableId};
use shsa_core::plan::{BestFirst, Graph, Limits, Options, StopReason, best, exhaustive};
use shsa_core::substitution::Substitution;

/// Enough for the oracle on everything that is generated here.
const LIMITS: Limits = Limits { expansions: 300_000, states: 300_000 };

fn check(seed: u64) -> usize {
    let mut numbers = Random(seed);
    let (kind, knowledge, root, options) = question(&mut numbers);

    let oracle = exhaustive(&knowledge, root, &options, LIMITS);
    assert_eq!(oracle.stop, StopReason::Complete, "seed {seed} {kind:?}: too big");
    let graph = Graph::new(&knowledge);
    let mut search = BestFirst::new(&graph, root, &options, LIMITS);
    let mut found = Vec::new();
    loop {
        let bound = search.bound();
        let Some((substitution, utility)) = search.next() else { break };
        assert!(utility <= bound, "seed {seed} {kind:?}: bound {bound}, utility {utility}");
        check_sound(&knowledge, root, &options, &substitution);
        found.push((substitution, utility));
    }
    assert_eq!(search.stop(), StopReason::Complete);
    assert_eq!(found, oracle.substitutions, "seed {seed} {kind:?}");
    let count = numbers.below(found.len() + 2);
    let first = best(&graph, root, &options, count, LIMITS);
    assert_eq!(first.substitutions, found[..count.min(found.len())], "seed {seed} {kind:?}: first {count}");
    check_any(&knowledge, root, &options, &found);
    found.len()
}

/// Without a single decision there is an answer, if there is one at all.
fn check_any(knowledge: &KnowledgeBase, root: VariableId, options: &Options, found: &[(Substitution, f64)]) {
    let graph = Graph::new(knowledge);
    let limits = Limits { expansions: 0, ..LIMITS };
    let mut search = BestFirst::new(&graph, root, options, limits);
    assert!(search.next().is_none());
    let Some((any, utility)) = search.any() else { return assert!(found.is_empty()) };
    assert!(utility <= search.bound());
    check_sound(knowledge, root, options, &any);
    let same = found.iter().find(|(substitution, _)| substitution.relations() == any.relations());
    assert!(same.is_some_and(|(_, best)| utility <= *best), "{any:?}");
}

#[test]
fn best_first_equals_exhaustive_on_10_000_random_knowledge_bases() {
    let answers: Vec<usize> = (0..10_000).map(check).collect();
    let several = answers.iter().filter(|&&count| count > 1).count();
    assert!(several > 3_000, "the knowledge bases are too simple: {several} have several substitutions");
}

#[test]
fn the_norm_written_out_is_the_norm() {
    for seed in 0..200 {
        let mut numbers = Random(seed);
        let norm = random(&mut numbers, Kind::Mixed, 8, false);
        let written = norm.clone().with_utility(utility("product", NORM, ""));
        let all = |knowledge: &KnowledgeBase| {
            let root = knowledge.variables().ids().next().unwrap();
            best(&Graph::new(knowledge), root, &Options::default(), usize::MAX, LIMITS).substitutions
        };
        assert_eq!(all(&norm), all(&written), "seed {seed}");
    }
}
