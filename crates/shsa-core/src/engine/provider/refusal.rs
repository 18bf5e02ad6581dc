//! What a need would be served by if it demanded less, and what was left because its values fell short.

use super::super::ready_sources::ReadySources;
use super::super::ways::Lost;
use super::settings::Settings;
use super::situation::Succession;
use super::sources::MOST_NAMED;
use crate::knowledge::{KnowledgeBase, NeedId};
use crate::monitor::{Monitor, WayIndex};
use crate::plan::Graph;
use crate::reason::{Joint, Reason, Reasons};
use crate::substitution::Way;
use crate::time::{Span, Time};
use alloc::vec::Vec;

/// So many refusals are remembered, so that each is told once.
const MOST_TOLD: usize = 256;

/// How often the wait before a source that fell short is used again doubles at most.
const MOST_DOUBLINGS: u32 = 6;

/// Sources that were refused, each with how it falls short, and those whose values fell short.
#[derive(Debug, Default)]
pub(super) struct Refusals {
    told: Vec<Refused>,
    open: Vec<Refused>,
    short: Vec<Short>,
}

/// A source that was refused, and how it falls short.
type Refused = (Way, Vec<Reason>);

/// A source whose values fell short.
#[derive(Clone, Debug)]
struct Short {
    way: Way,
    /// Where it is watched.
    index: Option<WayIndex>,
    /// When a value of it fell short last.
    last: Time,
    /// How long none must before it is used again.
    wait: Span,
    doublings: u32,
}

impl Short {
    /// The same after a change of the model; `None` where the source is gone.
    fn inherit(&self, change: &Succession<'_>) -> Option<Short> {
        let index = self.index.and_then(|index| change.inheritance.way(index));
        Some(Short { way: self.way.succeeded(change.lineage)?, index, ..self.clone() })
    }
}

impl Refusals {
    /// Goes on after a change of the model: a refusal that is still the same is not told again, and a source whose values fell
    /// short is still left aside.
    pub(super) fn inherit(&mut self, old: &Refusals, change: &Succession<'_>) {
        let same = |(way, reasons): &Refused| Some((way.succeeded(change.lineage)?, reasons.clone()));
        self.told = old.told.iter().filter_map(same).collect();
        self.short = old.short.iter().filter_map(|short| short.inherit(change)).collect();
    }

    /// After a restart nothing is news that was true before.
    pub(super) fn take_as_told(&mut self) {
        self.told.append(&mut self.open);
    }

    /// Notes what would serve a need rather than what may, if it demanded less.
    pub(super) fn note(
        &mut self,
        knowledge: &KnowledgeBase,
        graph: &Graph,
        ready_sources: &ReadySources,
        need: NeedId,
        lost: &Lost,
    ) {
        let Refusals { told, open, .. } = self;
        for (way, shortfalls) in ready_sources.refused(knowledge, graph, need, lost) {
            let reasons = shortfalls.iter().map(|shortfall| shortfall.reason(knowledge));
            let refused = (way, reasons.collect());
            if told.len() + open.len() < MOST_TOLD && !told.contains(&refused) && !open.contains(&refused) {
                open.push(refused);
            }
        }
    }

    /// Whether something was refused since the last time that it was told.
    #[inline]
    pub(super) fn is_open(&self) -> bool {
        !self.open.is_empty()
    }

    /// What was refused since the last time.
    pub(super) fn tell(&mut self, knowledge: &KnowledgeBase) -> Reasons {
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
        self.told.extend(open);
        because
    }

    /// Whether the values of a source fell short of late.
    pub(super) fn is_short(&self, way: &Way, now: Time) -> bool {
        self.short.iter().any(|short| short.way == *way && now - short.last < short.wait)
    }

    /// Sees whether what was left because its values fell short still does.
    #[inline]
    pub(super) fn follow(&mut self, settings: &Settings, monitor: &Monitor, now: Time) {
        for known in &mut self.short {
            let watched = known.index.and_then(|index| monitor.way(index));
            let falls_short = watched.and_then(|way| way.outputs.newest(0)).is_some_and(|newest| {
                now - newest.validity.to <= settings.max_age && newest.value.width() > settings.max_width
            });
            if falls_short {
                known.last = now;
            }
        }
    }

    /// A source is left because its values fall short.
    pub(super) fn remember(&mut self, settings: &Settings, monitor: &Monitor, way: &Way, now: Time) {
        let usual = settings.switching.probation.max(settings.switching.hold);
        if let Some(known) = self.short.iter_mut().find(|short| short.way == *way) {
            if now - known.last >= known.wait {
                known.doublings = (known.doublings + 1).min(MOST_DOUBLINGS);
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

/// A source with how it falls short.
fn short(knowledge: &KnowledgeBase, way: &Way, reasons: &[Reason]) -> Reasons {
    let mut short = Reasons::from(Reason::ShortSource { source: way.describe(knowledge) });
    let mut joint = Joint::Namely;
    for reason in reasons {
        short = short.then(joint, reason.clone());
        joint = Joint::Also;
    }
    short
}
