//! The utility of a way compared with the exhaustive search in a knowledge base with only the way's signals.

use crate::plan_support::{Random, question};
use shsa_core::knowledge::{Element, KnowledgeBase, SignalId, Utility};
use shsa_core::plan::{Appraisal, Graph, Limits, Options, exhaustive};
use shsa_core::substitution::Way;

const LIMITS: Limits = Limits { expansions: 10_000_000, states: 3_000_000 };

/// The knowledge base in which only the way's signals carry its sources; a signal without a given accuracy gets that of the least
/// exact one beside it. `None` where that would change the rating of the signal itself.
fn only(knowledge: &KnowledgeBase, way: &Way, lost: &[SignalId]) -> Option<KnowledgeBase> {
    let mut left = knowledge.clone();
    let pairs = way.substitution.sources.iter().zip(&way.signals);
    for (&source, chosen) in pairs.filter_map(|(source, signal)| Some((source, (*signal)?))) {
        let usable = |signal: &SignalId| knowledge.is_available(*signal) && !lost.contains(signal);
        let accuracy = |signal: &SignalId| knowledge.signals()[*signal].properties.get("accuracy").copied();
        let carriers = || knowledge.carriers(source).iter().filter(|signal| usable(signal));
        if let (None, Some(least)) = (accuracy(&chosen), carriers().filter_map(accuracy).reduce(f64::min)) {
            if knowledge.utility().rates_signals() {
                return None;
            }
            left.set_property(Element::Signal(chosen), "accuracy", Some(least)).unwrap();
        }
        carriers().filter(|&&signal| signal != chosen).for_each(|&signal| left.set_available(signal, false));
    }
    Some(left)
}

/// Returns how many ways were compared whose substitution has others.
fn check(seed: u64) -> usize {
    let mut numbers = Random(seed);
    let (kind, knowledge, root, mut options) = question(&mut numbers);
    options.forbidden_signals.sort_unstable();
    let lost = options.forbidden_signals.clone();
    let graph = Graph::new(&knowledge);
    let appraisal = Appraisal::new(&graph, &lost);
    let usable = |signal: SignalId| knowledge.is_available(signal) && !lost.contains(&signal);
    let mut compared = 0;
    for (substitution, utility) in
        exhaustive(&knowledge, root, &options, LIMITS).substitutions.into_iter().take(4)
    {
        let ways = Way::choices(&knowledge, &substitution, usable, 9);
        let rated: Vec<f64> = ways.iter().map(|way| appraisal.utility(way)).collect();
        assert!(
            rated.iter().all(|rated| *rated <= utility),
            "seed {seed} {kind:?}: {rated:?} above {utility}"
        );
        if matches!(knowledge.utility(), Utility::Norm) && ways.len() < 9 {
            assert_eq!(rated.first(), Some(&utility), "seed {seed} {kind:?}: the best signals are the first");
        }
        if ways.len() == 1 {
            assert_eq!(rated, [utility], "seed {seed} {kind:?}");
            continue;
        }
        for (way, rated) in ways.iter().zip(rated) {
            let Some(left) = only(&knowledge, way, &lost) else { continue };
            let options = Options { forbidden_signals: lost.clone(), ..options.clone() };
            let alone = exhaustive(&left, root, &options, LIMITS).substitutions;
            let Some(found) = alone.iter().find(|(other, _)| *other == substitution) else {
                // The same relations for other outputs are then as good or better, and only the best is returned.
                let relations = substitution.relations();
                let same = alone.iter().find(|(other, _)| other.relations() == relations).unwrap();
                assert!(rated <= same.1, "seed {seed} {kind:?}: {}", way.describe(&knowledge));
                continue;
            };
            assert_eq!(rated, found.1, "seed {seed} {kind:?}: {}", way.describe(&knowledge));
            compared += 1;
        }
    }
    compared
}

#[test]
fn a_way_is_worth_what_its_substitution_is_with_its_signals_alone() {
    let compared: usize = (0..150).map(check).sum();
    assert!(compared > 50, "the knowledge bases are too simple: {compared} ways have others beside them");
}
