//! The rows of a table: single lines, or several lines with a quoted cell that contains line breaks. After a stray quote, or a
//! row of the wrong length, reading goes on with the very next line.

use super::cells::Split;
use super::layout::{Layout, is_comment};
use super::line::Line;
use super::places::place;
use super::row::Row;
use crate::lines::Lines;
use std::collections::VecDeque;
use std::io::BufRead;

/// The most lines of a quoted cell.
const LINES_IN_QUOTES: usize = 16;
/// The most bytes of the lines of a quoted cell.
const QUOTED_MAX: usize = 1 << 20;
/// The longest row whose memory is used again, bytes.
const SPARE_MAX: usize = 1 << 12;
/// How many lines decide the layout of a table.
const HEAD_LINES: usize = 200;
/// How many bytes decide the layout of a table.
const HEAD_BYTES: usize = 1 << 20;

/// Whether a line is blank, or a comment.
fn is_no_row(text: &str) -> bool {
    match text.as_bytes().first() {
        // Nearly all rows begin so.
        Some(first) if first.is_ascii_graphic() && *first != b'#' => false,
        _ => text.trim().is_empty() || is_comment(text),
    }
}

/// The rows of a table, and the damages of its lines.
pub(super) struct Rows<R> {
    lines: Lines<R>,
    pending: VecDeque<Line>,
    /// Rows that are done: their memory is used again.
    spare: Vec<Line>,
    /// The unreadable lines with their problems.
    pub(super) damages: Vec<(u64, String)>,
}

impl<R: BufRead> Rows<R> {
    /// Begins with the first line.
    pub(super) fn new(input: R) -> Rows<R> {
        Rows { lines: Lines::new(input), pending: VecDeque::new(), spare: Vec::new(), damages: Vec::new() }
    }

    /// The first lines, which [`Rows::row`] returns again.
    pub(super) fn head(&mut self) -> &[Line] {
        let mut bytes = 0;
        while self.pending.len() < HEAD_LINES && bytes < HEAD_BYTES {
            let Some(line) = self.fetch() else { break };
            bytes += line.text.len();
            self.pending.push_back(line);
        }
        self.pending.make_contiguous()
    }

    /// Skips lines.
    pub(super) fn skip(&mut self, lines: usize) {
        (0..lines).for_each(|_| drop(self.line()));
    }

    /// Takes back rows that are done.
    pub(super) fn reuse(&mut self, rows: impl Iterator<Item = Line>) {
        let is_short = |row: &Line| row.text.capacity() <= SPARE_MAX;
        self.spare.extend(rows.filter(is_short));
    }

    fn line(&mut self) -> Option<Line> {
        self.pending.pop_front().or_else(|| self.fetch())
    }

    fn fetch(&mut self) -> Option<Line> {
        loop {
            match self.lines.read()? {
                Ok(line) => {
                    let Line { mut text, places, .. } = self.spare.pop().unwrap_or_default();
                    text.clear();
                    text.push_str(&line.text);
                    let (number, is_ended) = (line.number, line.is_ended);
                    return Some(Line { number, text, is_ended, places, is_placed: false });
                }
                Err(problem) => self.damages.push(problem),
            }
        }
    }

    /// The next row that is neither blank nor a comment. Lines are joined only where that makes a complete row.
    pub(super) fn row(&mut self, layout: &Layout) -> Option<Line> {
        let mut first = self.line()?;
        let is_open = |text: &str| layout.separator.is_open(text);
        if is_no_row(&first.text) {
            return self.row_behind(layout);
        }
        first.is_placed = place(layout.separator, &first.text, &mut first.places);
        if first.is_placed || first.text.len() > QUOTED_MAX || !is_open(&first.text) {
            return Some(first);
        }
        let mut joined = first.text.clone();
        let mut taken: Vec<Line> = Vec::new();
        while taken.len() < LINES_IN_QUOTES {
            let Some(next) = self.line() else { break };
            joined.push('\n');
            joined.push_str(&next.text);
            let (is_ended, may_close) = (next.is_ended, next.text.contains('"'));
            taken.push(next);
            if joined.len() > QUOTED_MAX {
                break;
            }
            if !may_close {
                continue;
            }
            match layout.separator.split(&joined) {
                Split::Cells(cells) => {
                    let fits = Row::Copied(cells).fits(&layout.headers);
                    if !fits {
                        break;
                    }
                    return Some(Line { number: first.number, text: joined, is_ended, ..Line::default() });
                }
                Split::Broken => break,
                Split::Open => {}
            }
        }
        for line in taken.into_iter().rev() {
            self.pending.push_front(line);
        }
        Some(first)
    }

    /// The next row after lines that are none.
    fn row_behind(&mut self, layout: &Layout) -> Option<Line> {
        loop {
            let next = self.line()?;
            if !is_no_row(&next.text) {
                self.pending.push_front(next);
                return self.row(layout);
            }
        }
    }
}
