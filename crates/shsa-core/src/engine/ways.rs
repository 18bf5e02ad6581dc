//! Which ways of knowing are watched, and which can serve a need.

use crate::computation::Computation;
use crate::knowledge::{Id, KnowledgeBase, Shape, SignalId, SignalSet, VariableId};
use crate::plan::{self, Graph, Limits, Options};
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

/// All ways of knowing every variable that can be known in two ways or more.
pub(super) fn to_watch(knowledge: &KnowledgeBase, graph: &Graph) -> Vec<Way> {
    (0..knowledge.variables().len())
        .map(|index| witnesses(knowledge, graph, VariableId::from_index(index)))
        .filter(|ways| ways.len() > 1)
        .flatten()
        .collect()
}

/// The ways of knowing a variable that say something which its other comparisons do not.
///
/// A provided number is not looked behind: it is compared in its own right. A provided vector is, as vectors are
/// compared only in the numbers that follow from them. At most 32.
#[must_use]
pub fn witnesses(knowledge: &KnowledgeBase, graph: &Graph, variable: VariableId) -> Vec<Way> {
    let is_vector = |variable: VariableId| knowledge.variables()[variable].shape == Shape::Vector;
    let options = Options { substitute_provided: true, ..Options::default() };
    let found = plan::best(graph, variable, &options, MOST_SEARCHED, LIMITS);
    let compared_itself = |substitution: &Substitution| {
        let mut behind =
            substitution.steps.iter().map(|step| step.output).filter(|&output| output != variable);
        behind.any(|output| knowledge.is_provided(output) && !is_vector(output))
    };
    found
        .substitutions
        .iter()
        .filter(|(substitution, _)| !compared_itself(substitution))
        .flat_map(|(substitution, _)| Way::choices(knowledge, substitution, |_| true, MOST))
        .take(MOST)
        .collect()
}

/// The ways of knowing a variable from usable signals that can run, best utility first, then in file order; last those that
/// only go on from the variable's own last value.
pub(super) fn ways(
    knowledge: &KnowledgeBase,
    graph: &Graph,
    variable: VariableId,
    usable: &SignalSet,
) -> Vec<Source> {
    let may_use = |signal: SignalId| usable.contains(signal);
    let forbidden_signals = knowledge.signals().ids().filter(|signal| !usable.contains(*signal)).collect();
    let options = Options { forbidden_signals, ..Options::default() };
    let found = plan::best(graph, variable, &options, MOST, LIMITS);
    let mut sources: Vec<Source> = found
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
