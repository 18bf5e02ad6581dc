//! The searches of the thesis: compared with the oracle, with the answers of its public programs, and on difficult graphs.

use crate::plan_support::{Builder, Kind, Random, chain, check_sound, first, knowledge, question, tree};
use crate::seeds::seeds;
use shsa_core::knowledge::{KnowledgeBase, VariableId};
use shsa_core::plan::{
    BestFirst, Graph, Limits, Options, Plan, StopReason, Take, depth_first, exhaustive, ontology,
    property_guided,
};
use shsa_core::substitution::Substitution;
use std::collections::BTreeMap;

/// Limits that suffice for all searches of these tests.
const LIMITS: Limits = Limits { expansions: 30_000_000, states: 3_000_000 };

/// A question with the oracle's answer.
struct Case {
    label: String,
    knowledge: KnowledgeBase,
    graph: Graph,
    root: VariableId,
    options: Options,
    oracle: Vec<(Substitution, f64)>,
    /// The bound when nothing is missing.
    worst: f64,
}

impl Case {
    fn random(seed: u64) -> (Case, Kind) {
        let (kind, knowledge, root, options) = question(&mut Random(seed));
        let plan = exhaustive(&knowledge, root, &options, LIMITS);
        let label = format!("seed {seed} {kind:?}");
        assert_eq!(plan.stop, StopReason::Complete, "{label}: too big");
        let graph = Graph::new(&knowledge);
        (Case { label, knowledge, graph, root, options, oracle: plan.substitutions, worst: plan.bound }, kind)
    }

    fn depth_first(&self, take: Take, limits: Limits) -> Plan {
        depth_first(&self.graph, self.root, &self.options, take, limits)
    }

    fn property_guided(&self, count: usize, limits: Limits) -> Plan {
        property_guided(&self.graph, self.root, &self.options, count, limits)
    }

    fn ontology(&self, limits: Limits) -> Plan {
        ontology(&self.graph, self.root, &self.options, limits)
    }

    fn check_all(&self) {
        let found: Vec<_> = BestFirst::new(&self.graph, self.root, &self.options, LIMITS).collect();
        assert_eq!(found, self.oracle, "{} best-first", self.label);
        for (engine, plan) in [
            ("depth-first", self.depth_first(Take::All, LIMITS)),
            ("property-guided", self.property_guided(usize::MAX, LIMITS)),
        ] {
            assert_eq!(plan.stop, StopReason::Complete, "{} {engine}", self.label);
            assert_eq!(plan.bound, self.worst, "{} {engine}", self.label);
            assert_eq!(plan.substitutions, self.oracle, "{} {engine}", self.label);
        }
    }

    /// Checks a plan that need not be complete: its substitutions and its bound are valid.
    fn check_plan(&self, engine: &str, plan: &Plan) {
        for (substitution, utility) in &plan.substitutions {
            check_sound(&self.knowledge, self.root, &self.options, substitution);
            let same = |(other, _): &&(Substitution, f64)| other.relations() == substitution.relations();
            let best = self.oracle.iter().find(same).map(|&(_, best)| best);
            assert!(best.is_some_and(|best| *utility <= best), "{} {engine}: {utility} {best:?}", self.label);
        }
        let is_missing = |(one, _): &&(Substitution, f64)| {
            plan.substitutions.iter().all(|(found, _)| found.relations() != one.relations())
        };
        if let Some((_, missing)) = self.oracle.iter().find(is_missing) {
            assert!(*missing <= plan.bound, "{} {engine}: {missing} above {}", self.label, plan.bound);
        }
    }

    fn check_one(&self) {
        for (engine, plan) in
            [("depth-first", self.depth_first(Take::First, LIMITS)), ("ontology", self.ontology(LIMITS))]
        {
            let expected = if self.oracle.is_empty() { StopReason::Complete } else { StopReason::Found(1) };
            assert_eq!(plan.stop, expected, "{} {engine}", self.label);
            assert_eq!(plan.substitutions.len(), self.oracle.len().min(1), "{} {engine}", self.label);
            self.check_plan(engine, &plan);
        }
    }

    fn check_limited(&self, numbers: &mut Random) {
        let limits = match numbers.chance(0.5) {
            true => Limits { expansions: numbers.below(60) as u64, ..LIMITS },
            false => Limits { states: numbers.below(60), ..LIMITS },
        };
        self.check_plan("depth-first", &self.depth_first(Take::All, limits));
        self.check_plan("ontology", &self.ontology(limits));
        let plan = self.property_guided(usize::MAX, limits);
        self.check_plan("property-guided", &plan);
        let count = numbers.below(5);
        let some = self.property_guided(count, LIMITS);
        assert_eq!(some.substitutions, self.oracle[..count.min(self.oracle.len())], "{}", self.label);
        self.check_plan("property-guided", &some);
    }
}

fn agree_on(seeds: std::ops::Range<u64>) {
    let mut several = BTreeMap::new();
    for seed in seeds {
        let (case, kind) = Case::random(seed);
        case.check_all();
        case.check_one();
        case.check_limited(&mut Random(!seed));
        *several.entry(format!("{kind:?}")).or_insert(0) += usize::from(case.oracle.len() > 1);
    }
    assert!(several.len() == 6 && several.values().all(|&count| count > 20), "too simple: {several:?}");
}

#[test]
fn all_searches_agree_on_random_knowledge_bases() {
    agree_on(seeds(1_000));
}

/// One line for each substitution: its utility and its relations in the order of computation.
fn text(knowledge: &KnowledgeBase, plan: &Plan) -> Vec<String> {
    let line = |(substitution, utility): &(Substitution, f64)| {
        let steps = substitution.steps.iter();
        let names: Vec<_> = steps.map(|step| knowledge.relations()[step.relation].name.as_str()).collect();
        format!("{utility:.4} {}", names.join(" "))
    };
    plan.substitutions.iter().map(line).collect()
}

/// Checks the answers of ORR, and the first ones of a depth-first search and of SH-PGSA.
#[track_caller]
fn check_firsts(lines: &[&str], expected: [&str; 3]) {
    let knowledge = knowledge(lines);
    let graph = Graph::new(&knowledge);
    let (root, options) = (first(&knowledge), Options::default());
    let plans = [
        ontology(&graph, root, &options, LIMITS),
        depth_first(&graph, root, &options, Take::First, LIMITS),
        property_guided(&graph, root, &options, 1, LIMITS),
    ];
    assert_eq!(plans.map(|plan| text(&knowledge, &plan).join("; ")), expected);
}

#[test]
fn first_relations_are_taken_in_file_order_and_give_way_when_they_lead_nowhere() {
    let lines = ["x = dear(a) 9", "x = cheap(b)", "!a", "!b"];
    check_firsts(&lines, ["0.6825 dear", "0.6825 dear", "1.0000 cheap"]);
    let lines = ["x = r(a b)", "a = s(c)", "b = t(d)", "x = u(e)", "e = v(f)", "!c", "!f"];
    check_firsts(&lines, ["0.9643 v u", "0.9643 v u", "0.9643 v u"]);
    check_firsts(&["x = r(a)", "a = s(b)"], ["", "", ""]);
    check_firsts(&["x = r(a)", "!x", "!a"], ["1.0000 ", "1.0000 ", "1.0000 "]);
}

#[test]
fn what_failed_on_a_cycle_is_tried_again_elsewhere() {
    // Below a, b fails, as it needs a; next to a, it does not.
    let lines = ["x = r(a b)", "a = s(b)", "a = t(c)", "b = u(a)", "!c"];
    check_firsts(&lines, ["0.8151 t u r", "0.8151 t u r", "0.8151 t u r"]);
    check_firsts(&["x = r(a)", "a = s(b)", "b = t(c)", "c = u(a)"], ["", "", ""]);
}

#[test]
fn a_variable_that_is_needed_at_two_depths_is_decided_once() {
    // The public programs miss these, or choose both relations of c.
    let lines = ["x = r(a c)", "a = s(c)", "c = t(d)", "c = u(e) 2", "!d", "!e"];
    let knowledge = knowledge(&lines);
    let graph = Graph::new(&knowledge);
    let expected = ["0.8151 t s r", "0.6695 u s r"];
    let plan = depth_first(&graph, first(&knowledge), &Options::default(), Take::All, LIMITS);
    assert_eq!(text(&knowledge, &plan), expected);
    let plan = property_guided(&graph, first(&knowledge), &Options::default(), usize::MAX, LIMITS);
    assert_eq!(text(&knowledge, &plan), expected);
}

#[test]
fn a_relation_that_is_used_for_three_outputs_counts_once_with_its_smallest_factor() {
    // For a, it needs less than for b and c, between which a is decided.
    let knowledge = knowledge(&["x = r(b a c)", "b a c = s(a d)", "!d"]);
    let plans = all_engines(&knowledge, LIMITS);
    let oracle = exhaustive(&knowledge, first(&knowledge), &Options::default(), LIMITS).substitutions;
    for (engine, plan) in plans {
        assert_eq!(plan.substitutions, oracle, "{engine}");
    }
}

#[test]
fn a_utility_that_may_rise_is_refused() {
    let knowledge = knowledge(&["x = r(a) 0.5", "!a"]);
    for (engine, plan) in all_engines(&knowledge, LIMITS) {
        let found = (plan.stop, plan.bound, plan.substitutions.len());
        assert_eq!(found, (StopReason::NotMonotone, 1.0, 0), "{engine}");
    }
}

fn all_engines(knowledge: &KnowledgeBase, limits: Limits) -> [(&'static str, Plan); 5] {
    let graph = Graph::new(knowledge);
    let (root, options) = (first(knowledge), Options::default());
    [
        ("dfs first", depth_first(&graph, root, &options, Take::First, limits)),
        ("dfs all", depth_first(&graph, root, &options, Take::All, limits)),
        ("orr", ontology(&graph, root, &options, limits)),
        ("sh-pgsa first", property_guided(&graph, root, &options, 1, limits)),
        ("sh-pgsa all", property_guided(&graph, root, &options, usize::MAX, limits)),
    ]
}

/// The end of each search: the number of answers, and the reason.
fn ends(knowledge: &KnowledgeBase, limit: usize) -> Vec<(usize, StopReason)> {
    let limits = Limits { expansions: limit as u64, states: limit };
    let plans = all_engines(knowledge, limits).map(|(engine, plan)| {
        // A combination is decided as a whole, and may exceed the limit by one choice for each variable.
        let most = limits.expansions + knowledge.variables().len() as u64;
        assert!(plan.expanded <= most, "{engine}: {}", plan.expanded);
        (plan.substitutions.len(), plan.stop)
    });
    plans.to_vec()
}

#[test]
fn long_chains() {
    use StopReason::{Complete, Found, LimitExpansions, LimitStates};
    let one = [(1, Found(1)), (1, Complete), (1, Found(1)), (1, Found(1)), (1, Complete)];
    assert_eq!(ends(&chain(100_000, 1), 300_000), one);
    let ends = ends(&chain(50_000, 2), 200_000);
    assert_eq!(ends[0], (1, Found(1)));
    assert!(ends[1].0 > 0 && ends[1].1 == LimitStates, "{ends:?}");
    assert_eq!(ends[2], (1, Found(1)));
    assert!(matches!(ends[3].1, LimitStates | LimitExpansions), "{ends:?}");
}

/// Layers of variables; each variable has `ways` relations, each of which reads the whole next layer.
fn layers(depth: usize, width: usize, ways: usize) -> KnowledgeBase {
    let mut builder = Builder::default();
    let mut above = vec![builder.variable("root", None)];
    for layer in 0..depth {
        let next: Vec<_> = (0..width).map(|i| builder.variable(&format!("v{layer}_{i}"), None)).collect();
        for &variable in &above {
            (0..ways).for_each(|way| builder.relation("r", &[variable], &next, Some(1.0 + (way % 3) as f64)));
        }
        above = next;
    }
    above.iter().for_each(|&leaf| builder.signal(leaf, None));
    builder.build()
}

#[test]
fn complete_bipartite_layers() {
    let ends = ends(&layers(8, 30, 8), 50_000);
    assert_eq!([ends[0], ends[2]], [(1, StopReason::Found(1)); 2]);
    for at in [1, 3, 4] {
        assert!(matches!(ends[at].1, StopReason::LimitStates | StopReason::LimitExpansions), "{ends:?}");
    }
}

#[test]
fn one_relation_of_many_variables_with_many_relations() {
    let ends = ends(&layers(2, 60, 60), 50_000);
    assert_eq!([ends[0], ends[2], ends[3]], [(1, StopReason::Found(1)); 3]);
}

#[test]
fn dense_cycles() {
    for provided in [0, 1, 3] {
        let mut builder = Builder::default();
        let variables: Vec<_> = (0..60).map(|i| builder.variable(&format!("v{i}"), None)).collect();
        for (i, &a) in variables.iter().enumerate() {
            for (j, &b) in variables.iter().enumerate().skip(i + 1) {
                let c = variables[(i * j) % 60];
                builder.relation("r", &[a, b, c], &[a, b, c], None);
            }
        }
        for &variable in variables.iter().rev().take(provided) {
            builder.signal(variable, None);
        }
        let ends = ends(&builder.build(), 50_000);
        let found = if provided > 0 { (1, StopReason::Found(1)) } else { (0, StopReason::Complete) };
        assert_eq!(ends[2], found, "{provided} provided: {ends:?}");
    }
}

#[test]
fn a_limit_leaves_the_best_so_far_and_the_gap() {
    let knowledge = tree(2, 6, Some(0.1), 3);
    let graph = Graph::new(&knowledge);
    let root = first(&knowledge);
    let oracle = exhaustive(&knowledge, root, &Options::default(), LIMITS).substitutions;
    let mut gaps = Vec::new();
    for expansions in 0..200 {
        let limits = Limits { expansions, ..LIMITS };
        let plan = depth_first(&graph, root, &Options::default(), Take::All, limits);
        let best = plan.substitutions.first().map_or(0.0, |(_, utility)| *utility);
        assert!(best <= oracle[0].1 && oracle[0].1 <= best.max(plan.bound), "{best} {}", plan.bound);
        gaps.push((best, plan.bound));
        let plan = property_guided(&graph, root, &Options::default(), usize::MAX, limits);
        let proven = plan.substitutions.iter().filter(|(_, utility)| *utility >= plan.bound).count();
        assert_eq!(plan.substitutions[..proven], oracle[..proven], "{expansions}");
    }
    assert!(gaps.is_sorted_by(|one, next| one.0 <= next.0 && one.1 >= next.1), "{gaps:?}");
}
