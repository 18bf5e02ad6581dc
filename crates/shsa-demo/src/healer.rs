//! The engine over a model that is compiled in, with what it decides in names and words.

use crate::DemoError;
use shsa_core::engine::{
    Engine, Event, EventKind, Input, Options, Output, Publication, PublishedValue, Ticks,
};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{NeedId, SignalId};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::{Time, Validity};
use shsa_format::words;

/// A decision of the engine, in names and words.
#[derive(Clone, Debug, PartialEq)]
pub struct Decision {
    /// When it was decided.
    pub time: Time,
    /// What was decided.
    pub kind: EventKind,
    /// The signal that it is about, if it is about one.
    pub signal: Option<String>,
    /// The variable that it is about, if it is about one.
    pub variable: Option<String>,
    /// The reasons as a sentence.
    pub because: String,
    /// The new source of the need, if it has changed.
    pub substitution: Option<String>,
}

/// What the engine gives.
pub enum Healed {
    /// A value for a need.
    Value(Publication),
    /// A decision.
    Decision(Decision),
}

/// The engine at work over a model.
pub struct Healer {
    engine: Engine,
}

impl Healer {
    /// The engine at its start; `path` names the model in messages.
    ///
    /// # Errors
    /// [`DemoError::Model`] when the model is invalid, which tests exclude.
    pub fn new(model: &str, path: &str, options: Options) -> Result<Healer, DemoError> {
        let loaded = shsa_model::load(model, path);
        if !loaded.report.ok() {
            return Err(DemoError::Model(loaded.report.render(false)));
        }
        Ok(Healer { engine: shsa_estimate::node::engine(loaded.knowledge, options) })
    }

    /// The signals with the source of each.
    pub fn sources(&self) -> impl Iterator<Item = (SignalId, &str)> {
        self.engine.knowledge().signals().enumerate().map(|(id, signal)| (id, &*signal.source))
    }

    /// The needs, each with the name of its variable.
    pub fn needs(&self) -> impl Iterator<Item = (NeedId, &str)> {
        let knowledge = self.engine.knowledge();
        let name = |need| &*knowledge.variables()[knowledge.needs()[need].variable].name;
        knowledge.needs().ids().map(move |need| (need, name(need)))
    }

    /// What serves a need at present, as text.
    #[must_use]
    pub fn source(&self, need: NeedId) -> String {
        let source = self.engine.need_status(need).source;
        source.as_ref().map_or_else(|| "nothing".to_string(), words::served_by)
    }

    /// Takes a value in, after the time until its reception has passed.
    pub fn observe(&mut self, signal: SignalId, stamp: Time, received: Time, value: RawValue) {
        self.engine.pass(Ticks::before(received));
        self.engine.handle(Input::Observation(Observation { signal, stamp, received, value }));
    }

    /// Lets the time pass.
    pub fn pass(&mut self, now: Time) {
        self.engine.pass(Ticks::up_to(now));
    }

    /// The next value or decision.
    pub fn poll(&mut self) -> Option<Healed> {
        loop {
            match self.engine.poll()? {
                Output::Event(event) => return Some(Healed::Decision(self.decision(event))),
                Output::Publication(publication) => return Some(Healed::Value(publication)),
                // The models of demonstrations never change, and run in the engine.
                Output::Task { .. } | Output::Reloaded(_) => {}
            }
        }
    }

    fn decision(&self, event: Event) -> Decision {
        let knowledge = self.engine.knowledge();
        Decision {
            time: event.time,
            kind: event.kind,
            signal: event.signal.map(|signal| knowledge.signals()[signal].name.clone()),
            variable: event.variable.map(|variable| knowledge.variables()[variable].name.clone()),
            because: words::reasons(&event.because),
            substitution: event.substitution.as_ref().map(words::served_by),
        }
    }
}

/// The moment in the middle of a validity.
#[must_use]
pub fn middle(validity: Validity) -> Time {
    Time(validity.from.0.midpoint(validity.to.0))
}

/// A published number; `None` for a list.
#[must_use]
pub fn scalar(value: &PublishedValue) -> Option<Interval> {
    match value {
        PublishedValue::Scalar(interval) => Some(*interval),
        PublishedValue::Vector(_) => None,
    }
}
