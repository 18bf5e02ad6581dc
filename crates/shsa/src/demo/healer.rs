//! Who provides `dmin`: the healer, or the plain node that it replaces.

use super::sensors::{LIDAR, nearest_seen};
use shsa_bridge::Message;
use shsa_core::engine::EventKind;
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use std::collections::VecDeque;

/// Under which `dmin` is needed, as in the model.
pub(super) const NEED: &str = "/emergency_stop/dmin";

/// A decision of the healer, in words.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Decision {
    pub(super) time: Time,
    pub(super) kind: EventKind,
    /// The signal that it is about.
    pub(super) signal: Option<String>,
    /// The variable that it is about.
    pub(super) variable: Option<String>,
    pub(super) because: String,
    /// What `dmin` comes from now, where that has changed.
    pub(super) substitution: Option<String>,
}

/// What a healer gives.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Gift {
    /// A value of `dmin`, to be published.
    Dmin {
        /// When it was true.
        stamp: Time,
        /// A number or an interval, metres.
        value: RawValue,
    },
    /// Something was decided.
    Decision(Decision),
}

/// Turns what the sensors say into `dmin`.
pub(super) trait Healer {
    /// The topics that it listens to.
    fn topics(&self) -> Vec<String>;
    /// What `dmin` comes from now, in words.
    fn source(&self) -> String;
    /// Something has arrived.
    fn observe(&mut self, message: &Message);
    /// Time has passed.
    fn tick(&mut self, now: Time);
    /// What has come of it since, one by one.
    fn poll(&mut self) -> Option<Gift>;
}

/// `dmin` as it is done without healing: the smallest distance of each scan of the lidar.
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
