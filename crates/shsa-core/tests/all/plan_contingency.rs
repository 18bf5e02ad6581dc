//! The table of plans for every failure compared with new searches, on random knowledge bases.

use crate::plan_support::{KINDS, Kind, Random, first, knowledge, random, random_utility, tree};
use crate::seeds::seeds;
use shsa_core::knowledge::{
    Element, Id, IdVec, KnowledgeBase, Relation, RelationId, Signal, SignalId, Variable, VariableId,
};
use shsa_core::plan::{Contingency, Graph, Limits, Options, Plan, Preparation, StopReason, best};

fn preparation(random: &mut Random) -> Preparation {
    let options = Options {
        substitute_provided: random.chance(0.2),
        without_empty: random.chance(0.2),
        ..Options::default()
    };
    let count = [1, 1, 2, 5, usize::MAX][random.below(5)];
    let limits = Limits { expansions: 100_000, states: 100_000 };
    Preparation { count, pairs: random.chance(0.5), options, limits, ..Preparation::default() }
}

fn some_knowledge(numbers: &mut Random) -> KnowledgeBase {
    let kind = KINDS[numbers.below(KINDS.len())];
    let size = match kind {
        Kind::Tree | Kind::BidirectionalTree => 4 + numbers.below(30),
        Kind::Shared => 3 + numbers.below(12),
        Kind::Cyclic | Kind::Equations | Kind::Mixed => 3 + numbers.below(8),
    };
    let ties = numbers.chance(0.3);
    let knowledge = random(numbers, kind, size, ties).with_utility(random_utility(numbers));
    if numbers.chance(0.5) { knowledge } else { changed(&knowledge, |parts| derive(numbers, parts)) }
}

/// Derives some signals from others, also transitively and in cycles.
fn derive(numbers: &mut Random, parts: &mut Parts) {
    let count = parts.signals.len();
    for signal in parts.signals.iter_mut() {
        if numbers.chance(0.3) {
            let origins = 0..1 + numbers.below(2);
            signal.derived_from = origins.map(|_| SignalId::from_index(numbers.below(count))).collect();
        }
    }
}

struct Parts {
    variables: IdVec<VariableId, Variable>,
    relations: IdVec<RelationId, Relation>,
    signals: IdVec<SignalId, Signal>,
}

/// The same knowledge base with other numbers somewhere; availability is kept.
fn changed(old: &KnowledgeBase, change: impl FnOnce(&mut Parts)) -> KnowledgeBase {
    let mut parts = Parts { variables: IdVec::new(), relations: IdVec::new(), signals: IdVec::new() };
    old.variables().iter().for_each(|item| _ = parts.variables.push(item.clone()));
    old.relations().iter().for_each(|item| _ = parts.relations.push(item.clone()));
    old.signals().iter().for_each(|item| _ = parts.signals.push(item.clone()));
    change(&mut parts);
    let mut new = KnowledgeBase::from_parts(parts.variables, parts.relations, parts.signals, IdVec::new())
        .with_utility(old.utility().clone());
    old.signals().ids().for_each(|signal| new.set_available(signal, old.is_available(signal)));
    new
}

/// Some variables of a knowledge base, the first one among them.
fn some_variables(numbers: &mut Random, knowledge: &KnowledgeBase) -> Vec<VariableId> {
    let chosen = knowledge.variables().ids().filter(|id| id.index() == 0 || numbers.chance(0.15));
    chosen.collect()
}

/// Compares a plan with a search; the bounds may differ, but must be valid.
#[track_caller]
fn check_plan(known: &Plan, graph: &Graph, table: &Contingency, variable: VariableId, lost: &[SignalId]) {
    let Preparation { count, options, limits, .. } = table.preparation();
    let options = Options { forbidden_signals: lost.to_vec(), ..options.clone() };
    let fresh = best(graph, variable, &options, *count, *limits);
    assert_eq!((&known.substitutions, known.stop), (&fresh.substitutions, fresh.stop), "lost {lost:?}");
    let next = best(graph, variable, &options, count.saturating_add(1), *limits).substitutions;
    let next = next.get(*count).map_or(f64::NEG_INFINITY, |(_, utility)| *utility);
    let last = fresh.substitutions.last().map_or(1.0, |(_, utility)| *utility);
    assert!((next..=last).contains(&known.bound), "lost {lost:?}: {next} {} {last}", known.bound);
}

/// Losses of every signal and of every pair, with and without derived signals, and of some larger sets; returns how many of them
/// are in the table.
fn check_table(seed: u64, knowledge: &KnowledgeBase, graph: &Graph, table: &Contingency) -> usize {
    eprintln!("seed {seed}");
    let signals: Vec<SignalId> = knowledge.signals().ids().collect();
    let pairs = signals.iter().flat_map(|&a| signals.iter().map(move |&b| vec![b, a]));
    let raw: Vec<Vec<SignalId>> = std::iter::once(vec![]).chain(pairs).collect();
    let events: Vec<Vec<SignalId>> = raw.iter().map(|lost| table.with_derived(lost)).collect();
    let must_be_known = |lost: &[SignalId]| lost.len() < 2 || lost[0] == lost[1] || table.preparation().pairs;
    let of_two = raw.iter().zip(&raw).chain(events.iter().zip(&raw));
    let mut losses: Vec<_> = of_two.map(|(lost, of)| (lost.clone(), must_be_known(of))).collect();
    let mut numbers = Random(seed);
    losses
        .extend((0..30).map(|_| (signals.iter().copied().filter(|_| numbers.chance(0.3)).collect(), false)));
    let mut known = 0;
    for variable in table.variables() {
        assert!(table.is_complete(variable));
        for (lost, must_be_known) in &losses {
            check_plan(&table.plan_or_search(knowledge, graph, variable, lost), graph, table, variable, lost);
            match table.plan(variable, lost) {
                None => assert!(!must_be_known, "lost {lost:?}"),
                Some(plan) => {
                    check_plan(plan, graph, table, variable, lost);
                    known += 1;
                }
            }
        }
    }
    known
}

#[test]
fn every_loss_has_the_plan_of_a_search() {
    let mut known = 0;
    for seed in seeds(60) {
        let mut numbers = Random(seed);
        let knowledge = some_knowledge(&mut numbers);
        let variables = some_variables(&mut numbers, &knowledge);
        let graph = Graph::new(&knowledge);
        let table = Contingency::new(&knowledge, &graph, variables, preparation(&mut numbers));
        known += check_table(seed, &knowledge, &graph, &table);
    }
    assert!(known > 9_000, "the knowledge bases are too simple: {known}");
}

/// Changes a number of a random element.
fn set_property(numbers: &mut Random, parts: &mut Parts) -> Element {
    let accuracy = if numbers.chance(0.05) { 1.5 } else { numbers.share() };
    match numbers.below(3) {
        0 if !parts.signals.is_empty() => {
            let id = SignalId::from_index(numbers.below(parts.signals.len()));
            parts.signals[id].properties.insert("accuracy", accuracy);
            Element::Signal(id)
        }
        1 if !parts.relations.is_empty() => {
            let id = RelationId::from_index(numbers.below(parts.relations.len()));
            let cost = if numbers.chance(0.05) { 0.5 } else { 1.0 + 9.0 * numbers.share() };
            parts.relations[id].properties.insert("cost", cost);
            Element::Relation(id)
        }
        _ => {
            let id = VariableId::from_index(numbers.below(parts.variables.len()));
            parts.variables[id].properties.insert("accuracy", accuracy);
            Element::Variable(id)
        }
    }
}

fn change(numbers: &mut Random, knowledge: &mut KnowledgeBase) -> Element {
    if numbers.chance(0.5) && !knowledge.signals().is_empty() {
        let signal = SignalId::from_index(numbers.below(knowledge.signals().len()));
        knowledge.set_available(signal, !knowledge.is_available(signal));
        return Element::Signal(signal);
    }
    let mut what = None;
    *knowledge = changed(knowledge, |parts| what = Some(set_property(numbers, parts)));
    what.unwrap()
}

#[test]
fn a_table_that_is_kept_current_equals_one_that_is_made_anew() {
    let (mut again, mut not) = (0, 0);
    for seed in seeds(50) {
        let mut numbers = Random(seed);
        let mut knowledge = some_knowledge(&mut numbers);
        let variables = some_variables(&mut numbers, &knowledge);
        let mut graph = Graph::new(&knowledge);
        let mut table = Contingency::new(&knowledge, &graph, variables.clone(), preparation(&mut numbers));
        for _ in 0..6 {
            let changed: Vec<Element> =
                (0..1 + numbers.below(2)).map(|_| change(&mut numbers, &mut knowledge)).collect();
            graph.update(&knowledge, &changed);
            let fresh = Graph::new(&knowledge);
            assert_eq!(format!("{graph:?}"), format!("{fresh:?}"), "seed {seed}: {changed:?}");
            let updated = table.update(&knowledge, &graph, &changed);
            again += updated.len();
            not += variables.len() - updated.len();
            assert_eq!(table.version(), knowledge.version());
            let new = Contingency::new(&knowledge, &fresh, variables.clone(), table.preparation().clone());
            for &variable in &variables {
                let old: Vec<_> = table.losses(variable).collect();
                let new: Vec<_> = new.losses(variable).collect();
                assert_eq!(old, new, "seed {seed}: {changed:?}");
            }
        }
    }
    assert!(again > 100 && not > 100, "{again} made again, {not} not");
}

fn only_need(lines: &[&str], preparation: Preparation) -> (KnowledgeBase, Graph, Contingency) {
    let knowledge = knowledge(lines);
    let graph = Graph::new(&knowledge);
    let table = Contingency::new(&knowledge, &graph, [knowledge.variable("x").unwrap()], preparation);
    (knowledge, graph, table)
}

fn signals(knowledge: &KnowledgeBase, names: &[&str]) -> Vec<SignalId> {
    names.iter().map(|name| knowledge.signal(name).unwrap()).collect()
}

const CHAIN: [&str; 8] = ["x = r0(a)", "x = r1(b) 2", "b = r2(c)", "c = r3(d)", "!a", "!b", "!d", "!z"];

#[test]
fn what_makes_no_difference_is_left_out_of_a_loss() {
    let (knowledge, _, table) = only_need(&CHAIN, Preparation { pairs: true, ..Preparation::default() });
    let x = knowledge.variable("x").unwrap();
    let [a, b, d] = signals(&knowledge, &["/a/0", "/b/1", "/d/2"])[..] else { panic!() };
    let loss = |names: &[&str]| table.loss(x, &signals(&knowledge, names));
    assert_eq!(loss(&["/z/3"]), Some(&[][..]));
    assert_eq!(loss(&["/d/2"]), Some(&[][..]), "behind b, which is provided");
    assert_eq!(loss(&["/z/3", "/a/0", "/d/2"]), Some(&[a][..]));
    assert_eq!(loss(&["/b/1", "/a/0", "/z/3"]), Some(&[a, b][..]));
    assert_eq!(loss(&["/b/1", "/a/0", "/d/2"]), None, "d is read once a and b are lost");
    assert_eq!(loss(&["/d/2", "/b/1"]), Some(&[b][..]), "a is better whatever b is known from");
    assert!(table.losses(x).all(|(lost, _)| !lost.contains(&d)));
    assert_eq!((table.events(x), table.then_matter(x, &[a, b])), (&[a, b][..], &[d][..]));
}

#[test]
fn a_loss_that_no_substitution_survives_has_an_empty_plan() {
    let (knowledge, _, table) = only_need(&["x = r(a)", "!a"], Preparation::default());
    let x = knowledge.variable("x").unwrap();
    let plan = table.plan(x, &signals(&knowledge, &["/a/0"])).unwrap();
    assert_eq!((plan.substitutions.len(), plan.stop), (0, StopReason::Complete));
}

#[test]
fn what_the_work_was_not_enough_for_is_searched_for() {
    let lines = ["x = r0(a)", "x = r1(b)", "!a", "!b"];
    for work in 0..60 {
        let preparation = Preparation { work_each: work, ..Preparation::default() };
        let (knowledge, graph, table) = only_need(&lines, preparation);
        let x = knowledge.variable("x").unwrap();
        for lost in [vec![], signals(&knowledge, &["/a/0"]), signals(&knowledge, &["/b/1"])] {
            check_plan(&table.plan_or_search(&knowledge, &graph, x, &lost), &graph, &table, x, &lost);
        }
        assert_eq!(table.is_complete(x), table.plan(x, &signals(&knowledge, &["/b/1"])).is_some());
    }
    let nothing = Preparation { work: 0, ..Preparation::default() };
    assert_eq!(only_need(&lines, nothing).2.variables().count(), 0);
}

#[test]
fn a_table_of_an_earlier_version_is_not_used() {
    let (mut knowledge, mut graph, table) = only_need(&CHAIN, Preparation::default());
    let x = knowledge.variable("x").unwrap();
    let a = knowledge.signal("/a/0").unwrap();
    knowledge.set_available(a, false);
    graph.update(&knowledge, &[Element::Signal(a)]);
    let plan = table.plan_or_search(&knowledge, &graph, x, &[]);
    assert_eq!(plan.substitutions[0].0.sources, [knowledge.variable("b").unwrap()]);
}

#[test]
fn only_losses_that_can_make_a_difference_are_searched_for() {
    let knowledge = tree(2, 14, Some(0.2), 0);
    let graph = Graph::new(&knowledge);
    let root = first(&knowledge);
    let table = Contingency::new(&knowledge, &graph, [root], Preparation::default());
    let (_, plan) = table.losses(root).next().unwrap();
    let losses = table.losses(root).count() as u64;
    let used = plan.substitutions[0].0.sources.len() as u64;
    assert!(losses > 4 * used && table.searches() == 1 + used, "{losses} {used} {}", table.searches());
}
