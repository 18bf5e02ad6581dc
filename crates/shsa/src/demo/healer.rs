//! The provider of `dmin`: the healer, or the plain node that it replaces.

use super::sensors::{LIDAR, nearest_seen};
use shsa_bridge::Message;
use shsa_core::engine::EventKind;
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use std::collections::VecDeque;

/// The published name of `dmin`, as in the model.
pub(super) const NEED: &str = "/emergency_stop/dmin";

/// A decision of the healer as text.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Decision {
    pub(super) time: Time,
    pub(super) kind: EventKind,
    pub(super) signal: Option<String>,
    pub(super) variable: Option<String>,
    pub(super) because: String,
    /// The new source of `dmin`, if it has changed.
    pub(super) substitution: Option<String>,
}

/// An output of a healer.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Gift {
    /// A value of `dmin` to be published.
    Dmin {
        /// The time at which the value was true.
        stamp: Time,
        /// A number or an interval, metres.
        value: RawValue,
    },
    /// A decision.
    Decision(Decision),
}

/// Computes `dmin` from the sensors' messages.
pub(super) trait Healer {
    /// The topics to subscribe to.
    fn topics(&self) -> Vec<String>;
    /// The present source of `dmin` as text.
    fn source(&self) -> String;
    /// Takes a message in.
    fn observe(&mut self, message: &Message);
    /// Advances the time.
    fn tick(&mut self, now: Time);
    /// The next output.
    fn poll(&mut self) -> Option<Gift>;
}

/// `dmin` without healing: the smallest distance of each scan of the lidar.
#[derive(Debug, Default)]
pub(super) struct PlainNode {
    ready: VecDeque<Gift>,
}

impl Healer for PlainNode {
    fn topics(&self) -> Vec<String> {
        vec![LIDAR.to_string()]
    }

    fn source(&self) -> String {
        format!("{LIDAR} by minimum")
    }

    fn observe(&mut self, message: &Message) {
        let dmin = message.value().and_then(|value| nearest_seen(&message.topic, value));
        self.ready
            .extend(dmin.map(|dmin| Gift::Dmin { stamp: message.stamped(), value: RawValue::Number(dmin) }));
    }

    fn tick(&mut self, _now: Time) {}

    fn poll(&mut self) -> Option<Gift> {
        self.ready.pop_front()
    }
}
