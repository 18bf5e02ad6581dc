//! The searches against what the public programs of the thesis answered, where those are right.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::indexing_slicing,
    reason = "tests may fail loudly"
)]

mod plan_support;

use plan_support::{Builder, first, reference, reference_tree};
use serde_json::Value;
use shsa_core::knowledge::KnowledgeBase;
use shsa_core::plan::{BestFirst, Graph, Limits, Options, Plan, StopReason, best, exhaustive};
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
            roots += 1;
        }
    }
    assert_eq!(roots, 161);
}

fn check_tree(label: &str, model: &Value) {
    /// More answers than this are not counted one by one.
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
    let files = [
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
    for file in files {
        let Some(models) = reference(&format!("models/{file}.json")) else { continue };
        for model in models.as_array().unwrap() {
            check_tree(&format!("{file} seed {}", model["seed"]), model);
        }
    }
}
