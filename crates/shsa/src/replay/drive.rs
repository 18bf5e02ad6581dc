//! Drives the engine over recorded inputs, with the ticks that a live run would send.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use shsa_core::engine::{Engine, Event, Input, Options, Output, Publication};
use shsa_core::knowledge::KnowledgeBase;
use shsa_core::time::Time;
use std::io::{IsTerminal, stderr};

/// How often the progress bar moves, in inputs.
const PROGRESS_STEP: usize = 4_096;

/// What came out of a run.
pub(super) struct Run {
    pub(super) engine: Engine,
    pub(super) observations: usize,
    pub(super) first: Time,
    pub(super) last: Time,
    pub(super) events: Vec<Event>,
    pub(super) publications: Vec<Publication>,
}

impl Run {
    /// Drives a new engine over all inputs and on to `end`; `record` sees everything that goes in, ticks included.
    ///
    /// Ticks that the inputs hold already (a journal) are the only ones; else they come when they are due.
    pub(super) fn of(
        knowledge: &KnowledgeBase,
        inputs: &[Input],
        end: Option<Time>,
        mut record: impl FnMut(&Input) -> anyhow::Result<()>,
    ) -> anyhow::Result<Run> {
        let has_ticks = inputs.iter().any(|input| matches!(input, Input::Tick(_)));
        let mut run = Run::new(knowledge, inputs);
        let progress = progress(inputs.len());
        for (at, input) in inputs.iter().enumerate() {
            if at % PROGRESS_STEP == 0 {
                progress.set_position(at as u64);
            }
            if !has_ticks {
                run.pass_until(time(input), &mut record)?;
            }
            run.take(input, &mut record)?;
        }
        if !has_ticks && !inputs.is_empty() {
            let end = end.unwrap_or(run.last).max(run.last);
            run.pass_until(end, &mut record)?;
            run.take(&Input::Tick(end), &mut record)?;
        }
        progress.finish_and_clear();
        Ok(run)
    }

    fn new(knowledge: &KnowledgeBase, inputs: &[Input]) -> Run {
        let first = inputs.first().map_or(Time(0), time);
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
    fn pass_until(
        &mut self,
        moment: Time,
        record: &mut impl FnMut(&Input) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        let mut before = None;
        while let Some(due) = self.engine.next_deadline().filter(|due| *due < moment && before != Some(*due))
        {
            self.take(&Input::Tick(due), record)?;
            before = Some(due);
        }
        Ok(())
    }

    fn take(
        &mut self,
        input: &Input,
        record: &mut impl FnMut(&Input) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
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

fn time(input: &Input) -> Time {
    match input {
        Input::Observation(observation) => observation.received,
        Input::Tick(time) => *time,
    }
}

fn progress(length: usize) -> ProgressBar {
    let target =
        if stderr().is_terminal() { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
    let bar = ProgressBar::with_draw_target(Some(length as u64), target);
    let style =
        ProgressStyle::with_template("{bar:40} {percent:>3} %  {pos} of {len} observations  {eta} left");
    bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}
