//! What a knowledge base can do at all, known before anything runs: which faults show, which can be told apart,
//! what survives which losses, and what would help.
//!
//! [`analyze`] asks the same monitor and planner that will run: a fault is detectable when a comparison that the monitor
//! makes shows it, and a loss is survived when the planner finds another way. One exception: a way that only goes on
//! from the last value of its own variable, as dead reckoning does, counts as no substitute.

pub mod structure;
mod budget;
mod basis;
mod hitting;
mod comparisons;
mod faults;
mod losses;
mod survey;
mod watch;
mod gaps;
mod additions;
mod prospect;

pub use additions::{Addition, Candidate, Survives};
pub use comparisons::{Comparison, Comparisons};
pub use faults::Faults;
pub use gaps::{Gap, Obstacle};
pub use losses::Tolerance;
pub use prospect::{Candidacy, Failure, Prospect, Serving};
pub use watch::{Hidden, Watch};

use crate::knowledge::{Id, IdVec, KnowledgeBase, NeedId, RelationId, SignalId, SignalSet};
use crate::plan::Graph;
use crate::residual_selection::WatchBudget;
use alloc::vec::Vec;
use budget::Budget;
use losses::{Losses, Target};
use survey::Survey;

/// What is asked of an analysis, and what it may spend.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Relations without a formula are left out; else they count as if they had one.
    pub only_runnable: bool,
    /// Steps for the model as it is: decisions of searches, sets looked at.
    pub steps: u64,
    /// Steps for trying additions; with 0 none is tried.
    pub addition_steps: u64,
    /// How much the monitor watches.
    pub watch: WatchBudget,
}

impl Default for Options {
    /// Seconds at the most.
    fn default() -> Options {
        let watch = WatchBudget::default();
        Options { only_runnable: false, steps: 3_000_000, addition_steps: 2_000_000, watch }
    }
}

/// What was not looked at to the end, and how much of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limited {
    /// Of so many variables the monitor compares a choice of ways, as there are more than it watches.
    Ways {
        /// How many.
        variables: usize,
    },
    /// The steps were spent before the ways of so many variables were looked for: more faults may show.
    Skipped {
        /// How many.
        variables: usize,
    },
    /// So many needs may survive more losses than is proven.
    Needs {
        /// How many.
        needs: usize,
    },
    /// So many variables may survive more losses than is proven.
    Variables {
        /// How many.
        variables: usize,
    },
    /// Not all additions were tried.
    Additions {
        /// How many were.
        tried: usize,
        /// How many there are.
        of: usize,
    },
}

/// What is known about a model before it runs.
#[derive(Clone, Debug)]
pub struct Analysis {
    /// The comparisons that the monitor makes.
    pub comparisons: Comparisons,
    /// Which faults they show, and which they tell apart.
    pub faults: Faults,
    /// What is watched of each number that can be known in two ways or more, in file order.
    pub watched: Vec<Watch>,
    /// How many losses the variable of each signal survives, and which signals it cannot do without.
    pub signals: IdVec<SignalId, Tolerance>,
    /// How many losses each need survives, within its age.
    pub needs: IdVec<NeedId, Tolerance>,
    /// What would help, the best first.
    pub additions: Vec<Addition>,
    /// What the structure tells and no comparison does, and why.
    pub gaps: Vec<Gap>,
    /// What was not looked at to the end.
    pub limited: Vec<Limited>,
}

impl Analysis {
    /// Whether the variable of a signal can be known without the signal, and without what is derived from it.
    #[must_use]
    pub fn is_substitutable(&self, signal: SignalId) -> bool {
        let tolerance = &self.signals[signal];
        tolerance.known && !tolerance.single_points.contains(signal)
    }

    /// The needs that the loss of a signal takes, in file order.
    pub fn needs_lost(&self, signal: SignalId) -> impl Iterator<Item = NeedId> + '_ {
        let takes = move |(need, tolerance): (NeedId, &Tolerance)| {
            tolerance.single_points.contains(signal).then_some(need)
        };
        self.needs.enumerate().filter_map(takes)
    }

    /// Signals whose variable nothing else knows, or whose loss takes a need.
    #[must_use]
    pub fn unhealed(&self) -> SignalSet {
        let is_unhealed =
            |&signal: &SignalId| !self.is_substitutable(signal) || self.needs_lost(signal).next().is_some();
        self.signals.ids().filter(is_unhealed).collect()
    }
}

/// What a model declares, or its structure allows, and is not watched.
#[derive(Clone, Debug)]
pub struct Unwatched {
    /// As [`Analysis::watched`].
    pub watched: Vec<Watch>,
    /// As [`Analysis::gaps`].
    pub gaps: Vec<Gap>,
}

/// What of an analysis is about what is not watched, without its losses and additions.
///
/// Complexity: the searches of a monitor, at most [`Options::steps`], and 2,000,000 edges of the structure.
#[must_use]
pub fn unwatched(knowledge: &KnowledgeBase, options: Options) -> Unwatched {
    let graph = Graph::new(knowledge);
    let basis = basis::Basis::new(knowledge, options, RelationId::from_index(knowledge.relations().len()));
    let mut budget = Budget::new(options.steps);
    let (watched, comparisons) = survey::compared(knowledge, &graph, &basis, &mut budget);
    let faults = Faults::new(knowledge, &comparisons);
    Unwatched {
        watched: watch::watched(knowledge, &watched.are, &faults),
        gaps: gaps::gaps(knowledge, &basis, &faults),
    }
}

/// How many more losses each need survives, within its age, while these signals are lost.
///
/// Complexity: a few dozen searches for each need, at most [`Options::steps`] for all.
#[must_use]
pub fn tolerances(knowledge: &KnowledgeBase, lost: &SignalSet, options: Options) -> IdVec<NeedId, Tolerance> {
    let mut left = knowledge.clone();
    // What is derived from a lost signal is lost with it.
    let taken = knowledge.signals().ids().filter(|&signal| knowledge.origins(signal).meets(lost));
    taken.for_each(|signal| left.set_available(signal, false));
    let graph = Graph::new(&left);
    let basis = basis::Basis::new(&left, options, RelationId::from_index(left.relations().len()));
    let mut losses = Losses::new(&left, &graph, &basis);
    let mut budget = Budget::new(options.steps);
    IdVec::filled(left.needs().len(), |need| losses.tolerance(&Target::of_need(&left, need), &mut budget))
}

/// Analyses a model.
///
/// Complexity: the searches of a monitor and a few dozen searches for each variable that a signal carries, at most
/// [`Options::steps`]; the same again for each addition, at most [`Options::addition_steps`].
#[must_use]
pub fn analyze(knowledge: &KnowledgeBase, options: Options) -> Analysis {
    let graph = Graph::new(knowledge);
    let all = RelationId::from_index(knowledge.relations().len());
    let basis = basis::Basis::new(knowledge, options, all);
    let survey = Survey::new(knowledge, &graph, &basis, options.steps);
    let mut limited = survey.limited();
    let mut budget = Budget::new(options.addition_steps);
    let tried = match budget.is_spent() {
        true => additions::Tried::default(),
        false => additions::ranked(knowledge, options, &survey, &mut budget),
    };
    if tried.tried < tried.candidates {
        limited.push(Limited::Additions { tried: tried.tried, of: tried.candidates });
    }
    let of_signal = |signal| {
        let variable = knowledge.signals()[signal].variable;
        survey.variables[variable].clone().unwrap_or_default()
    };
    Analysis {
        watched: watch::watched(knowledge, &survey.watched, &survey.faults),
        gaps: gaps::gaps(knowledge, &basis, &survey.faults),
        signals: IdVec::filled(knowledge.signals().len(), of_signal),
        comparisons: survey.comparisons,
        faults: survey.faults,
        needs: survey.needs,
        additions: tried.additions,
        limited,
    }
}
