//! The searches in several parts, compared with the searches in one piece, on any number of threads.

use crate::plan_support::{Kind, Random, first, question, random, tree};
use crate::seeds::seeds;
use shsa_core::knowledge::{KnowledgeBase, VariableId};
use shsa_core::plan::{
    Deal, Graph, Limits, Options, Part, Plan, StopReason, best, best_in_parts, property_guided,
    property_guided_in_parts,
};
use std::cell::Cell;
use std::thread;

/// Limits that suffice for the searches of these tests.
const LIMITS: Limits = Limits { expansions: 30_000_000, states: 10_000_000 };

/// The searches that can run in parts.
#[derive(Clone, Copy, Debug)]
enum Engine {
    BestFirst,
    PropertyGuided,
}

const ENGINES: [Engine; 2] = [Engine::BestFirst, Engine::PropertyGuided];

/// A search for the `count` best substitutions.
struct Question<'a> {
    engine: Engine,
    graph: &'a Graph,
    root: VariableId,
    options: &'a Options,
    count: usize,
    limits: Limits,
}

impl Question<'_> {
    fn whole(&self) -> Plan {
        let search = match self.engine {
            Engine::BestFirst => best,
            Engine::PropertyGuided => property_guided,
        };
        search(self.graph, self.root, self.options, self.count, self.limits)
    }

    fn in_parts(&self, deal: Deal, run_all: impl Fn(&mut [Part])) -> Plan {
        let Question { graph, root, options, count, limits, .. } = *self;
        match self.engine {
            Engine::BestFirst => best_in_parts(graph, root, options, count, limits, deal, run_all),
            Engine::PropertyGuided => {
                property_guided_in_parts(graph, root, options, count, limits, deal, run_all)
            }
        }
    }
}

/// Runs the parts of a search on some threads, each of which takes every so many-th part.
fn on_threads(threads: usize) -> impl Fn(&mut [Part]) {
    move |parts: &mut [Part]| {
        let share = parts.len().div_ceil(threads).max(1);
        thread::scope(|scope| {
            for some in parts.chunks_mut(share) {
                scope.spawn(|| some.iter_mut().for_each(Part::run));
            }
        });
    }
}

/// Runs the parts one after the other, the last one first.
fn in_turn(parts: &mut [Part]) {
    parts.iter_mut().rev().for_each(Part::run);
}

#[test]
fn parts_of_a_search_give_what_the_whole_gives() {
    let mut several = 0;
    for seed in seeds(500) {
        let mut numbers = Random(seed);
        let (kind, knowledge, root, options) = question(&mut numbers);
        let graph = Graph::new(&knowledge);
        let count = if numbers.chance(0.5) { usize::MAX } else { numbers.below(6) };
        let parts = 1 + numbers.below(5);
        let deal = Deal { parts, alone: numbers.below(20) as u64 };
        let plans = ENGINES.map(|engine| {
            let question = Question { engine, graph: &graph, root, options: &options, count, limits: LIMITS };
            let (whole, found) = (question.whole(), question.in_parts(deal, in_turn));
            let label = format!("seed {seed} {kind:?} {engine:?} in {parts} parts");
            assert_eq!(found.substitutions, whole.substitutions, "{label}");
            assert_eq!(found.stop, whole.stop, "{label}");
            if seed % 20 == 0 {
                assert_eq!(found, question.in_parts(deal, on_threads(2)), "{label}");
            }
            found.substitutions
        });
        assert_eq!(plans[0], plans[1], "seed {seed} {kind:?}");
        several += usize::from(plans[0].len() > 1);
    }
    assert!(several > 75, "{several}");
}

/// Checks that a search of several rounds gives the same in any number of parts, on any number of threads.
#[track_caller]
fn check_rounds(engine: Engine, knowledge: &KnowledgeBase) {
    let rounds = Cell::new(0);
    let counted = |parts: &mut [Part]| {
        rounds.set(rounds.get() + 1);
        in_turn(parts);
    };
    let graph = Graph::new(knowledge);
    let (root, options) = (first(knowledge), Options::default());
    let all = Question { engine, graph: &graph, root, options: &options, count: usize::MAX, limits: LIMITS };
    let whole = all.whole();
    assert!(whole.stop == StopReason::Complete && whole.substitutions.len() > 1_000);
    let found = all.in_parts(Deal::among(2), counted);
    assert!(rounds.get() > 1 && found.substitutions == whole.substitutions);
    for (parts, threads) in [(2, 1), (2, 2), (3, 2)] {
        let other = all.in_parts(Deal::among(parts), on_threads(threads));
        assert!(parts != 2 || other == found, "{parts} parts on {threads} threads");
        assert!(other.substitutions == found.substitutions, "{parts} parts on {threads} threads");
    }
}

#[test]
fn rounds_do_not_depend_on_threads() {
    check_rounds(Engine::BestFirst, &tree(2, 8, None, 0));
    check_rounds(Engine::PropertyGuided, &tree(3, 6, Some(0.1), 1));
}

#[test]
fn a_part_gives_no_more_answers_than_are_wanted() {
    // All 32,768 answers have the same utility: a search in one piece stops after a few decisions.
    let knowledge = tree(2, 8, None, 0);
    let graph = Graph::new(&knowledge);
    let (root, options) = (first(&knowledge), Options::default());
    for engine in ENGINES {
        let best = Question { engine, graph: &graph, root, options: &options, count: 3, limits: LIMITS };
        let (whole, found) = (best.whole(), best.in_parts(Deal { parts: 4, alone: 0 }, in_turn));
        assert_eq!((&found.substitutions, found.stop), (&whole.substitutions, whole.stop));
        assert!(found.expanded < 1_000, "{engine:?}: {} decisions", found.expanded);
    }
}

#[test]
fn a_limit_of_parts_leaves_a_true_bound() {
    let knowledge = random(&mut Random(7), Kind::Equations, 60, false);
    let graph = Graph::new(&knowledge);
    let (root, options) = (first(&knowledge), Options::default());
    let limits = Limits { expansions: 30_000, states: 300_000 };
    for engine in ENGINES {
        let question = Question { engine, graph: &graph, root, options: &options, count: usize::MAX, limits };
        let found = question.in_parts(Deal::among(3), in_turn);
        assert!(matches!(found.stop, StopReason::LimitExpansions | StopReason::LimitStates), "{found:?}");
        assert!(found.expanded < 30_000 + 3 * 9_000, "{engine:?}: {}", found.expanded);
        let best = Question { engine: Engine::BestFirst, count: 1, limits: LIMITS, ..question }.whole();
        let at_most =
            found.substitutions.first().map_or(found.bound, |(_, utility)| utility.max(found.bound));
        assert!(best.substitutions.iter().all(|(_, utility)| *utility <= at_most), "{engine:?}: {at_most}");
        assert_eq!(found, question.in_parts(Deal::among(3), on_threads(3)));
    }
}
