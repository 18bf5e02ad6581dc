//! Which ways of knowing can serve a need.

use crate::computation::Computation;
use crate::knowledge::{KnowledgeBase, RelationId, SignalId, VariableId};
use crate::plan::{self, Graph, Limits, Options, Plan, Preparation};
use crate::substitution::Way;
use alloc::vec::Vec;

/// How many substitutions, and ways, of one variable are considered for a need.
const MOST: usize = 32;

/// Expansions after which a search for the next best substitution ends; counted, so that runs repeat.
const LIMITS: Limits = Limits { expansions: 20_000, states: 20_000 };

/// A way of serving a need, with its utility.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Source {
    pub(super) way: Way,
    pub(super) utility: f64,
}

/// What nothing may rest on, ascending.
#[derive(Clone, Debug, Default)]
pub(super) struct Lost {
    pub(super) signals: Vec<SignalId>,
    /// Relations that do not hold.
    pub(super) relations: Vec<RelationId>,
}

/// The ways of knowing a variable that can run without what is lost, best utility first, then in file
/// order; last those that only go on from the variable's own last value.
pub(super) fn ways(
    knowledge: &KnowledgeBase,
    graph: &Graph,
    variable: VariableId,
    lost: &Lost,
) -> Vec<Source> {
    let options = Options {
        forbidden_signals: lost.signals.clone(),
        forbidden_relations: lost.relations.clone(),
        ..Options::default()
    };
    let found = plan::best(graph, variable, &options, MOST, LIMITS);
    ways_of(knowledge, &found, |signal| lost.signals.binary_search(&signal).is_err())
}

/// The ways of a plan's substitutions, in their order, with signals that may be used.
pub(super) fn ways_of(
    knowledge: &KnowledgeBase,
    plan: &Plan,
    may_use: impl Fn(SignalId) -> bool,
) -> Vec<Source> {
    let may_use = |signal| knowledge.is_available(signal) && may_use(signal);
    let mut sources: Vec<Source> = plan
        .substitutions
        .iter()
        .flat_map(|(substitution, utility)| {
            let mut choices = Way::choices(knowledge, substitution, may_use, MOST);
            // The choices differ in their signals only: one can run when all can.
            if !choices.first().is_some_and(|way| Computation::can_run(knowledge, way)) {
                choices.clear();
            }
            choices.into_iter().map(move |way| Source { way, utility: *utility })
        })
        .take(MOST)
        .collect();
    sources.sort_by_key(|source| source.way.substitution.continues_itself(knowledge));
    sources
}

/// What a table of plans must hold so that [`ways`] can be taken from it. Counted: some tenths of a second and tens of
/// megabytes at the most.
pub(super) fn preparation() -> Preparation {
    Preparation { count: MOST, limits: LIMITS, work_each: 200_000, work: 2_000_000, ..Preparation::default() }
}
