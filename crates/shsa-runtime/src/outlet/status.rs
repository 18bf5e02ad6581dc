//! The state of a need in words.

use super::Outlet;
use serde_json::{Value, json};
use shsa_bridge::{Clock, Offered, Quality};
use shsa_core::time::Time;

impl Outlet {
    /// What the bus is told before the first value.
    pub(crate) fn offered(&self) -> Offered<'_> {
        Offered { topic: &self.topic, unit: self.unit.as_ref() }
    }

    /// The words of the status topic.
    pub(in super::super) fn status(&self, now: Time, clock: &Clock) -> Value {
        let quality = self.quality(now);
        let mut status = json!({
            "variable": self.variable,
            "signal": self.topic,
            "quality": quality.name(),
            "status": quality.code(),
            "source": (quality != Quality::Bad).then_some(&self.provenance.source),
            "last_ns": self.last.map(|last| clock.by_wall(last).0),
            "unwritten": self.unwritten,
        });
        if let (Some(admission), Some(status)) = (&self.provenance.admission, status.as_object_mut()) {
            let now = self.admitted(now).map(|_| admission);
            status.insert("admitted".to_owned(), json!(now.map(|it| it.ground.name())));
            status.insert("level".to_owned(), json!(now.and_then(|it| it.level.as_deref())));
            status.insert("rank".to_owned(), json!(now.map_or(0, |it| it.rank)));
        }
        status
    }
}
