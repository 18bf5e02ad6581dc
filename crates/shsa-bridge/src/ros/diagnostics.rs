//! Diagnostics as CDR: `std_msgs/Header header` without a frame, `DiagnosticStatus[] status`; a status is `byte level, string name,
//! string message, string hardware_id, KeyValue[] values`, and a `KeyValue` is two strings.

use crate::cdr::{HEADER, time_parts};
use crate::diagnostic::{Diagnostic, Level};
use crate::{Bridge, BridgeError, Outgoing, Payload};
use bytes::Bytes;
use shsa_core::time::Time;

/// The topic that tools of ROS listen to.
const TOPIC: &str = "/diagnostics";
/// Its type.
const TYPE: &str = "diagnostic_msgs/msg/DiagnosticArray";

/// Publishes the states on the topic that tools of ROS listen to.
///
/// # Errors
/// As [`Bridge::publish`].
pub(crate) fn publish(bridge: &mut dyn Bridge, stamp: Time, all: &[Diagnostic]) -> Result<(), BridgeError> {
    bridge.advertise(TOPIC, TYPE)?;
    bridge.publish(Outgoing::new(TOPIC, stamp, Payload::Bytes(written(stamp, all))))
}

/// The message of these states.
fn written(stamp: Time, all: &[Diagnostic]) -> Bytes {
    let mut out = Out(HEADER.to_vec());
    let (seconds, nanoseconds) = time_parts(stamp);
    out.0.extend(seconds);
    out.0.extend(nanoseconds);
    out.text("");
    out.count(all.len());
    for diagnostic in all {
        out.0.push(level(diagnostic.level));
        out.text(&diagnostic.name);
        out.text(&diagnostic.message);
        out.text(&diagnostic.reporter);
        out.count(diagnostic.details.len());
        for (key, value) in &diagnostic.details {
            out.text(key);
            out.text(value);
        }
    }
    out.0.into()
}

/// The constants of `DiagnosticStatus`.
fn level(level: Level) -> u8 {
    match level {
        Level::Ok => 0,
        Level::Warn => 1,
        Level::Error => 2,
        Level::Stale => 3,
    }
}

/// A message under way.
struct Out(Vec<u8>);

impl Out {
    /// A length, at the next multiple of four bytes behind the encapsulation, which has four bytes itself.
    fn count(&mut self, count: usize) {
        self.0.resize(self.0.len().next_multiple_of(4), 0);
        self.0.extend(u32::try_from(count).unwrap_or(u32::MAX).to_le_bytes());
    }

    /// A text, which ends by a zero byte that is counted, and has no other.
    fn text(&mut self, text: &str) {
        let text: Vec<u8> = text.bytes().filter(|byte| *byte != 0).collect();
        self.count(text.len() + 1);
        self.0.extend(text);
        self.0.push(0);
    }
}
