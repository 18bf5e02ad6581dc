//! The searches compared with the answers of the thesis's public programs, where those are right.

use crate::plan_support::{Builder, first, reference, reference_tree};
use serde_json::Value;
use shsa_core::knowledge::{KnowledgeBase, VariableId};
use shsa_core::plan::{
    BestFirst, Graph, Limits, Options, Plan, StopReason, Take, best, depth_first, exhaustive, ontology,
    property_guided,
};
use std::collections::BTreeMap;

fn names(list: &Value) -> Vec<String> {
    list.as_array().unwrap().iter().map(|name| name.as_str().unwrap().to_owned()).collect()
}

fn model(graph: &Value) -> KnowledgeBase {
    let mut builder = Builder::default();
    for (name, facts) in graph["variables"].as_object().unwrap() {
        let variable = builder.variable(name, facts["accuracy"].as_f64());
        if facts["provided"].as_bool().unwrap() {
            builder.signal(variable, None);
        }
    }
    for (name, facts) in graph["relations"].as_object().unwrap() {
        let mut ids = |key: &str| -> Vec<_> {
            names(&facts[key]).iter().map(|name| builder.variable(name, None)).collect()
        };
        let (inputs, outputs) = (ids("in"), ids("out"));
        builder.relation(name, &outputs, &inputs, facts["cost"].as_f64());
    }
    builder.build()
}

fn recorded(answers: &Value) -> BTreeMap<Vec<String>, f64> {
    let answers = answers.as_array().unwrap().iter();
    answers.map(|answer| (names(&answer["relations"]), answer["utility"].as_f64().unwrap())).collect()
}

fn found(knowledge: &KnowledgeBase, plan: &Plan) -> BTreeMap<Vec<String>, f64> {
    let name = |relation| knowledge.relations()[relation].name.clone();
    let sorted = |mut names: Vec<String>| {
        names.sort();
        names
    };
    let answers = plan.substitutions.iter();
    answers.map(|(s, utility)| (sorted(s.relations().into_iter().map(name).collect()), *utility)).collect()
}

#[track_caller]
fn check_same(label: &str, found: &BTreeMap<Vec<String>, f64>, recorded: &BTreeMap<Vec<String>, f64>) {
    let sets = |answers: &BTreeMap<Vec<String>, f64>| answers.keys().cloned().collect::<Vec<_>>();
    assert_eq!(sets(found), sets(recorded), "{label}");
    for (relations, utility) in found {
        assert!((utility - recorded[relations]).abs() < 1e-9, "{label} {relations:?}: {utility}");
    }
}

#[test]
fn all_roots_of_all_models_as_recorded() {
    let Some(golden) = reference("search.json") else { return };
    let mut roots = 0;
    for (file, recordings) in golden["models"].as_object().unwrap() {
        let knowledge = model(&recordings["graph"]);
        let graph = Graph::new(&knowledge);
        for (root, recording) in recordings["roots"].as_object().unwrap() {
            let id = knowledge.variable(root).unwrap();
            let all = best(&graph, id, &Options::default(), usize::MAX, Limits::default());
            let oracle = exhaustive(&knowledge, id, &Options::default(), Limits::default());
            assert_eq!(all.stop, StopReason::Complete);
            assert_eq!(all.substitutions, oracle.substitutions, "{file} {root}");
            check_same(&format!("{file} {root}"), &found(&knowledge, &all), &recorded(&recording["dfs"]));
            check_engines(&format!("{file} {root}"), &knowledge, id, recording);
            roots += 1;
        }
    }
    assert_eq!(roots, 161);
}

/// The searches of the thesis: all substitutions, and those that the public programs found.
fn check_engines(label: &str, knowledge: &KnowledgeBase, root: VariableId, recording: &Value) {
    let graph = Graph::new(knowledge);
    let (options, limits) = (Options::default(), Limits::default());
    let oracle = exhaustive(knowledge, root, &options, limits);
    let all = depth_first(&graph, root, &options, Take::All, limits);
    assert_eq!((all.stop, &all.substitutions), (StopReason::Complete, &oracle.substitutions), "{label} dfs");
    let all = property_guided(&graph, root, &options, usize::MAX, limits);
    assert_eq!(
        (all.stop, &all.substitutions),
        (StopReason::Complete, &oracle.substitutions),
        "{label} shpgsa"
    );
    for variant in recording["shpgsa"].as_array().unwrap() {
        let sequence = variant["sequence"].as_array().unwrap();
        // The public program does not expand a root that is provided.
        assert!(recording["provided"] == true || sequence.len() == all.substitutions.len(), "{label} shpgsa");
        for (recorded, (_, utility)) in sequence.iter().zip(&all.substitutions) {
            assert!((recorded["utility"].as_f64().unwrap() - utility).abs() < 1e-9, "{label} shpgsa");
        }
    }
    let one = found(knowledge, &ontology(&graph, root, &options, limits));
    let variants = || recording["orr"].as_array().unwrap().iter();
    let none = variants().all(|variant| variant["result"].as_str().unwrap().starts_with("none"));
    assert_eq!(one.is_empty(), none, "{label} orr");
    for (relations, utility) in one {
        // The order of its relations was that of a hash set: one of its answers equals ours.
        let mut same = variants()
            .filter(|variant| variant["result"] == "found" && names(&variant["relations"]) == relations);
        let same = same.next().expect(label);
        assert!((same["utility"].as_f64().unwrap() - utility).abs() < 1e-9, "{label} orr");
    }
}

/// The generated trees.
const FILES: [&str; 18] = [
    "ex1_b2_d2",
    "ex1_b2_d4",
    "ex1_b2_d6",
    "ex1_b2_d8",
    "ex2_b2_d2",
    "ex2_b2_d4",
    "ex2_b2_d6",
    "ex2_b2_d8",
    "ex2_b2_d10",
    "ex2_b2_d12",
    "ex2_b2_d14",
    "ex2_b2_d16",
    "ex3_b1_d6",
    "ex3_b2_d6",
    "ex3_b3_d6",
    "ex3_b4_d6",
    "ex3c_b2_d6",
    "ex3c_b3_d6",
];

fn check_tree(label: &str, model: &Value) {
    /// Answers beyond this number are not counted one by one.
    const COUNTED: u64 = 20_000;
    let knowledge = reference_tree(model);
    let graph = Graph::new(&knowledge);
    let root = first(&knowledge);
    let (count, utility) =
        (model["expected"]["count"].as_u64().unwrap(), model["expected"]["best_utility"].as_f64().unwrap());
    let mut search = BestFirst::new(&graph, root, &Options::default(), Limits::NONE);
    let (_, first) = search.next().expect("a substitution");
    assert!((first - utility).abs() < 1e-9, "{label}: {first}, not {utility}");
    if count <= COUNTED {
        assert_eq!(1 + search.count() as u64, count, "{label}");
    }
    if count <= 300 {
        let oracle = exhaustive(&knowledge, root, &Options::default(), Limits::default());
        let all = best(&graph, root, &Options::default(), usize::MAX, Limits::default());
        assert_eq!(all.substitutions, oracle.substitutions, "{label}");
    }
}

#[test]
fn generated_trees_as_computed() {
    for file in FILES {
        let Some(models) = reference(&format!("models/{file}.json")) else { continue };
        for model in models.as_array().unwrap() {
            check_tree(&format!("{file} seed {}", model["seed"]), model);
        }
    }
}

/// Checks the first answer of each search on one tree; returns whether that of the public SH-PGSA was below the best.
fn check_first(label: &str, model: &Value) -> bool {
    let expected = &model["expected"];
    let utility = |key: &str| expected[key].as_f64();
    let (best, count) = (utility("best_utility").unwrap(), expected["count"].as_u64().unwrap());
    let knowledge = reference_tree(model);
    let graph = Graph::new(&knowledge);
    let (root, options, limits) = (first(&knowledge), Options::default(), Limits::default());
    let guided = property_guided(&graph, root, &options, 1, limits);
    assert_eq!(guided.stop, StopReason::Found(1), "{label}");
    assert!((guided.substitutions[0].1 - best).abs() < 1e-9, "{label}: {guided:?}");
    let any =
        [ontology(&graph, root, &options, limits), depth_first(&graph, root, &options, Take::First, limits)];
    for plan in any {
        assert_eq!((plan.stop, plan.substitutions.len()), (StopReason::Found(1), 1), "{label}");
        assert!(plan.substitutions[0].1 <= best + 1e-9, "{label}: {plan:?}");
    }
    if count <= 10_000 {
        let all = depth_first(&graph, root, &options, Take::All, limits);
        assert_eq!((all.stop, all.substitutions.len() as u64), (StopReason::Complete, count), "{label} dfs");
        let guided = property_guided(&graph, root, &options, usize::MAX, limits);
        assert_eq!(guided.stop, StopReason::Complete, "{label}");
        assert_eq!(guided.substitutions, all.substitutions, "{label}");
    }
    utility("shpgsa_first_utility").is_some_and(|public| public < best - 1e-9)
}

#[test]
fn the_first_answer_is_the_best_where_that_of_the_public_program_is_not() {
    // For each kind of tree: the number of trees, and of those where the public program's first answer is below the best.
    let mut kinds: BTreeMap<&str, (usize, usize)> = BTreeMap::new();
    for file in FILES {
        let Some(models) = reference(&format!("models/{file}.json")) else { return };
        for model in models.as_array().unwrap() {
            let below = check_first(&format!("{file} seed {}", model["seed"]), model);
            let counts = kinds.entry(file.split('_').next().unwrap()).or_default();
            *counts = (counts.0 + 1, counts.1 + usize::from(below));
        }
    }
    let expected = [("ex1", (4, 0)), ("ex2", (34, 14)), ("ex3", (18, 5)), ("ex3c", (8, 4))];
    assert_eq!(kinds.into_iter().collect::<Vec<_>>(), expected);
}
