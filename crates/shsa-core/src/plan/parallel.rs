//! The exact search in several parts that can run at the same time, with the same result for any number of threads.
//!
//! The first decisions are taken by one search; what is then open is dealt out. The parts work in rounds of a fixed
//! number of expansions. After each round all that was found is put together, and no part goes on where it cannot
//! beat the last of the wanted answers any more. What a round does depends on nothing but its beginning, so neither
//! the answers nor the expansions depend on who ran it, when, or beside what. The core starts no threads: the caller
//! runs the parts, `std::thread::scope` will do.

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

/// Expansions of a part in one round: about a millisecond, much more than it takes to start a thread.
const ROUND: u64 = 8192;

/// Open states that are looked for before they are dealt out, for each part.
const SPREAD: usize = 8;

/// A part of a search: a share of the open states, run for a round at a time.
#[derive(Debug)]
pub struct Part<'s, 'a> {
    search: &'s BestFirst<'a>,
    open: Open,
    /// Answers since the last round.
    found: Vec<Answer>,
    /// Nothing heavier is wanted.
    cutoff: Weight,
}

/// A substitution with all that the order looks at.
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

    /// Whether something open may be among the wanted answers.
    fn is_wanted(&self) -> bool {
        self.open.bound().is_some_and(|bound| bound <= self.cutoff)
    }
}

impl Answer {
    fn at(search: &BestFirst, open: &Open) -> Answer {
        let (weight, order) = open.standing();
        Answer { weight, order, substitution: search.substitution(open) }
    }
}

/// The `count` best substitutions of `root`, searched for in `parts` parts that `run_all` runs for a round: it must call
/// [`Part::run`] once for each.
///
/// The answers are those of [`best`](super::best), whatever the parts. Where a limit stops it, what is proven best so
/// far is given; limits count over all parts, and are looked at after each round of at most 8192 expansions a part.
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

/// Deals out what is open after the first decisions.
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
    // What is as heavy as something open may come later in file order.
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

    /// The weight above which nothing is wanted any more.
    fn cutoff(&self) -> Weight {
        match self.best.last() {
            Some(last) if self.best.len() == self.wanted => last.weight,
            _ => Weight::MAX,
        }
    }
}
