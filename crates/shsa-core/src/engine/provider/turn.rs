//! Whose turn it is: one server at a time gives the values of a need, each under its own name, and stamps never go back.
//!
//! Where one server follows another, the stamps of the two values are at least half of the faster one's period apart, as stamps of
//! sources out of phase are at an average: a value from closer to the last one tells nothing new. It waits, and goes out where no
//! newer one follows, or the need is about to be overdue.

use super::settings::Given;
use super::{Provider, Server};
use crate::alignment::Sample;
use crate::computation::{Computation, Timing};
use crate::knowledge::KnowledgeBase;
use crate::monitor::{Monitor, WatchedWay, WayIndex};
use crate::numbers::MISSED_PERIODS;
use crate::reason::ServedBy;
use crate::substitution::Way;
use crate::time::{Span, Time, Validity};
use alloc::sync::Arc;

/// A server with the usual time between its values, zero where that is unknown or its values stand, and how its values relate to
/// time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turn {
    pub(super) server: Server,
    pub(super) period: Span,
    pub(super) timing: Timing,
}

/// What the values of the present servers are called. Names are made once: values share them.
#[derive(Debug, Default)]
pub(super) struct Names {
    own: Option<Arc<ServedBy>>,
    stand_in: Option<(WayIndex, Arc<ServedBy>)>,
}

impl Names {
    /// The source is another one.
    pub(super) fn forget(&mut self) {
        *self = Names::default();
    }
}

/// The declared time between the values of a way; zero where nothing is declared or its values stand.
pub(super) fn period_of(knowledge: &KnowledgeBase, computation: &Computation) -> Span {
    let period = computation.trigger().and_then(|trigger| knowledge.signals()[trigger].period());
    period.filter(|_| !computation.stands(knowledge)).unwrap_or(Span::ZERO)
}

fn named(knowledge: &KnowledgeBase, way: &Way) -> Arc<ServedBy> {
    Arc::new(ServedBy::Way(way.describe(knowledge)))
}

/// Stands for a server that is gone; it gives no values.
fn unnamed() -> Arc<ServedBy> {
    Arc::new(ServedBy::LastTrusted)
}

impl Provider {
    /// The turn of the source.
    pub(super) fn own_turn(&self) -> Turn {
        let period = self.state.serving().map_or(Span::ZERO, |serving| serving.pace.declared());
        let timing = self.state.serving().map_or_else(Timing::default, |serving| serving.service.timing());
        Turn { server: Server::Active { since: self.switched }, period, timing }
    }

    /// The turn of another way.
    pub(super) fn turn_of(&self, knowledge: &KnowledgeBase, index: WayIndex, way: &WatchedWay) -> Turn {
        let (period, timing) = (period_of(knowledge, &way.computation), way.computation.timing());
        Turn { server: Server::StandIn(index), period, timing }
    }

    /// Whether a value may follow the last published one.
    pub(super) fn may_follow(&self, turn: Turn, validity: Validity, now: Time) -> bool {
        let Some((at, Sample { validity: last, .. })) = self.last else { return true };
        let last = last.centre();
        if validity.to < last {
            return false;
        }
        let goes_on = self.blend.server() == Some(turn.server) && turn.server != Server::Unsure;
        let least = || Span(turn.period.min(self.last_period).0 / 2);
        let is_apart = || self.following(validity).centre() - last >= least();
        goes_on || is_apart() || now - at > self.longest_turn(turn)
    }

    /// The value of the source that may follow the last published one: the one given now, or else the one that waits. A value that
    /// is too close to the last one waits for a newer one.
    pub(super) fn in_turn(&mut self, given: Option<Given>, now: Time) -> Option<Given> {
        let has_waited = given.is_none();
        let given = given.or_else(|| self.waiting.take())?;
        if self.may_follow(self.own_turn(), given.1, now) {
            self.waiting = None;
            let is_old = has_waited && now - given.1.to > self.settings.max_age;
            return Some(given).filter(|_| !is_old);
        }
        let is_newest = self.last.is_none_or(|(_, last)| given.1.to >= last.validity.centre());
        self.waiting = Some(given).filter(|_| is_newest);
        None
    }

    /// When a value that waits goes out.
    pub(super) fn next_turn(&self) -> Option<Time> {
        let (at, _) = self.last.filter(|_| self.waiting.is_some())?;
        Some(at + self.longest_turn(self.own_turn()) + Span(1))
    }

    /// How long after a value another server's value may be too close to it: until the need is about to be overdue; for a new source,
    /// until a newer value would have come.
    fn longest_turn(&self, turn: Turn) -> Span {
        let half_age = self.settings.half_age();
        match turn.server {
            Server::Active { .. } => turn.period.min(self.last_period).times(MISSED_PERIODS).min(half_age),
            Server::StandIn(_) | Server::Unsure => half_age,
        }
    }

    /// When a value was true, for readers who take the middle for its stamp. What is true of a window counts for its newer part
    /// after a value of a moment, until the middle of the window is later than that: at half of the pace, so that stamps advance.
    pub(super) fn following(&self, validity: Validity) -> Validity {
        let Some((_, Sample { validity: last, .. })) = self.last else { return validity };
        let advanced = last.centre() + Span((validity.to - last.to).0.max(0) / 2);
        match advanced.min(validity.to) {
            least if least > validity.centre() => {
                let half = validity.to - least;
                Validity { from: (least - half).max(validity.from), ..validity }
            }
            _ => validity,
        }
    }

    /// What the server of a value is called.
    pub(super) fn name_of(&mut self, knowledge: &KnowledgeBase, server: Server) -> Arc<ServedBy> {
        let name = match server {
            Server::Unsure => return self.state.unsure_mut().map_or_else(unnamed, |it| it.name(knowledge)),
            Server::Active { .. } => {
                let Some(way) = self.state.way() else { return unnamed() };
                self.names.own.get_or_insert_with(|| named(knowledge, way))
            }
            Server::StandIn(index) => match &self.names.stand_in {
                Some((known, name)) if *known == index => name,
                _ => return unnamed(),
            },
        };
        name.clone()
    }

    /// Names a stand-in before it is needed, with the first value of a source: what is named later is named once, too.
    pub(super) fn name_next(&mut self, knowledge: &KnowledgeBase, monitor: &Monitor) {
        if self.names.own.is_none() {
            let others = self.sources.ways().filter(|way| self.state.way() != Some(way));
            let next = others.filter_map(|way| monitor.find(way)).next();
            next.into_iter().for_each(|index| self.name_stand_in(knowledge, monitor, index));
        }
    }

    /// Notes what a stand-in is called, before its value goes out.
    pub(super) fn name_stand_in(&mut self, knowledge: &KnowledgeBase, monitor: &Monitor, index: WayIndex) {
        let is_known = self.names.stand_in.as_ref().is_some_and(|(known, _)| *known == index);
        if let Some(way) = monitor.way(index).filter(|_| !is_known) {
            self.names.stand_in = Some((index, named(knowledge, way.computation.way())));
        }
    }
}
