//! Times of the exact search and of the table of plans for every failure; reading and preparing a knowledge base is
//! not included.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs, reason = "benchmarks may fail loudly")]

#[path = "../tests/plan_support/mod.rs"]
mod plan_support;

use criterion::{Criterion, criterion_group, criterion_main};
use plan_support::{drivetrain, first, large, reference, reference_tree, tree, under_contract};
use shsa_core::assurance::{Assurance, Reading, Search};
use shsa_core::interval::Truth;
use shsa_core::knowledge::{ContractId, Element, Id, KnowledgeBase, SignalId, VariableId, Watched};
use shsa_core::plan::{BestFirst, Contingency, Graph, Limits, Options, Plan, Preparation, Scratch};
use shsa_core::substitution::Way;
use std::hint::black_box;

/// The baseline of a search: a breadth-first visit of the variables that it can reach.
struct Visit {
    provided: Vec<bool>,
    seen: Vec<u32>,
    round: u32,
    queue: Vec<VariableId>,
}

impl Visit {
    fn new(knowledge: &KnowledgeBase) -> Visit {
        let provided: Vec<_> = knowledge.variables().ids().map(|v| knowledge.is_provided(v)).collect();
        Visit { seen: vec![0; provided.len()], provided, round: 0, queue: Vec::new() }
    }

    fn run(&mut self, knowledge: &KnowledgeBase, root: VariableId) -> usize {
        self.round += 1;
        self.queue.clear();
        self.queue.push(root);
        self.seen[root.index()] = self.round;
        let mut next = 0;
        while let Some(&variable) = self.queue.get(next) {
            next += 1;
            for &relation in knowledge.producers(variable) {
                for input in knowledge.relations()[relation].needs(variable) {
                    let at = input.index();
                    if !self.provided[at] && self.seen[at] != self.round {
                        self.seen[at] = self.round;
                        self.queue.push(input);
                    }
                }
            }
        }
        next
    }
}

fn bench_model(c: &mut Criterion, name: &str, knowledge: &KnowledgeBase, root: VariableId, count: usize) {
    let graph = Graph::new(knowledge);
    let options = Options::default();
    let (mut scratch, mut plan) = (Scratch::default(), Plan::default());
    let what = if count == usize::MAX { "all".to_owned() } else { format!("first {count}") };
    let mut group = c.benchmark_group(name);
    group.bench_function(&what, |b| {
        b.iter(|| {
            let search =
                &mut BestFirst::with_scratch(&mut scratch, &graph, black_box(root), &options, Limits::NONE);
            plan.refill(search, count);
            plan.bound
        });
    });
    group.bench_function(format!("{what}, memory anew"), |b| {
        b.iter(|| BestFirst::new(&graph, black_box(root), &options, Limits::NONE).take(count).count());
    });
    let mut visit = Visit::new(knowledge);
    group.bench_function("breadth-first visit", |b| b.iter(|| visit.run(knowledge, black_box(root))));
    group.finish();
}

fn drivetrain_bench(c: &mut Criterion) {
    let knowledge = drivetrain();
    let root = knowledge.variable("steering_angle").unwrap();
    bench_model(c, "drivetrain", &knowledge, root, 1);
    bench_model(c, "drivetrain", &knowledge, root, usize::MAX);
}

fn trees(c: &mut Criterion) {
    for seed in 0..3 {
        let knowledge = tree(2, 14, Some(0.2), seed);
        bench_model(c, &format!("ex2 d14 own seed {seed}"), &knowledge, first(&knowledge), 1);
    }
    let ex1 = tree(2, 8, None, 0);
    bench_model(c, "ex1 d8", &ex1, first(&ex1), 1);
    bench_model(c, "ex1 d8", &ex1, first(&ex1), usize::MAX);
    let ex1 = tree(2, 10, None, 0);
    bench_model(c, "ex1 d10", &ex1, first(&ex1), 1);
}

fn recorded(c: &mut Criterion) {
    for file in ["ex2_b2_d14", "ex2_b2_d16"] {
        let Some(models) = reference(&format!("models/{file}.json")) else { continue };
        for model in models.as_array().unwrap() {
            let knowledge = reference_tree(model);
            bench_model(c, &format!("{file} seed {}", model["seed"]), &knowledge, first(&knowledge), 1);
        }
    }
}

/// Looking up the plan after a loss, and updating the table after a change of one signal.
fn contingency(c: &mut Criterion) {
    for (name, knowledge, roots) in [
        ("ex2 d14", tree(2, 14, Some(0.2), 0), 1),
        ("100,000 relations", large(100_000, 0), 1_000),
        ("1,000,000 relations", large(1_000_000, 0), 10_000),
    ] {
        bench_contingency(c, name, knowledge, roots);
    }
}

fn bench_contingency(c: &mut Criterion, name: &str, mut knowledge: KnowledgeBase, roots: usize) {
    let mut graph = Graph::new(&knowledge);
    let variables: Vec<VariableId> =
        knowledge.variables().ids().step_by(knowledge.variables().len() / roots).collect();
    let mut table = Contingency::new(&knowledge, &graph, variables, Preparation::default());
    println!("{name}: {} searches for {} variables", table.searches(), table.variables().count());
    let losses: Vec<(VariableId, SignalId)> = table
        .variables()
        .flat_map(|variable| table.losses(variable).map(move |(loss, _)| (variable, loss)))
        .filter_map(|(variable, loss)| loss.first().map(|&lost| (variable, lost)))
        .collect();
    let mut group = c.benchmark_group(format!("contingency {name}"));
    let mut at = 0;
    group.bench_function("one plan of the table", |b| {
        b.iter(|| {
            at = (at + 7919) % losses.len();
            table.plan(losses[at].0, black_box(&[losses[at].1]))
        });
    });
    group.bench_function("all plans after a change of one signal", |b| {
        b.iter(|| {
            // A signal is lost, and comes back before the next loss.
            let lost = !knowledge.is_available(losses[at].1);
            at = if lost { at } else { (at + 7919) % losses.len() };
            let signal = losses[at].1;
            knowledge.set_available(signal, lost);
            graph.update(&knowledge, &[Element::Signal(signal)]);
            table.update(&knowledge, &graph, &[Element::Signal(signal)]).len()
        });
    });
    group.finish();
}

/// The first answer without contracts, with contracts that are asked of each answer, and the bounds that a search uses where
/// contracts refuse: made, and after a change of one piece of evidence.
fn contracts(c: &mut Criterion) {
    let (drivetrain, trees) = (drivetrain(), [(2, 8), (2, 14)]);
    let steering = drivetrain.variable("steering_angle").unwrap();
    bench_contracts(c, "drivetrain", &drivetrain, steering);
    for (branch, depth) in trees {
        let tree = tree(branch, depth, Some(0.2), 0);
        bench_contracts(c, &format!("ex2 d{depth}"), &tree, first(&tree));
    }
}

fn bench_contracts(c: &mut Criterion, name: &str, plain: &KnowledgeBase, root: VariableId) {
    let knowledge = under_contract(plain, root);
    let (options, assurance) = (Options::default(), Assurance::new(&knowledge).unwrap());
    let need = knowledge.needs().ids().next().unwrap();
    let all = |_: ContractId, _: &Watched, _: &Way| Reading::lasting(Truth::True);
    let graph = Graph::new(&knowledge);
    let without = || BestFirst::new(&graph, black_box(root), &options, Limits::NONE);
    let asked = || Search::new(&knowledge, &assurance, need, &all, &[]);
    assert_eq!(without().admitted_by(&asked()).next(), without().next(), "all is admissible");
    let mut group = c.benchmark_group(format!("contracts {name}"));
    group.sample_size(10);
    group.bench_function("without", |b| b.iter(|| without().next()));
    group.bench_function("inside", |b| b.iter(|| without().admitted_by(&asked()).next()));
    group.bench_function("bounds, made", |b| b.iter(|| assurance.bounds(&knowledge, black_box(need))));
    let mut bounds = assurance.bounds(&knowledge, need);
    bounds.read(&knowledge, &all);
    group.bench_function("bounds, no change", |b| b.iter(|| bounds.read(&knowledge, &all)));
    let first = ContractId::from_index(0);
    let but_one = |contract, _: &Watched, _: &Way| {
        Reading::lasting(if contract == first { Truth::False } else { Truth::True })
    };
    let mut holds = true;
    group.bench_function("bounds, one change", |b| {
        b.iter(|| {
            holds = !holds;
            bounds.read(&knowledge, if holds { &all } else { &but_one });
        });
    });
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().warm_up_time(std::time::Duration::from_millis(300))
        .measurement_time(std::time::Duration::from_millis(1_000)).sample_size(20);
    targets = drivetrain_bench, trees, recorded, contingency, contracts
}
criterion_main!(benches);
