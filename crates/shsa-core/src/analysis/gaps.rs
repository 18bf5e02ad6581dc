//! What the structure would tell and no comparison does, with what hinders it.
//!
//! The structure says which faults any method could detect and tell apart with these equations. The monitor compares ways
//! that compute one variable after the other, in the directions in which relations can be solved. Where that is less, a
//! residual that would tell is looked for, and what is in its way is named.

use super::basis::Basis;
use super::faults::Faults;
use super::structure::{EquationId, EquationSet, Isolability, Origin, Solving, Structure};
use crate::diagnosis::Component;
use crate::expression::Formula;
use crate::knowledge::{KnowledgeBase, NEGLIGIBLE, RelationId, SignalId, VariableId};
use crate::plan::{Limits, StopReason};
use alloc::collections::BTreeMap;
use alloc::vec::Vec;

/// Faults and pairs of them that are looked at.
const MOST_GAPS: usize = 500;

/// Gaps for which a residual of their own is looked for when it is not among those that were found for all.
const MOST_SEARCHED: usize = 64;

/// Edges that are walked to say what the structure tells.
const LIMITS: Limits = Limits { expansions: 2_000_000, states: 500 };

/// What the search for sets of equations may cost, and how many are looked at.
const SET_LIMITS: Limits = Limits { expansions: 200_000, states: 500 };

/// A fault that the structure tells and no comparison does.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Gap {
    /// What is faulty.
    pub fault: Component,
    /// What it is taken for and would be told from; `None` where it does not show at all.
    pub from: Option<Component>,
    /// What hinders the residual that comes closest, in the order of computation.
    pub obstacles: Vec<Obstacle>,
}

/// What hinders a residual.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Obstacle {
    /// Relations would have to be solved together, as each rests on what another one gives.
    Loop {
        /// Which.
        relations: Vec<RelationId>,
        /// For these.
        variables: Vec<VariableId>,
        /// One of them is a derivative, an integral or another relation with a memory: together, a differential equation.
        is_dynamic: bool,
    },
    /// A relation would have to be solved for a variable for which it is not.
    Direction {
        /// Which.
        relation: RelationId,
        /// For this.
        variable: VariableId,
    },
    /// A relation is not counted on: it has no formula where that is asked for, or goes on from its own last value.
    NotRun {
        /// Which.
        relation: RelationId,
    },
    /// What a signal is derived from follows from no relation of the model.
    Derived {
        /// Which.
        signal: SignalId,
    },
    /// Nothing is in its way but how much may be watched, or searched.
    LeftOut,
    /// No residual was looked for: a limit of the search was reached.
    NotSearched,
}

/// All gaps, by the fault and then by what it is taken for, in file order; relations count that have a declared prior
/// probability of a fault.
///
/// Complexity: at most 2,000,000 edges of the structure for its isolability, and 500 sets of equations for 500 gaps.
pub(super) fn gaps(knowledge: &KnowledgeBase, basis: &Basis, faults: &Faults) -> Vec<Gap> {
    let structure = Structure::new(knowledge);
    let isolability = structure.isolability(LIMITS);
    if isolability.stop != StopReason::Complete {
        return Vec::new();
    }
    let untold = untold(knowledge, &structure, &isolability, faults);
    if untold.is_empty() {
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
    untold.into_iter().map(gap).collect()
}

/// The equation of a component whose fault is looked for.
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

/// The faults, and pairs of them, that the structure tells and the comparisons do not.
fn untold(
    knowledge: &KnowledgeBase,
    structure: &Structure,
    isolability: &Isolability,
    faults: &Faults,
) -> Vec<(Component, Option<Component>)> {
    let of = |component| equation(knowledge, structure, component);
    let mut untold = Vec::new();
    for fault in faults.components() {
        let (Some(own), Some(told)) = (of(fault), faults.told(fault)) else { continue };
        if !isolability.is_detectable(own) {
            continue;
        }
        if told.shown_by == 0 {
            untold.push((fault, None));
            continue;
        }
        let signals = told.signals.iter().map(Component::Signal);
        let suspects = signals.chain(told.relations.iter().map(Component::Relation));
        let is_told = |other: &Component| of(*other).is_some_and(|other| isolability.is_isolable(own, other));
        untold.extend(suspects.filter(is_told).map(|other| (fault, Some(other))));
        if untold.len() >= MOST_GAPS {
            break;
        }
    }
    untold.truncate(MOST_GAPS);
    untold
}

/// Looks for residuals.
struct Residuals<'a> {
    knowledge: &'a KnowledgeBase,
    basis: &'a Basis,
    structure: &'a Structure,
    /// Minimal overdetermined sets, the fewest equations first.
    sets: Vec<EquationSet>,
    is_complete: bool,
    /// How each would be solved, as far as it was asked for.
    solved: BTreeMap<usize, Option<Solving>>,
    /// For how many gaps a set of their own is looked for yet.
    left: usize,
}

impl Residuals<'_> {
    /// What hinders the residual with a fault and without another that comes closest.
    fn obstacles(&mut self, fault: Component, from: Option<Component>) -> Vec<Obstacle> {
        let of = |component| equation(self.knowledge, self.structure, component);
        let Some(with) = of(fault) else { return Vec::new() };
        let without = from.and_then(of);
        let tells =
            |set: &EquationSet| set.contains(with) && without.is_none_or(|other| !set.contains(other));
        let places: Vec<usize> =
            self.sets.iter().enumerate().filter(|(_, set)| tells(set)).map(|(at, _)| at).collect();
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

    /// Whether an equation gives a variable, as comparisons count on it.
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
