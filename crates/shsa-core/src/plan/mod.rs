//! Searches for substitutions: which relations compute a variable best from trusted sources.
//!
//! [`exhaustive()`] tries everything and is the oracle; [`BestFirst`] returns the best substitutions first and stops when the
//! caller has enough. The other searches are those of the thesis: [`depth_first()`], [`ontology()`] (ORR), and
//! [`property_guided()`] (SH-PGSA). All complete searches return the same substitutions in the same order.

pub mod utility;
mod limits;
mod graph;
mod exhaustive;
mod choices;
mod depth_first;
mod ontology;
mod partial;
mod progress;
mod combinations;
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
pub use parallel::{Deal, Part, best_in_parts, property_guided_in_parts};
pub use property_guided::{Leaves, Step, property_guided, property_guided_traced};
pub use requirements::{Requirements, Shortfall};
pub use scratch::Scratch;

use crate::knowledge::{KnowledgeBase, VariableId};
use crate::substitution::Substitution;
use alloc::vec::Vec;

/// The result of a search.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Substitutions with their utilities, best first.
    pub substitutions: Vec<(Substitution, f64)>,
    /// The reason for the end of the search.
    pub stop: StopReason,
    /// The number of decisions taken.
    pub expanded: u64,
    /// An upper bound of the utility of missing substitutions; the lowest utility when none is missing.
    pub bound: f64,
}

/// The `count` best substitutions of `root`, by [`BestFirst`].
///
/// When a limit is reached before the first answer, the plan has that of [`BestFirst::any`]. An answer is proven best when its
/// utility is not below [`Plan::bound`].
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
    /// The first `count` answers of a new search; as [`best`].
    #[must_use]
    pub fn of(search: &mut BestFirst, count: usize) -> Plan {
        let mut plan = Plan::default();
        plan.refill(search, count);
        plan
    }

    /// As [`Plan::of`], in the memory of a plan that is no longer needed.
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
    /// A plan without a search.
    fn default() -> Plan {
        Plan { substitutions: Vec::new(), stop: StopReason::Found(0), expanded: 0, bound: f64::INFINITY }
    }
}
