//! Finds all smallest redundant sets of a connected part, each once.
//!
//! Krysander, Aslund and Nyberg 2008, doi:10.1109/TSMCA.2007.909555: leaves out one equation and continues with the remaining
//! overdetermined part, until the redundancy is 1. Equations of one class are left out together, as a redundant set contains all
//! of them or none. Here the sets that *keep* the class are searched first, since that soon leads to a set when there is much
//! redundancy.
//!
//! Beyond the paper, empty branches are detected early, as a knowledge base with several signals for each variable has much more
//! redundancy than the models of the literature. A minimal set is connected: the search stays in the connected part of the kept
//! rows, so unconnected parts cost a sum and not a product. When the kept rows are redundant themselves, no other set contains
//! them.
//!
//! The same search gives the supports of minimal tests when only possible faults are left out, until the faults are one class:
//! Krysander, Aslund and Frisk 2010, "A structural algorithm for finding testable sub-models and multiple fault isolability
//! analysis", 21st International Workshop on Principles of Diagnosis.

use super::redundant::{Redundant, Row};
use crate::knowledge::{Id, IdSet};
use alloc::vec::Vec;

/// A search through one connected part; its memory is of the order of the part, whatever the redundancy.
pub(super) struct Search<'p> {
    part: &'p mut Redundant,
    /// The rows that may be left out.
    removable: IdSet<Row>,
    /// The rows that every remaining set contains, in the order in which they were kept.
    kept: Vec<Row>,
    is_kept: IdSet<Row>,
    /// The rows that are left out, in order.
    removed: Vec<Row>,
    frames: Vec<Frame>,
}

/// Up to this redundancy, empty branches are too small to test for.
const LOOK_AHEAD: usize = 4;

/// The state of the search of a subset.
struct Frame {
    /// The lengths of `removed` and of `kept` before.
    removed: usize,
    kept: usize,
    /// Rows before this index are kept, left out, or not removable.
    cursor: usize,
    next: Next,
}

/// The next step for a frame.
enum Next {
    /// Evaluate the kept rows; those before this index are known to be whole classes.
    Settle(usize),
    /// Search the sets that contain some class.
    Keep,
    /// After that, search the sets without the class of this row.
    LeaveOut(Row),
}

/// The result of a step of a search.
pub(super) enum Progress {
    /// The rows of the next set.
    Found(Vec<Row>),
    /// There is no further set.
    Done,
    /// The limit of visited edges was reached.
    Limited,
}

/// The result for a subset, from its kept rows.
enum Outlook {
    /// A smallest set.
    Minimal(Vec<Row>),
    /// The subset may contain several sets.
    Open,
    /// The subset contains no set.
    Lost,
}

impl<'p> Search<'p> {
    pub(super) fn new(part: &'p mut Redundant, removable: IdSet<Row>) -> Self {
        let root = Frame { removed: 0, kept: 0, cursor: 0, next: Next::Keep };
        let (kept, is_kept, removed) = (Vec::new(), IdSet::new(), Vec::new());
        Search { part, removable, kept, is_kept, removed, frames: Vec::from([root]) }
    }

    /// The next smallest set; at most `visits` edges are visited in total.
    pub(super) fn advance(&mut self, visits: u64) -> Progress {
        while let Some(mut frame) = self.frames.pop() {
            if self.part.visits() >= visits {
                self.frames.push(frame);
                return Progress::Limited;
            }
            match frame.next {
                Next::Keep => self.keep_next(frame),
                Next::LeaveOut(row) => self.leave_out(frame, row),
                Next::Settle(whole) => match self.settle(whole) {
                    Outlook::Open => {
                        frame.next = Next::Keep;
                        self.frames.push(frame);
                    }
                    Outlook::Lost => self.leave(&frame),
                    Outlook::Minimal(rows) => {
                        self.leave(&frame);
                        return Progress::Found(rows);
                    }
                },
            }
        }
        Progress::Done
    }

    /// The number of edges visited so far.
    pub(super) fn visits(&self) -> u64 {
        self.part.visits()
    }

    /// Whether a row may be left out.
    pub(super) fn may_miss(&self, row: Row) -> bool {
        self.removable.contains(row)
    }

    /// The overdetermined part of `rows` alone.
    pub(super) fn overdetermined(&mut self, rows: &[Row]) -> Vec<Row> {
        self.part.overdetermined(rows)
    }

    /// Searches the sets that contain the next class, if there is one.
    fn keep_next(&mut self, mut frame: Frame) {
        let is_open = |row: &Row| self.removable.contains(*row) && !self.is_kept.contains(*row);
        let Some(row) = self.part.present().iter_from(frame.cursor).find(is_open) else {
            return self.leave(&frame);
        };
        frame.cursor = row.index() + 1;
        frame.next = Next::LeaveOut(row);
        let rows = self.part.connected(row);
        let class = self.part.class(row, &rows);
        let (removed, kept, cursor) = (self.removed.len(), self.kept.len(), frame.cursor);
        self.keep(&class);
        let next = Next::Settle(self.kept.len());
        self.frames.extend([frame, Frame { removed, kept, cursor, next }]);
    }

    /// Searches the sets without the class of a row.
    fn leave_out(&mut self, mut frame: Frame, row: Row) {
        let rows = self.part.connected(row);
        let class = self.part.class(row, &rows);
        if class.iter().any(|&row| self.is_kept.contains(row)) {
            return self.leave(&frame);
        }
        self.part.take_out(&class);
        self.removed.extend(class);
        frame.next = Next::Settle(0);
        self.frames.push(frame);
    }

    fn keep(&mut self, class: &[Row]) {
        for &row in class {
            if self.is_kept.insert(row) {
                self.kept.push(row);
            }
        }
    }

    /// Restricts the subset to the connected part of the kept rows, keeps their classes, and evaluates them.
    fn settle(&mut self, whole: usize) -> Outlook {
        let Some(&first) = self.kept.first() else { return Outlook::Open };
        let rows = self.part.connected(first);
        if rows.iter().filter(|&&row| self.is_kept.contains(row)).count() < self.kept.len() {
            return Outlook::Lost;
        }
        if rows.len() < self.part.present().len() {
            let inside: IdSet<Row> = rows.iter().copied().collect();
            let outside: Vec<Row> = self.part.present().iter().filter(|&row| !inside.contains(row)).collect();
            self.part.take_out(&outside);
            self.removed.extend(outside);
        }
        let redundancy = self.part.redundancy(&rows);
        if redundancy == 1 {
            return Outlook::Minimal(rows);
        }
        if redundancy <= LOOK_AHEAD && self.misses_any() {
            return Outlook::Open;
        }
        self.keep_classes(whole, &rows);
        self.outlook(&rows)
    }

    /// Whether every row may be left out: then all smallest sets have the redundancy 1.
    fn misses_any(&self) -> bool {
        self.removable.len() == self.part.equations().len()
    }

    /// Keeps the classes of the kept rows, from an index on.
    fn keep_classes(&mut self, whole: usize, rows: &[Row]) {
        let mut covered = IdSet::new();
        let mut at = whole;
        while let Some(&row) = self.kept.get(at) {
            at += 1;
            if !covered.contains(row) {
                let class = self.part.class(row, rows);
                covered.extend(&class.iter().copied().collect());
                self.keep(&class);
            }
        }
    }

    /// Tests whether the rows that must stay are redundant: then there is no other set, as any set with these rows contains
    /// theirs.
    fn outlook(&mut self, rows: &[Row]) -> Outlook {
        let needed: Vec<Row> = rows
            .iter()
            .copied()
            .filter(|&row| self.is_kept.contains(row) || !self.removable.contains(row))
            .collect();
        let set = self.part.overdetermined(&needed);
        let count = |rows: &[Row]| rows.iter().filter(|&&row| self.removable.contains(row)).count();
        let Some(&some) = set.iter().find(|&&row| self.removable.contains(row)) else { return Outlook::Open };
        if count(&set) < count(&needed) {
            return Outlook::Lost;
        }
        let without: Vec<Row> = set.iter().copied().filter(|&row| row != some).collect();
        let smaller = self.part.overdetermined(&without);
        if count(&smaller) == 0 { Outlook::Minimal(set) } else { Outlook::Lost }
    }

    /// Puts back the rows left out for a frame, and forgets its kept rows.
    fn leave(&mut self, frame: &Frame) {
        for row in self.removed.drain(frame.removed..) {
            self.part.put_back(row);
        }
        for row in self.kept.drain(frame.kept..) {
            self.is_kept.remove(row);
        }
    }
}
