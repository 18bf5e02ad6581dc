//! One measurement: the search, the graph and the result.

use super::experiment::Case;
use serde_json::{Value, json};
use shsa_core::plan::{Plan, StopReason, Take};

/// A search, or an operation that searches are compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Search {
    /// The plain visit that all others are compared with.
    Visit,
    BestFirst(Take),
    PropertyGuided(Take),
    /// All answers, by several threads.
    BestFirstInParts,
    PropertyGuidedInParts,
    Ontology,
    DepthFirst(Take),
    Exhaustive,
    /// A look into the contingency table.
    Table,
}

impl Search {
    /// The searches, in the order in which they run.
    pub(super) const ALL: [Search; 8] = [
        Search::BestFirst(Take::First),
        Search::PropertyGuided(Take::First),
        Search::Ontology,
        Search::DepthFirst(Take::First),
        Search::BestFirst(Take::All),
        Search::PropertyGuided(Take::All),
        Search::DepthFirst(Take::All),
        Search::Exhaustive,
    ];

    /// The searches that run on several threads.
    pub(super) const IN_PARTS: [Search; 2] = [Search::BestFirstInParts, Search::PropertyGuidedInParts];

    /// The search's name.
    pub(super) fn name(self) -> &'static str {
        match self {
            Search::Visit => "visit",
            Search::BestFirst(_) => "best_first",
            Search::PropertyGuided(_) => "property_guided",
            Search::BestFirstInParts => "best_first_in_parts",
            Search::PropertyGuidedInParts => "property_guided_in_parts",
            Search::Ontology => "ontology",
            Search::DepthFirst(_) => "depth_first",
            Search::Exhaustive => "exhaustive",
            Search::Table => "contingency",
        }
    }

    /// Whether it looks for the `first` answer or for `all`.
    pub(super) fn takes(self) -> Option<&'static str> {
        match self {
            Search::Visit | Search::Table => None,
            Search::Ontology => Some("first"),
            Search::Exhaustive | Search::BestFirstInParts | Search::PropertyGuidedInParts => Some("all"),
            Search::BestFirst(take) | Search::PropertyGuided(take) | Search::DepthFirst(take) => {
                Some(if take == Take::First { "first" } else { "all" })
            }
        }
    }
}

#[derive(Clone, Debug)]
pub(super) struct Record {
    pub(super) case: Case,
    pub(super) search: Search,
    /// Variables and relations of the graph.
    pub(super) nodes: usize,
    /// Nodes that can be reached from the root without passing a provided variable.
    pub(super) reached: usize,
    pub(super) seconds: f64,
    /// Why the search ended; `None` for a visit or a table.
    pub(super) stop: Option<StopReason>,
    pub(super) expanded: u64,
    /// The number of substitutions found.
    pub(super) found: usize,
    /// The utility of the first answer.
    pub(super) utility: Option<f64>,
    /// An upper bound of the utility of all answers not found.
    pub(super) bound: Option<f64>,
    /// The best utility of all answers.
    pub(super) best: Option<f64>,
}

impl Record {
    /// A record without results.
    pub(super) fn of(case: Case, search: Search) -> Record {
        Record {
            case,
            search,
            nodes: 0,
            reached: 0,
            seconds: 0.0,
            stop: None,
            expanded: 0,
            found: 0,
            utility: None,
            bound: None,
            best: None,
        }
    }

    /// The record with the result of a search.
    pub(super) fn with(self, plan: &Plan) -> Record {
        Record {
            stop: Some(plan.stop),
            expanded: plan.expanded,
            found: plan.substitutions.len(),
            utility: plan.substitutions.first().map(|(_, utility)| *utility),
            bound: Some(plan.bound),
            ..self
        }
    }

    /// Whether a limit ended it.
    pub(super) fn is_limited(&self) -> bool {
        matches!(self.stop, Some(StopReason::LimitExpansions | StopReason::LimitStates))
    }

    /// The record as a JSON object; times to a nanosecond.
    pub(super) fn to_json(&self) -> Value {
        let (branch, depth) = self.case.kind.size.unzip();
        json!({
            "experiment": self.case.kind.experiment.name(),
            "branch": branch,
            "depth": depth,
            "seed": self.case.seed,
            "nodes": self.nodes,
            "reached": self.reached,
            "search": self.search.name(),
            "take": self.search.takes(),
            "seconds": (self.seconds * 1e9).round() / 1e9,
            "stop": self.stop.map(|stop| stop.to_string()),
            "expanded": self.stop.map(|_| self.expanded),
            "found": self.stop.map(|_| self.found),
            "utility": self.utility,
            "bound": self.bound,
            "best": self.best,
        })
    }
}
