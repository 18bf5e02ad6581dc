//! The ticks that an engine is given between two inputs: one rule for recorded and live runs.

use super::{Engine, Input};
use crate::time::{Span, Time};

/// The ticks that are due until a moment, in their order.
///
/// The driver of an engine gives it these ticks before an input of that moment. Each tick is asked for after the one before has
/// been given, as a tick may change the next deadline.
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
    /// Ticks from this moment on are not due yet.
    end: Time,
    last: Option<Time>,
}

impl Ticks {
    /// The ticks before a moment: a recorded input of that moment goes in before its tick.
    #[must_use]
    pub fn before(moment: Time) -> Ticks {
        Ticks { end: moment, last: None }
    }

    /// The ticks up to and at a moment: in a live run, every earlier input has gone in by now.
    #[must_use]
    pub fn up_to(now: Time) -> Ticks {
        Ticks { end: now + Span(1), last: None }
    }

    /// The next tick, if any; never the same moment twice, so that the loop ends. For drivers that do more with each tick than
    /// [`Engine::pass`], such as journalling.
    #[must_use]
    pub fn next(&mut self, engine: &Engine) -> Option<Time> {
        let due = engine.next_deadline().filter(|due| *due < self.end && self.last != Some(*due))?;
        self.last = Some(due);
        Some(due)
    }
}

impl Engine {
    /// Lets time pass: handles all these ticks.
    pub fn pass(&mut self, mut ticks: Ticks) {
        while let Some(due) = ticks.next(self) {
            self.handle(Input::Tick(due));
        }
    }
}
