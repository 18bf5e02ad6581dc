//! A connected overdetermined part whose equations can be removed and put back.

use super::EquationId;
use super::matching::{Incidence, Matching};
use crate::knowledge::{Id, IdSet, IdVec, VariableId};
use alloc::collections::BTreeMap;
use alloc::vec::Vec;

/// An equation of the part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Row(u32);

/// A variable of the part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Column(u32);

impl Id for Row {
    fn from_index(index: usize) -> Self {
        Row(u32::try_from(index).unwrap_or(u32::MAX))
    }
    fn index(self) -> usize {
        self.0 as usize
    }
}

impl Id for Column {
    fn from_index(index: usize) -> Self {
        Column(u32::try_from(index).unwrap_or(u32::MAX))
    }
    fn index(self) -> usize {
        self.0 as usize
    }
}

/// Equations any one of which can be left out while all variables stay determined, with a matching that covers every variable.
///
/// The present equations change while the matching stays valid: an equation that is removed hands its variable over first, and
/// the others of its class determine exactly the variables of the class. So removed equations can be put back unchanged, in the
/// opposite order.
#[derive(Clone, Debug)]
pub(super) struct Redundant {
    /// The equation of each row in the whole structure.
    equations: IdVec<Row, EquationId>,
    incidence: Incidence<Row, Column>,
    matching: Matching<Row, Column>,
    /// The present rows.
    present: IdSet<Row>,
    /// The number of visited edges.
    visits: u64,
}

impl Redundant {
    /// The connected parts of the overdetermined `equations`, in file order.
    pub(super) fn parts(
        incidence: &Incidence<EquationId, VariableId>,
        equations: &[EquationId],
    ) -> Vec<Redundant> {
        let mut rest: IdSet<EquationId> = equations.iter().copied().collect();
        let mut parts = Vec::new();
        for &first in equations {
            if rest.contains(first) {
                let mut part = incidence.connected(first, &rest, &mut 0);
                part.iter().for_each(|&equation| rest.remove(equation));
                part.sort_unstable();
                parts.push(Redundant::new(incidence, &part));
            }
        }
        parts
    }

    fn new(incidence: &Incidence<EquationId, VariableId>, equations: &[EquationId]) -> Redundant {
        let incidence = incidence.restricted(equations);
        let mut origins = IdVec::new();
        equations.iter().for_each(|&equation| _ = origins.push(equation));
        let matching = incidence.matching();
        let present = incidence.rows.ids().collect();
        Redundant { equations: origins, matching, present, incidence, visits: 0 }
    }

    /// The present rows.
    pub(super) fn present(&self) -> &IdSet<Row> {
        &self.present
    }

    /// The number of edges visited so far.
    pub(super) fn visits(&self) -> u64 {
        self.visits
    }

    /// The equation of each row in the whole structure.
    pub(super) fn equations(&self) -> &IdVec<Row, EquationId> {
        &self.equations
    }

    /// Removes a row, or a class of rows.
    pub(super) fn take_out(&mut self, rows: &[Row]) {
        rows.iter().for_each(|&row| self.present.remove(row));
    }

    /// Puts a row back.
    pub(super) fn put_back(&mut self, row: Row) {
        self.present.insert(row);
    }

    /// The number of rows of a connected part beyond the number of its columns.
    pub(super) fn redundancy(&self, rows: &[Row]) -> usize {
        rows.iter().filter(|&&row| self.matching.rows[row].is_none()).count()
    }

    /// The present rows that shared columns connect with `row`, which comes first.
    pub(super) fn connected(&mut self, row: Row) -> Vec<Row> {
        self.incidence.connected(row, &self.present, &mut self.visits)
    }

    /// The class of `row`: the rows of the connected part `rows` that are no longer overdetermined without it, itself included.
    /// Every overdetermined set contains all of them or none.
    ///
    /// O(edges). Krysander, Aslund and Nyberg 2008, doi:10.1109/TSMCA.2007.909555.
    pub(super) fn class(&mut self, row: Row, rows: &[Row]) -> Vec<Row> {
        self.release(row);
        let is_free = |other: &Row| *other != row && self.matching.rows[*other].is_none();
        let mut open: Vec<Row> = rows.iter().copied().filter(is_free).collect();
        let mut reached: IdSet<Row> = open.iter().copied().collect();
        let mut columns = IdSet::new();
        while let Some(row) = open.pop() {
            self.visits += self.incidence.rows[row].len() as u64;
            for &column in self.incidence.rows[row].iter().filter(|&&column| columns.insert(column)) {
                if let Some(owner) = self.matching.columns[column]
                    && reached.insert(owner)
                {
                    open.push(owner);
                }
            }
        }
        self.visits += rows.len() as u64;
        rows.iter().copied().filter(|&other| !reached.contains(other)).collect()
    }

    /// Gives the column of `row` to another row, so that `row` is free.
    fn release(&mut self, row: Row) {
        let Some(column) = self.matching.rows[row] else { return };
        // For each met row: the column that it would take over.
        let mut takes: BTreeMap<Row, Column> = BTreeMap::new();
        let mut open = Vec::from([column]);
        let mut at = 0;
        while let Some(&column) = open.get(at) {
            at += 1;
            self.visits += self.incidence.columns[column].len() as u64;
            for &next in &self.incidence.columns[column] {
                if next == row || !self.present.contains(next) || takes.contains_key(&next) {
                    continue;
                }
                takes.insert(next, column);
                match self.matching.rows[next] {
                    Some(held) => open.push(held),
                    None => return self.hand_over(next, row, &takes),
                }
            }
        }
    }

    fn hand_over(&mut self, free: Row, row: Row, takes: &BTreeMap<Row, Column>) {
        let mut taker = free;
        while let Some(&column) = takes.get(&taker) {
            let owner = self.matching.columns[column].replace(taker);
            self.matching.rows[taker] = Some(column);
            match owner {
                Some(owner) if owner != row => taker = owner,
                _ => break,
            }
        }
        self.matching.rows[row] = None;
    }

    /// The overdetermined part of `rows` alone, regardless of the present rows.
    pub(super) fn overdetermined(&mut self, rows: &[Row]) -> Vec<Row> {
        let edges = |row: &Row| 1 + self.incidence.rows[*row].len() as u64;
        self.visits += rows.iter().map(edges).sum::<u64>();
        self.incidence.overdetermined(rows)
    }
}
