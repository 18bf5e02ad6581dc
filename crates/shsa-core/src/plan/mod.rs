//! Searches for substitutions: which relations compute a variable best from what can be trusted.
//!
//! [`exhaustive()`] tries everything and is the oracle; [`BestFirst`] gives the best ones first and stops when the
//! caller has enough. Beside them stand the searches of the thesis: [`depth_first()`], [`ontology()`] (ORR), and
//! [`property_guided()`] (SH-PGSA). Those that find all answer with the same substitutions in the same order.

pub mod utility;
mod limits;
mod graph;
mod exhaustive;
mod choices;
mod depth_first;
mod ontology;
mod partial;
mod workers;
mod property_guided;
mod scope;
mod trail;
mod greedy;
mod frontier;
pub mod requirements;
mod best_first;
mod parallel;
mod contingency;

pub use best_first::BestFirst;
pub use contingency::{Contingency, Preparation};
pub use depth_first::{Take, depth_first};
pub use exhaustive::exhaustive;
pub use graph::{Appraisal, Graph, Options};
pub use limits::{Limits, StopReason};
pub use ontology::ontology;
pub use parallel::{Part, best_in_parts};
pub use property_guided::property_guided;
pub use requirements::{Requirements, Shortfall};
pub use scope::Marks;

use crate::knowledge::{KnowledgeBase, VariableId};
use crate::substitution::Substitution;
use alloc::vec::Vec;

/// What a search has found.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Substitutions with their utilities, best first.
    pub substitutions: Vec<(Substitution, f64)>,
    /// Why there are no more.
    pub stop: StopReason,
    /// How many decisions were taken.
    pub expanded: u64,
    /// No substitution that is missing here has a higher utility; the lowest of all when none is missing.
    pub bound: f64,
}

/// The `count` best substitutions of `root`, by [`BestFirst`].
///
/// When a limit is reached before the first one, it is [`BestFirst::any`]: an answer is proven to be the best
/// when its utility is not below [`Plan::bound`].
#[must_use]
pub fn best(graph: &Graph, root: VariableId, options: &Options, count: usize, limits: Limits) -> Plan {
    first(BestFirst::new(graph, root, options, limits), count)
}

/// The `count` best substitutions of `root` that meet requirements; as [`best`].
#[must_use]
pub fn best_meeting(
    knowledge: &KnowledgeBase,
    graph: &Graph,
    root: VariableId,
    options: &Options,
    requirements: &Requirements,
    count: usize,
    limits: Limits,
) -> Plan {
    first(BestFirst::meeting(knowledge, graph, root, options, requirements, limits), count)
}

fn first(mut search: BestFirst, count: usize) -> Plan {
    let mut substitutions = Vec::new();
    while substitutions.len() < count
        && let Some(answer) = search.next()
    {
        search.keep(limits::states(answer.0.steps.len() + answer.0.sources.len()));
        substitutions.push(answer);
    }
    let limited = matches!(search.stop(), StopReason::LimitExpansions | StopReason::LimitStates);
    if limited && substitutions.is_empty() {
        substitutions.extend(search.any());
    }
    Plan { substitutions, stop: search.stop(), expanded: search.expanded(), bound: search.bound() }
}
