//! Which ticks an engine is given between two inputs: the one rule that recorded and live runs share.

use super::{Engine, Input};
use crate::time::{Span, Time};

/// The ticks that fall due until a moment, in their order.
///
/// Whoever drives an engine gives it these before an input of that moment. Each is asked for after the one before it has been
/// given, as that may have put off what was due or let something new fall due.
///
/// ```
/// use shsa_core::engine::{Engine, Input, Options, Ticks};
/// use shsa_core::knowledge::KnowledgeBase;
/// use shsa_core::time::Time;
///
/// let mut engine = Engine::new(KnowledgeBase::default(), Options::default());
/// for input in [1.0, 2.0].map(|seconds| Input::Tick(Time::from_seconds(seconds))) {
///     engine.pass(Ticks::before(input.time()));
///     engine.handle(input);
/// }
/// assert_eq!(engine.poll(), None);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Ticks {
    /// The first moment whose ticks do not count.
    end: Time,
    last: Option<Time>,
}

impl Ticks {
    /// Those before a moment: a recorded input of that moment goes in before its tick.
    #[must_use]
    pub fn before(moment: Time) -> Ticks {
        Ticks { end: moment, last: None }
    }

    /// Those up to a moment and at it: all that has come of a live run by now has gone in.
    #[must_use]
    pub fn up_to(now: Time) -> Ticks {
        Ticks { end: now + Span(1), last: None }
    }

    /// The next one, if any; never the same moment twice, so that asking ends. For drivers that do more with each than
    /// [`Engine::pass`] does, such as writing it to a journal.
    #[must_use]
    pub fn next(&mut self, engine: &Engine) -> Option<Time> {
        let due = engine.next_deadline().filter(|due| *due < self.end && self.last != Some(*due))?;
        self.last = Some(due);
        Some(due)
    }
}

impl Engine {
    /// Lets time pass: gives itself all these ticks.
    pub fn pass(&mut self, mut ticks: Ticks) {
        while let Some(due) = ticks.next(self) {
            self.handle(Input::Tick(due));
        }
    }
}
