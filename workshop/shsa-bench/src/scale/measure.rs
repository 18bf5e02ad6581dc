//! Measures one model: loading, setting up, planning, and the cost of changed signals and of a changed structure.

use crate::processor::memory_bytes;
use anyhow::{Context, bail};
use serde_json::{Value, json};
use shsa_core::knowledge::{Element, Id, IdVec, KnowledgeBase, Lineage, Relation, SignalId, VariableId};
use shsa_core::plan::{BestFirst, Contingency, Graph, Limits, Options, Preparation, Scratch};
use std::path::Path;
use std::time::Instant;

/// How many signals are lost and found again, one after the other.
const CHANGES: usize = 200;

/// How many times a relation is added and a signal removed.
const RESTRUCTURINGS: usize = 3;

/// The results for one model; times in seconds, memory in bytes.
pub(super) struct Measured {
    values: Vec<f64>,
}

/// The keys of the JSON object, in the order of the values.
const KEYS: [&str; 24] = [
    "relations",
    "variables",
    "signals",
    "needs",
    "file_bytes",
    "load_s",
    "load_peak_bytes",
    "graph_s",
    "plans_s",
    "plan_median_s",
    "plan_worst_s",
    "plans_limited",
    "table_s",
    "table_searches",
    "table_needs",
    "change_median_s",
    "change_worst_s",
    "peak_bytes",
    "structure_median_s",
    "structure_worst_s",
    "structure_match_s",
    "structure_graph_s",
    "structure_table_s",
    "structure_searches",
];

impl Measured {
    /// The value of a key.
    pub(super) fn get(&self, key: &str) -> f64 {
        let at = KEYS.iter().position(|known| *known == key);
        at.and_then(|at| self.values.get(at)).copied().unwrap_or(f64::NAN)
    }

    pub(super) fn to_json(&self) -> Value {
        KEYS.iter().zip(&self.values).map(|(key, value)| (key.to_string(), json!(value))).collect()
    }

    pub(super) fn from_json(text: &[u8]) -> anyhow::Result<Measured> {
        let value: Value =
            serde_json::from_slice(text).context("the measuring process said something else")?;
        let number = |key: &&str| value.get(key).and_then(Value::as_f64).unwrap_or(f64::NAN);
        Ok(Measured { values: KEYS.iter().map(number).collect() })
    }
}

/// Loads a model and measures each operation on it.
pub(super) fn measure(path: &Path) -> anyhow::Result<Measured> {
    let file_bytes = std::fs::metadata(path)?.len() as f64;
    let began = Instant::now();
    let loaded = shsa_model::load_file(path);
    let load_s = began.elapsed().as_secs_f64();
    let load_peak_bytes = memory_bytes("self", "VmHWM");
    if !loaded.report.ok() {
        bail!("{}", loaded.report.render(false));
    }
    let mut knowledge = loaded.knowledge;
    let began = Instant::now();
    let mut graph = Graph::new(&knowledge);
    let graph_s = began.elapsed().as_secs_f64();
    let needed: Vec<VariableId> = knowledge.needs().iter().map(|need| need.variable).collect();
    let (mut plans, limited) = plans(&graph, &needed);
    let plans_s = plans.iter().sum();
    let preparation = Preparation { work: u64::MAX, ..Preparation::default() };
    let began = Instant::now();
    let mut table = Contingency::new(&knowledge, &graph, needed.iter().copied(), preparation);
    let table_s = began.elapsed().as_secs_f64();
    let searches = table.searches();
    let complete = table.variables().filter(|&variable| table.is_complete(variable)).count();
    let mut changes = changes(&mut knowledge, &mut graph, &mut table);
    let peak_bytes = memory_bytes("self", "VmHWM");
    let count = |count: usize| count as f64;
    let mut values = vec![
        count(knowledge.relations().len()),
        count(knowledge.variables().len()),
        count(knowledge.signals().len()),
        count(knowledge.needs().len()),
        file_bytes,
        load_s,
        load_peak_bytes,
        graph_s,
        plans_s,
        median(&mut plans),
        worst(&plans),
        count(limited),
        table_s,
        searches as f64,
        count(complete),
        median(&mut changes),
        worst(&changes),
        peak_bytes,
    ];
    values.extend(restructurings(knowledge, graph, table));
    Ok(Measured { values })
}

/// The time of the best plan of each variable, and the number of searches that a limit stopped.
fn plans(graph: &Graph, variables: &[VariableId]) -> (Vec<f64>, usize) {
    let mut scratch = Scratch::default();
    let options = Options { substitute_provided: false, without_empty: true, ..Options::default() };
    let mut limited = 0;
    let time = |&variable: &VariableId| {
        let began = Instant::now();
        let mut search = BestFirst::with_scratch(&mut scratch, graph, variable, &options, Limits::default());
        limited += usize::from(search.next().is_none());
        began.elapsed().as_secs_f64()
    };
    let times = variables.iter().map(time).collect();
    (times, limited)
}

/// The times from the loss of a signal, and from its return, until graph and table are current.
fn changes(knowledge: &mut KnowledgeBase, graph: &mut Graph, table: &mut Contingency) -> Vec<f64> {
    let signals: Vec<SignalId> = knowledge.signals().ids().collect();
    let step = (signals.len() / CHANGES).max(1);
    let mut times = Vec::new();
    for &signal in signals.iter().step_by(step) {
        for available in [false, true] {
            let began = Instant::now();
            knowledge.set_available(signal, available);
            graph.update(knowledge, &[Element::Signal(signal)]);
            table.update(knowledge, graph, &[Element::Signal(signal)]);
            times.push(began.elapsed().as_secs_f64());
        }
    }
    times
}

/// The times from an added relation and from a removed signal, in the middle of the model, until graph and table are current; the
/// new knowledge base is already checked. In order: the median and the worst; the medians of matching the elements, of the graph
/// and of the table; the largest number of searches.
fn restructurings(mut knowledge: KnowledgeBase, mut graph: Graph, mut table: Contingency) -> [f64; 6] {
    let mut times: [Vec<f64>; 4] = Default::default();
    let mut most = 0;
    for at in 0..2 * RESTRUCTURINGS {
        let place = (1 + at) as f64 / (2 * RESTRUCTURINGS + 1) as f64;
        let next = if at % 2 == 0 {
            with_a_relation(&knowledge, place)
        } else {
            without_a_signal(&knowledge, place)
        };
        let next = next.succeeding(knowledge.version());
        let searches = table.searches();
        let began = Instant::now();
        let lineage = Lineage::new(&knowledge, &next);
        let matched = began.elapsed().as_secs_f64();
        let fresh = Graph::new(&next);
        let prepared = began.elapsed().as_secs_f64();
        let needed = next.needs().iter().map(|need| need.variable);
        table = table.carried_over(&graph, &lineage, &next, &fresh, needed);
        let all = began.elapsed().as_secs_f64();
        let parts = [all, matched, prepared - matched, all - prepared];
        times.iter_mut().zip(parts).for_each(|(times, time)| times.push(time));
        most = most.max(table.searches() - searches);
        (knowledge, graph) = (next, fresh);
    }
    let worst = worst(&times[0]);
    let [all, matched, prepared, carried] = times.each_mut().map(|times| median(times));
    [all, worst, matched, prepared, carried, most as f64]
}

/// The same knowledge base with one more relation, from the next two variables to the one at `place`.
fn with_a_relation(knowledge: &KnowledgeBase, place: f64) -> KnowledgeBase {
    let variables = knowledge.variables().len();
    let output = (variables as f64 * place) as usize;
    let id = |ahead: usize| VariableId::from_index((output + ahead).min(variables.saturating_sub(1)));
    let mut relations = knowledge.relations().clone();
    relations.push(Relation {
        name: format!("added {output}"),
        inputs: vec![id(1), id(2)],
        outputs: vec![id(0)],
        formulas: Vec::new(),
        condition: None,
        text: String::new(),
        properties: [("cost".to_owned(), 2.0)].into_iter().collect(),
    });
    let (variables, signals) = (knowledge.variables().clone(), knowledge.signals().clone());
    KnowledgeBase::from_parts(variables, relations, signals, knowledge.needs().clone())
}

/// The same knowledge base without one signal; no signal may be derived from others.
fn without_a_signal(knowledge: &KnowledgeBase, place: f64) -> KnowledgeBase {
    let lost = (knowledge.signals().len() as f64 * place) as usize;
    let mut signals = IdVec::new();
    for (id, signal) in knowledge.signals().enumerate().filter(|(id, _)| id.index() != lost) {
        debug_assert!(signal.derived_from.is_empty(), "{id:?}");
        signals.push(signal.clone());
    }
    let (variables, relations) = (knowledge.variables().clone(), knowledge.relations().clone());
    KnowledgeBase::from_parts(variables, relations, signals, knowledge.needs().clone())
}

fn median(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or(f64::NAN)
}

fn worst(times: &[f64]) -> f64 {
    times.iter().copied().fold(f64::NAN, f64::max)
}
