//! From the start of a message to a field: skips and alignments, few of which depend on the message.

use super::definition::Count;
use super::layout::Body;

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Step {
    /// So many bytes.
    Skip(usize),
    /// To a multiple of this.
    Align(usize),
    /// A text.
    Text,
    /// As many elements as the wire says, of this size, the first one at a multiple of `align`.
    List { align: usize, size: usize },
    /// Elements of changing size.
    Each { count: Count, element: Vec<Step> },
    /// To one element of a list that must be longer than the index.
    Enter { count: Count, index: usize, element: Vec<Step> },
}

/// Steps, and what is known of the position behind them: modulo `modulus` it is `residue`.
pub(super) struct Steps {
    pub(super) list: Vec<Step>,
    modulus: usize,
    residue: usize,
}

impl Default for Steps {
    /// At the beginning of a body.
    fn default() -> Steps {
        Steps { list: Vec::new(), modulus: 8, residue: 0 }
    }
}

impl Steps {
    /// Somewhere in a body.
    pub(super) fn anywhere() -> Steps {
        Steps { modulus: 1, ..Steps::default() }
    }

    /// Appends a step behind which the position is a multiple of `modulus`.
    pub(super) fn push(&mut self, step: Step, modulus: usize) {
        self.list.push(step);
        (self.modulus, self.residue) = (modulus, 0);
    }

    pub(super) fn skip(&mut self, size: usize) {
        match self.list.last_mut() {
            _ if size == 0 => {}
            Some(Step::Skip(before)) => *before = before.saturating_add(size),
            _ => self.list.push(Step::Skip(size)),
        }
        self.residue = self.residue.wrapping_add(size) % self.modulus;
    }

    pub(super) fn align(&mut self, to: usize) {
        if to <= self.modulus {
            self.skip((to - self.residue % to) % to);
        } else {
            self.push(Step::Align(to), to);
        }
    }
}

/// The position behind some steps; `None` past the end of the message.
pub(super) fn run(steps: &[Step], body: Body<'_>, at: usize) -> Option<usize> {
    steps.iter().try_fold(at, |at, step| step.run(body, at))
}

impl Step {
    fn run(&self, body: Body<'_>, at: usize) -> Option<usize> {
        let end = match self {
            Step::Skip(size) => at.checked_add(*size)?,
            Step::Align(to) => at.checked_next_multiple_of(*to)?,
            Step::Text => body.text(at)?.1,
            Step::List { align, size } => {
                let (count, at) = body.counted(at)?;
                let elements = || at.checked_next_multiple_of(*align)?.checked_add(count.checked_mul(*size)?);
                if count == 0 { at } else { elements()? }
            }
            Step::Each { count, element } => {
                let (count, at) = count.read(body, at)?;
                each(count, element, body, at)?
            }
            Step::Enter { count, index, element } => {
                let (count, at) = count.read(body, at)?;
                if *index >= count { None } else { each(*index, element, body, at) }?
            }
        };
        (end <= body.bytes.len()).then_some(end)
    }
}

/// Behind so many elements. Those of one size are skipped in one go; every other takes a byte at least, so this ends with the
/// message.
fn each(count: usize, element: &[Step], body: Body<'_>, at: usize) -> Option<usize> {
    match element {
        [] => Some(at),
        [Step::Skip(size)] => at.checked_add(count.checked_mul(*size)?),
        _ if count > body.bytes.len() => None,
        _ => (0..count).try_fold(at, |at, _| run(element, body, at)),
    }
}

impl Count {
    fn read(self, body: Body<'_>, at: usize) -> Option<(usize, usize)> {
        match self {
            Count::One => Some((1, at)),
            Count::Fixed(count) => Some((count, at)),
            Count::Free(_) => body.counted(at),
        }
    }
}
