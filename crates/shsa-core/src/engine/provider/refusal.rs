//! What a need would be served by if it demanded less, and what was left because its values fell short.

use super::super::message::{Event, EventKind, Output};
use super::super::ready_sources::ReadySources;
use super::super::reason;
use super::super::ways::{Lost, Source};
use super::inherit::Succession;
use super::{Given, MOST_NAMED, Provider, Ranked};
use crate::knowledge::{KnowledgeBase, Lineage};
use crate::monitor::{Monitor, WayIndex};
use crate::plan::Graph;
use crate::service::Service;
use crate::substitution::Way;
use crate::time::{Span, Time};
use alloc::collections::VecDeque;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;

/// So many refusals are remembered, so that each is told once.
const MOST_TOLD: usize = 256;

/// How often the wait before a source that fell short is used again doubles at most.
const MOST_DOUBLINGS: u32 = 6;

/// Sources that were refused, each with the reason in words.
#[derive(Debug, Default)]
pub(super) struct Refusals {
    told: Vec<(Way, String)>,
    open: Vec<(Way, String)>,
}

impl Refusals {
    /// What was told before a change of the model need not be told again where it is the same.
    pub(super) fn inherit(&mut self, old: &Refusals, lineage: &Lineage) {
        let same = |(way, reason): &(Way, String)| Some((way.succeeded(lineage)?, reason.clone()));
        self.told = old.told.iter().filter_map(same).collect();
    }

    /// After a restart nothing is news that was true before.
    pub(super) fn take_as_told(&mut self) {
        self.told.append(&mut self.open);
    }
}

/// A source whose values fell short.
#[derive(Clone, Debug)]
pub(super) struct Short {
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
    pub(super) fn inherit(&self, change: &Succession<'_>) -> Option<Short> {
        let index = self.index.and_then(|index| change.inheritance.way(index));
        Some(Short { way: self.way.succeeded(change.lineage)?, index, ..self.clone() })
    }
}

impl Provider {
    /// Notes what would serve the need rather than what may, if it demanded less.
    pub(super) fn note_refused(
        &mut self,
        knowledge: &KnowledgeBase,
        graph: &Graph,
        ready_sources: &ReadySources,
        lost: &Lost,
    ) {
        let Refusals { told, open } = &mut self.refusals;
        for (way, shortfalls) in ready_sources.refused(knowledge, graph, self.need, lost) {
            let reasons = shortfalls.iter().map(|shortfall| shortfall.describe(knowledge));
            let refused = (way, reasons.collect::<Vec<_>>().join(", "));
            if told.len() + open.len() < MOST_TOLD && !told.contains(&refused) && !open.contains(&refused) {
                open.push(refused);
            }
        }
    }

    /// Whether something was refused since the last time that it was told.
    #[inline]
    pub(super) fn has_refused(&self) -> bool {
        !self.refusals.open.is_empty()
    }

    /// Tells what was refused since the last time.
    pub(super) fn tell_refused(&mut self, knowledge: &KnowledgeBase, now: Time) -> Option<Event> {
        if self.refusals.open.is_empty() {
            return None;
        }
        let open = core::mem::take(&mut self.refusals.open);
        let named = |(way, reason): &(Way, String)| format!("{}: {reason}", way.describe(knowledge));
        let mut named: Vec<String> = open.iter().take(MOST_NAMED).map(named).collect();
        if open.len() > MOST_NAMED {
            named.push(format!("and {} more", open.len() - MOST_NAMED));
        }
        self.refusals.told.extend(open);
        let because = format!("the need demands more than these give: {}", named.join("; "));
        Some(self.event(knowledge, EventKind::Refused, because, now))
    }

    /// The next value of the source; where it falls short of what the need demands and another one does not, that of the other
    /// one.
    pub(super) fn given(
        &mut self,
        knowledge: &KnowledgeBase,
        monitor: &Monitor,
        now: Time,
        outputs: &mut VecDeque<Output>,
    ) -> Option<Given> {
        let last = self.last.map(|(_, sample)| sample);
        let given = self.computed(monitor.ports(), last, outputs)?;
        self.pace.step(now);
        if self.meets(&given, now) {
            self.unfit_since = None;
            return Some(given);
        }
        let left = self.leave_unfit(knowledge, monitor, &given, now);
        if left.is_none() {
            self.unfit_since = self.unfit_since.or(Some(now));
            return Some(given);
        }
        super::tell(outputs, left);
        let given = self.computed(monitor.ports(), last, outputs)?;
        let is_fit = self.meets(&given, now);
        self.unfit_since = if is_fit { None } else { Some(now) };
        Some(given)
    }

    /// Whether a value of any shape is as new and as narrow as the need asks.
    fn meets(&self, (value, validity): &Given, now: Time) -> bool {
        now - validity.to <= self.max_age && super::width(value) <= self.max_width
    }

    /// Whether the values of a source fell short of late.
    pub(super) fn is_short(&self, way: &Way, now: Time) -> bool {
        self.short.iter().any(|short| short.way == *way && now - short.last < short.wait)
    }

    /// Sees whether what was left because its values fell short still does.
    pub(super) fn follow_short(&mut self, monitor: &Monitor, now: Time) {
        let mut short = core::mem::take(&mut self.short);
        for known in &mut short {
            let watched = known.index.and_then(|index| monitor.way(index));
            let falls_short = watched.and_then(|way| way.outputs.newest(0)).is_some_and(|newest| {
                now - newest.validity.to <= self.max_age && newest.value.width() > self.max_width
            });
            if falls_short {
                known.last = now;
            }
        }
        self.short = short;
    }

    /// Leaves a source whose value is too wide, or not for the first time too old, for one whose newest value is fit.
    pub(super) fn leave_unfit(
        &mut self,
        knowledge: &KnowledgeBase,
        monitor: &Monitor,
        computed: &Given,
        now: Time,
    ) -> Option<Event> {
        let (value, validity) = computed;
        let width = super::width(value);
        let age = now - validity.to;
        let is_first = self.unfit_since.is_none();
        if self.forced.is_some() || (is_first && width <= self.max_width) {
            return None;
        }
        // In the place of the last ranks: while nothing better is there, this is done with every value.
        self.rank(knowledge, monitor, Some(now));
        let next = self.fittest(monitor, now, true)?;
        let current = self.active.as_ref().map(|service| service.way().clone())?;
        self.remember_short(monitor, &current, now);
        let owed = self.last.map(|(_, sample)| sample.validity.to);
        let service = Service::start(knowledge, next, monitor.ports(), owed)?;
        self.take_over(knowledge, Some(service));
        self.switched = Some(now);
        let amount = |amount: f64| reason::difference(knowledge, self.variable, amount);
        let shortfall = match width > self.max_width {
            true => format!("{} wide, more than {}", amount(width), amount(self.max_width)),
            false => format!("{} old, more than {}", reason::span(age), reason::span(self.max_age)),
        };
        let left = current.describe(knowledge);
        let because = format!("values of {left} are {shortfall}; {}", self.alternatives(knowledge));
        Some(self.event(knowledge, EventKind::Substituted, because, now))
    }

    fn remember_short(&mut self, monitor: &Monitor, way: &Way, now: Time) {
        let usual = self.switching.probation.max(self.switching.hold);
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

    /// The best source whose newest value is fit, another one than that in use where it must be; of those that are not watched,
    /// nothing is known.
    pub(super) fn fittest(&self, monitor: &Monitor, now: Time, another: bool) -> Option<Way> {
        let current = self.active.as_ref().filter(|_| another).map(Service::way);
        let fits = |(source, _): &(&Source, &Ranked)| {
            current != Some(&source.way)
                && !self.is_short(&source.way, now)
                && self.delivers(monitor, &source.way, now)
        };
        self.ranked().find(fits).map(|(source, _)| source.way.clone())
    }
}
