//! Faults that the structure could detect or isolate but no comparison does, with the obstacles.
//!
//! The structure tells which faults any method could detect and isolate with these equations. The monitor compares ways that
//! compute one variable after the other, in the directions in which relations can be solved. Where that is less, the analysis
//! searches a suitable residual and names its obstacles.

use super::basis::Basis;
use super::faults::Faults;
use super::structure::{EquationId, EquationSet, Isolability, Origin, Solving, Structure};
use crate::expression::Formula;
use crate::knowledge::{KnowledgeBase, NEGLIGIBLE, Relation, RelationId, SignalId, VariableId};
use crate::plan::{Limits, StopReason};
use crate::trust::Component;
use alloc::collections::BTreeMap;
use alloc::vec::Vec;

/// At most this many faults and pairs of faults are examined.
const MOST_GAPS: usize = 500;

/// At most this many gaps get a search of their own, where the sets found for all hold no suitable residual.
const MOST_SEARCHED: usize = 64;

/// The limits of the isolability analysis of the structure.
const LIMITS: Limits = Limits { expansions: 2_000_000, states: 500 };

/// The limits of the search for sets of equations.
const SET_LIMITS: Limits = Limits { expansions: 200_000, states: 500 };

/// A fault that the structure could detect or isolate but no comparison does.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Gap {
    /// The faulty component.
    pub fault: Component,
    /// The component that the fault could be isolated from, and is not; `None` where the fault is not detected at all.
    pub from: Option<Component>,
    /// The obstacles of the most feasible residual, in the order of computation.
    pub obstacles: Vec<Obstacle>,
}

/// An obstacle of a residual.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Obstacle {
    /// Relations that must be solved together, as each uses the output of another one.
    Loop {
        /// The relations of the loop.
        relations: Vec<RelationId>,
        /// The variables to solve for.
        variables: Vec<VariableId>,
        /// Whether the loop is a differential equation: it contains a derivative, an integral or another relation with a memory.
        is_dynamic: bool,
    },
    /// A relation that must be solved for a variable, and is not.
    Direction {
        /// The relation.
        relation: RelationId,
        /// The variable to solve for.
        variable: VariableId,
    },
    /// A relation that the analysis excludes: it has no formula where one is required, or goes on from its own last value.
    NotRun {
        /// The relation.
        relation: RelationId,
    },
    /// A derived signal whose derivation is no relation of the model.
    Derived {
        /// The signal.
        signal: SignalId,
    },
    /// No obstacle but the limits of the monitor or of the search.
    LeftOut,
    /// The limit of searches was reached first.
    NotSearched,
}

/// All gaps, by the fault and then by the other component, in file order; of relations, those with a declared prior probability
/// of a fault.
///
/// Complexity: at most 2,000,000 edges of the structure for its isolability, and 500 sets of equations for 500 gaps.
pub(super) fn gaps(knowledge: &KnowledgeBase, basis: &Basis, faults: &Faults) -> Vec<Gap> {
    let structure = Structure::new(knowledge);
    let isolability = structure.isolability(LIMITS);
    if isolability.stop != StopReason::Complete {
        return Vec::new();
    }
    let missed = missed(knowledge, &structure, &isolability, faults);
    if missed.is_empty() {
        return Vec::new();
    }
    let sets = structure.overdetermined_sets(SET_LIMITS);
    let mut residuals = Residuals {
        knowledge,
        basis,
        structure: &structure,
        sets: sets.sets,
        is_complete: sets.stop == StopReason::Complete,
        solved: BTreeMap::new(),
        left: MOST_SEARCHED,
    };
    let gap = |(fault, from): (Component, Option<Component>)| {
        let obstacles = residuals.obstacles(fault, from);
        Gap { fault, from, obstacles }
    };
    missed.into_iter().map(gap).collect()
}

/// The equation of a component whose faults are considered.
fn equation(knowledge: &KnowledgeBase, structure: &Structure, component: Component) -> Option<EquationId> {
    match component {
        Component::Signal(signal) => {
            let prior = knowledge.signals()[signal].properties.prior();
            structure.of_signal(signal).filter(|_| prior.is_none_or(|prior| prior >= NEGLIGIBLE))
        }
        Component::Relation(relation) => {
            let prior = knowledge.relations()[relation].properties.prior();
            structure.of_relation(relation).filter(|_| prior.is_some_and(|prior| prior >= NEGLIGIBLE))
        }
        Component::Cause(_) => None,
    }
}

/// Whether conditions read a signal's variable, and nothing else does.
fn is_only_asked(knowledge: &KnowledgeBase, component: Component) -> bool {
    let Component::Signal(signal) = component else { return false };
    let variable = knowledge.signals()[signal].variable;
    let reads = |formula: &Formula| formula.symbols().contains(&variable.symbol());
    let asks = |relation: &Relation| relation.condition.as_ref().is_some_and(reads);
    let uses = |relation: &Relation| match relation.formulas.is_empty() {
        true => relation.inputs.contains(&variable) || relation.outputs.contains(&variable),
        false => relation.outputs.contains(&variable) || relation.formulas.iter().any(reads),
    };
    knowledge.relations().iter().any(asks) && !knowledge.relations().iter().any(uses)
}

/// The faults that the structure could detect, and the pairs of faults that it could isolate, where the comparisons do not.
fn missed(
    knowledge: &KnowledgeBase,
    structure: &Structure,
    isolability: &Isolability,
    faults: &Faults,
) -> Vec<(Component, Option<Component>)> {
    let of = |component| equation(knowledge, structure, component);
    let mut missed = Vec::new();
    for fault in faults.components() {
        let (Some(own), Some(shown)) = (of(fault), faults.isolability(fault)) else { continue };
        if !isolability.is_detectable(own) {
            continue;
        }
        if shown.shown_by == 0 {
            // A condition is no evidence about what it reads, whatever the structure says.
            missed.extend((!is_only_asked(knowledge, fault)).then_some((fault, None)));
            continue;
        }
        let signals = shown.signals.iter().map(Component::Signal);
        let suspects = signals.chain(shown.relations.iter().map(Component::Relation));
        let could_isolate =
            |other: &Component| of(*other).is_some_and(|other| isolability.is_isolable(own, other));
        missed.extend(suspects.filter(could_isolate).map(|other| (fault, Some(other))));
        if missed.len() >= MOST_GAPS {
            break;
        }
    }
    missed.truncate(MOST_GAPS);
    missed
}

/// Searches residuals.
struct Residuals<'a> {
    knowledge: &'a KnowledgeBase,
    basis: &'a Basis,
    structure: &'a Structure,
    /// Minimal overdetermined sets, the fewest equations first.
    sets: Vec<EquationSet>,
    is_complete: bool,
    /// The solving of each set that was asked for.
    solved: BTreeMap<usize, Option<Solving>>,
    /// The remaining searches of a set for one gap.
    left: usize,
}

impl Residuals<'_> {
    /// The obstacles of the most feasible residual that contains a fault and not another.
    fn obstacles(&mut self, fault: Component, from: Option<Component>) -> Vec<Obstacle> {
        let of = |component| equation(self.knowledge, self.structure, component);
        let Some(with) = of(fault) else { return Vec::new() };
        let without = from.and_then(of);
        let shows =
            |set: &EquationSet| set.contains(with) && without.is_none_or(|other| !set.contains(other));
        let places: Vec<usize> =
            self.sets.iter().enumerate().filter(|(_, set)| shows(set)).map(|(at, _)| at).collect();
        let mut best: Option<Solving> = None;
        for at in places {
            if let Some(found) = self.solved(at)
                && best.as_ref().is_none_or(|best| found.rank() < best.rank())
            {
                best = Some(found);
            }
            if best.as_ref().is_some_and(Solving::is_free) {
                break;
            }
        }
        if best.is_none() && !self.is_complete && self.left > 0 {
            self.left -= 1;
            let own = self.structure.overdetermined_set(with, without);
            best = own.and_then(|set| {
                self.structure.solving(&set, &|equation, variable| self.solves(equation, variable))
            });
        }
        match best {
            None => Vec::from([Obstacle::NotSearched]),
            Some(solving) if solving.is_free() => Vec::from([Obstacle::LeftOut]),
            Some(solving) => self.named(&solving),
        }
    }

    fn solved(&mut self, at: usize) -> Option<Solving> {
        if !self.solved.contains_key(&at) {
            let set = self.sets.get(at)?;
            let found = self.structure.solving(set, &|equation, variable| self.solves(equation, variable));
            self.solved.insert(at, found);
        }
        self.solved.get(&at).cloned().flatten()
    }

    /// Whether an equation gives a variable in the comparisons.
    fn solves(&self, equation: EquationId, variable: VariableId) -> bool {
        match self.structure.equations().find(equation).map(|equation| equation.origin) {
            Some(Origin::Relation(relation)) => {
                self.knowledge.relations()[relation].outputs.contains(&variable)
                    && self.basis.forbidden().binary_search(&relation).is_err()
            }
            Some(Origin::Signal(signal)) => {
                let is_own = self.knowledge.witness(signal) == signal;
                is_own && self.knowledge.signals()[signal].derived_from.is_empty()
            }
            None => false,
        }
    }

    fn named(&self, solving: &Solving) -> Vec<Obstacle> {
        let origin = |equation: EquationId| self.structure.equations().find(equation).map(|it| it.origin);
        let relation = |&equation: &EquationId| match origin(equation)? {
            Origin::Relation(relation) => Some(relation),
            Origin::Signal(_) => None,
        };
        let loops = solving.loops.iter().map(|part| {
            let relations: Vec<RelationId> = part.equations.iter().filter_map(relation).collect();
            let is_dynamic = relations.iter().any(|&relation| {
                self.knowledge.relations()[relation].formulas.iter().any(Formula::is_stateful)
            });
            Obstacle::Loop { relations, variables: part.variables.clone(), is_dynamic }
        });
        let backwards =
            solving.backwards.iter().filter_map(|&(equation, variable)| match origin(equation)? {
                Origin::Signal(signal) => Some(Obstacle::Derived { signal }),
                Origin::Relation(relation) if self.basis.forbidden().binary_search(&relation).is_ok() => {
                    Some(Obstacle::NotRun { relation })
                }
                Origin::Relation(relation) => Some(Obstacle::Direction { relation, variable }),
            });
        loops.chain(backwards).collect()
    }
}
