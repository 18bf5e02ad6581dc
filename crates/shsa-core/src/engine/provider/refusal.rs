//! Sources that the demands of a need refuse, and sources left because their values fell short.

use super::super::ready_sources::ReadySources;
use super::super::ways::Lost;
use super::settings::Settings;
use super::situation::Succession;
use super::sources::MOST_NAMED;
use crate::knowledge::{KnowledgeBase, NeedId};
use crate::monitor::{Monitor, WayIndex};
use crate::numbers::DOUBLINGS;
use crate::plan::Graph;
use crate::reason::{Joint, Reason, Reasons};
use crate::substitution::Way;
use crate::time::{Span, Time};
use alloc::vec::Vec;

/// At most this many refusals are remembered, so that each is reported once.
const MOST_REPORTED: usize = 256;

/// Refused sources, each with its shortfalls, and sources whose values fell short.
#[derive(Debug, Default)]
pub(super) struct Refusals {
    reported: Vec<Refused>,
    open: Vec<Refused>,
    short: Vec<Short>,
}

/// A refused source, and its shortfalls.
type Refused = (Way, Vec<Reason>);

/// A source whose values fell short.
#[derive(Clone, Debug)]
struct Short {
    way: Way,
    /// The index of the source's way, where the way is watched.
    index: Option<WayIndex>,
    /// When a value of the source last fell short.
    last: Time,
    /// How long no value must fall short before the source is used again.
    wait: Span,
    doublings: u32,
}

impl Short {
    /// The same record after a change of the model; `None` where the source is gone.
    fn inherit(&self, change: &Succession<'_>) -> Option<Short> {
        let index = self.index.and_then(|index| change.inheritance.way(index));
        Some(Short { way: self.way.succeeded(change.lineage)?, index, ..self.clone() })
    }
}

impl Refusals {
    /// Goes on after a change of the model: an unchanged refusal is not reported again, and sources that fell short are still
    /// left aside.
    pub(super) fn inherit(&mut self, old: &Refusals, change: &Succession<'_>) {
        let same = |(way, reasons): &Refused| Some((way.succeeded(change.lineage)?, reasons.clone()));
        self.reported = old.reported.iter().filter_map(same).collect();
        self.short = old.short.iter().filter_map(|short| short.inherit(change)).collect();
    }

    /// Marks the open refusals as reported: after a restart they are no news.
    pub(super) fn take_as_reported(&mut self) {
        self.reported.append(&mut self.open);
    }

    /// Notes the sources better than the allowed ones that the need's demands refuse.
    pub(super) fn note(
        &mut self,
        knowledge: &KnowledgeBase,
        graph: &Graph,
        ready_sources: &ReadySources,
        need: NeedId,
        lost: &Lost,
    ) {
        let Refusals { reported, open, .. } = self;
        for (way, shortfalls) in ready_sources.refused(knowledge, graph, need, lost) {
            let reasons = shortfalls.iter().map(|shortfall| shortfall.reason(knowledge));
            let refused = (way, reasons.collect());
            if reported.len() + open.len() < MOST_REPORTED
                && !reported.contains(&refused)
                && !open.contains(&refused)
            {
                open.push(refused);
            }
        }
    }

    /// Whether there are refusals that no event has reported.
    #[inline]
    pub(super) fn is_open(&self) -> bool {
        !self.open.is_empty()
    }

    /// The reasons for the refusals that no event has reported.
    pub(super) fn report(&mut self, knowledge: &KnowledgeBase) -> Reasons {
        let open = core::mem::take(&mut self.open);
        let mut because = Reasons::from(Reason::DemandsMore);
        let mut joint = Joint::Namely;
        for (way, reasons) in open.iter().take(MOST_NAMED) {
            because = because.then(joint, short(knowledge, way, reasons));
            joint = Joint::Next;
        }
        if open.len() > MOST_NAMED {
            let count = (open.len() - MOST_NAMED) as u64;
            because = because.then(Joint::Next, Reason::MoreSources { count });
        }
        self.reported.extend(open);
        because
    }

    /// Whether values of a source fell short within its wait.
    pub(super) fn is_short(&self, way: &Way, now: Time) -> bool {
        self.short.iter().any(|short| short.way == *way && now - short.last < short.wait)
    }

    /// Notes the sources left aside whose values still fall short.
    #[inline]
    pub(super) fn follow(&mut self, settings: &Settings, monitor: &Monitor, now: Time) {
        for known in &mut self.short {
            let watched = known.index.and_then(|index| monitor.way(index));
            let newest = watched.and_then(|way| Some((way, way.outputs.newest(0)?)));
            let falls_short = newest.is_some_and(|(way, newest)| {
                let stated = settings.stated(*newest, way.computation.timing()).value;
                let is_short = stated.is_empty() || stated.width() > settings.max_width;
                is_short && now - newest.validity.to <= settings.max_age
            });
            if falls_short {
                known.last = now;
            }
        }
    }

    /// Remembers a source that is left because its values fall short.
    pub(super) fn remember(&mut self, settings: &Settings, monitor: &Monitor, way: &Way, now: Time) {
        let usual = settings.switching.probation.max(settings.switching.hold);
        if let Some(known) = self.short.iter_mut().find(|short| short.way == *way) {
            if now - known.last >= known.wait {
                known.doublings = (known.doublings + 1).min(DOUBLINGS);
                known.wait = usual.times(1 << known.doublings);
            }
            known.last = now;
            return;
        }
        self.short.retain(|short| now - short.last < short.wait.times(4));
        let index = monitor.find(way);
        self.short.push(Short { way: way.clone(), index, last: now, wait: usual, doublings: 0 });
    }
}

/// A source with its shortfalls, as reasons.
fn short(knowledge: &KnowledgeBase, way: &Way, reasons: &[Reason]) -> Reasons {
    let mut short = Reasons::from(Reason::ShortSource { source: way.describe(knowledge) });
    let mut joint = Joint::Namely;
    for reason in reasons {
        short = short.then(joint, reason.clone());
        joint = Joint::Also;
    }
    short
}
