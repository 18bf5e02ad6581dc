//! Which ways of knowing are watched, and which can serve a need.

use crate::computation::Computation;
use crate::knowledge::{Id, KnowledgeBase, Shape, SignalId, VariableId};
use crate::plan::{self, Appraisal, Graph, Limits, Options, Plan, Preparation, StopReason};
use crate::substitution::{Substitution, Way};
use alloc::vec::Vec;

/// How many substitutions, and ways, of one variable are watched or considered for a need.
const MOST: usize = 32;

/// How many substitutions of one variable are looked at for these.
const MOST_SEARCHED: usize = 256;

/// Expansions after which a search for the next best substitution ends; counted, so that runs repeat.
const LIMITS: Limits = Limits { expansions: 20_000, states: 20_000 };

/// A way of serving a need, with its utility.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Source {
    pub(super) way: Way,
    pub(super) utility: f64,
}

/// All ways of knowing every variable that can be known in two ways or more: what the engine's monitor compares.
#[must_use]
pub fn to_watch(knowledge: &KnowledgeBase, graph: &Graph) -> Vec<Way> {
    (0..knowledge.variables().len())
        .map(|index| witnesses(knowledge, graph, VariableId::from_index(index)).ways)
        .filter(|ways| ways.len() > 1)
        .flatten()
        .collect()
}

/// The ways of knowing a variable that are compared.
#[derive(Clone, Debug, PartialEq)]
pub struct Witnesses {
    /// Best utility first, then in file order.
    pub ways: Vec<Way>,
    /// Whether there are no others: neither the number of ways nor a limit of the search has ended the list.
    pub complete: bool,
    /// How many decisions the search has taken.
    pub expanded: u64,
}

/// The ways of knowing a variable that say something which its other comparisons do not.
///
/// A provided number is not looked behind: it is compared in its own right. A provided vector is, as vectors are
/// compared only in the numbers that follow from them. At most 32.
#[must_use]
pub fn witnesses(knowledge: &KnowledgeBase, graph: &Graph, variable: VariableId) -> Witnesses {
    let is_vector = |variable: VariableId| knowledge.variables()[variable].shape == Shape::Vector;
    let is_looked_behind = |variable: VariableId| {
        is_vector(variable) && knowledge.is_provided(variable) && !knowledge.producers(variable).is_empty()
    };
    // The search looks behind all that is provided or behind nothing, and all takes much longer in a large model.
    let substitute_provided = knowledge.variables().ids().any(is_looked_behind);
    let options = Options { substitute_provided, ..Options::default() };
    let found = plan::best(graph, variable, &options, MOST_SEARCHED, LIMITS);
    let compared_itself = |substitution: &Substitution| {
        let mut behind =
            substitution.steps.iter().map(|step| step.output).filter(|&output| output != variable);
        behind.any(|output| knowledge.is_provided(output) && !is_vector(output))
    };
    let mut ways: Vec<Way> = found
        .substitutions
        .iter()
        .filter(|(substitution, _)| !compared_itself(substitution))
        .flat_map(|(substitution, _)| {
            let mut choices = Way::choices(knowledge, substitution, |_| true, MOST + 1);
            // Rows of a table come in the order of the file: so do comparisons.
            choices.sort_by(|one, other| one.signals.cmp(&other.signals));
            choices
        })
        .take(MOST + 1)
        .collect();
    let complete = found.stop == StopReason::Complete && ways.len() <= MOST;
    ways.truncate(MOST);
    Witnesses { ways, complete, expanded: found.expanded }
}

/// The ways of knowing a variable that can run without some lost signals (ascending), best utility first, then in file
/// order; last those that only go on from the variable's own last value.
pub(super) fn ways(
    knowledge: &KnowledgeBase,
    graph: &Graph,
    variable: VariableId,
    lost: &[SignalId],
) -> Vec<Source> {
    let options = Options { forbidden_signals: lost.to_vec(), ..Options::default() };
    let found = plan::best(graph, variable, &options, MOST, LIMITS);
    ways_of(knowledge, graph, &found, lost)
}

/// The best ways of a plan's substitutions without some lost signals (ascending), each with its own utility, best first.
///
/// No way has a higher utility than its substitution, so the ways of the next ones need not be asked for when they
/// cannot be among the best any more.
pub(super) fn ways_of(
    knowledge: &KnowledgeBase,
    graph: &Graph,
    plan: &Plan,
    lost: &[SignalId],
) -> Vec<Source> {
    let may_use = |signal| knowledge.is_available(signal) && lost.binary_search(&signal).is_err();
    let appraisal = Appraisal::new(graph, lost);
    let mut sources: Vec<Source> = Vec::new();
    for (substitution, utility) in &plan.substitutions {
        if sources.get(MOST - 1).is_some_and(|last| last.utility >= *utility) {
            break;
        }
        let choices = Way::choices(knowledge, substitution, may_use, MOST);
        // The choices differ in their signals only: one can run when all can.
        if !choices.first().is_some_and(|way| Computation::can_run(knowledge, way)) {
            continue;
        }
        let is_one = choices.len() == 1;
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

/// What a table of plans must hold so that [`ways`] can be taken from it. Counted: some tenths of a second and tens of
/// megabytes at the most.
pub(super) fn preparation() -> Preparation {
    Preparation { count: MOST, limits: LIMITS, work_each: 200_000, work: 2_000_000, ..Preparation::default() }
}
