//! Drives an engine over recorded inputs, with the ticks that a live run would send, and keeps what comes out.

use shsa_core::engine::{Engine, Event, Input, Options, Output, Publication};
use shsa_core::knowledge::KnowledgeBase;
use shsa_core::time::Time;

/// An engine under way, with all that it has said.
#[derive(Debug)]
pub struct Run {
    /// The engine as it is now.
    pub engine: Engine,
    /// How many observations went in.
    pub observations: usize,
    /// The time of the first input.
    pub first: Time,
    /// The time of the latest input.
    pub last: Time,
    /// Every decision, oldest first.
    pub events: Vec<Event>,
    /// Every value that the needs were served with, oldest first.
    pub publications: Vec<Publication>,
}

impl Run {
    /// Drives a new engine over all inputs, which are in the order of their reception; `record` sees everything that
    /// goes in, ticks included. `span` is when the recording begins and ends, where its inputs do not tell.
    ///
    /// Ticks that the inputs hold already (a journal) are the only ones; else they come when they are due.
    ///
    /// # Errors
    /// Those of `record`.
    pub fn of<E>(
        knowledge: &KnowledgeBase,
        inputs: &[Input],
        span: Option<(Time, Time)>,
        mut record: impl FnMut(&Input) -> Result<(), E>,
    ) -> Result<Run, E> {
        let has_ticks = inputs.iter().any(|input| matches!(input, Input::Tick(_)));
        let begins = inputs.first().map_or(Time(0), time);
        let (first, end) = span.unwrap_or((begins, begins));
        let mut run = Run::new(knowledge, first.min(begins));
        if !has_ticks && first < begins {
            run.take(&Input::Tick(first), &mut record)?;
        }
        for input in inputs {
            if !has_ticks {
                run.pass_until(time(input), &mut record)?;
            }
            run.take(input, &mut record)?;
        }
        if !has_ticks && !inputs.is_empty() {
            let end = end.max(run.last);
            run.pass_until(end, &mut record)?;
            run.take(&Input::Tick(end), &mut record)?;
        }
        Ok(run)
    }

    /// A new engine that has been given nothing; `first` is when the run begins.
    #[must_use]
    pub fn new(knowledge: &KnowledgeBase, first: Time) -> Run {
        Run {
            engine: Engine::new(knowledge.clone(), Options::default()),
            observations: 0,
            first,
            last: first,
            events: Vec::new(),
            publications: Vec::new(),
        }
    }

    /// Sends the ticks that fall due before `moment`.
    ///
    /// # Errors
    /// Those of `record`.
    pub fn pass_until<E>(
        &mut self,
        moment: Time,
        record: &mut impl FnMut(&Input) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut before = None;
        while let Some(due) = self.engine.next_deadline().filter(|due| *due < moment && before != Some(*due))
        {
            self.take(&Input::Tick(due), record)?;
            before = Some(due);
        }
        Ok(())
    }

    /// Gives one input to the engine and keeps what comes out.
    ///
    /// # Errors
    /// Those of `record`.
    pub fn take<E>(
        &mut self,
        input: &Input,
        record: &mut impl FnMut(&Input) -> Result<(), E>,
    ) -> Result<(), E> {
        record(input)?;
        self.last = self.last.max(time(input));
        self.observations += usize::from(matches!(input, Input::Observation(_)));
        self.engine.handle(input.clone());
        while let Some(output) = self.engine.poll() {
            match output {
                Output::Event(event) => self.events.push(event),
                Output::Publication(publication) => self.publications.push(publication),
            }
        }
        Ok(())
    }
}

/// When an input arrives.
pub(crate) fn time(input: &Input) -> Time {
    match input {
        Input::Observation(observation) => observation.received,
        Input::Tick(time) => *time,
    }
}
