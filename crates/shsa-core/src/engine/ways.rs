//! The ways of knowing that can serve a need.

use crate::assurance::Search;
use crate::computation::Computation;
use crate::knowledge::{KnowledgeBase, RelationId, SignalId, VariableId};
use crate::plan::{self, Appraisal, BestFirst, Graph, Limits, Options, Plan, Preparation, Requirements};
use crate::substitution::Way;
use alloc::collections::BTreeSet;
use alloc::vec::Vec;

/// At most this many substitutions, and ways, of one variable are considered for a need.
pub(super) const MOST: usize = 32;

/// At most this many choices of signals of one substitution are checked against the demands.
const MOST_CHOICES: usize = 256;

/// Expansions after which a search for the next best substitution ends; counted, so that runs repeat.
const LIMITS: Limits = Limits { expansions: 20_000, states: 20_000 };

/// A way that can serve a need, with its utility.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Source {
    pub(super) way: Way,
    pub(super) utility: f64,
}

/// Elements that no source may rest on, ascending.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Lost {
    pub(super) signals: Vec<SignalId>,
    /// Relations that do not hold.
    pub(super) relations: Vec<RelationId>,
}

impl Lost {
    /// The union of two sets of lost elements.
    pub(super) fn with(&self, barred: &Lost) -> Lost {
        fn joined<T: Ord + Copy>(one: &[T], other: &[T]) -> Vec<T> {
            let all: BTreeSet<T> = one.iter().chain(other).copied().collect();
            all.into_iter().collect()
        }
        Lost {
            signals: joined(&self.signals, &barred.signals),
            relations: joined(&self.relations, &barred.relations),
        }
    }
}

/// The ways of knowing a variable that run without the lost elements and meet the demands, best utility first, then in file
/// order; last the ways that only go on from the variable's own last value.
pub(super) fn ways(
    knowledge: &KnowledgeBase,
    graph: &Graph,
    variable: VariableId,
    lost: &Lost,
    demands: &Requirements,
) -> Vec<Source> {
    let found = plan::best_meeting(knowledge, graph, variable, &without(lost), demands, MOST, LIMITS);
    ways_of(knowledge, graph, &found, &lost.signals, |way| {
        demands.shortfalls_of_way(knowledge, way).is_empty()
    })
}

/// The ways among these that contracts admit, pruned inside the search.
pub(super) fn admitted_ways(
    knowledge: &KnowledgeBase,
    graph: &Graph,
    variable: VariableId,
    lost: &Lost,
    demands: &Requirements,
    contracts: &Search<'_>,
) -> Vec<Source> {
    let options = without(lost);
    let search = BestFirst::meeting(knowledge, graph, variable, &options, demands, LIMITS);
    let mut search = search.admitted_by(contracts);
    let found = Plan::of(&mut search, MOST);
    let is_admitted =
        |way: &Way| demands.shortfalls_of_way(knowledge, way).is_empty() && contracts.admits_way(way);
    ways_of(knowledge, graph, &found, &lost.signals, is_admitted)
}

fn without(lost: &Lost) -> Options {
    Options {
        forbidden_signals: lost.signals.clone(),
        forbidden_relations: lost.relations.clone(),
        ..Options::default()
    }
}

/// The best admitted ways of a plan's substitutions without some lost signals (ascending), each with its own utility, best first.
///
/// No way has a higher utility than its substitution. So the search ends at a substitution that cannot be among the best any
/// more.
pub(super) fn ways_of(
    knowledge: &KnowledgeBase,
    graph: &Graph,
    plan: &Plan,
    lost: &[SignalId],
    is_admitted: impl Fn(&Way) -> bool,
) -> Vec<Source> {
    // A prediction of an input serves as a witness only: the output of its fusion knows more.
    let serves = |signal| knowledge.is_available(signal) && !knowledge.is_prediction(signal);
    let may_use = |signal| serves(signal) && lost.binary_search(&signal).is_err();
    let appraisal = Appraisal::new(graph, lost);
    let mut sources: Vec<Source> = Vec::new();
    for (substitution, utility) in &plan.substitutions {
        if sources.get(MOST - 1).is_some_and(|last| last.utility >= *utility) {
            break;
        }
        let mut choices = Way::choices(knowledge, substitution, may_use, MOST_CHOICES);
        // The choices differ in their signals only: all of them can run, or none.
        if !choices.first().is_some_and(|way| Computation::can_run(knowledge, way)) {
            continue;
        }
        let is_one = choices.len() == 1;
        choices.retain(|way| is_admitted(way));
        choices.truncate(MOST);
        sources.extend(choices.into_iter().map(|way| {
            let utility = if is_one { *utility } else { appraisal.utility(&way) };
            Source { way, utility }
        }));
        sources.sort_by(|one, other| other.utility.total_cmp(&one.utility));
        sources.truncate(MOST);
    }
    sources.sort_by_key(|source| source.way.substitution.continues_itself(knowledge));
    sources
}

/// The bounds of a table of plans for [`ways`]. Counted: some tenths of a second and tens of megabytes at the most.
pub(super) fn preparation() -> Preparation {
    Preparation { count: MOST, limits: LIMITS, work_each: 200_000, work: 2_000_000, ..Preparation::default() }
}
