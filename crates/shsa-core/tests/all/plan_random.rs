//! The exact search compared with the oracle, on random knowledge bases.

use crate::plan_support::{Builder, Kind, NORM, Random, check_sound, question, random, utility};
use crate::seeds::seeds;
use shsa_core::knowledge::{KnowledgeBase, VariableId};
use shsa_core::plan::{BestFirst, Graph, Limits, Options, Plan, Scratch, StopReason, best, exhaustive};
use shsa_core::substitution::Substitution;

/// Limits that suffice for the oracle in these tests.
const LIMITS: Limits = Limits { expansions: 10_000_000, states: 3_000_000 };

/// Compares the answers; `memory` is that of earlier searches in other knowledge bases.
fn check(memory: &mut (Scratch, Plan), seed: u64) -> usize {
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
    memory.1.refill(&mut BestFirst::with_scratch(&mut memory.0, &graph, root, &options, LIMITS), count);
    assert_eq!(memory.1, first, "seed {seed} {kind:?}: first {count}, in used memory");
    check_any(&knowledge, root, &options, &found);
    found.len()
}

/// Without a single decision there is an answer, if one exists.
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
fn best_first_equals_exhaustive_on_random_knowledge_bases() {
    let mut memory = (Scratch::default(), Plan::default());
    let answers: Vec<usize> = seeds(2_000).map(|seed| check(&mut memory, seed)).collect();
    let several = answers.iter().filter(|&&count| count > 1).count();
    assert!(
        several * 10 > 3 * answers.len(),
        "the knowledge bases are too simple: {several} have several substitutions"
    );
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

/// What a relation lacks is that of its output, and what a signal lacks that of its variable; the default counts where neither has any.
#[test]
fn properties_of_variables_count() {
    let mut builder = Builder::default();
    let [root, exact, vague] = [("root", Some(0.8)), ("exact", Some(0.9)), ("vague", None)]
        .map(|(name, accuracy)| builder.variable(name, accuracy));
    for (name, input) in [("by_vague", vague), ("by_exact", exact)] {
        builder.relation(name, &[root], &[input], None);
    }
    builder.signal(exact, None);
    builder.signal(vague, Some(0.7));
    let knowledge = builder.build().with_utility(utility("product", "accuracy / cost", "accuracy"));
    let found = best(&Graph::new(&knowledge), root, &Options::default(), 2, LIMITS).substitutions;
    let utilities: Vec<f64> = found.iter().map(|(_, utility)| *utility).collect();
    assert!((utilities[0] - 0.8 * 0.9).abs() < 1e-9 && (utilities[1] - 0.8 * 0.7).abs() < 1e-9, "{found:?}");
}
