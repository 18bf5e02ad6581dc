//! All smallest redundant sets of a connected part, each once.
//!
//! Krysander, Aslund and Nyberg 2008, doi:10.1109/TSMCA.2007.909555: leave out one equation, go on with what is
//! still overdetermined, until the redundancy is 1. Equations that only go together (a class) are left out
//! together: a set that is looked for either misses the class or holds all of it. Here the second case is searched
//! first, with the class *kept*, for that soon leads to a set when there is much redundancy.
//!
//! Beyond the paper, branches that hold nothing are seen early, for a knowledge base with several signals for each
//! variable has much more redundancy than the models of the literature. A minimal set is connected: the search
//! stays in the connected part of what is kept, so parts that have nothing to do with each other cost a sum and
//! not a product. And when what is kept is redundant itself, there is no other set that holds it.
//!
//! The same search gives the supports of minimal tests when only what may be faulty is left out, until the faults
//! are one class: Krysander, Aslund and Frisk 2010, "A structural algorithm for finding testable sub-models and
//! multiple fault isolability analysis", 21st International Workshop on Principles of Diagnosis.

use super::redundant::{Redundant, Row};
use crate::knowledge::{Id, IdSet};
use alloc::vec::Vec;

/// A search through one connected part; its memory is of the order of the part, whatever the redundancy.
pub(super) struct Search<'p> {
    part: &'p mut Redundant,
    /// What may be left out.
    removable: IdSet<Row>,
    /// What every set that is still looked for holds, in the order in which it was kept.
    kept: Vec<Row>,
    is_kept: IdSet<Row>,
    /// What is left out, in order.
    removed: Vec<Row>,
    frames: Vec<Frame>,
}

/// Up to this redundancy, branches that hold nothing are too small to be looked for.
const LOOK_AHEAD: usize = 4;

/// How far a subset of the part is searched.
struct Frame {
    /// The length of `removed` and of `kept` before.
    removed: usize,
    kept: usize,
    /// Rows before this index are kept, left out, or must not be left out.
    cursor: usize,
    next: Next,
}

/// What is to be done with a frame.
enum Next {
    /// Look what the kept rows say; those before this index are known to be whole classes.
    Settle(usize),
    /// Go on with all sets that hold some class.
    Keep,
    /// They were searched; go on with the sets that miss the class of this row.
    LeaveOut(Row),
}

/// What a search says when it is asked to go on.
pub(super) enum Progress {
    /// The rows of the next set.
    Found(Vec<Row>),
    /// There is no further set.
    Done,
    /// As many edges were walked as were allowed.
    Limited,
}

/// What the kept rows say about a subset.
enum Outlook {
    /// A smallest set.
    Minimal(Vec<Row>),
    /// It may hold several.
    Open,
    /// It holds none.
    Lost,
}

impl<'p> Search<'p> {
    pub(super) fn new(part: &'p mut Redundant, removable: IdSet<Row>) -> Self {
        let root = Frame { removed: 0, kept: 0, cursor: 0, next: Next::Keep };
        let (kept, is_kept, removed) = (Vec::new(), IdSet::new(), Vec::new());
        Search { part, removable, kept, is_kept, removed, frames: Vec::from([root]) }
    }

    /// The next smallest set; at most `visits` edges are walked in all.
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

    /// How many edges were walked so far.
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

    /// Searches the sets that hold the next class, if there is one.
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

    /// Goes on without the class of a row.
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

    /// Stays in the connected part of the kept rows, keeps what they take with them, and looks whether they are a set.
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

    /// Keeps the classes of the kept rows from an index on.
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

    /// Whether the kept rows, with those that are never left out, are redundant: then there is nothing else to find,
    /// for whatever holds all of them holds this.
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

    /// Puts back what was left out for a frame, and forgets what was kept in it.
    fn leave(&mut self, frame: &Frame) {
        for row in self.removed.drain(frame.removed..) {
            self.part.put_back(row);
        }
        for row in self.kept.drain(frame.kept..) {
            self.is_kept.remove(row);
        }
    }
}
