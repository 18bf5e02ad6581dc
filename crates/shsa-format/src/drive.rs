//! Drives an engine over recorded inputs, with the ticks of a live run, and keeps the outputs.
//!
//! A run has one era for each of its knowledge bases; the ids in the outputs of an era belong to its knowledge base.

use shsa_core::engine::{Engine, Event, Input, Options, Output, Publication, Ticks};
use shsa_core::knowledge::KnowledgeBase;
use shsa_core::observation::Observation;
use shsa_core::time::Time;

/// A stretch of a run under one knowledge base.
#[derive(Clone, Debug)]
pub struct Era {
    /// The time from which the knowledge base applies; the first one applies from the beginning.
    pub from: Time,
    /// The knowledge base to which the ids in `inputs` belong.
    pub knowledge: KnowledgeBase,
    /// The cause: the name and the text of a file. `None` for the first era.
    pub change: Option<(String, String)>,
    /// The inputs in the order of reception.
    pub inputs: Vec<Input>,
}

impl Era {
    /// The one era of a run whose knowledge base never changes.
    #[must_use]
    pub fn only(knowledge: KnowledgeBase, inputs: Vec<Input>) -> Era {
        Era { from: Time::MIN, knowledge, change: None, inputs }
    }
}

/// An input of a run.
#[derive(Clone, Copy, Debug)]
pub enum Given<'a> {
    /// An observation or a tick.
    Input(&'a Input),
    /// A new knowledge base.
    Era(&'a Era),
}

impl Given<'_> {
    /// The time of the input, or the begin of the era.
    #[must_use]
    pub fn time(self) -> Time {
        match self {
            Given::Input(input) => input.time(),
            Given::Era(era) => era.from,
        }
    }
}

/// A past era: its knowledge base, and the counts of outputs at its end.
#[derive(Clone, Debug)]
pub struct Past {
    /// The begin of the next era.
    pub until: Time,
    /// The knowledge base to which the ids of its events and publications belong.
    pub knowledge: KnowledgeBase,
    /// The number of events until its end.
    pub events: usize,
    /// The number of published values until its end.
    pub publications: usize,
}

/// An engine in operation, with all of its outputs.
#[derive(Debug)]
pub struct Run {
    /// The engine in its present state.
    pub engine: Engine,
    /// The number of observations.
    pub observations: usize,
    /// The time of the first input.
    pub first: Time,
    /// The time of the latest input.
    pub last: Time,
    /// Every decision that was not [forgotten](Run::forget), oldest first.
    pub events: Vec<Event>,
    /// Every single wrong reading, oldest first: no decision.
    pub outliers: Vec<Event>,
    /// Every published value of the needs, oldest first.
    pub publications: Vec<Publication>,
    /// The eras before the present one.
    pub past: Vec<Past>,
    /// The knowledge base to which the ids of the next output belong.
    knowledge: KnowledgeBase,
}

impl Run {
    /// Drives a new engine over all inputs, which are in the order of their reception. `step` sees every input, ticks included,
    /// and [gives](Run::give) it to the run. `span` is the begin and end of the recording where its inputs do not show them.
    ///
    /// When the inputs hold ticks (a journal), no others are sent; else ticks are sent when they are due.
    ///
    /// # Errors
    /// The errors of `step`, which end the run.
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

    /// Drives a new engine over observations that are not kept, in the order of their reception; `span` is their begin and end.
    /// `look` sees the run after each observation, with the values published since the last one. These values are then dropped,
    /// so that only the events grow with time.
    ///
    /// # Errors
    /// The first error of `observations`, `record` and `look`.
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
            if run.observations == 0 && span.0 < observation.received {
                run.take(&Input::Tick(span.0), &mut record)?;
            }
            run.pass_until(observation.received, &mut record)?;
            run.take(&Input::Observation(observation), &mut record)?;
            look(&mut run)?;
            run.publications.clear();
        }
        if run.observations > 0 {
            let end = span.1.max(run.last);
            run.pass_until(end, &mut record)?;
            run.take(&Input::Tick(end), &mut record)?;
            look(&mut run)?;
            run.publications.clear();
        }
        Ok(run)
    }

    /// A new engine without inputs; `first` is the begin of the run.
    #[must_use]
    pub fn new(knowledge: &KnowledgeBase, first: Time) -> Run {
        Run::with(knowledge, Options::default(), first)
    }

    /// As [`Run::new`], with options.
    #[must_use]
    pub fn with(knowledge: &KnowledgeBase, options: Options, first: Time) -> Run {
        Run {
            engine: shsa_estimate::node::engine(knowledge.clone(), options),
            observations: 0,
            first,
            last: first,
            events: Vec::new(),
            outliers: Vec::new(),
            publications: Vec::new(),
            past: Vec::new(),
            knowledge: knowledge.clone(),
        }
    }

    /// Every event with the knowledge base to which its ids belong, oldest first.
    pub fn events_with_models(&self) -> impl Iterator<Item = (&KnowledgeBase, &Event)> {
        let known = move |at: usize| self.known(|past| at < past.events);
        self.events.iter().enumerate().map(move |(at, event)| (known(at), event))
    }

    /// Every outlier with the knowledge base to which its ids belong, oldest first.
    pub fn outliers_with_models(&self) -> impl Iterator<Item = (&KnowledgeBase, &Event)> {
        self.outliers.iter().map(|event| (self.known(|past| event.time < past.until), event))
    }

    /// The published values from the `from`th on, each with the knowledge base to which its ids belong, oldest first.
    pub fn publications_with_models(
        &self,
        from: usize,
    ) -> impl Iterator<Item = (&KnowledgeBase, &Publication)> {
        let known = move |at: usize| self.known(|past| at < past.publications);
        self.publications.iter().enumerate().skip(from).map(move |(at, publication)| (known(at), publication))
    }

    fn known(&self, is_in: impl Fn(&Past) -> bool) -> &KnowledgeBase {
        let at = self.past.partition_point(|past| !is_in(past));
        self.past.get(at).map_or(&self.knowledge, |past| &past.knowledge)
    }

    /// Drops the outputs and the past eras, so that a run without end needs no more memory.
    pub fn forget(&mut self) {
        self.events.clear();
        self.outliers.clear();
        self.publications.clear();
        self.past.clear();
    }

    /// Changes to the knowledge base of an era.
    ///
    /// # Errors
    /// The errors of `record`.
    pub fn reload<E>(
        &mut self,
        era: &Era,
        record: &mut impl FnMut(Given<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        record(Given::Era(era))?;
        self.give(Given::Era(era));
        Ok(())
    }

    /// Sends the ticks that are due before `moment`.
    ///
    /// # Errors
    /// The errors of `record`.
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

    /// Gives one input to the engine and keeps the outputs.
    ///
    /// # Errors
    /// The errors of `record`.
    pub fn take<E>(
        &mut self,
        input: &Input,
        record: &mut impl FnMut(Given<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        record(Given::Input(input))?;
        self.give(Given::Input(input));
        Ok(())
    }

    /// Gives an input, or another knowledge base, to the engine and keeps the outputs.
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
                Output::Event(event) if event.kind.is_decision() => self.events.push(event),
                Output::Event(outlier) => self.outliers.push(outlier),
                Output::Publication(publication) => self.publications.push(publication),
                // The answer to a task is among the inputs.
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
