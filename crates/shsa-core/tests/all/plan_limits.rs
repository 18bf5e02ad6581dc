//! Limits, order of ties, and difficult graphs: nothing overflows, and no search exceeds its limit.

use crate::plan_support::{Builder, chain, first, knowledge, tree};
use shsa_core::knowledge::{KnowledgeBase, VariableId};
use shsa_core::plan::{BestFirst, Graph, Limits, Options, Plan, StopReason, best, exhaustive};

fn all(knowledge: &KnowledgeBase, options: &Options) -> Plan {
    let graph = Graph::new(knowledge);
    let plan = best(&graph, first(knowledge), options, usize::MAX, Limits::default());
    let oracle = exhaustive(knowledge, first(knowledge), options, Limits::default());
    assert_eq!(plan.substitutions, oracle.substitutions);
    assert_eq!(plan.stop, oracle.stop);
    plan
}

/// One line for each substitution: its utility, its steps in order, its sources.
fn text(knowledge: &KnowledgeBase, plan: &Plan) -> String {
    let name = |variable: VariableId| knowledge.variables()[variable].name.as_str();
    let line = |(substitution, utility): &(_, f64)| {
        let substitution: &shsa_core::substitution::Substitution = substitution;
        let steps = substitution.steps.iter();
        let steps: Vec<_> = steps
            .map(|step| format!("{}={}", name(step.output), knowledge.relations()[step.relation].name))
            .collect();
        let sources: Vec<_> = substitution.sources.iter().map(|&source| name(source)).collect();
        format!("{utility:.4} [{}] from {}", steps.join(" "), sources.join(" "))
    };
    plan.substitutions.iter().map(line).collect::<Vec<_>>().join("\n")
}

#[track_caller]
fn check(lines: &[&str], options: &Options, expected: &[&str]) {
    let knowledge = knowledge(lines);
    assert_eq!(text(&knowledge, &all(&knowledge, options)), expected.join("\n"));
}

#[test]
fn a_provided_root_is_expanded_and_known_by_itself() {
    let lines = ["x = r(a)", "x = s(b)", "b = t(x)", "!x", "!a"];
    let expected = ["1.0000 [] from x", "1.0000 [x=r] from a"];
    check(&lines, &Options::default(), &expected);
    check(&lines, &Options { without_empty: true, ..Options::default() }, &expected[1..]);
}

#[test]
fn provided_variables_are_substituted_on_request() {
    let lines = ["x = r(a) 2", "a = s(b) 2", "!a", "!b"];
    check(&lines, &Options::default(), &["0.8214 [x=r] from a"]);
    let options = Options { substitute_provided: true, ..Options::default() };
    check(&lines, &options, &["0.8214 [x=r] from a", "0.6747 [a=s x=r] from b"]);
}

#[test]
fn forbidden_signals_and_relations_are_as_if_they_were_not_there() {
    let lines = ["x = r(a)", "x = s(b)", "a = t(c)", "!a 0.9", "!b 0.5", "!c"];
    let plain = ["0.9643 [x=r] from a", "0.8214 [x=s] from b"];
    check(&lines, &Options::default(), &plain);
    let kb = knowledge(&lines);
    let forbidden_signals = vec![kb.carriers(kb.variable("a").unwrap())[0]];
    let options = Options { forbidden_signals, ..Options::default() };
    check(&lines, &options, &["0.9643 [a=t x=r] from c", "0.8214 [x=s] from b"]);
    let forbidden_relations = kb.relations().ids().take(1).collect();
    check(&lines, &Options { forbidden_relations, ..options }, &plain[1..]);
}

#[test]
fn a_shared_variable_is_computed_once() {
    let lines = ["x = r(a b)", "a = s(c)", "b = t(c)", "c = u(d)", "!d"];
    check(&lines, &Options::default(), &["0.7859 [c=u a=s b=t x=r] from d"]);
}

#[test]
fn a_relation_that_is_used_twice_counts_once() {
    let lines = ["x = r(a b)", "a b = s(c d)", "!c", "!d"];
    check(&lines, &Options::default(), &["0.7547 [a=s b=s x=r] from c d"]);
}

#[test]
fn ties_prefer_fewer_relations_then_file_order() {
    let lines = ["x = late(e)", "e = free(f)", "x = r(a)", "x = s(b)", "!f", "!a", "!b"];
    let expected = ["1.0000 [x=r] from a", "1.0000 [x=s] from b", "0.9643 [e=free x=late] from f"];
    check(&lines, &Options::default(), &expected);
}

#[test]
fn a_cycle_is_no_substitution() {
    check(&["x = r(a)", "a = s(b)", "b = t(a)"], &Options::default(), &[]);
    let lines = ["x = r(a)", "a = s(b)", "b = t(a)", "b = u(c)", "!c"];
    check(&lines, &Options::default(), &["0.9298 [b=u a=s x=r] from c"]);
}

#[test]
fn a_utility_that_may_rise_is_refused() {
    let knowledge = knowledge(&["x = r(a) 0.5", "!a"]);
    let problems = knowledge.utility().check(&knowledge);
    assert_eq!(problems.len(), 1);
    assert_eq!(problems[0].message, "the cost 0.5 of relation `r` is below 1");
    let plan = all(&knowledge, &Options::default());
    assert_eq!((plan.stop, plan.bound, plan.substitutions.len()), (StopReason::NotMonotone, 1.0, 0));
}

#[test]
fn a_limit_stops_at_the_same_place_and_leaves_a_true_bound() {
    let knowledge = tree(2, 6, Some(0.1), 3);
    let graph = Graph::new(&knowledge);
    let complete = all(&knowledge, &Options::default());
    for expansions in 0..complete.expanded {
        let limits = Limits { expansions, ..Limits::default() };
        let mut search = BestFirst::new(&graph, first(&knowledge), &Options::default(), limits);
        let found: Vec<_> = search.by_ref().collect();
        assert_eq!(search.stop(), StopReason::LimitExpansions);
        assert_eq!(found, complete.substitutions[..found.len()]);
        let missing = complete.substitutions.get(found.len());
        assert!(missing.is_none_or(|(_, utility)| *utility <= search.bound()));
    }
}

#[test]
fn a_limit_before_the_first_answer_leaves_a_valid_one() {
    let knowledge =
        knowledge(&["x = r(a b)", "a = s(c) 2", "a = t(d)", "b = u(d)", "d = v(e) 3", "!c", "!e"]);
    let graph = Graph::new(&knowledge);
    let limits = Limits { expansions: 1, ..Limits::default() };
    let plan = best(&graph, first(&knowledge), &Options::default(), 3, limits);
    assert_eq!(text(&knowledge, &plan), "0.5101 [a=s d=v b=u x=r] from c e");
    assert_eq!(plan.stop, StopReason::LimitExpansions);
    assert!(plan.bound > 0.5988);
}

/// The number of substitutions found within limits of about a second.
fn within_limits(knowledge: &KnowledgeBase, count: usize) -> (usize, StopReason) {
    let graph = Graph::new(knowledge);
    let limits = Limits { expansions: 400_000, states: 400_000 };
    let mut search = BestFirst::new(&graph, first(knowledge), &Options::default(), limits);
    let found = search.by_ref().take(count).count();
    // The last decision may open as many states as a variable has relations.
    assert!(search.expanded() <= limits.expansions + knowledge.variables().len() as u64);
    (found, search.stop())
}

#[test]
fn long_chains() {
    assert_eq!(within_limits(&chain(100_000, 1), 10), (1, StopReason::Complete));
    assert_eq!(within_limits(&chain(20_000, 2), 5), (5, StopReason::Found(5)));
    assert_eq!(within_limits(&chain(50_000, 2), usize::MAX).1, StopReason::LimitStates);
}

/// Layers of variables; each variable has `ways` relations, each of which reads the whole next layer.
#[test]
fn complete_bipartite_layers() {
    let mut builder = Builder::default();
    let mut above = vec![builder.variable("root", None)];
    for layer in 0..8 {
        let next: Vec<_> = (0..30).map(|i| builder.variable(&format!("v{layer}_{i}"), None)).collect();
        for &variable in &above {
            (0..8).for_each(|way| builder.relation("r", &[variable], &next, Some(1.0 + (way % 3) as f64)));
        }
        above = next;
    }
    above.iter().for_each(|&leaf| builder.signal(leaf, None));
    let (_, stop) = within_limits(&builder.build(), usize::MAX);
    assert!(matches!(stop, StopReason::LimitStates | StopReason::LimitExpansions), "{stop:?}");
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
        let (found, stop) = within_limits(&builder.build(), 1_000);
        let solvable = provided > 0;
        assert_eq!(found > 0, solvable, "{provided} provided: {stop:?}");
    }
}
