//! All smallest redundant sets of a connected part, each once.
//!
//! Krysander, Aslund and Nyberg 2008, doi:10.1109/TSMCA.2007.909555: leave out one equation, go on with what is
//! still overdetermined, until the redundancy is 1. Equations that only go together (a class) are left out
//! together. A set that is looked for either misses the class or holds all of it; once the first case is searched,
//! the class is *kept*, so that nothing is found twice. A branch that would lose a kept equation is none. A
//! minimal set is connected: with the first kept class, the search stays in its connected part, so parts that
//! have nothing to do with each other cost a sum and not a product.
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
    /// Whether there is anything else.
    is_partial: bool,
    /// What every set that is still looked for holds, in the order in which it was kept.
    kept: Vec<Row>,
    is_kept: IdSet<Row>,
    /// What is left out, in order.
    removed: Vec<Row>,
    frames: Vec<Frame>,
}

/// How far a subset of the part is searched.
struct Frame {
    /// The length of `removed` and of `kept` before.
    removed: usize,
    kept: usize,
    /// Rows before this index are kept, left out, or must not be left out.
    cursor: usize,
    /// The class that the branch below leaves out; to be kept when the search comes back.
    class: Vec<Row>,
    /// Whether it must be looked at whether the kept rows hang together.
    is_new: bool,
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
        let is_partial = removable.len() < part.present().len();
        let root = Frame { removed: 0, kept: 0, cursor: 0, class: Vec::new(), is_new: false };
        let (kept, is_kept, removed) = (Vec::new(), IdSet::new(), Vec::new());
        Search { part, removable, is_partial, kept, is_kept, removed, frames: Vec::from([root]) }
    }

    /// The next smallest set; at most `visits` edges are walked in all.
    pub(super) fn advance(&mut self, visits: u64) -> Progress {
        while let Some(mut frame) = self.frames.pop() {
            if self.part.visits() >= visits {
                self.frames.push(frame);
                return Progress::Limited;
            }
            let class = core::mem::take(&mut frame.class);
            frame.is_new |= !class.is_empty() && self.kept.is_empty();
            self.keep(&class);
            let outlook = if frame.is_new { self.settle() } else { Outlook::Open };
            frame.is_new = false;
            match outlook {
                Outlook::Open => self.branch(frame),
                Outlook::Lost => self.leave(&frame),
                Outlook::Minimal(rows) => {
                    self.leave(&frame);
                    return Progress::Found(rows);
                }
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

    /// Leaves out the next class, if there is one.
    fn branch(&mut self, mut frame: Frame) {
        let is_open = |row: &Row| self.removable.contains(*row) && !self.is_kept.contains(*row);
        let Some(row) = self.part.present().iter_from(frame.cursor).find(is_open) else {
            return self.leave(&frame);
        };
        frame.cursor = row.index() + 1;
        let rows = self.part.connected(row);
        let class = self.part.class(row, &rows);
        if class.iter().any(|&row| self.is_kept.contains(row)) {
            self.keep(&class);
            return self.frames.push(frame);
        }
        let below = Frame {
            removed: self.removed.len(),
            kept: self.kept.len(),
            cursor: frame.cursor,
            class: Vec::new(),
            is_new: !self.kept.is_empty(),
        };
        self.part.take_out(&class);
        self.removed.extend(&class);
        frame.class = class;
        self.frames.extend([frame, below]);
    }

    fn keep(&mut self, class: &[Row]) {
        for &row in class {
            if self.is_kept.insert(row) {
                self.kept.push(row);
            }
        }
    }

    /// Stays in the connected part of the kept rows.
    fn settle(&mut self) -> Outlook {
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
        if self.is_minimal(first, &rows) { Outlook::Minimal(rows) } else { Outlook::Open }
    }

    /// Whether nothing that may be left out can be, with anything to look for left.
    fn is_minimal(&mut self, kept: Row, rows: &[Row]) -> bool {
        if self.part.redundancy(rows) == 1 {
            return true;
        }
        if !self.is_partial {
            return false;
        }
        let class: IdSet<Row> = self.part.class(kept, rows).into_iter().collect();
        rows.iter().all(|&row| class.contains(row) || !self.removable.contains(row))
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
