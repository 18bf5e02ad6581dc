//! Another way fills in for a moment: when the source is late, or what it says is contradicted.

use super::{Provider, Server};
use crate::alignment::Sample;
use crate::knowledge::KnowledgeBase;
use crate::monitor::{Monitor, WatchedWay, WayIndex};
use crate::time::{Span, Time};

/// How many mean deviations from its mean the time between two values may be.
const DEVIATIONS: i64 = 4;

/// How regularly a source gives values: the running mean of the time between two, and its mean deviation, as TCP knows when to
/// send a segment again (V. Jacobson, Congestion avoidance and control, 1988, doi:10.1145/52324.52356; RFC 6298).
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pace {
    last: Option<Time>,
    mean: Option<Span>,
    deviation: Span,
}

impl Pace {
    /// The source has given a value now.
    pub(super) fn step(&mut self, now: Time) {
        let Some(last) = self.last.replace(now) else { return };
        let gap = now - last;
        match &mut self.mean {
            None => {
                self.mean = Some(gap);
                self.deviation = Span(gap.0 / 2);
            }
            Some(mean) => {
                // One long silence does not make a source that is waited for longer; a slower one it becomes all the same.
                let gap = gap.0.min(mean.0.saturating_mul(3));
                let off = gap - mean.0;
                mean.0 += off / 8;
                self.deviation.0 += (off.abs() - self.deviation.0) / 4;
            }
        }
    }

    /// How long after a value the next one is late: three quarters of a mean gap more than the mean, so that nobody waits for
    /// two, or what its jitter asks for.
    fn patience(&self) -> Option<Span> {
        let Span(mean) = self.mean?;
        let jitter = self.deviation.0.saturating_mul(DEVIATIONS);
        Some(Span(mean.saturating_add(mean.saturating_sub(mean / 4).max(jitter))))
    }
}

impl Provider {
    /// From when on another way shall fill in because nothing comes: when the source is late by its own pace, at the latest
    /// when half of the time is over that a value may be old; and not more often than the source would speak.
    pub(super) fn late_after(&self) -> Option<Time> {
        let most = Span(self.max_age.0 / 2);
        let patience = self.pace.patience().map_or(most, |patience| patience.min(most));
        let rest = self.pace.mean.map_or(most, |mean| Span(mean.0 / 2).min(most));
        let served = self.last_served()?;
        Some((self.pace.last.unwrap_or(served) + patience).max(served + rest))
    }

    /// Whether another way shall fill in now because nothing has come.
    pub(super) fn is_late(&self, now: Time) -> bool {
        self.late_after().is_some_and(|late| now > late)
    }

    /// What another trusted way gives at this moment, or has given since the last value that went out, when it is not
    /// contradicted itself: the best proven one.
    pub(super) fn stand_in(
        &mut self,
        knowledge: &KnowledgeBase,
        monitor: &Monitor,
        trusts: impl Fn(&WatchedWay) -> bool + Copy,
        (now, is_late): (Time, bool),
    ) -> Option<(Sample, Server)> {
        if self.forced.is_some() {
            return None;
        }
        if !matches!(self.server, Some(Server::StandIn(_))) {
            self.rank(knowledge, monitor, Some(now));
        }
        let usable = |index: WayIndex| {
            let way = monitor.way(index)?;
            let sample = self.news(monitor, index, way)?;
            let usable = trusts(way) && way.rests_on != self.active_rests_on && self.is_fit(&sample, now);
            let votes = usable.then(|| monitor.votes(self.variable, &way.rests_on, sample, trusts))?;
            (!votes.is_contradicted()).then_some((sample, Server::StandIn(index), votes.is_doubted()))
        };
        // What is only doubted is taken where there is nothing else: not in the place of a value that is doubted itself.
        let mut doubted = None;
        for (source, _) in self.ranked() {
            match monitor.find(&source.way).and_then(usable) {
                Some((sample, server, false)) => return Some((sample, server)),
                Some((sample, server, true)) if is_late => doubted = doubted.or(Some((sample, server))),
                _ => {}
            }
        }
        doubted
    }

    /// What a way says that has not been known when the last value went out.
    fn news(&self, monitor: &Monitor, index: WayIndex, way: &WatchedWay) -> Option<Sample> {
        let fresh = monitor.fresh().find(|(fresh, _)| *fresh == index);
        let is_newer =
            |sample: &Sample| self.last.is_none_or(|(_, last)| sample.validity.to > last.validity.to);
        let newest = || way.outputs.newest(0).filter(|sample| is_newer(sample));
        fresh.map(|(_, sample)| sample).or_else(|| newest().copied())
    }
}
