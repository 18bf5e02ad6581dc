//! Drives an engine over recorded inputs, with the ticks that a live run would send, and keeps what comes out.
//!
//! A run has one era for each knowledge base that it goes through; what the engine says in one speaks with its ids.

use shsa_core::engine::{Engine, Event, Input, Options, Output, Publication, Ticks};
use shsa_core::knowledge::KnowledgeBase;
use shsa_core::observation::Observation;
use shsa_core::time::Time;

/// A stretch of a run under one knowledge base.
#[derive(Clone, Debug)]
pub struct Era {
    /// When the knowledge base takes over; the first one is there from the beginning.
    pub from: Time,
    /// What the ids in `inputs` belong to.
    pub knowledge: KnowledgeBase,
    /// What brought it about: the name and the text of a file. None for the first era.
    pub change: Option<(String, String)>,
    /// What goes in, in the order of reception.
    pub inputs: Vec<Input>,
}

impl Era {
    /// The one era of a run whose knowledge base never changes.
    #[must_use]
    pub fn only(knowledge: KnowledgeBase, inputs: Vec<Input>) -> Era {
        Era { from: Time::MIN, knowledge, change: None, inputs }
    }
}

/// What goes into a run.
#[derive(Clone, Copy, Debug)]
pub enum Given<'a> {
    /// An observation or a tick.
    Input(&'a Input),
    /// A new knowledge base.
    Era(&'a Era),
}

/// An era that is over: its knowledge base, and how much had been said by its end.
#[derive(Clone, Debug)]
pub struct Past {
    /// When the next one began.
    pub until: Time,
    /// What the ids of its events and publications belong to.
    pub knowledge: KnowledgeBase,
    /// How many events there had been.
    pub events: usize,
    /// How many values had been published.
    pub publications: usize,
}

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
    /// The eras before the present one.
    pub past: Vec<Past>,
    /// What the ids of the next output belong to.
    knowledge: KnowledgeBase,
}

impl Run {
    /// Drives a new engine over all inputs, which are in the order of their reception; `step` sees everything that goes
    /// in, ticks included, and [gives](Run::give) it to the run. `span` is when the recording begins and ends, where
    /// its inputs do not tell.
    ///
    /// Ticks that the inputs hold already (a journal) are the only ones; else they come when they are due.
    ///
    /// # Errors
    /// Those of `step`, which end the run.
    pub fn of<E>(
        eras: &[Era],
        span: Option<(Time, Time)>,
        options: Options,
        mut step: impl FnMut(&mut Run, Given<'_>) -> Result<(), E>,
    ) -> Result<Run, E> {
        let mut inputs = eras.iter().flat_map(|era| &era.inputs);
        let has_ticks = inputs.clone().any(|input| matches!(input, Input::Tick(_)));
        let first_input = inputs.next().map(Input::time);
        let begins = first_input.unwrap_or(Time(0));
        let (first, end) = span.unwrap_or((begins, begins));
        let none = KnowledgeBase::default();
        let knowledge = eras.first().map_or(&none, |era| &era.knowledge);
        let mut run = Run::with(knowledge, options, first.min(begins));
        if !has_ticks && first < begins {
            step(&mut run, Given::Input(&Input::Tick(first)))?;
        }
        for (number, era) in eras.iter().enumerate() {
            if number > 0 {
                if !has_ticks {
                    run.tick_until(era.from, &mut step)?;
                }
                step(&mut run, Given::Era(era))?;
            }
            for input in &era.inputs {
                if !has_ticks {
                    run.tick_until(input.time(), &mut step)?;
                }
                step(&mut run, Given::Input(input))?;
            }
        }
        if !has_ticks && first_input.is_some() {
            let end = end.max(run.last);
            run.tick_until(end, &mut step)?;
            step(&mut run, Given::Input(&Input::Tick(end)))?;
        }
        Ok(run)
    }

    /// Drives a new engine over observations that are not kept, in the order of their reception; `span` is when they begin
    /// and end. `look` sees the run after each of them, with what the needs were served with since; that is dropped then, so that only events
    /// grow with time.
    ///
    /// # Errors
    /// The first of `observations`, `record` and `look`.
    pub fn streamed<E>(
        knowledge: &KnowledgeBase,
        span: (Time, Time),
        options: Options,
        observations: impl Iterator<Item = Result<Observation, E>>,
        mut record: impl FnMut(Given<'_>) -> Result<(), E>,
        mut look: impl FnMut(&mut Run) -> Result<(), E>,
    ) -> Result<Run, E> {
        let mut run = Run::with(knowledge, options, span.0);
        for observation in observations {
            let observation = observation?;
            run.pass_until(observation.received, &mut record)?;
            run.take(&Input::Observation(observation), &mut record)?;
            look(&mut run)?;
            run.publications.clear();
        }
        let end = span.1.max(run.last);
        run.pass_until(end, &mut record)?;
        run.take(&Input::Tick(end), &mut record)?;
        look(&mut run)?;
        run.publications.clear();
        Ok(run)
    }

    /// A new engine that has been given nothing; `first` is when the run begins.
    #[must_use]
    pub fn new(knowledge: &KnowledgeBase, first: Time) -> Run {
        Run::with(knowledge, Options::default(), first)
    }

    /// As [`Run::new`], with other settings than the usual ones.
    #[must_use]
    pub fn with(knowledge: &KnowledgeBase, options: Options, first: Time) -> Run {
        Run {
            engine: shsa_estimate::node::engine(knowledge.clone(), options),
            observations: 0,
            first,
            last: first,
            events: Vec::new(),
            publications: Vec::new(),
            past: Vec::new(),
            knowledge: knowledge.clone(),
        }
    }

    /// Every event with the knowledge base that its ids belong to, oldest first.
    pub fn told_events(&self) -> impl Iterator<Item = (&KnowledgeBase, &Event)> {
        let known = move |at: usize| self.known(|past| at < past.events);
        self.events.iter().enumerate().map(move |(at, event)| (known(at), event))
    }

    /// The published values from the `from`th on, each with the knowledge base that its ids belong to, oldest first.
    pub fn told_values(&self, from: usize) -> impl Iterator<Item = (&KnowledgeBase, &Publication)> {
        let known = move |at: usize| self.known(|past| at < past.publications);
        self.publications.iter().enumerate().skip(from).map(move |(at, publication)| (known(at), publication))
    }

    fn known(&self, is_in: impl Fn(&Past) -> bool) -> &KnowledgeBase {
        let at = self.past.partition_point(|past| !is_in(past));
        self.past.get(at).map_or(&self.knowledge, |past| &past.knowledge)
    }

    /// Lets the knowledge base of an era take over.
    ///
    /// # Errors
    /// Those of `record`.
    pub fn reload<E>(
        &mut self,
        era: &Era,
        record: &mut impl FnMut(Given<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        record(Given::Era(era))?;
        self.give(Given::Era(era));
        Ok(())
    }

    /// Sends the ticks that fall due before `moment`.
    ///
    /// # Errors
    /// Those of `record`.
    pub fn pass_until<E>(
        &mut self,
        moment: Time,
        record: &mut impl FnMut(Given<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        self.tick_until(moment, &mut |run: &mut Run, given: Given<'_>| {
            record(given)?;
            run.give(given);
            Ok(())
        })
    }

    fn tick_until<E>(
        &mut self,
        moment: Time,
        step: &mut impl FnMut(&mut Run, Given<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut ticks = Ticks::before(moment);
        while let Some(due) = ticks.next(&self.engine) {
            step(self, Given::Input(&Input::Tick(due)))?;
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
        record: &mut impl FnMut(Given<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        record(Given::Input(input))?;
        self.give(Given::Input(input));
        Ok(())
    }

    /// Gives an input, or another knowledge base, to the engine and keeps what comes out.
    pub fn give(&mut self, given: Given<'_>) {
        match given {
            Given::Era(era) => self.engine.reload(era.knowledge.clone(), era.from),
            Given::Input(input) => {
                self.last = self.last.max(input.time());
                self.observations += usize::from(matches!(input, Input::Observation(_)));
                self.engine.handle(input.clone());
            }
        }
        self.listen();
    }

    fn listen(&mut self) {
        while let Some(output) = self.engine.poll() {
            match output {
                Output::Event(event) => self.events.push(event),
                Output::Publication(publication) => self.publications.push(publication),
                // Who answers is among the inputs.
                Output::Task { .. } => {}
                Output::Reloaded(until) => {
                    let knowledge = std::mem::replace(&mut self.knowledge, self.engine.knowledge().clone());
                    let (events, publications) = (self.events.len(), self.publications.len());
                    self.past.push(Past { until, knowledge, events, publications });
                }
            }
        }
    }
}
