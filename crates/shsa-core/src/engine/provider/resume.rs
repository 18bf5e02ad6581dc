//! A need goes on after a restart: from the source that served it, where that may still be used.

use super::super::message::{Event, EventKind};
use super::{Provider, Server, Situation};
use crate::alignment::Sample;
use crate::service::Service;
use crate::time::Time;
use alloc::format;

/// How a need was served before a restart; its times are not in the future.
#[derive(Clone, Debug, PartialEq)]
pub(in super::super) struct Resumption<'a> {
    /// What served it, in words.
    pub(in super::super) source: Option<&'a str>,
    /// When the last switch was.
    pub(in super::super) switched: Option<Time>,
    /// Whether it has been told that nothing serves it.
    pub(in super::super) unserved: bool,
    /// The last published value, and when that was.
    pub(in super::super) last: Option<(Time, Sample)>,
}

impl Provider {
    /// What is to be known after a restart, but for the source that it is tied to.
    pub(in super::super) fn switched(&self) -> Option<Time> {
        self.switched
    }

    /// Whether it has been told that nothing serves the need.
    pub(in super::super) fn is_unserved(&self) -> bool {
        self.unserved
    }

    /// The last published value, and when that was.
    pub(in super::super) fn last(&self) -> Option<(Time, Sample)> {
        self.last
    }

    /// What serves the need.
    pub(in super::super) fn active(&self) -> Option<&Service> {
        self.active.as_ref()
    }

    /// Goes on from before a restart. Tells when the source had to be left.
    pub(in super::super) fn resume(
        &mut self,
        before: &Resumption<'_>,
        situation: &Situation<'_>,
    ) -> Option<Event> {
        let Situation { knowledge, monitor, now, .. } = *situation;
        self.started = Some(now);
        self.switched = before.switched;
        self.unserved = before.unserved;
        // What is older says nothing about now: neither is there a jump from it, nor can anything go on from it.
        self.last = before.last.filter(|(at, _)| now - *at <= self.max_age);
        self.server = Some(Server::Active { since: self.switched });
        self.refusals.take_as_told();
        self.find_sources(situation);
        let described =
            |way: &crate::substitution::Way| Some(way.describe(knowledge)) == before.source.map(Into::into);
        if let Some(forced) = self.forced.clone() {
            if described(&forced) {
                self.start(knowledge, Some(forced), monitor.ports());
            }
            return self.stay_forced(situation);
        }
        let same = self.ranked().map(|(source, _)| &source.way).find(|way| described(way)).cloned();
        if same.is_some() && self.start(knowledge, same, monitor.ports()) {
            return None;
        }
        let is_served = self.start_best(knowledge, monitor.ports());
        let left = format!("{} served it before the restart and must not be used now", before.source?);
        if !is_served {
            let because = format!("{left}, and nothing else is trusted");
            return self.do_without(situation, Some(because));
        }
        self.switched = Some(now);
        let because = format!("{left}; {}", self.alternatives(knowledge));
        Some(self.event(knowledge, EventKind::Substituted, because, now))
    }
}
