//! How everything stands, for who asks and for who is told.

use super::Healer;
use crate::wiring::Takeover;
use serde_json::{Value, json};
use shsa_bridge::{Clock, Quality};
use shsa_core::engine::NeedStatus;
use shsa_core::knowledge::{NeedId, SignalId};
use shsa_core::monitor::Symptom;
use shsa_core::time::Time;
use shsa_format::event;

/// How a need stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) struct Standing {
    quality: Quality,
    /// How far its takeover is, and the quality under the name that is taken over.
    takeover: Option<(&'static str, Quality)>,
}

impl Healer {
    /// How everything stands.
    pub(in super::super) fn state(&self, now: Time, clock: &Clock) -> Value {
        let needs = self.outlets().map(|(id, outlet)| {
            let NeedStatus { published, longest_gap, .. } = self.engine.need_status(id);
            let mut status = self.status(id, now, clock);
            if let Some(status) = status.as_object_mut() {
                status.insert("published".to_owned(), json!(published));
                status.insert("longest_gap_s".to_owned(), json!(longest_gap.seconds()));
                status.insert("execution_us".to_owned(), self.executions[id].json());
                let workers = self.workers.as_ref().and_then(|workers| workers.state(id));
                status.extend(workers.map(|state| ("isolation".to_owned(), state)));
            }
            (outlet.key().to_owned(), status)
        });
        let signals = self.engine.knowledge().signals().enumerate();
        let signals = signals.map(|(id, signal)| (signal.name.clone(), self.signal(id)));
        json!({ "needs": Value::Object(needs.collect()), "signals": Value::Object(signals.collect()) })
    }

    /// The words of a need's status topic.
    pub(in super::super) fn status(&self, need: NeedId, now: Time, clock: &Clock) -> Value {
        let mut status = self.outlets[need].status(now, clock);
        if let (Some(status), Some(takeover)) = (status.as_object_mut(), self.takeover_of(need)) {
            status.insert("takeover".to_owned(), takeover.json(self.quality_of(takeover, now), clock));
        }
        status
    }

    /// How every need stands: what changes here is told at once.
    pub(in super::super) fn standings(&self, now: Time) -> impl Iterator<Item = Standing> + Clone {
        self.outlets.enumerate().map(move |(id, outlet)| Standing {
            quality: outlet.quality(now),
            takeover: self.takeover_of(id).map(|takeover| (takeover.stage(), self.quality_of(takeover, now))),
        })
    }

    fn takeover_of(&self, need: NeedId) -> Option<&Takeover> {
        self.takeovers.iter().find(|takeover| takeover.need() == need)
    }

    fn signal(&self, id: SignalId) -> Value {
        let counts = self.engine.monitor().ports()[id].counts();
        json!({
            "verdict": event::verdict(self.engine.absence(id), self.engine.verdict(id)),
            "symptom": self.engine.fault(id).map(Symptom::name),
            "accepted": counts.accepted,
            "dropped": counts.dropped + counts.duplicates,
            "late": counts.late,
            "out_of_order": counts.out_of_order,
            "invalid": counts.invalid,
            "out_of_range": counts.out_of_range,
            "too_fast": counts.too_fast,
            "unreadable": self.inputs.unreadable(id).0,
            "unreadable_because": self.inputs.unreadable(id).1,
        })
    }
}
