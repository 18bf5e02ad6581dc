//! How a takeover stands, for who looks on.

use super::{Stage, Takeover};
use crate::wiring::action::describe;
use serde_json::{Value, json};
use shsa_bridge::{Clock, Quality};

impl Takeover {
    /// How far who reads the name can trust what was published last, where `quality` is that of the need.
    pub(in super::super::super) fn quality(&self, quality: Quality, is_bad: bool) -> Quality {
        match &self.stage {
            Stage::Taken | Stage::Restoring(_) if self.unwritten.is_none() => quality,
            // Another instance's care.
            Stage::Watching if !self.is_ours => quality,
            // From the source itself.
            Stage::Watching | Stage::Waiting { .. } if !is_bad && quality != Quality::Bad => Quality::Good,
            _ => Quality::Bad,
        }
    }

    /// How it stands, for who looks on.
    pub(in super::super::super) fn json(&self, quality: Quality, clock: &Clock) -> Value {
        let is_taken = matches!(self.stage, Stage::Taken | Stage::Restoring(_));
        let since = if is_taken { self.taken } else { self.since };
        let since = (!matches!(self.stage, Stage::Watching)).then(|| clock.by_wall(since).0);
        let again = match &self.stage {
            Stage::Waiting { until } => Some(clock.by_wall(*until).0),
            _ => None,
        };
        json!({
            "signal": self.signal,
            "name": self.topic(),
            "stage": self.stage(),
            "quality": quality.name(),
            "since_ns": since,
            "again_ns": again,
            "silenced_by": is_taken.then(|| describe(&self.settings.silence)),
            "released": self.is_released && is_taken,
            "last": self.last.as_ref().map(|note| note.kind),
            "because": self.unwritten.as_ref().or(self.last.as_ref().map(|note| &note.because)),
            "silenced": self.counts.silenced,
            "refused": self.counts.refused,
            "returned": self.counts.returned,
        })
    }
}
