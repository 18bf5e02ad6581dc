//! Maximum matching of a bipartite graph of equations and variables.

use crate::knowledge::{Id, IdSet, IdVec};
use alloc::collections::{BTreeMap, VecDeque};
use alloc::vec::Vec;

/// The variables (columns) of each equation (row).
#[derive(Clone, Debug)]
pub(super) struct Incidence<R, C> {
    /// The columns of each row, each once.
    pub(super) rows: IdVec<R, Vec<C>>,
    /// The rows of each column, ascending.
    pub(super) columns: IdVec<C, Vec<R>>,
}

/// Pairs of a row and a column; each row and each column is in at most one pair.
#[derive(Clone, Debug)]
pub(super) struct Matching<R, C> {
    /// The column of each row.
    pub(super) rows: IdVec<R, Option<C>>,
    /// The row of each column.
    pub(super) columns: IdVec<C, Option<R>>,
}

impl<R: Id, C: Id> Incidence<R, C> {
    /// The incidence of the columns of each row, each once; there are `columns` of them.
    pub(super) fn new(rows: IdVec<R, Vec<C>>, columns: usize) -> Self {
        let mut transposed = IdVec::filled(columns, |_| Vec::new());
        for (row, of_row) in rows.enumerate() {
            for &column in of_row {
                transposed[column].push(row);
            }
        }
        Incidence { rows, columns: transposed }
    }

    /// The incidence of `rows` alone, with new ids in their order.
    pub(super) fn restricted<Q: Id, D: Id>(&self, rows: &[R]) -> Incidence<Q, D> {
        let mut names: BTreeMap<C, D> = BTreeMap::new();
        let mut own = IdVec::new();
        for &row in rows {
            let mut columns = Vec::with_capacity(self.rows[row].len());
            for &column in &self.rows[row] {
                let next = D::from_index(names.len());
                columns.push(*names.entry(column).or_insert(next));
            }
            own.push(columns);
        }
        Incidence::new(own, names.len())
    }

    /// The rows among `within` that shared columns connect with `first`, which comes first; counts edges.
    pub(super) fn connected(&self, first: R, within: &IdSet<R>, edges: &mut u64) -> Vec<R> {
        let mut rows = IdSet::from_iter([first]);
        let mut columns = IdSet::new();
        let mut found = Vec::from([first]);
        let mut at = 0;
        while let Some(&row) = found.get(at) {
            at += 1;
            for &column in self.rows[row].iter().filter(|&&column| columns.insert(column)) {
                *edges += 1 + self.columns[column].len() as u64;
                let next = self.columns[column].iter().copied();
                found.extend(next.filter(|&next| within.contains(next) && rows.insert(next)));
            }
        }
        found
    }

    /// The overdetermined part of the `rows` alone: O(edges * sqrt(rows)).
    pub(super) fn overdetermined(&self, rows: &[R]) -> Vec<R> {
        let own: Incidence<R, C> = self.restricted(rows);
        let (reached, _) = own.reached(&own.matching());
        reached.iter().filter_map(|row| rows.get(row.index()).copied()).collect()
    }

    /// A maximum matching: O(edges * sqrt(rows)).
    ///
    /// Hopcroft and Karp 1973, doi:10.1137/0202019.
    pub(super) fn matching(&self) -> Matching<R, C> {
        let mut phase = Phase {
            incidence: self,
            matching: Matching {
                rows: IdVec::filled(self.rows.len(), |_| None),
                columns: IdVec::filled(self.columns.len(), |_| None),
            },
            levels: IdVec::filled(self.rows.len(), |_| UNSEEN),
            cursors: IdVec::filled(self.rows.len(), |_| 0),
        };
        while phase.layer() {
            phase.augment_all();
        }
        phase.matching
    }

    /// The overdetermined part: the rows that alternating paths from free rows reach, and their columns.
    pub(super) fn reached(&self, matching: &Matching<R, C>) -> (IdSet<R>, IdSet<C>) {
        let mut rows: IdSet<R> = matching.free_rows().collect();
        let mut columns = IdSet::new();
        let mut open: Vec<R> = rows.iter().collect();
        while let Some(row) = open.pop() {
            for &column in &self.rows[row] {
                if let Some(owner) = matching.columns[column]
                    && columns.insert(column)
                {
                    rows.insert(owner);
                    open.push(owner);
                }
            }
        }
        (rows, columns)
    }
}

impl<R: Id, C: Id> Matching<R, C> {
    /// Rows without a column, ascending.
    pub(super) fn free_rows(&self) -> impl Iterator<Item = R> + '_ {
        self.rows.enumerate().filter(|(_, column)| column.is_none()).map(|(row, _)| row)
    }
}

const UNSEEN: u32 = u32::MAX;

/// One round: shortest augmenting paths that share no row.
struct Phase<'i, R, C> {
    incidence: &'i Incidence<R, C>,
    matching: Matching<R, C>,
    /// The number of pairs on a shortest alternating path from a free row to each row.
    levels: IdVec<R, u32>,
    /// The next column of each row to try.
    cursors: IdVec<R, usize>,
}

enum Step<R, C> {
    Free(C),
    Down(R),
    Dead,
}

impl<R: Id, C: Id> Phase<'_, R, C> {
    /// Layers the rows up to the first free column; `false` when no path leads to one.
    fn layer(&mut self) -> bool {
        self.levels.iter_mut().for_each(|level| *level = UNSEEN);
        self.cursors.iter_mut().for_each(|cursor| *cursor = 0);
        let mut open: VecDeque<R> = self.matching.free_rows().collect();
        open.iter().for_each(|&row| self.levels[row] = 0);
        let mut last = UNSEEN;
        while let Some(row) = open.pop_front() {
            let below = self.levels[row].saturating_add(1);
            for &column in &self.incidence.rows[row] {
                match self.matching.columns[column] {
                    None => last = last.min(below),
                    Some(owner) if below < last && self.levels[owner] == UNSEEN => {
                        self.levels[owner] = below;
                        open.push_back(owner);
                    }
                    Some(_) => {}
                }
            }
        }
        last != UNSEEN
    }

    fn augment_all(&mut self) {
        let free: Vec<R> = self.matching.free_rows().collect();
        free.into_iter().for_each(|row| self.augment(row));
    }

    /// Follows the layers from a free row to a free column, and matches each row on the path with the next column.
    fn augment(&mut self, row: R) {
        let mut path = Vec::from([row]);
        while let Some(&row) = path.last() {
            match self.step(row) {
                Step::Free(column) => return self.flip(path, column),
                Step::Down(next) => path.push(next),
                Step::Dead => {
                    path.pop();
                    self.levels[row] = UNSEEN;
                }
            }
        }
    }

    fn step(&mut self, row: R) -> Step<R, C> {
        let below = self.levels[row].saturating_add(1);
        while let Some(&column) = self.incidence.rows[row].get(self.cursors[row]) {
            self.cursors[row] += 1;
            match self.matching.columns[column] {
                None => return Step::Free(column),
                Some(owner) if self.levels[owner] == below => return Step::Down(owner),
                Some(_) => {}
            }
        }
        Step::Dead
    }

    fn flip(&mut self, path: Vec<R>, mut column: C) {
        for row in path.into_iter().rev() {
            let before = self.matching.rows[row].replace(column);
            self.matching.columns[column] = Some(row);
            // A row on the path is used up in this round.
            self.levels[row] = UNSEEN;
            match before {
                Some(before) => column = before,
                None => return,
            }
        }
    }
}
