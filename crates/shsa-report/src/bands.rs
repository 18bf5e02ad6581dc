//! The values of ways and the disagreements of pairs while an engine runs; each call returns what is new.

use core::ops::{Bound, RangeBounds};
use shsa_core::alignment::Sample;
use shsa_core::engine::Engine;
use shsa_core::knowledge::{KnowledgeBase, SignalId};
use shsa_core::monitor::WayIndex;
use shsa_core::substitution::Way;
use shsa_core::time::{Span, Time, Validity};

/// The source of a band's values.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum BandSource {
    Way(WayIndex, Way),
    /// The values of a signal that is compared with nothing.
    Signal(SignalId),
}

impl BandSource {
    /// Passes on its values from a moment on, or after it, until `to`, oldest first.
    pub(crate) fn news(&self, engine: &Engine, from: Bound<Time>, to: Time, mut take: impl FnMut(Sample)) {
        let is_new = |sample: &Sample| {
            let time = sample.validity.to;
            (from, Bound::Included(to)).contains(&time)
        };
        let is_late = |sample: &&Sample| (from, Bound::Unbounded).contains(&sample.validity.to);
        match self {
            BandSource::Way(index, _) => {
                let Some(way) = engine.monitor().way(*index) else { return };
                let newest = || way.outputs.newest_first().take_while(is_late);
                let known = newest().count();
                for back in (0..known).rev() {
                    way.outputs.newest(back).copied().filter(is_new).into_iter().for_each(&mut take);
                }
            }
            BandSource::Signal(signal) => {
                let newest = engine.monitor().ports().find(*signal).and_then(|port| port.newest());
                newest.copied().filter(is_new).into_iter().for_each(take);
            }
        }
    }

    /// The name for a legend.
    pub(crate) fn name(&self, knowledge: &KnowledgeBase) -> String {
        match self {
            BandSource::Way(_, way) => way.describe(knowledge),
            BandSource::Signal(signal) => knowledge.signals()[*signal].name.clone(),
        }
    }
}

/// A pair that is watched for disagreements.
pub(crate) struct Watched {
    /// The index of the monitor's pair.
    pub(crate) pair: usize,
    /// The last known disagreement.
    pub(crate) last: Option<Time>,
}

impl Watched {
    /// The stretch of a new disagreement.
    pub(crate) fn look(&mut self, engine: &Engine) -> Option<Validity> {
        let pair = engine.monitor().residuals().get(self.pair)?;
        let last = pair.disagreement?.time;
        if self.last.replace(last).is_some_and(|before| before == last) {
            return None;
        }
        let outputs = &engine.monitor().way(pair.way)?.outputs;
        let newest = outputs.newest(0)?.validity;
        let spacing = outputs.newest(1).map_or(Span::ZERO, |before| newest.to - before.validity.to);
        // Half a step to both sides, and a little more, so that disagreements of successive steps form one stretch.
        let half = Span(spacing.0 / 2 + spacing.0 / 8);
        // The position of the value in its band.
        let middle = newest.from + Span(newest.length().0 / 2);
        Some(Validity { from: middle - half, to: middle + half })
    }
}

/// Stretches of time in ascending order; joins those with a gap of at most `slack`.
pub(crate) fn joined(mut all: Vec<Validity>, slack: Span) -> Vec<Validity> {
    all.sort_by_key(|each| (each.from, each.to));
    let mut merged: Vec<Validity> = Vec::new();
    for next in all {
        match merged.last_mut().filter(|last| next.from <= last.to + slack) {
            Some(last) => last.to = last.to.max(next.to),
            None => merged.push(next),
        }
    }
    merged
}
