//! The analysis of a knowledge base before it runs: detectability and isolability of faults, survived losses, and useful
//! additions.
//!
//! [`analyze`] uses the same monitor and planner as a run: a fault is detectable when a comparison of the monitor shows it, and a
//! loss is survived when the planner finds another way. One exception: a way that only goes on from its own variable's last
//! value, as dead reckoning does, counts as no substitute.

pub mod structure;
mod budget;
mod basis;
mod hitting;
mod comparisons;
mod faults;
mod held;
mod partly;
mod losses;
mod liars;
mod survey;
mod watch;
mod gaps;
mod additions;
mod prospect;

pub use additions::{Addition, Candidate, Survives};
pub use comparisons::{Comparison, Comparisons};
pub use faults::Faults;
pub use gaps::{Gap, Obstacle};
pub use held::Held;
pub use liars::{Liar, Withstands, liars};
pub use losses::Tolerance;
pub use partly::{Partly, Reservation};
pub use prospect::{Candidacy, Failure, Prospect, Serving};
pub use watch::{Hidden, Watch};

use crate::knowledge::{Id, IdVec, KnowledgeBase, NeedId, Relation, RelationId, SignalId, SignalSet};
use crate::plan::Graph;
use crate::residual_selection::WatchBudget;
use crate::trust::Component;
use additions::Extensible;
use alloc::vec::Vec;
use budget::Budget;
use losses::{Losses, Target};
use survey::Survey;

/// The scope and the limits of an analysis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Whether relations without a formula are excluded; otherwise they count as if they had one.
    pub only_runnable: bool,
    /// Steps for the model itself: decisions of searches, visited sets.
    pub steps: u64,
    /// Steps for trying additions; 0 tries none.
    pub addition_steps: u64,
    /// The limits of the monitor.
    pub watch: WatchBudget,
}

impl Default for Options {
    /// Limits of some seconds at most.
    fn default() -> Options {
        let watch = WatchBudget::default();
        Options { only_runnable: false, steps: 3_000_000, addition_steps: 2_000_000, watch }
    }
}

/// A limit that the analysis reached, and the number of elements beyond the limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limited {
    /// The monitor compares only a choice of ways of some variables, as there are more than it watches.
    Ways {
        /// The number of variables.
        variables: usize,
    },
    /// The steps were spent before the ways of some variables were searched: more faults may be detectable.
    Skipped {
        /// The number of variables.
        variables: usize,
    },
    /// Some needs may survive more losses than proven.
    Needs {
        /// The number of needs.
        needs: usize,
    },
    /// Some variables may survive more losses than proven.
    Variables {
        /// The number of variables.
        variables: usize,
    },
    /// Not all additions were tried.
    Additions {
        /// The number of tried additions.
        tried: usize,
        /// The number of all additions.
        of: usize,
    },
}

/// The result of an analysis.
#[derive(Clone, Debug)]
pub struct Analysis {
    /// The comparisons that the monitor makes.
    pub comparisons: Comparisons,
    /// The faults that they detect and isolate.
    pub faults: Faults,
    /// Those that they show only in part.
    pub partly: Partly,
    /// The watched ways of each number that can be known in two ways or more, in file order.
    pub watched: Vec<Watch>,
    /// The losses that the variable of each signal survives, and the single points of failure.
    pub signals: IdVec<SignalId, Tolerance>,
    /// The losses that each need survives, within its age.
    pub needs: IdVec<NeedId, Tolerance>,
    /// Useful additions, the best first.
    pub additions: Vec<Addition>,
    /// Faults that the structure could detect or isolate and no comparison does, with the obstacles.
    pub gaps: Vec<Gap>,
    /// The limits that were reached.
    pub limited: Vec<Limited>,
}

impl Analysis {
    /// Whether the variable of a signal can be known without the signal and all that is derived from it.
    #[must_use]
    pub fn is_substitutable(&self, signal: SignalId) -> bool {
        let tolerance = &self.signals[signal];
        tolerance.known && !tolerance.single_points.contains(signal)
    }

    /// Whether a fault of a component is isolable from one of another, without a comparison that has several solutions.
    #[must_use]
    pub fn is_isolable_from(&self, component: Component, other: Component) -> bool {
        let by_structure =
            self.faults.isolability(component).is_some_and(|found| found.is_isolable_from(other));
        by_structure && self.partly.is_isolable_from(component, other)
    }

    /// All components that a fault is isolable from so, signals and then relations, in file order.
    pub fn isolable_from(&self, component: Component) -> impl Iterator<Item = Component> + '_ {
        self.faults
            .components()
            .filter(move |&other| other != component && self.is_isolable_from(component, other))
    }

    /// All components that a fault is isolable from only by comparisons that have several solutions: a fault that leads to another
    /// one of these is not isolable from them.
    pub fn isolable_in_part_from(&self, component: Component) -> impl Iterator<Item = Component> + '_ {
        self.faults
            .isolable_components_from(component)
            .filter(move |&other| !self.partly.is_isolable_from(component, other))
    }

    /// The needs that fail when a signal is lost, in file order.
    pub fn needs_lost(&self, signal: SignalId) -> impl Iterator<Item = NeedId> + '_ {
        let takes = move |(need, tolerance): (NeedId, &Tolerance)| {
            tolerance.single_points.contains(signal).then_some(need)
        };
        self.needs.enumerate().filter_map(takes)
    }

    /// Signals without a substitute, or whose loss fails a need.
    #[must_use]
    pub fn unhealed(&self) -> SignalSet {
        let is_unhealed =
            |&signal: &SignalId| !self.is_substitutable(signal) || self.needs_lost(signal).next().is_some();
        self.signals.ids().filter(is_unhealed).collect()
    }
}

/// Comparisons that the model or its structure allows, and the monitor does not make; and those whose bounds are no bounds.
#[derive(Clone, Debug)]
pub struct Unwatched {
    /// As [`Analysis::watched`].
    pub watched: Vec<Watch>,
    /// As [`Analysis::gaps`].
    pub gaps: Vec<Gap>,
    /// The inputs that substitutes hold between their values without a limit of their change.
    pub held: Vec<Held>,
}

/// The part of an analysis about comparisons that are not made, without losses and additions.
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
        held: held::held(knowledge, comparisons.ways()),
    }
}

/// For each need, the measured signals without which it is not served and whose faults no comparison shows.
///
/// Complexity: the searches of a monitor and some for each need, at most [`Options::steps`].
#[must_use]
pub fn unconfirmed(knowledge: &KnowledgeBase, options: Options) -> IdVec<NeedId, SignalSet> {
    let graph = Graph::new(knowledge);
    let basis = basis::Basis::new(knowledge, options, RelationId::from_index(knowledge.relations().len()));
    let mut budget = Budget::new(options.steps);
    let (_, comparisons) = survey::compared(knowledge, &graph, &basis, &mut budget);
    let faults = Faults::new(knowledge, &comparisons);
    let mut losses = Losses::new(knowledge, &graph, &basis);
    IdVec::filled(knowledge.needs().len(), |need| {
        let points = losses.tolerance(&Target::of_need(knowledge, need), &mut budget).single_points;
        points.iter().filter(|&it| !faults.is_detectable(it) && !knowledge.is_computed(it)).collect()
    })
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
    analyze_with(knowledge, &[], options)
}

/// Analyses a model, and ranks relations that it does not have among the additions. Their variables are those of the model.
///
/// Complexity: as [`analyze`].
#[must_use]
pub fn analyze_with(knowledge: &KnowledgeBase, given: &[Relation], options: Options) -> Analysis {
    let graph = Graph::new(knowledge);
    let all = RelationId::from_index(knowledge.relations().len());
    let basis = basis::Basis::new(knowledge, options, all);
    let survey = Survey::new(knowledge, &graph, &basis, options.steps);
    let mut limited = survey.limited();
    let mut budget = Budget::new(options.addition_steps);
    let tried = match budget.is_spent() {
        true => additions::Tried::default(),
        false => additions::ranked(Extensible { knowledge, given }, options, &survey, &mut budget),
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
        partly: Partly::new(knowledge, &survey.comparisons),
        comparisons: survey.comparisons,
        faults: survey.faults,
        needs: survey.needs,
        additions: tried.additions,
        limited,
    }
}
