//! The solving of a minimal overdetermined set: one equation after the other, or some together.

use super::decomposition::{Blocks, Part};
use super::matching::Incidence;
use super::{EquationId, EquationSet};
use crate::knowledge::{Id, IdSet, IdVec, VariableId};
use alloc::vec::Vec;

/// The obstacles between a minimal overdetermined set and a comparison of two ways, for the best choice of the residual equation.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Solving {
    /// Equations that must be solved together, with their variables: a variable of each rests on itself.
    pub loops: Vec<Part>,
    /// Equations that must be solved for a variable, and cannot be.
    pub backwards: Vec<(EquationId, VariableId)>,
}

impl Solving {
    /// Whether solving one equation after the other gives two ways of knowing a variable.
    #[must_use]
    pub fn is_free(&self) -> bool {
        self.backwards.is_empty() && self.loops.is_empty()
    }

    /// The number of equations that are obstacles; of equal numbers, loops rank before impossible directions.
    pub(crate) fn rank(&self) -> (usize, usize) {
        let together = self.loops.iter().map(|part| part.equations.len()).sum::<usize>();
        (self.backwards.len() + together, self.backwards.len())
    }
}

/// The best solving of a set, over all choices of the residual; the first of equals.
///
/// `solves` says whether an equation can be solved for a variable. `None` for a set that is not minimal. Complexity:
/// O(n edges sqrt(n)) for n equations.
pub(super) fn best(
    incidence: &Incidence<EquationId, VariableId>,
    set: &EquationSet,
    solves: &dyn Fn(EquationId, VariableId) -> bool,
) -> Option<Solving> {
    let equations: Vec<EquationId> = set.iter().collect();
    let mut best: Option<Solving> = None;
    for &residual in &equations {
        let rest: Vec<EquationId> = equations.iter().copied().filter(|&other| other != residual).collect();
        let Some(found) = without(incidence, residual, &rest, solves) else { continue };
        let is_free = found.is_free();
        if best.as_ref().is_none_or(|best| found.rank() < best.rank()) {
            best = Some(found);
        }
        if is_free {
            break;
        }
    }
    best
}

/// The solving of the other equations when one equation is the residual.
fn without(
    incidence: &Incidence<EquationId, VariableId>,
    residual: EquationId,
    rest: &[EquationId],
    solves: &dyn Fn(EquationId, VariableId) -> bool,
) -> Option<Solving> {
    let own: Incidence<EquationId, VariableId> = incidence.restricted(rest);
    let matching = own.matching();
    if matching.free_rows().next().is_some() || matching.columns.iter().any(Option::is_none) {
        return None;
    }
    let names = names(incidence, rest);
    let blocks = Blocks::new(&own, &matching, own.rows.ids().collect()).find();
    let mut solving = Solving::default();
    // The variables that each variable rests on, itself included.
    let mut under: IdVec<VariableId, IdSet<VariableId>> = IdVec::filled(names.len(), |_| IdSet::new());
    for block in &blocks {
        let read = block.equations.iter().flat_map(|&equation| own.rows[equation].iter().copied());
        let mut all: IdSet<VariableId> = block.variables.iter().copied().collect();
        for variable in read.collect::<Vec<VariableId>>() {
            all.extend(&under[variable].clone());
        }
        block.variables.iter().for_each(|&variable| under[variable] = all.clone());
        let equations = block.equations.iter().filter_map(|local| rest.get(local.index()).copied()).collect();
        let variables: Vec<VariableId> =
            block.variables.iter().filter_map(|local| names.get(local.index()).copied()).collect();
        let part = Part { equations, variables };
        match (part.equations.as_slice(), part.variables.as_slice()) {
            (&[equation], &[variable]) if solves(equation, variable) => {}
            (&[equation], &[variable]) => solving.backwards.push((equation, variable)),
            _ => solving.loops.push(sorted(part)),
        }
    }
    let local =
        |variable: VariableId| names.iter().position(|&name| name == variable).map(VariableId::from_index);
    let read: Vec<(VariableId, VariableId)> =
        incidence.rows[residual].iter().filter_map(|&variable| Some((variable, local(variable)?))).collect();
    // The residual gives a variable from other variables that do not rest on the first one.
    let is_last = |(_, own): &&(VariableId, VariableId)| {
        read.iter().all(|&(_, other)| other == *own || !under[other].contains(*own))
    };
    let mut last = read.iter().filter(is_last);
    if !last.clone().any(|&(variable, _)| solves(residual, variable)) {
        let any = last.next().or_else(|| read.first());
        solving.backwards.extend(any.map(|&(variable, _)| (residual, variable)));
    }
    Some(solving)
}

/// The variables of some equations, in the order in which a restricted incidence numbers them.
fn names(incidence: &Incidence<EquationId, VariableId>, equations: &[EquationId]) -> Vec<VariableId> {
    let mut names = Vec::new();
    let mut seen = IdSet::new();
    for &equation in equations {
        names.extend(incidence.rows[equation].iter().copied().filter(|&variable| seen.insert(variable)));
    }
    names
}

fn sorted(mut part: Part) -> Part {
    part.equations.sort_unstable();
    part.variables.sort_unstable();
    part
}
