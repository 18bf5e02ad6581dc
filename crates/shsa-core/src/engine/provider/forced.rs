//! A need that an operator has tied to one source: it serves, whatever is thought of it, and nothing takes its place.

use super::super::message::{Event, EventKind};
use super::super::operator::Subject;
use super::super::reason;
use super::{Better, Provider, Situation};
use crate::knowledge::SignalId;
use crate::service::Service;
use crate::substitution::Way;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

impl Provider {
    /// The only source that may serve the need, where that is ordered.
    pub(in super::super) fn forced(&self) -> Option<&Way> {
        self.forced.as_ref()
    }

    /// Ties the need to a source without a switch, for [`Provider::inherit`] and [`Provider::resume`].
    pub(in super::super) fn tie(&mut self, way: Way) {
        self.forced = Some(way);
        self.unsure = None;
    }

    /// Serves the need from one source from now on. Tells the switch, when it is one.
    pub(in super::super) fn force(&mut self, way: Way, situation: &Situation<'_>) -> Option<Event> {
        self.tie(way);
        self.stay_forced(situation)
    }

    /// Chooses the source again, as after a change of trust: what serves well goes on until a better one may take over.
    pub(in super::super) fn release(&mut self, situation: &Situation<'_>) -> Option<Event> {
        self.forced = None;
        self.is_doubted = false;
        let event = self.replan(situation);
        self.better_by = Better::Ordered;
        event
    }

    /// Looks whether the source that the need is tied to can serve it, and tells when that has changed.
    pub(super) fn stay_forced(&mut self, situation: &Situation<'_>) -> Option<Event> {
        let Situation { knowledge, monitor, judge, now, .. } = *situation;
        let way = self.forced.clone()?;
        let only = format!("{} alone may serve it by order of the operator", way.describe(knowledge));
        self.is_doubted = !self.sources.iter().any(|source| source.way == way);
        let forbidden = judge.forbidden_in(knowledge, &way);
        if !forbidden.is_empty() {
            self.take_over(knowledge, None);
            let names =
                forbidden.into_iter().map(|component| format!("{}", Subject::of(knowledge, component)));
            let names: Vec<String> = names.collect();
            let because = format!("{only}, and by another order {} must not be used", names.join(", "));
            return self.tell_unserved(knowledge, Some(because), now);
        }
        if self.active.as_ref().map(Service::way) != Some(&way) {
            let left = self.active.as_ref().map(|service| service.way().describe(knowledge));
            self.start(knowledge, Some(way), monitor.ports());
            self.switched = Some(now);
            let is_back = self.active.as_ref().map(Service::way) == self.preferred.as_ref();
            let kind = if is_back { EventKind::Restored } else { EventKind::Substituted };
            let because = format!("{only}; before: {}", left.as_deref().unwrap_or("nothing"));
            return Some(self.event(knowledge, kind, because, now));
        }
        let is_absent = |signal: &SignalId| monitor.timeouts().absence(*signal).is_some();
        let absent: Vec<&str> = self
            .active_rests_on
            .iter()
            .filter(is_absent)
            .map(|signal| knowledge.signals()[signal].name.as_str())
            .collect();
        let because = (!absent.is_empty())
            .then(|| format!("{only}, and {} gives no usable value", reason::listed(&absent)));
        self.tell_unserved(knowledge, because, now)
    }
}
