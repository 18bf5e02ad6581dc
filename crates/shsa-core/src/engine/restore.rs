//! A new engine continues from the snapshot of an earlier one, in which everything has its name.
//!
//! A new engine has no evidence, and the absence of evidence is no reason to trust a failed component. So verdicts, silences,
//! orders and sources continue. An accusation ends by evidence that the new engine has gathered itself, never by a restart.

use super::Engine;
use super::message::Output;
use super::operator::find_need;
use super::provider::Resumption;
use super::snapshot::{Compared, Missing, Published, Remembered, Served, Snapshot, Trending};
use crate::alignment::Sample;
use crate::interval::Interval;
use crate::knowledge::NeedId;
use crate::monitor::{Absence, Residual, WatchedWay, WayIndex};
use crate::order::Subject;
use crate::reason::Reason;
use crate::time::{Span, Time};
use crate::trust::{Component, Record};
use alloc::collections::BTreeMap;
use alloc::vec::Vec;

/// The ways of each comparison, by their names.
type AllCompared = BTreeMap<Compared, (WayIndex, WayIndex)>;

impl Engine {
    /// The state that must outlast the process. O(signals + pairs + accusations so far); allocates.
    #[must_use]
    pub fn snapshot(&self) -> Snapshot {
        let subject = |component| Subject::of(&self.knowledge, component);
        let verdicts =
            self.ledger.standings().filter(|(_, it)| is_worth(&it.record())).map(|(component, standing)| {
                let mut record = standing.record();
                // The snapshot has no readings from before the jump, so a return cannot be recognised later.
                record.contradicted |= record.failed_by_detector && !self.has_returned(component);
                let accusation = standing.accused().and_then(|it| it.reported.clone());
                let conflicts = standing.accused().into_iter().flat_map(|it| &it.conflicts);
                let conflicts = conflicts.filter_map(|(way, other)| self.compared(*way, *other)).collect();
                Remembered { subject: subject(component), record, accusation, conflicts }
            });
        let missing = self.knowledge.signals().enumerate().filter_map(|(id, signal)| {
            let absence = self.absence(id);
            let is_missing = absence.is_some() || self.ledger.is_returning(id);
            is_missing.then(|| Missing { signal: signal.name.clone(), absence })
        });
        let confirmed = self.knowledge.signals().enumerate();
        let confirmed = confirmed.filter(|(id, _)| self.monitor.is_confirmed(*id) == Some(true));
        Snapshot {
            time: self.now.unwrap_or_default(),
            verdicts: verdicts.collect(),
            absences: missing.collect(),
            trends: self.monitor.residuals().iter().filter_map(|pair| self.trending(pair)).collect(),
            orders: self.standing_orders(),
            needs: self.providers.ids().map(|need| self.served(need)).collect(),
            learned: self.recollections(),
            confirmed: confirmed.map(|(_, signal)| signal.name.clone()).collect(),
        }
    }

    fn has_returned(&self, component: Component) -> bool {
        !matches!(component, Component::Signal(signal) if !self.monitor.ports()[signal].has_returned())
    }

    fn trending(&self, pair: &Residual) -> Option<Trending> {
        let record = pair.trend.to_record()?;
        Some(Trending { compared: self.compared(pair.way, pair.other)?, record, moved: pair.moved() })
    }

    fn compared(&self, way: WayIndex, other: WayIndex) -> Option<Compared> {
        let (way, other) = (self.monitor.way(way)?, self.monitor.way(other)?);
        let words = |way: &WatchedWay| way.computation.way().describe(&self.knowledge);
        let variable = self.knowledge.variables()[way.variable()].name.clone();
        Some(Compared { variable, way: words(way), other: words(other) })
    }

    fn served(&self, need: NeedId) -> Served {
        let provider = &self.providers[need];
        let published = |(time, sample): (Time, Sample)| {
            let Sample { validity, value } = sample;
            value.is_bounded().then_some(Published { time, validity, value })
        };
        Served {
            need: self.knowledge.needs()[need].signal.clone(),
            source: provider.active().map(|service| service.way().describe(&self.knowledge)),
            switched: provider.switched(),
            unserved: provider.is_unserved(),
            last: provider.last().and_then(published),
        }
    }

    /// Restores the state from before a restart, or a part of another engine's, about which there is no evidence here; the state of a
    /// whole run must come before any input. [`Refused`](super::EventKind::Refused) reports
    /// the names that this knowledge base does not have. Where a need's source may not be used any more, another one serves it,
    /// and an event reports that, too.
    ///
    /// An accusation stands until new evidence has supported the accused for its probation. A silent signal stays silent until it
    /// gives a value, and a signal that had just returned begins its probation again. Times after `at` (the clock was set back)
    /// count as `at`.
    pub fn restore(&mut self, snapshot: &Snapshot, at: Time) {
        self.advance(at);
        if self.waiting {
            self.settle();
        }
        let now = self.now.unwrap_or(at);
        let compared = self.all_compared(snapshot);
        snapshot.verdicts.iter().for_each(|verdict| self.recall(verdict, &compared, now));
        snapshot.absences.iter().for_each(|missing| self.miss(missing, now));
        let confirmed = snapshot.confirmed.iter().filter_map(|name| self.knowledge.signal(name));
        confirmed.for_each(|signal| self.monitor.confirm(signal));
        self.recall_trends(&snapshot.trends, &compared, now);
        self.recollect(&snapshot.learned, now);
        self.keep_orders(&snapshot.orders, (now - snapshot.time).max(Span::ZERO), now);
        let mut served: Vec<(NeedId, &Served)> = Vec::new();
        for need in &snapshot.needs {
            match find_need(&self.knowledge, &need.need) {
                Ok(id) => served.push((id, need)),
                Err(refusal) => {
                    self.refuse(Reason::ServedForgotten { need: need.need.clone() }, refusal, now);
                }
            }
        }
        let (providers, outputs, situation) = self.situation(now, None);
        for (need, served) in served {
            let event = providers[need].resume(&resumption(served, now), &situation);
            outputs.extend(event.map(Output::Event));
        }
        // New needs, and those whose source is no longer among the candidates.
        self.replan(now, None);
        self.settle_after(true);
    }

    fn recall(&mut self, remembered: &Remembered, compared: &AllCompared, now: Time) {
        let Remembered { subject, record, accusation, conflicts } = remembered;
        match subject.find(&self.knowledge) {
            Ok(component @ (Component::Signal(_) | Component::Relation(_))) => {
                let cleared = record.cleared.map(|at| at.min(now));
                self.ledger.recall(component, Record { cleared, ..*record });
                let conflicts = conflicts.iter().filter_map(|it| compared.get(it).copied());
                self.ledger.recall_conflicts(component, conflicts.collect());
                if let Some(accusation) = accusation {
                    self.ledger.note_report(component, accusation.clone());
                }
            }
            Ok(Component::Cause(_)) => {}
            Err(_) if record.verdict.is_none() => {}
            Err(refusal) => {
                self.refuse(Reason::AccusationForgotten { subject: subject.clone() }, refusal, now);
            }
        }
    }

    /// The comparisons that are made, by their names; those of a snapshot without any need no names. O(pairs).
    fn all_compared(&self, snapshot: &Snapshot) -> AllCompared {
        if snapshot.trends.is_empty() && snapshot.verdicts.iter().all(|it| it.conflicts.is_empty()) {
            return AllCompared::new();
        }
        let pairs = self.monitor.residuals().iter().map(|pair| (pair.way, pair.other));
        pairs.filter_map(|pair| Some((self.compared(pair.0, pair.1)?, pair))).collect()
    }

    /// Ways that are no longer observed, or compared in the other order, begin anew.
    fn recall_trends(&mut self, trends: &[Trending], compared: &AllCompared, now: Time) {
        let pair = |it: &Trending| Some((*compared.get(&it.compared)?, (it.record, it.moved)));
        let found: BTreeMap<_, _> = trends.iter().filter_map(pair).collect();
        self.monitor.recall_trends(&found, now);
    }

    fn miss(&mut self, missing: &Missing, now: Time) {
        // Nothing depends on a signal that is not in the knowledge base any more.
        let Some(signal) = self.knowledge.signal(&missing.signal) else { return };
        match missing.absence {
            // Without a timeout, nothing would end the silence.
            Some(Absence::Silent) if self.knowledge.signals()[signal].timeout.is_none() => {}
            Some(absence) => self.monitor.expect_absent(signal, absence),
            None => self.ledger.come_back(signal, now, false),
        }
    }
}

/// Whether the record has a verdict, or may become a relapse.
fn is_worth(record: &Record) -> bool {
    record.verdict.is_some() || record.cleared.is_some()
}

fn resumption(served: &Served, now: Time) -> Resumption<'_> {
    let last = |published: Published| {
        let Published { time, validity, value } = published;
        (time.min(now), Sample { validity, value })
    };
    Resumption {
        source: served.source.as_deref(),
        switched: served.switched.map(|at| at.min(now)),
        unserved: served.unserved,
        last: served.last.filter(|published| is_number(published.value)).map(last),
    }
}

fn is_number(value: Interval) -> bool {
    value.is_bounded() && !value.is_empty()
}
