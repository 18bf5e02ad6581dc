//! A need goes on being served while the knowledge base changes: from the same source where that is still there.

use super::super::message::{Event, EventKind};
use super::super::reason;
use super::{Better, Provider, Server, Situation};
use crate::knowledge::{KnowledgeBase, Lineage, SignalId};
use crate::monitor::Inheritance;
use crate::service::Service;
use crate::substitution::Way;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

/// A change of the knowledge base, as the needs see it.
pub(in super::super) struct Succession<'a> {
    pub(in super::super) old: &'a KnowledgeBase,
    pub(in super::super) lineage: &'a Lineage,
    pub(in super::super) inheritance: &'a Inheritance,
    /// In the changed model.
    pub(in super::super) situation: Situation<'a>,
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
        self.served_again = old.served_again;
        self.steady_since = old.steady_since;
        self.is_wary = old.is_wary;
        self.is_uncertain = old.is_uncertain;
        self.refusals.inherit(&old.refusals, change.lineage);
        self.short = old.short.iter().filter_map(|short| short.inherit(change)).collect();
        self.blend = old.blend;
        self.server = old.server.and_then(|server| match server {
            Server::Active { .. } | Server::Unsure => Some(server),
            Server::StandIn(way) => change.inheritance.way(way).map(Server::StandIn),
        });
        self.find_sources(&change.situation);
        let preferred = old.preferred.as_ref().and_then(|way| way.succeeded(change.lineage));
        let way = old.active.as_ref().and_then(|service| service.way().succeeded(change.lineage));
        let way = way.filter(|way| self.may_go_on(way, change));
        match (way, old.active) {
            (Some(way), Some(mut service)) => {
                self.go_on(way, &mut service, change);
                self.pace = old.pace;
                self.unfit_since = old.unfit_since;
                self.episode = old.episode.and_then(|episode| episode.inherit(change.inheritance));
                self.is_doubted = old.is_doubted;
                self.better_by = if self.preferred == preferred { old.better_by } else { Better::Changed };
                None
            }
            _ if self.forced.is_some() => self.stay_forced(&change.situation),
            (_, left) => self.start_anew(left.as_ref().map(Service::way), change),
        }
    }

    /// Whether a source that has served until the change may do so.
    fn may_go_on(&self, way: &Way, change: &Succession<'_>) -> bool {
        let Situation { knowledge, judge, .. } = change.situation;
        match &self.forced {
            Some(forced) => forced == way && judge.forbidden_in(knowledge, way).is_empty(),
            None => self.sources.iter().any(|source| source.way == *way),
        }
    }

    /// A need that is new, or means something else now, begins with what can be trusted.
    pub(in super::super) fn begin(&mut self, change: &Succession<'_>) {
        self.find_sources(&change.situation);
        self.start_heard(&change.situation);
    }

    /// Goes on with the same source, without a gap in what its program remembers where it still computes the same.
    fn go_on(&mut self, way: Way, old: &mut Service, change: &Succession<'_>) {
        let Situation { knowledge, monitor, .. } = change.situation;
        let Some(mut service) = Service::start(knowledge, way, monitor.ports(), None) else { return };
        if !service.inherit(old, change.lineage) {
            // Its values may differ from now on: that is a switch, as for the blending.
            self.server = None;
        }
        self.take_over(knowledge, Some(service));
    }

    /// Leaves a source that the change has taken away.
    fn start_anew(&mut self, lost: Option<&Way>, change: &Succession<'_>) -> Option<Event> {
        let Situation { knowledge, now, .. } = change.situation;
        self.unfit_since = None;
        let is_served = self.start_heard(&change.situation);
        let reason = lost.map(|way| lost_by(way, change));
        if !is_served {
            let because = reason.map(|reason| format!("{reason}, and nothing else is trusted"));
            return self.do_without(&change.situation, because);
        }
        self.switched = Some(now);
        let because = format!("{}; {}", reason?, self.alternatives(knowledge));
        Some(self.event(knowledge, EventKind::Substituted, because, now))
    }

    /// Starts the best source whose signals have all spoken, else the best; whether there is one.
    fn start_heard(&mut self, situation: &Situation<'_>) -> bool {
        let Situation { knowledge, monitor, .. } = *situation;
        let spoken = |way: &Way| way.inputs().all(|signal| monitor.timeouts().has_spoken(signal));
        let heard = self.ranked().map(|(source, _)| &source.way).find(|way| spoken(way)).cloned();
        let service = heard.and_then(|way| Service::start(knowledge, way, monitor.ports(), None));
        match service {
            Some(_) => {
                self.take_over(knowledge, service);
                true
            }
            None => self.start_best(knowledge, monitor.ports()),
        }
    }
}

/// Why a change takes a source away: what is gone, described anew or withdrawn, or that it does not serve any more.
fn lost_by(way: &Way, change: &Succession<'_>) -> String {
    let Succession { old, lineage, .. } = *change;
    let new = change.situation.knowledge;
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
        (false, ..) => format!("the changed model has no {} any more", reason::listed(&gone)),
        (_, false, _) => format!("the changed model describes {} anew", reason::listed(&anew)),
        (.., false) => format!("the changed model withdraws {}", reason::listed(&withdrawn)),
        _ => format!("the changed model does not serve this from {} any more", way.describe(old)),
    }
}
