//! The searches that can run in several parts at once, with the same result for any number of threads.
//!
//! One search makes the first decisions, and a small one is over then; what it leaves open is dealt out to the parts. They work in rounds of a fixed number
//! of decisions. After each round all answers are merged, and a part stops where it cannot beat the last of the wanted answers. The
//! result of a round depends only on its start, so neither answers nor decisions depend on the threads. The core starts no
//! threads: the caller runs the parts, for example with `std::thread::scope`. Each part gives its answers in order, so it is also done
//! once it has as many as are wanted, or one that comes after all wanted ones.
//!
//! [`best_in_parts`] deals out the open states of [`BestFirst`], [`property_guided_in_parts`] the workers of SH-PGSA: a worker has
//! all that its steps need (its relations, and the variables that they leave open), so any number of workers can make steps at the
//! same time. The public program of the thesis has the workers, but lets one after the other make steps.

use super::Plan;
use super::best_first::{BestFirst, Open};
use super::graph::{Graph, Options};
use super::limits::{Limits, StopReason, states};
use super::progress::Progress;
use super::property_guided::{Search, property_guided};
use super::utility::Weight;
use crate::knowledge::{Id, RelationId, VariableId};
use crate::substitution::Substitution;
use alloc::boxed::Box;
use alloc::collections::BTreeSet;
use alloc::vec::Vec;
use core::fmt::Debug;

/// The decisions of a part in one round: about a millisecond, much more than the start of a thread.
const ROUND: u64 = 8192;

/// The open states to have for each part before they are dealt out.
const SPREAD: usize = 8;

/// How a search is dealt out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Deal {
    /// The number of parts; 0 counts as 1.
    pub parts: usize,
    /// The decisions that are made before anything is dealt out: a search that needs no more is over sooner without threads.
    pub alone: u64,
}

impl Deal {
    /// Deals out to so many parts, after 2048 decisions: about as long as the start of several threads takes.
    #[must_use]
    pub const fn among(parts: usize) -> Deal {
        Deal { parts, alone: 2048 }
    }
}

/// A part of a search: a share of what is open, run for a round at a time.
#[derive(Debug)]
pub struct Part<'s> {
    share: Box<dyn Share + 's>,
    /// How many answers it may still give, until nobody wants more of it.
    missing: usize,
    /// The answers since the last round.
    found: Vec<Answer>,
    /// The rank of the last answer.
    last: Option<Rank>,
    /// The last rank that is wanted; `None` while any is.
    cutoff: Option<Rank>,
}

/// What the order of answers depends on.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Rank {
    weight: Weight,
    /// The decisions, breadth first from the root: numbers that rise in file order.
    order: Vec<u32>,
}

/// A substitution with its rank.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Answer {
    rank: Rank,
    substitution: Substitution,
}

impl Answer {
    /// Its size as [`Limits::states`] counts it.
    fn states(&self) -> usize {
        states(self.rank.order.len() + self.substitution.steps.len() + self.substitution.sources.len())
    }
}

/// A search, or a share of one, that makes a step at a time.
trait Share: Debug + Send {
    fn advance(&mut self) -> Progress;

    /// The smallest weight of what is open; `None` when nothing is.
    fn bound(&self) -> Option<Weight>;

    /// The number of decisions made.
    fn expanded(&self) -> u64;

    /// What is kept, as [`Limits::states`] counts it.
    fn states(&self) -> usize;

    /// The answer that the last step has reached.
    fn answer(&self) -> Answer;

    /// Some answer, perhaps not the best, that was not yet reached.
    fn any(&mut self) -> Option<(Substitution, f64)>;

    /// Makes steps until there are so many decisions more, or no further answer is wanted: of so many, up to a rank.
    fn run(&mut self, decisions: u64, missing: usize, cutoff: Option<&Rank>, found: &mut Vec<Answer>) {
        let end = self.expanded().saturating_add(decisions);
        let most = cutoff.map_or(Weight::MAX, |cutoff| cutoff.weight);
        while self.expanded() < end && self.bound().is_some_and(|bound| bound <= most) {
            if self.advance() == Progress::Answer {
                found.push(self.answer());
                let is_last = found.last().zip(cutoff).is_some_and(|(last, cutoff)| last.rank > *cutoff);
                if is_last || found.len() >= missing {
                    break;
                }
            }
        }
    }
}

impl Part<'_> {
    /// Runs one round.
    pub fn run(&mut self) {
        if self.is_wanted() {
            self.share.run(ROUND, self.missing, self.cutoff.as_ref(), &mut self.found);
            self.missing = self.missing.saturating_sub(self.found.len());
            self.last = self.found.last().map(|answer| answer.rank.clone()).or(self.last.take());
        }
    }

    /// Whether what is open may lead to a wanted answer.
    fn is_wanted(&self) -> bool {
        let Some(bound) = self.share.bound() else { return false };
        let is_before =
            |cutoff: &Rank| bound <= cutoff.weight && self.last.as_ref().is_none_or(|it| it <= cutoff);
        self.missing > 0 && self.cutoff.as_ref().is_none_or(is_before)
    }
}

/// A share of the open states of the exact search.
#[derive(Debug)]
struct States<'s, 'a> {
    search: &'s BestFirst<'a>,
    open: Open,
}

impl Share for States<'_, '_> {
    fn advance(&mut self) -> Progress {
        self.search.advance(&mut self.open)
    }

    fn bound(&self) -> Option<Weight> {
        self.open.bound()
    }

    fn expanded(&self) -> u64 {
        self.open.expanded()
    }

    fn states(&self) -> usize {
        self.open.states()
    }

    fn answer(&self) -> Answer {
        let (weight, choices) = self.open.rank();
        let order = choices.into_iter().map(|choice| choice.index() as u32).collect();
        Answer { rank: Rank { weight, order }, substitution: self.search.substitution(&self.open) }
    }

    fn any(&mut self) -> Option<(Substitution, f64)> {
        self.search.any()
    }
}

impl Share for Search<'_> {
    fn advance(&mut self) -> Progress {
        Search::advance(self)
    }

    fn bound(&self) -> Option<Weight> {
        Search::bound(self)
    }

    fn expanded(&self) -> u64 {
        Search::expanded(self)
    }

    fn states(&self) -> usize {
        self.kept()
    }

    fn answer(&self) -> Answer {
        let (weight, relations) = self.rank();
        let number =
            |relation: Option<RelationId>| relation.map_or(0, |relation| relation.index() as u32 + 1);
        let rank = Rank { weight, order: relations.map(number).collect() };
        Answer { rank, substitution: Search::answer(self).0 }
    }

    fn any(&mut self) -> Option<(Substitution, f64)> {
        Search::any(self)
    }
}

/// The `count` best substitutions of `root`, searched in parts that `run_all` runs for a round: it must call [`Part::run`] once
/// for each.
///
/// The answers are those of [`best`](super::best), whatever the parts. At a limit, the answers proven best so far are returned;
/// limits count over all parts, and are checked after each round of at most 8192 decisions a part.
pub fn best_in_parts(
    graph: &Graph,
    root: VariableId,
    options: &Options,
    count: usize,
    limits: Limits,
    deal: Deal,
    run_all: impl Fn(&mut [Part<'_>]),
) -> Plan {
    let search = BestFirst::new(graph, root, options, Limits::NONE);
    if count == 0 || search.stopped().is_some() {
        return Plan { substitutions: Vec::new(), stop: search.stop(), expanded: 0, bound: search.bound() };
    }
    let parts = deal.parts.max(1);
    let mut first = States { search: &search, open: search.begin() };
    let found = spread(&mut first, count, limits, deal, |first| first.open.count());
    let share = |open| -> Box<dyn Share + '_> { Box::new(States { search: &search, open }) };
    let shares = search.deal(first.open, parts).into_iter().map(share);
    in_rounds(graph, shares, found, count, limits, run_all)
}

/// The `count` best substitutions of `root` by SH-PGSA, whose workers are dealt out to parts; `run_all` as for [`best_in_parts`].
///
/// The answers are those of [`property_guided`](super::property_guided()), whatever the parts. Limits as for [`best_in_parts`].
pub fn property_guided_in_parts(
    graph: &Graph,
    root: VariableId,
    options: &Options,
    count: usize,
    limits: Limits,
    deal: Deal,
    run_all: impl Fn(&mut [Part<'_>]),
) -> Plan {
    if count == 0 {
        return property_guided(graph, root, options, count, limits);
    }
    let mut search = match Search::begin(graph, root, options) {
        Ok(search) => search,
        Err(refusal) => return refusal,
    };
    let parts = deal.parts.max(1);
    let found = spread(&mut search, count, limits, deal, Search::open_count);
    let share = |at| -> Box<dyn Share + '_> { Box::new(search.share(at, parts)) };
    in_rounds(graph, (0..parts).map(share), found, count, limits, run_all)
}

/// Makes the first decisions, until the `count` best answers are found or there is enough for each part; returns the answers.
fn spread<S: Share>(
    search: &mut S,
    count: usize,
    limits: Limits,
    deal: Deal,
    open: impl Fn(&S) -> usize,
) -> Vec<Answer> {
    let mut found = Vec::new();
    search.run(deal.alone.min(limits.expansions), count, None, &mut found);
    let enough = deal.parts.max(1).saturating_mul(SPREAD);
    for _ in 0..enough.saturating_mul(SPREAD) {
        if found.len() >= count || open(search) >= enough {
            break;
        }
        match search.advance() {
            Progress::Answer => found.push(search.answer()),
            Progress::Decision => {}
            Progress::End => break,
        }
    }
    found
}

/// Runs the parts with these shares, round by round, until the `count` best answers or a limit are reached.
fn in_rounds<'s>(
    graph: &Graph,
    shares: impl Iterator<Item = Box<dyn Share + 's>>,
    found: Vec<Answer>,
    count: usize,
    limits: Limits,
    run_all: impl Fn(&mut [Part<'_>]),
) -> Plan {
    // What is found later comes later in the order.
    let (missing, last) = (count - found.len().min(count), found.last().map(|last| last.rank.clone()));
    let part = |share| Part { share, missing, found: Vec::new(), last: last.clone(), cutoff: None };
    let mut parts: Vec<Part> = shares.map(part).collect();
    let mut answers = Answers { graph, wanted: count, all: Vec::new(), states: 0 };
    answers.add(found);
    let stop = loop {
        let cutoff = answers.cutoff();
        parts.iter_mut().for_each(|part| part.cutoff.clone_from(&cutoff));
        if !parts.iter().any(Part::is_wanted) {
            let left = parts.iter().any(|part| part.share.bound().is_some());
            break if left { StopReason::Found(count) } else { StopReason::Complete };
        }
        if let Some(limit) = limit(&parts, &answers, limits) {
            break limit;
        }
        run_all(&mut parts);
        parts.iter_mut().for_each(|part| answers.add(core::mem::take(&mut part.found)));
    };
    plan(graph, parts, answers, stop)
}

fn limit(parts: &[Part], answers: &Answers, limits: Limits) -> Option<StopReason> {
    let expanded: u64 = parts.iter().map(|part| part.share.expanded()).sum();
    if expanded >= limits.expansions {
        return Some(StopReason::LimitExpansions);
    }
    let states: usize = parts.iter().map(|part| part.share.states()).sum();
    (states + answers.states >= limits.states).then_some(StopReason::LimitStates)
}

fn plan(graph: &Graph, mut parts: Vec<Part>, mut answers: Answers, stop: StopReason) -> Plan {
    answers.sort();
    let expanded = parts.iter().map(|part| part.share.expanded()).sum();
    let open = parts.iter().filter_map(|part| part.share.bound()).min();
    let bound = open.map_or(graph.scale().worst(), |open| graph.scale().utility(open));
    // An answer as heavy as an open state may come later in file order.
    let proven = |answer: &Answer| {
        open.is_none_or(|open| answer.rank.weight < open) || matches!(stop, StopReason::Found(_))
    };
    let utility = |answer: Answer| (answer.substitution, graph.scale().utility(answer.rank.weight));
    let wanted = answers.wanted;
    let (found, unproven): (Vec<_>, Vec<_>) = answers.all.into_iter().partition(proven);
    let mut substitutions: Vec<_> = found.into_iter().map(utility).collect();
    if substitutions.is_empty() && stop != StopReason::Complete {
        let any = || parts.iter_mut().filter_map(|part| part.share.any()).max_by(|a, b| a.1.total_cmp(&b.1));
        substitutions.extend(unproven.into_iter().next().map(utility).or_else(any));
    }
    let all_found = substitutions.len() == wanted && stop == StopReason::Complete;
    let stop = if all_found { StopReason::Found(wanted) } else { stop };
    Plan { substitutions, stop, expanded, bound }
}

/// The answers so far.
struct Answers<'g> {
    graph: &'g Graph,
    wanted: usize,
    /// The wanted ones and perhaps others, in order only after [`Answers::sort`].
    all: Vec<Answer>,
    /// The size of all, as [`Limits::states`] counts it.
    states: usize,
}

impl Answers<'_> {
    fn add(&mut self, found: Vec<Answer>) {
        self.states += found.iter().map(Answer::states).sum::<usize>();
        self.all.extend(found);
    }

    /// Puts the wanted answers in order, each set of relations once; drops the others.
    fn sort(&mut self) {
        self.all.sort_unstable();
        let mut seen: BTreeSet<Vec<RelationId>> = BTreeSet::new();
        let graph = self.graph;
        self.all.retain(|Answer { substitution, .. }| {
            let mut steps = substitution.steps.iter();
            let is_ambiguous = steps.any(|step| graph.has_several_outputs(step.relation));
            !is_ambiguous || seen.insert(substitution.relations())
        });
        self.all.truncate(self.wanted);
        self.states = self.all.iter().map(Answer::states).sum();
    }

    /// The last rank that is wanted; `None` while any is.
    fn cutoff(&mut self) -> Option<Rank> {
        if self.all.len() < self.wanted {
            return None;
        }
        self.sort();
        self.all.get(self.wanted.checked_sub(1)?).map(|last| last.rank.clone())
    }
}
