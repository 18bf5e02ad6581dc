//! Steps from the start of a message to a field: skips and alignments, most of them the same for all messages.

use super::definition::Count;
use super::layout::Body;

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Step {
    /// Skips a number of bytes.
    Skip(usize),
    /// Skips to a multiple of this.
    Align(usize),
    /// Skips a text.
    Text,
    /// Skips a list whose count is on the wire: elements of this size, the first one aligned to `align`.
    List { align: usize, size: usize },
    /// Skips elements of variable size.
    Each { count: Count, element: Vec<Step> },
    /// Goes to one element of a list, which must be longer than the index.
    Enter { count: Count, index: usize, element: Vec<Step> },
}

/// Steps, and the position behind them: `residue` modulo `modulus`.
pub(super) struct Steps {
    pub(super) list: Vec<Step>,
    modulus: usize,
    residue: usize,
}

impl Default for Steps {
    /// The start of a body.
    fn default() -> Steps {
        Steps { list: Vec::new(), modulus: 8, residue: 0 }
    }
}

impl Steps {
    /// An unknown position in a body.
    pub(super) fn anywhere() -> Steps {
        Steps { modulus: 1, ..Steps::default() }
    }

    /// Appends a step that ends at a multiple of `modulus`.
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

/// The position behind a number of elements. Elements of one size are skipped together; every other takes at least a byte, so the
/// loop ends with the message.
fn each(count: usize, element: &[Step], body: Body<'_>, at: usize) -> Option<usize> {
    match element {
        [] => Some(at),
        [Step::Skip(size)] => at.checked_add(count.checked_mul(*size)?),
        _ if count > body.bytes.len() => None,
        _ => (0..count).try_fold(at, |at, _| run(element, body, at)),
    }
}

impl Count {
    pub(super) fn read(self, body: Body<'_>, at: usize) -> Option<(usize, usize)> {
        match self {
            Count::One => Some((1, at)),
            Count::Fixed(count) => Some((count, at)),
            Count::Free(_) => body.counted(at),
        }
    }
}
