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
mod subproblem;
mod scratch;
mod decisions;
mod greedy;
mod frontier;
pub mod requirements;
mod admission;
mod best_first;
mod parallel;
mod contingency;

pub use admission::Admission;
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
pub use scratch::Scratch;

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
    Plan::of(&mut BestFirst::new(graph, root, options, limits), count)
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
    Plan::of(&mut BestFirst::meeting(knowledge, graph, root, options, requirements, limits), count)
}

impl Plan {
    /// The first `count` answers of a search that was just begun; as [`best`].
    #[must_use]
    pub fn of(search: &mut BestFirst, count: usize) -> Plan {
        let mut plan = Plan::default();
        plan.refill(search, count);
        plan
    }

    /// As [`Plan::of`], in the memory of a plan that is not needed any more.
    pub fn refill(&mut self, search: &mut BestFirst, count: usize) {
        let mut found = 0;
        while found < count {
            if found == self.substitutions.len() {
                self.substitutions.push((search.blank(), 0.0));
            }
            let Some((substitution, utility)) = self.substitutions.get_mut(found) else { break };
            let Some(rated) = search.next_into(substitution) else { break };
            *utility = rated;
            search.keep(limits::states(substitution.steps.len() + substitution.sources.len()));
            found += 1;
        }
        self.substitutions.truncate(found);
        self.stop = search.stop();
        if found == 0 && matches!(self.stop, StopReason::LimitExpansions | StopReason::LimitStates) {
            self.substitutions.extend(BestFirst::any(search));
        }
        (self.expanded, self.bound) = (search.expanded(), search.bound());
    }
}

impl Default for Plan {
    /// Nothing was searched for.
    fn default() -> Plan {
        Plan { substitutions: Vec::new(), stop: StopReason::Found(0), expanded: 0, bound: f64::INFINITY }
    }
}
