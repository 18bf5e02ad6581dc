//! Drives an engine through a story, and looks at it at the moments of the expectations.

use super::trace::Echo;
use super::{Story, change};
use crate::drive::{Era, Given, Run};
use shsa_core::engine::{Engine, Input, PublishedValue};
use shsa_core::knowledge::KnowledgeBase;
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::Time;
use std::convert::Infallible;

/// Drives a story to its end; `look` sees the engine at each of the moments, by their index, and `record` sees all inputs.
pub(super) fn drive(
    story: &Story,
    moments: &[Time],
    look: impl FnMut(usize, &Engine),
    mut record: impl FnMut(Given<'_>),
) -> Run {
    let mut order: Vec<usize> = (0..moments.len()).collect();
    order.sort_by_key(|&at| moments[at]);
    let run = Run::new(&story.knowledge, Time(0));
    let record = |given: Given<'_>| -> Result<(), Infallible> {
        record(given);
        Ok(())
    };
    let mut stage = Stage {
        story,
        run,
        seen: 0,
        echoes: Vec::new(),
        moments,
        order,
        look,
        record,
        changes: &story.changes,
    };
    for input in story.trace.inputs(&story.knowledge) {
        stage.echo_until(input.time());
        stage.give(&input);
    }
    let end = Time(0) + story.trace.duration;
    stage.echo_until(end);
    stage.give(&Input::Tick(end));
    stage.look_until(Time::MAX);
    stage.run
}

struct Stage<'a, L, R> {
    story: &'a Story,
    run: Run,
    /// The number of publications that have become echoes.
    seen: usize,
    /// Echoes that have not arrived yet.
    echoes: Vec<Observation>,
    moments: &'a [Time],
    /// The indices of the remaining moments.
    order: Vec<usize>,
    look: L,
    record: R,
    /// The remaining changes of the model.
    changes: &'a [Era],
}

impl<L, R> Stage<'_, L, R>
where
    L: FnMut(usize, &Engine),
    R: FnMut(Given<'_>) -> Result<(), Infallible>,
{
    /// Gives the echoes that arrive before `moment`.
    fn echo_until(&mut self, moment: Time) {
        loop {
            let next = (0..self.echoes.len()).min_by_key(|&at| self.echoes[at].received);
            let Some(at) = next.filter(|&at| self.echoes[at].received < moment) else { return };
            let echo = self.echoes.remove(at);
            self.give(&Input::Observation(echo));
        }
    }

    fn give(&mut self, input: &Input) {
        self.change_until(input.time());
        self.look_until(input.time());
        self.pass(input.time());
        let Some(input) = self.known(input) else { return };
        let Ok(()) = self.run.take(&input, &mut self.record);
        self.listen();
    }

    /// An input with the ids of the present model; `None` for a signal that this model lacks.
    fn known(&self, input: &Input) -> Option<Input> {
        let mut input = input.clone();
        if let Input::Observation(observation) = &mut input {
            let known = self.run.engine.knowledge();
            observation.signal = change::signal(&self.story.knowledge, observation.signal, known)?;
        }
        Some(input)
    }

    /// Applies the changes up to `moment`.
    fn change_until(&mut self, moment: Time) {
        while let Some((era, later)) = self.changes.split_first().filter(|(era, _)| era.from <= moment) {
            self.changes = later;
            self.look_until(era.from);
            self.pass(era.from);
            let Ok(()) = self.run.reload(era, &mut self.record);
            self.listen();
        }
    }

    fn look_until(&mut self, moment: Time) {
        while let Some(&at) = self.order.first().filter(|&&at| self.moments[at] < moment) {
            self.pass(self.moments[at]);
            (self.look)(at, &self.run.engine);
            self.order.remove(0);
        }
    }

    fn pass(&mut self, moment: Time) {
        let Ok(()) = self.run.pass_until(moment, &mut self.record);
    }

    /// Makes echoes of the newest publications.
    fn listen(&mut self) {
        let story = self.story;
        for (known, publication) in self.run.publications_with_models(self.seen) {
            let need = change::need(known, publication.need, &story.knowledge);
            let of_it = story.trace.echoes.iter().filter(|echo| Some(echo.need) == need);
            let echo = |echo: &Echo| {
                let value = repeated(&story.knowledge, echo, &publication.value);
                let (stamp, received) = (publication.time, publication.time + echo.latency);
                Observation { signal: echo.signal, stamp, received, value }
            };
            self.echoes.extend(of_it.map(echo));
        }
        self.seen = self.run.publications.len();
    }
}

/// A published value as a reading of the signal that repeats it.
fn repeated(knowledge: &KnowledgeBase, echo: &Echo, value: &PublishedValue) -> RawValue {
    let signal = &knowledge.signals()[echo.signal];
    let in_unit = |middle: f64| signal.unit.as_ref().map_or(middle, |unit| unit.from_si(middle));
    let shown =
        |middle: f64| signal.scaling.map_or(in_unit(middle), |scaling| scaling.reading(in_unit(middle)));
    match value {
        PublishedValue::Scalar(value) => RawValue::Number(shown(value.midpoint())),
        PublishedValue::Vector(elements) => {
            RawValue::Vector(elements.iter().map(|element| shown(element.midpoint())).collect())
        }
    }
}
