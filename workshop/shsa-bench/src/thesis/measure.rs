//! Measures the searches in one graph.

use super::experiment::Case;
use super::record::{Record, Search};
use super::visit::Visit;
use shsa_core::knowledge::{KnowledgeBase, VariableId};
use shsa_core::plan::{
    BestFirst, Contingency, Deal, Graph, Limits, Options, Part, Plan, Preparation, Scratch, Take,
    best_in_parts, depth_first, exhaustive, ontology, property_guided, property_guided_in_parts,
};
use std::hint::black_box;
use std::time::{Duration, Instant};

/// A search that takes longer is run once.
const LONG: Duration = Duration::from_millis(100);
/// The longest time of all turns together, once the least number of turns is done.
const ENOUGH: Duration = Duration::from_millis(5);
/// The time of the runs in one turn, long compared with the resolution of the clock.
const TURN: Duration = Duration::from_micros(500);
/// The least and the largest number of turns; the fastest counts.
const TURNS: (usize, usize) = (3, 10);

/// A graph, prepared for the searches.
struct Subject<'a> {
    knowledge: &'a KnowledgeBase,
    graph: Graph,
    root: VariableId,
    options: Options,
    limits: Limits,
    threads: usize,
}

/// Runs all searches in one graph, those in parts with several threads only. The root's own signals are lost. The times do not
/// include making the graph.
///
/// # Errors
/// When the graph cannot be made.
pub(super) fn measure(case: &Case, limits: Limits, threads: usize) -> anyhow::Result<Vec<Record>> {
    let (mut knowledge, root) = case.knowledge()?;
    for signal in knowledge.carriers(root).to_vec() {
        knowledge.set_available(signal, false);
    }
    let graph = Graph::new(&knowledge);
    let subject =
        Subject { knowledge: &knowledge, graph, root, options: Options::default(), limits, threads };
    let mut visit = Visit::new(&knowledge);
    let (reached, seconds) = time(|| visit.run(black_box(root)));
    let nodes = knowledge.variables().len() + knowledge.relations().len();
    let blank = Record { case: *case, nodes, reached, ..Record::of(*case, Search::Visit) };
    let mut records = vec![Record { seconds, ..blank.clone() }];
    let in_parts = Search::IN_PARTS.into_iter().filter(|_| threads > 1);
    let searches = Search::ALL.into_iter().chain(in_parts);
    records.extend(searches.filter_map(|search| {
        let (plan, seconds) = subject.search(search)?;
        Some(Record { search, seconds, ..blank.clone() }.with(&plan))
    }));
    let best = records.iter().filter_map(|record| record.utility).reduce(f64::max);
    records.iter_mut().for_each(|record| record.best = best);
    if case.kind.size.is_none() {
        let lookup = |seconds| Record { search: Search::Table, seconds, ..blank.clone() };
        records.extend(subject.lookups().into_iter().map(lookup));
    }
    Ok(records)
}

impl Subject<'_> {
    /// The plan of a search and its time; `None` for a visit or a table.
    fn search(&self, search: Search) -> Option<(Plan, f64)> {
        let Subject { knowledge, graph, root, options, limits, threads } = self;
        let (root, limits, deal) = (*root, *limits, Deal::among(*threads));
        let count = |take| if take == Take::First { 1 } else { usize::MAX };
        Some(match search {
            Search::Visit | Search::Table => return None,
            Search::BestFirst(Take::First) => {
                let (mut scratch, mut plan) = (Scratch::default(), Plan::default());
                let ((), seconds) = time(|| {
                    let root = black_box(root);
                    plan.refill(&mut BestFirst::with_scratch(&mut scratch, graph, root, options, limits), 1);
                });
                (plan, seconds)
            }
            Search::BestFirst(Take::All) => {
                let mut scratch = Scratch::default();
                time(|| all(BestFirst::with_scratch(&mut scratch, graph, black_box(root), options, limits)))
            }
            Search::PropertyGuided(take) => {
                time(|| property_guided(graph, black_box(root), options, count(take), limits))
            }
            Search::BestFirstInParts => {
                time(|| best_in_parts(graph, black_box(root), options, usize::MAX, limits, deal, at_once))
            }
            Search::PropertyGuidedInParts => time(|| {
                property_guided_in_parts(graph, black_box(root), options, usize::MAX, limits, deal, at_once)
            }),
            Search::Ontology => time(|| ontology(graph, black_box(root), options, limits)),
            Search::DepthFirst(take) => time(|| depth_first(graph, black_box(root), options, take, limits)),
            Search::Exhaustive => time(|| exhaustive(knowledge, black_box(root), options, limits)),
        })
    }

    /// The time to look up the substitute, for each signal whose loss matters.
    fn lookups(&self) -> Vec<f64> {
        let table = Contingency::new(self.knowledge, &self.graph, [self.root], Preparation::default());
        let losses = table.losses(self.root).filter(|(lost, _)| !lost.is_empty());
        losses
            .map(|(lost, _)| time(|| table.plan(black_box(self.root), black_box(lost)).is_some()).1)
            .collect()
    }
}

/// Runs each part of a search in a thread of its own.
fn at_once(parts: &mut [Part]) {
    std::thread::scope(|scope| {
        for part in parts {
            scope.spawn(|| part.run());
        }
    });
}

/// All answers; without counting them as kept states.
fn all(mut search: BestFirst) -> Plan {
    let substitutions = search.by_ref().collect();
    Plan { substitutions, stop: search.stop(), expanded: search.expanded(), bound: search.bound() }
}

/// The result of a function and its time in seconds: the mean of the fastest of several turns, or the only run.
fn time<T>(mut run: impl FnMut() -> T) -> (T, f64) {
    let began = Instant::now();
    let given = run();
    let first = began.elapsed();
    if first >= LONG {
        return (given, first.as_secs_f64());
    }
    let repeats = (TURN.as_nanos() / first.as_nanos().max(1)).clamp(1, 10_000) as u32;
    let mut fastest = first.as_secs_f64();
    let all = Instant::now();
    for turn in 1..=TURNS.1 {
        let began = Instant::now();
        for _ in 0..repeats {
            black_box(run());
        }
        fastest = fastest.min(began.elapsed().as_secs_f64() / f64::from(repeats));
        if turn >= TURNS.0 && all.elapsed() > ENOUGH {
            break;
        }
    }
    (given, fastest)
}
