//! `dmin` from whatever can be trusted: the engine over the model of the rover.

use super::provider::{Decision, Provided, Provider};
use crate::DemoError;
use shsa_bridge::Message;
use shsa_core::engine::{Engine, Event, Input, Options, Output, PublishedValue, Ticks};
use shsa_core::knowledge::SignalId;
use shsa_core::monitor::{self, Debounce};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::{Span, Time, Validity};
use shsa_format::words;
use shsa_message::source::split_topic;
use std::collections::BTreeMap;

/// The model is compiled in, so that the demonstration runs anywhere.
const MODEL: &str = include_str!("../../models/rover.yaml");

/// A conflict takes three disagreements in four comparisons. When an obstacle's edge enters or leaves the field of view, `dmin`
/// jumps: a sensor that measured before the jump then disagrees twice with a sensor that measured after it.
const DEBOUNCE: Debounce = Debounce { span: Span::from_millis(250), least: 4, share: 0.75 };

/// The model of the rover, and how many disagreements make a conflict.
#[derive(Clone, Debug)]
pub struct Settings {
    /// The model, as YAML.
    pub model: String,
    /// When disagreements are a conflict.
    pub debounce: Debounce,
}

impl Default for Settings {
    /// `models/rover.yaml`, and what it runs with in the demonstration.
    fn default() -> Settings {
        Settings { model: MODEL.to_owned(), debounce: DEBOUNCE }
    }
}

/// Feeds the engine from the bus.
pub(super) struct HealedNode {
    engine: Engine,
    /// The signal that each topic carries.
    signals: BTreeMap<String, SignalId>,
}

impl HealedNode {
    /// # Errors
    /// When the model is invalid.
    pub(super) fn new(settings: &Settings) -> Result<HealedNode, DemoError> {
        let loaded = shsa_format::model::load(&settings.model, "models/rover.yaml");
        if !loaded.report.ok() {
            return Err(DemoError::Model(loaded.report.render(false)));
        }
        let topic = |source: &str| split_topic(source).0.to_owned();
        let signals = loaded.knowledge.signals().enumerate();
        let signals = signals.map(|(id, signal)| (topic(&signal.source), id)).collect();
        let monitor = monitor::Options { debounce: settings.debounce, ..monitor::Options::default() };
        let options = Options { monitor, ..Options::default() };
        Ok(HealedNode { engine: shsa_estimate::node::engine(loaded.knowledge, options), signals })
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

impl Provider for HealedNode {
    fn topics(&self) -> Vec<String> {
        self.signals.keys().cloned().collect()
    }

    fn source(&self) -> String {
        let need = self.engine.knowledge().needs().ids().next();
        let source = need.and_then(|need| self.engine.need_status(need).source);
        source.as_ref().map_or_else(|| "nothing".to_string(), words::served_by)
    }

    fn observe(&mut self, message: &Message) {
        let Some(&signal) = self.signals.get(&*message.topic) else { return };
        let Some(value) = message.value().cloned() else { return };
        let (stamp, received) = (message.stamped(), message.received);
        self.engine.pass(Ticks::before(received));
        self.engine.handle(Input::Observation(Observation { signal, stamp, received, value }));
    }

    fn tick(&mut self, now: Time) {
        self.engine.pass(Ticks::up_to(now));
    }

    fn poll(&mut self) -> Option<Provided> {
        match self.engine.poll()? {
            Output::Event(event) => Some(Provided::Decision(self.decision(event))),
            Output::Publication(publication) => {
                Some(Provided::Dmin { stamp: middle(publication.validity), value: raw(&publication.value) })
            }
            // The rover's model never changes.
            Output::Task { .. } | Output::Reloaded(_) => None,
        }
    }
}

fn middle(validity: Validity) -> Time {
    Time(validity.from.0.midpoint(validity.to.0))
}

fn raw(value: &PublishedValue) -> RawValue {
    match value {
        PublishedValue::Scalar(interval) => RawValue::Interval { lo: interval.lo(), hi: interval.hi() },
        PublishedValue::Vector(intervals) => {
            RawValue::Vector(intervals.iter().map(|i| i.midpoint()).collect())
        }
    }
}
