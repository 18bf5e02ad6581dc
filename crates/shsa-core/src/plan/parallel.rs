//! The exact search in several parts that can run in parallel, with the same result for any number of threads.
//!
//! One search makes the first decisions; the open states are then distributed. The parts work in rounds of a fixed number of
//! expansions. After each round all answers are merged, and a part stops where it cannot beat the last of the wanted answers. The
//! result of a round depends only on its start, so neither answers nor expansions depend on the threads. The core starts no
//! threads: the caller runs the parts, for example with `std::thread::scope`.

use super::Plan;
use super::best_first::{BestFirst, Open, Progress};
use super::graph::{Graph, Options};
use super::limits::{Limits, StopReason};
use super::subproblem::ChoiceId;
use super::utility::Weight;
use crate::knowledge::{RelationId, VariableId};
use crate::substitution::Substitution;
use alloc::collections::BTreeSet;
use alloc::vec::Vec;

/// The expansions of a part in one round: about a millisecond, much more than the start of a thread.
const ROUND: u64 = 8192;

/// The open states to have for each part before they are distributed.
const SPREAD: usize = 8;

/// A part of a search: a share of the open states, run for a round at a time.
#[derive(Debug)]
pub struct Part<'s, 'a> {
    search: &'s BestFirst<'a>,
    open: Open,
    /// The answers since the last round.
    found: Vec<Answer>,
    /// The largest weight that is wanted.
    cutoff: Weight,
}

/// A substitution with all that its order depends on.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Answer {
    weight: Weight,
    /// The decisions, breadth first from the root.
    order: Vec<ChoiceId>,
    substitution: Substitution,
}

impl Part<'_, '_> {
    /// Runs one round.
    pub fn run(&mut self) {
        let end = self.open.expanded().saturating_add(ROUND);
        while self.open.expanded() < end && self.is_wanted() {
            if self.search.advance(&mut self.open) == Progress::Answer {
                self.found.push(Answer::at(self.search, &self.open));
            }
        }
    }

    /// Whether an open state may lead to a wanted answer.
    fn is_wanted(&self) -> bool {
        self.open.bound().is_some_and(|bound| bound <= self.cutoff)
    }
}

impl Answer {
    fn at(search: &BestFirst, open: &Open) -> Answer {
        let (weight, order) = open.rank();
        Answer { weight, order, substitution: search.substitution(open) }
    }
}

/// The `count` best substitutions of `root`, searched in `parts` parts that `run_all` runs for a round: it must call
/// [`Part::run`] once for each.
///
/// The answers are those of [`best`](super::best), whatever the parts. At a limit, the answers proven best so far are returned;
/// limits count over all parts, and are checked after each round of at most 8192 expansions a part.
pub fn best_in_parts(
    graph: &Graph,
    root: VariableId,
    options: &Options,
    count: usize,
    limits: Limits,
    parts: usize,
    run_all: impl Fn(&mut [Part<'_, '_>]),
) -> Plan {
    let search = BestFirst::new(graph, root, options, Limits::NONE);
    if count == 0 || search.stopped().is_some() {
        return Plan { substitutions: Vec::new(), stop: search.stop(), expanded: 0, bound: search.bound() };
    }
    let mut answers = Answers { wanted: count, best: Vec::new() };
    let mut parts = deal(&search, parts.max(1), &mut answers);
    let stop = loop {
        let cutoff = answers.cutoff();
        parts.iter_mut().for_each(|part| part.cutoff = cutoff);
        if !parts.iter().any(Part::is_wanted) {
            let left = parts.iter().any(|part| part.open.bound().is_some());
            break if left { StopReason::Found(count) } else { StopReason::Complete };
        }
        if let Some(limit) = limit(&parts, limits) {
            break limit;
        }
        run_all(&mut parts);
        parts.iter_mut().for_each(|part| answers.add(&mut part.found));
    };
    plan(graph, &search, parts, answers, stop)
}

/// Distributes the open states after the first decisions.
fn deal<'s, 'a>(search: &'s BestFirst<'a>, parts: usize, answers: &mut Answers) -> Vec<Part<'s, 'a>> {
    let mut open = search.begin();
    let mut found = Vec::new();
    for _ in 0..SPREAD * SPREAD * parts {
        if open.count() >= SPREAD * parts {
            break;
        }
        match search.advance(&mut open) {
            Progress::Answer => found.push(Answer::at(search, &open)),
            Progress::Decision => {}
            Progress::End => break,
        }
    }
    answers.add(&mut found);
    let part = |open| Part { search, open, found: Vec::new(), cutoff: Weight::MAX };
    search.deal(open, parts).into_iter().map(part).collect()
}

fn limit(parts: &[Part], limits: Limits) -> Option<StopReason> {
    let expanded: u64 = parts.iter().map(|part| part.open.expanded()).sum();
    if expanded >= limits.expansions {
        return Some(StopReason::LimitExpansions);
    }
    let states: usize = parts.iter().map(|part| part.open.states()).sum();
    (states >= limits.states).then_some(StopReason::LimitStates)
}

fn plan(graph: &Graph, search: &BestFirst, parts: Vec<Part>, answers: Answers, stop: StopReason) -> Plan {
    let expanded = parts.iter().map(|part| part.open.expanded()).sum();
    let open = parts.iter().filter_map(|part| part.open.bound()).min();
    let bound = open.map_or(graph.scale().worst(), |open| graph.scale().utility(open));
    // An answer as heavy as an open state may come later in file order.
    let proven = |answer: &Answer| {
        open.is_none_or(|open| answer.weight < open) || matches!(stop, StopReason::Found(_))
    };
    let utility = |answer: Answer| (answer.substitution, graph.scale().utility(answer.weight));
    let mut substitutions: Vec<_> = answers.best.into_iter().filter(proven).map(utility).collect();
    if substitutions.is_empty() && stop != StopReason::Complete {
        substitutions.extend(search.any());
    }
    let all_found = substitutions.len() == answers.wanted && stop == StopReason::Complete;
    let stop = if all_found { StopReason::Found(answers.wanted) } else { stop };
    Plan { substitutions, stop, expanded, bound }
}

/// The best answers so far, in order, each set of relations once.
struct Answers {
    wanted: usize,
    best: Vec<Answer>,
}

impl Answers {
    fn add(&mut self, found: &mut Vec<Answer>) {
        if found.is_empty() {
            return;
        }
        self.best.append(found);
        self.best.sort_unstable();
        let mut seen: BTreeSet<Vec<RelationId>> = BTreeSet::new();
        self.best.retain(|answer| seen.insert(answer.substitution.relations()));
        self.best.truncate(self.wanted);
    }

    /// The largest weight that is still wanted.
    fn cutoff(&self) -> Weight {
        match self.best.last() {
            Some(last) if self.best.len() == self.wanted => last.weight,
            _ => Weight::MAX,
        }
    }
}
