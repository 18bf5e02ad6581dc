//! What the other ways of knowing a variable say of one value, without debouncing; and outliers, single readings that they prove
//! wrong.
//!
//! One contradiction says that one of two is wrong. A reading that two others contradict, which agree with each other and rest on no
//! signal in common, is wrong itself, unless two are wrong at the same moment in the same way. One such reading is no fault of
//! its signal: that takes as many as [`Debounce`](super::Debounce) says.

use super::{Monitor, Residual, WatchedWay, WayIndex};
use crate::alignment::Sample;
use crate::interval::Interval;
use crate::knowledge::{SignalId, SignalSet, VariableId};
use crate::time::{Span, Time};

/// A single wrong reading of a signal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outlier {
    /// The signal.
    pub signal: SignalId,
    /// The reading, SI.
    pub sample: Sample,
    /// The ways that contradict it, and what they say, SI.
    pub against: [(WayIndex, Interval); 2],
}

impl Monitor {
    /// How many ways that rest on other signals contradict and support a value of a variable right now, without debouncing.
    #[inline]
    #[must_use]
    pub fn votes(
        &self,
        variable: VariableId,
        rests_on: &SignalSet,
        sample: Sample,
        trusted: impl Fn(&WatchedWay) -> bool,
    ) -> Votes {
        let mut votes = Votes::default();
        let of_variable = self.index.of_variable(variable).iter().filter_map(|&index| self.way(index));
        for way in of_variable.filter(|way| way.rests_on != *rests_on && trusted(way)) {
            let value = sample.value;
            let agrees = |(known, is_certain)| (way.in_turn(known, value).overlaps(value), is_certain);
            match way.vote(sample.validity).map(agrees) {
                Some((true, _)) => votes.supporting += 1,
                Some((false, true)) => votes.contradicting += 1,
                Some((false, false)) => votes.doubting += 1,
                None => {}
            }
        }
        votes
    }

    /// Whether a comparison with a signal has ever agreed; `None` where the model has none. O(pairs of the signal).
    #[must_use]
    pub fn is_confirmed(&self, signal: SignalId) -> Option<bool> {
        let is_range = |way: WayIndex| self.way(way).is_some_and(WatchedWay::is_range);
        let agreements =
            self.pairs_of(signal).filter(|pair| !is_range(pair.other)).map(|pair| pair.has_agreed);
        let found = agreements.reduce(|one, other| one || other)?;
        Some(found || self.confirmed.contains(signal))
    }

    /// Takes over that a comparison with a signal has agreed before.
    pub fn confirm(&mut self, signal: SignalId) {
        self.confirmed.insert(signal);
    }

    /// The outliers that first disagreements of this moment show, and that are not noted yet; one may come several times. O(restless pairs, and for each
    /// first disagreement the ways of its variable).
    pub fn outliers(&self, now: Time) -> impl Iterator<Item = Outlier> + '_ {
        let is_new = move |pair: &&Residual| {
            pair.window.is_first() && pair.disagreement.is_some_and(|last| last.time == now)
        };
        let ways = self.restless().filter(is_new).flat_map(|pair| [pair.way, pair.other]);
        ways.filter_map(|way| self.way(way)).flat_map(move |way| {
            // A comparison may have waited for the output after the moment compared.
            let latest = (0..2).filter_map(|back| way.outputs.newest(back));
            let outliers = latest.filter_map(move |sample| self.outlier(way, *sample));
            outliers.filter(|it| self.outliers[it.signal].is_new(it.sample.validity.to))
        })
    }

    /// Takes a proven outlier back as what later readings of its signal are measured by.
    pub fn refute(&mut self, outlier: &Outlier) {
        self.ports[outlier.signal].refute(outlier.sample.validity);
    }

    /// Notes that a signal had an outlier at a time; returns whether it is to be told: not too often.
    pub fn note_outlier(&mut self, signal: SignalId, at: Time) -> bool {
        self.outliers[signal].note(at)
    }

    /// A reading of a way that is a signal itself, where two others prove it wrong and none supports it.
    fn outlier(&self, way: &WatchedWay, sample: Sample) -> Option<Outlier> {
        let signal = way.computation.way().direct()?;
        let mut first: Option<(WayIndex, &WatchedWay, Interval)> = None;
        let mut against = None;
        for &index in self.index.of_variable(way.variable()) {
            let Some(other) = self.way(index).filter(|other| !other.rests_on.meets(&way.rests_on)) else {
                continue;
            };
            let Some(value) = said(other, sample) else { continue };
            // Where nothing bounds what the value does between samples, only as much again is a proof.
            let unknown =
                if other.course.is_rated() { 0.0 } else { 0.5 * (value.width() + sample.value.width()) };
            if value.distance(sample.value) <= unknown {
                return None;
            }
            match first {
                None => first = Some((index, other, value)),
                Some((before, its, one)) if !other.rests_on.meets(&its.rests_on) && one.overlaps(value) => {
                    against = against.or(Some([(before, one), (index, value)]));
                }
                Some(_) => {}
            }
        }
        against.map(|against| Outlier { signal, sample, against })
    }
}

/// So many outliers of a signal are told at once, and one more for each of these times: whoever reads them has seen what there is
/// to see.
const TOLD_AT_ONCE: i64 = 4;
const TOLD_EACH: Span = Span::from_millis(60_000);

/// The outliers of a signal that were told lately: a leaky bucket.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Told {
    last: Option<Time>,
    /// The time after `last` until which some count.
    level: Span,
}

impl Told {
    fn is_new(&self, at: Time) -> bool {
        self.last.is_none_or(|last| last < at)
    }

    fn note(&mut self, at: Time) -> bool {
        let since = self.last.replace(at).map_or(Span::MAX, |last| at - last);
        self.level = (self.level - since).max(Span::ZERO);
        let is_told = self.level <= TOLD_EACH.times(TOLD_AT_ONCE - 1);
        self.level = self.level + if is_told { TOLD_EACH } else { Span::ZERO };
        is_told
    }
}

/// What a way certainly says at the moment of a sample, in its turn.
fn said(way: &WatchedWay, sample: Sample) -> Option<Interval> {
    let (value, is_certain) = way.vote(sample.validity)?;
    is_certain.then(|| way.in_turn(value, sample.value))
}

/// The votes of the other ways on a value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Votes {
    /// Ways whose value overlaps the value.
    pub supporting: u32,
    /// Ways whose value does not overlap it.
    pub contradicting: u32,
    /// Ways whose recent values do not overlap it, while their value at that very moment is not known.
    pub doubting: u32,
}

impl Votes {
    /// Whether more ways contradict than support: the value must not be used.
    #[must_use]
    pub fn is_contradicted(self) -> bool {
        self.contradicting > self.supporting
    }

    /// Whether more ways contradict or doubt than support: another value is preferable.
    #[must_use]
    pub fn is_doubted(self) -> bool {
        self.contradicting + self.doubting > self.supporting
    }
}
