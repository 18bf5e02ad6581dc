//! The Dulmage-Mendelsohn decomposition into an underdetermined, a just determined and an overdetermined part.

use super::EquationId;
use super::matching::{Incidence, Matching};
use crate::knowledge::{IdSet, IdVec, VariableId};
use alloc::vec::Vec;

/// Equations and the variables that belong to them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Part {
    /// Ascending.
    pub equations: Vec<EquationId>,
    /// Ascending.
    pub variables: Vec<VariableId>,
}

/// Equations and unknown variables, by how well they determine each other.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Decomposition {
    /// More variables than equations: these variables cannot be known.
    pub under: Part,
    /// As many variables as equations, in the smallest blocks that are solved together. The blocks are in an order in which one
    /// after the other can be solved once `over` is known. A fault in them is not detectable.
    pub just: Vec<Part>,
    /// More equations than variables: they can contradict each other.
    pub over: Part,
}

impl Decomposition {
    /// The structural redundancy: the number of equations beyond the number of variables in the overdetermined part.
    #[must_use]
    pub fn redundancy(&self) -> usize {
        self.over.equations.len().saturating_sub(self.over.variables.len())
    }

    /// The decomposition of the equations over the variables `unknown`: O(edges * sqrt(equations)).
    ///
    /// Dulmage and Mendelsohn 1958, doi:10.4153/CJM-1958-052-0; the blocks by Tarjan 1972, doi:10.1137/0201010.
    pub(super) fn new(
        incidence: &Incidence<EquationId, VariableId>,
        unknown: &IdSet<VariableId>,
    ) -> Decomposition {
        let matching = incidence.matching();
        let (over, over_variables) = incidence.reached(&matching);
        let (under, under_variables) = underdetermined(incidence, &matching, unknown);
        let rest = |equation: &EquationId| !over.contains(*equation) && !under.contains(*equation);
        let blocks = Blocks::new(incidence, &matching, incidence.rows.ids().filter(rest).collect());
        Decomposition {
            under: Part { equations: under.iter().collect(), variables: under_variables.iter().collect() },
            just: blocks.find(),
            over: Part { equations: over.iter().collect(), variables: over_variables.iter().collect() },
        }
    }
}

/// The equations and variables that alternating paths from free variables reach.
fn underdetermined(
    incidence: &Incidence<EquationId, VariableId>,
    matching: &Matching<EquationId, VariableId>,
    unknown: &IdSet<VariableId>,
) -> (IdSet<EquationId>, IdSet<VariableId>) {
    let mut variables: IdSet<VariableId> =
        unknown.iter().filter(|&variable| matching.columns[variable].is_none()).collect();
    let mut equations = IdSet::new();
    let mut open: Vec<VariableId> = variables.iter().collect();
    while let Some(variable) = open.pop() {
        for &equation in &incidence.columns[variable] {
            equations.insert(equation);
            if let Some(next) = matching.rows[equation]
                && variables.insert(next)
            {
                open.push(next);
            }
        }
    }
    (equations, variables)
}

/// Strongly connected components of the just determined equations: one rests on another when it contains the variable that the
/// other determines.
pub(super) struct Blocks<'i> {
    incidence: &'i Incidence<EquationId, VariableId>,
    matching: &'i Matching<EquationId, VariableId>,
    equations: IdSet<EquationId>,
    /// The step in which each equation was met, from 1; 0 before, and `DONE` when its block is complete.
    met: IdVec<EquationId, usize>,
    /// The earliest equation that each is known to lead back to.
    low: IdVec<EquationId, usize>,
    /// Equations that were met and are not in a block yet.
    waiting: Vec<EquationId>,
    blocks: Vec<Part>,
}

const DONE: usize = usize::MAX;

impl<'i> Blocks<'i> {
    pub(super) fn new(
        incidence: &'i Incidence<EquationId, VariableId>,
        matching: &'i Matching<EquationId, VariableId>,
        equations: IdSet<EquationId>,
    ) -> Self {
        let count = incidence.rows.len();
        let (met, low) = (IdVec::filled(count, |_| 0), IdVec::filled(count, |_| 0));
        Blocks { incidence, matching, equations, met, low, waiting: Vec::new(), blocks: Vec::new() }
    }

    /// The blocks in order of dependence: a block follows the blocks that it rests on.
    pub(super) fn find(mut self) -> Vec<Part> {
        let mut clock = 0;
        for root in self.incidence.rows.ids() {
            if self.equations.contains(root) && self.met[root] == 0 {
                self.walk(root, &mut clock);
            }
        }
        self.blocks
    }

    /// Depth first from `root`, on an explicit stack: chains of relations may be long.
    fn walk(&mut self, root: EquationId, clock: &mut usize) {
        let mut path = Vec::from([(root, 0)]);
        self.meet(root, clock);
        while let Some((equation, cursor)) = path.last_mut() {
            let (from, at) = (*equation, *cursor);
            *cursor += 1;
            match self.incidence.rows[from].get(at).map(|&variable| self.matching.columns[variable]) {
                Some(Some(next)) if self.equations.contains(next) => {
                    if self.met[next] == 0 {
                        self.meet(next, clock);
                        path.push((next, 0));
                    } else if self.met[next] != DONE {
                        self.low[from] = self.low[from].min(self.met[next]);
                    }
                }
                Some(_) => {}
                None => {
                    path.pop();
                    if let Some(&(parent, _)) = path.last() {
                        self.low[parent] = self.low[parent].min(self.low[from]);
                    }
                    self.close(from);
                }
            }
        }
    }

    fn meet(&mut self, equation: EquationId, clock: &mut usize) {
        *clock += 1;
        self.met[equation] = *clock;
        self.low[equation] = *clock;
        self.waiting.push(equation);
    }

    /// Makes a block of everything above `equation` when nothing in it leads further back.
    fn close(&mut self, equation: EquationId) {
        if self.low[equation] != self.met[equation] {
            return;
        }
        let mut equations = Vec::new();
        while let Some(top) = self.waiting.pop() {
            self.met[top] = DONE;
            equations.push(top);
            if top == equation {
                break;
            }
        }
        equations.sort_unstable();
        let mut variables: Vec<VariableId> =
            equations.iter().filter_map(|&equation| self.matching.rows[equation]).collect();
        variables.sort_unstable();
        self.blocks.push(Part { equations, variables });
    }
}
