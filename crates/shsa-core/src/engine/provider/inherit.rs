//! A need goes on being served while the knowledge base changes: from the same source where that is still there.

use super::super::explain;
use super::super::message::{Event, EventKind};
use super::super::standby::Standby;
use super::super::ways::Lost;
use super::{Provider, Server};
use crate::knowledge::{KnowledgeBase, Lineage, SignalId};
use crate::monitor::{Inheritance, Monitor};
use crate::plan::Graph;
use crate::service::Service;
use crate::substitution::Way;
use crate::time::Time;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

/// A change of the knowledge base, as the needs see it.
pub(in super::super) struct Succession<'a> {
    pub(in super::super) old: &'a KnowledgeBase,
    pub(in super::super) new: &'a KnowledgeBase,
    pub(in super::super) lineage: &'a Lineage,
    pub(in super::super) graph: &'a Graph,
    pub(in super::super) standby: &'a Standby,
    pub(in super::super) monitor: &'a Monitor,
    pub(in super::super) inheritance: &'a Inheritance,
    /// What may not be used: first with the signals that have yet to prove themselves.
    pub(in super::super) lost: [Lost; 2],
    pub(in super::super) now: Time,
}

impl Provider {
    /// Goes on from the provider of the same need before the change. Tells when the source had to be left.
    pub(in super::super) fn inherit(&mut self, old: Provider, change: &Succession<'_>) -> Option<Event> {
        self.started = old.started;
        self.last = old.last;
        self.published = old.published;
        self.longest_gap = old.longest_gap;
        self.widest = old.widest;
        self.unserved = old.unserved;
        self.switched = old.switched;
        self.blend = old.blend;
        self.server = old.server.and_then(|server| match server {
            Server::Active { .. } => Some(server),
            Server::StandIn(way) => change.inheritance.way(way).map(Server::StandIn),
        });
        self.choose(change);
        let Some(mut service) = old.active else { return self.start_anew(None, change) };
        let way = service.way().succeeded(change.lineage);
        match way.filter(|way| self.sources.iter().any(|source| source.way == *way)) {
            Some(way) => {
                self.go_on(way, &mut service, change);
                self.unfit_since = old.unfit_since;
                let preferred = old.preferred.as_ref().and_then(|way| way.succeeded(change.lineage));
                self.is_outdone = old.is_outdone || self.preferred != preferred;
                None
            }
            None => self.start_anew(Some(service.way()), change),
        }
    }

    /// A need that is new, or means something else now, begins with what can be trusted.
    pub(in super::super) fn begin(&mut self, change: &Succession<'_>) {
        self.choose(change);
        self.start_heard(change);
    }

    fn choose(&mut self, change: &Succession<'_>) {
        let Succession { new, graph, standby, monitor, lost, now, .. } = change;
        self.find_sources(new, graph, standby, monitor, lost, *now);
    }

    /// Goes on with the same source, without a gap in what its program remembers where it still computes the same.
    fn go_on(&mut self, way: Way, old: &mut Service, change: &Succession<'_>) {
        let ports = change.monitor.ports();
        let Some(mut service) = Service::start(change.new, way, ports) else { return };
        if !service.inherit(old, change.lineage) {
            // Its values may differ from now on: that is a switch, as for the blending.
            self.server = None;
        }
        self.take_over(change.new, Some(service));
    }

    /// Leaves a source that the change has taken away.
    fn start_anew(&mut self, lost: Option<&Way>, change: &Succession<'_>) -> Option<Event> {
        self.unfit_since = None;
        let is_served = self.start_heard(change);
        let reason = lost.map(|way| lost_by(way, change));
        if !is_served {
            let because = reason.map(|reason| format!("{reason}, and nothing else is trusted"));
            return self.tell_unserved(change.new, because, change.now);
        }
        self.switched = Some(change.now);
        let because = format!("{}; {}", reason?, self.alternatives(change.new));
        Some(self.event(change.new, EventKind::Substituted, because, change.now))
    }

    /// Starts the best source whose signals have all spoken, else the best; whether there is one.
    fn start_heard(&mut self, change: &Succession<'_>) -> bool {
        let spoken = |way: &Way| way.inputs().all(|signal| change.monitor.watch().has_spoken(signal));
        let heard = self.ranked().map(|(source, _)| &source.way).find(|way| spoken(way)).cloned();
        let service = heard.and_then(|way| Service::start(change.new, way, change.monitor.ports()));
        match service {
            Some(_) => {
                self.take_over(change.new, service);
                true
            }
            None => self.start_best(change.new, change.monitor.ports()),
        }
    }
}

/// Why a change takes a source away: what is gone, described anew or withdrawn, or that it does not serve any more.
fn lost_by(way: &Way, change: &Succession<'_>) -> String {
    let Succession { old, new, lineage, .. } = *change;
    let name = |signal: SignalId| old.signals()[signal].name.as_str();
    let signals =
        |is: &dyn Fn(SignalId) -> bool| way.inputs().filter(|&id| is(id)).map(name).collect::<Vec<_>>();
    let steps = way.substitution.steps.iter().filter(|step| lineage.relation(step.relation).is_none());
    let relations = steps.map(|step| old.relations()[step.relation].name.as_str());
    let gone: Vec<&str> =
        signals(&|id| lineage.namesake(id).is_none()).into_iter().chain(relations).collect();
    let anew = signals(&|id| lineage.signal(id).is_none());
    let withdrawn = signals(&|id| lineage.signal(id).is_some_and(|signal| !new.is_available(signal)));
    match (gone.is_empty(), anew.is_empty(), withdrawn.is_empty()) {
        (false, ..) => format!("the changed model has no {} any more", explain::listed(&gone)),
        (_, false, _) => format!("the changed model describes {} anew", explain::listed(&anew)),
        (.., false) => format!("the changed model withdraws {}", explain::listed(&withdrawn)),
        _ => format!("the changed model does not serve this from {} any more", way.describe(old)),
    }
}
