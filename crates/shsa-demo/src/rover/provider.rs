//! What computes `dmin`: the plain node here, or the engine (`healed`).

use super::sensors::{LIDAR, nearest_seen};
use crate::healer::Decision;
use shsa_bridge::Message;
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use std::collections::VecDeque;

/// The topic of `dmin`, as in the model.
pub const NEED: &str = "/emergency_stop/dmin";

/// What a provider gives.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Provided {
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
pub(super) trait Provider {
    /// The topics to subscribe to.
    fn topics(&self) -> Vec<String>;
    /// The present source of `dmin` as text.
    fn source(&self) -> String;
    /// Takes a message in.
    fn observe(&mut self, message: &Message);
    /// Advances the time.
    fn tick(&mut self, now: Time);
    /// The next output.
    fn poll(&mut self) -> Option<Provided>;
}

/// `dmin` without healing: the smallest distance of each scan of the lidar.
#[derive(Debug, Default)]
pub(super) struct LidarNode {
    ready: VecDeque<Provided>,
}

impl Provider for LidarNode {
    fn topics(&self) -> Vec<String> {
        vec![LIDAR.to_string()]
    }

    fn source(&self) -> String {
        format!("{LIDAR} by minimum")
    }

    fn observe(&mut self, message: &Message) {
        let dmin = message.value().and_then(|value| nearest_seen(&message.topic, value));
        let dmin =
            dmin.map(|dmin| Provided::Dmin { stamp: message.stamped(), value: RawValue::Number(dmin) });
        self.ready.extend(dmin);
    }

    fn tick(&mut self, _now: Time) {}

    fn poll(&mut self) -> Option<Provided> {
        self.ready.pop_front()
    }
}

/// The bound of a published `dmin` on the safe side, metres; `None` for a list.
#[must_use]
pub fn lower_bound(value: &RawValue) -> Option<f64> {
    match *value {
        RawValue::Number(dmin) | RawValue::Interval { lo: dmin, .. } => Some(dmin),
        RawValue::Vector(_) => None,
    }
}
