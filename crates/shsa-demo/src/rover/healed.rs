//! `dmin` from whatever can be trusted: the engine over the model of the rover.

use super::provider::{Provided, Provider};
use crate::DemoError;
use crate::healer::{Healed, Healer, middle};
use shsa_bridge::Message;
use shsa_core::engine::{Options, PublishedValue};
use shsa_core::knowledge::SignalId;
use shsa_core::monitor::{self, Debounce};
use shsa_core::observation::RawValue;
use shsa_core::time::{Span, Time};
use shsa_message::source::split_topic;
use std::collections::BTreeMap;

/// The model of the rover, compiled in, so that the demonstration runs anywhere.
pub const MODEL: &str = include_str!("../../models/rover.yaml");

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
    healer: Healer,
    /// The signal that each topic carries.
    signals: BTreeMap<String, SignalId>,
}

impl HealedNode {
    /// # Errors
    /// When the model is invalid.
    pub(super) fn new(settings: &Settings) -> Result<HealedNode, DemoError> {
        let monitor = monitor::Options { debounce: settings.debounce, ..monitor::Options::default() };
        let options = Options { monitor, ..Options::default() };
        let healer = Healer::new(&settings.model, "models/rover.yaml", options)?;
        let signals = healer.sources().map(|(id, source)| (split_topic(source).0.to_owned(), id)).collect();
        Ok(HealedNode { healer, signals })
    }
}

impl Provider for HealedNode {
    fn topics(&self) -> Vec<String> {
        self.signals.keys().cloned().collect()
    }

    fn source(&self) -> String {
        let need = self.healer.needs().next().map(|(need, _)| need);
        need.map_or_else(String::new, |need| self.healer.source(need))
    }

    fn observe(&mut self, message: &Message) {
        let Some(&signal) = self.signals.get(&*message.topic) else { return };
        let Some(value) = message.value().cloned() else { return };
        self.healer.observe(signal, message.stamped(), message.received, value);
    }

    fn tick(&mut self, now: Time) {
        self.healer.pass(now);
    }

    fn poll(&mut self) -> Option<Provided> {
        Some(match self.healer.poll()? {
            Healed::Decision(decision) => Provided::Decision(decision),
            Healed::Value(publication) => {
                Provided::Dmin { stamp: middle(publication.validity), value: raw(&publication.value) }
            }
        })
    }
}

fn raw(value: &PublishedValue) -> RawValue {
    match value {
        PublishedValue::Scalar(interval) => RawValue::Interval { lo: interval.lo(), hi: interval.hi() },
        PublishedValue::Vector(intervals) => {
            RawValue::Vector(intervals.iter().map(|i| i.midpoint()).collect())
        }
    }
}
