//! Makes the comparisons: each output of the slower of two ways with the faster way's value for the same moment.
//!
//! Where the faster way has no value for that moment yet, the comparison waits. So two ways are compared at moments for which
//! both have a value, and nothing is extrapolated without a bound.

use super::consensus::Consensus;
use super::index::Index;
use super::trend::Measured;
use super::{Fresh, Residual, WatchedWay, WayIndex};
use crate::alignment::{Known, Sample};
use crate::interval::Interval;
use crate::time::{Span, Time};
use alloc::vec::Vec;

/// The comparisons made at one moment of reception.
pub(super) struct Round<'m> {
    pub(super) ways: &'m [WatchedWay],
    pub(super) pairs: &'m mut [Residual],
    pub(super) consensus: &'m mut Consensus,
    pub(super) index: &'m mut Index,
    /// For each way, the pairs that wait for an output of this way.
    pub(super) awaited: &'m mut [Vec<u32>],
    pub(super) now: Time,
    /// Whether a relationship has changed.
    pub(super) changed: bool,
}

impl Round<'_> {
    /// Compares an output in all pairs of its way whose other value is known.
    #[inline]
    pub(super) fn compare(&mut self, fresh: &Fresh) {
        let Fresh { way, validity, ref measured } = *fresh;
        let Some(watched) = self.ways.get(way.0 as usize) else { return };
        let is_of_moment = watched.mean_over() == Span::ZERO;
        let mut waits = false;
        for &number in &watched.triggers {
            let Some(pair) = self.pairs.get_mut(number as usize) else { continue };
            let Some(other) = self.ways.get(pair.other.0 as usize) else { continue };
            if other.is_range {
                let range = other.latest_value().unwrap_or(Interval::ENTIRE);
                if pair.is_within_as_ever(measured.value, range) {
                    pair.made += 1;
                } else {
                    let recorded = pair.record_apart(measured, &Measured::of(range), self.now);
                    self.changed |= recorded.changed;
                    if let Some(restless) = recorded.restless {
                        self.index.note(number, restless);
                    }
                }
                continue;
            }
            if pair.due.is_some() {
                // Earlier outputs are compared first.
                waits = true;
                continue;
            }
            // The most frequent case, without the detour by [`Known`].
            let newest = if is_of_moment && !pair.is_of_lines { other.newest_about(validity) } else { None };
            let known = match newest {
                Some(known) => known,
                None => match pair.beside(watched, other, validity) {
                    Known::Value(value) => other.measure(value, measured.value),
                    Known::Later => {
                        pair.due = Some(validity.to);
                        let list = self.awaited.get_mut(pair.other.0 as usize);
                        list.into_iter().for_each(|list| insert(list, number));
                        waits = true;
                        continue;
                    }
                    Known::Never => continue,
                },
            };
            let may_be_of_bounds = pair.may_be_of_bounds;
            if !(may_be_of_bounds && Residual::are_bounds([watched, other], measured, &known)) {
                self.consensus.add_value(number as usize, &known);
            }
            if !is_of_moment {
                // Means are expensive, and the consensus needs them again when all ways have a value.
                pair.known = Some((validity, known));
            }
            let apart;
            let (output, known) = if pair.has_branches {
                apart = nearest_alternatives(watched, *measured, other, known, newest.is_some());
                (&apart.0, apart.1)
            } else {
                (measured, known)
            };
            let known =
                if pair.is_of_lines { pair.guessed(watched, other, output, known, validity) } else { known };
            let known =
                if may_be_of_bounds { pair.without_trend([watched, other], output, known) } else { known };
            let of_newest = || newest.and_then(|_| newest_end(other));
            let recorded = pair.record(output, &known, validity, self.now, of_newest);
            self.changed |= recorded.changed;
            if let Some(restless) = recorded.restless {
                self.index.note(number, restless);
            }
        }
        if waits {
            self.consensus.postpone(way, self.now);
        } else {
            self.consensus.settle(way, measured, self.now);
        }
    }

    /// Makes the comparisons that wait for an output of a way.
    #[inline]
    pub(super) fn catch_up(&mut self, way: WayIndex) {
        let place = way.0 as usize;
        let mut at = 0;
        while let Some(&number) = self.awaited.get(place).and_then(|list| list.get(at)) {
            if self.compare_due(number) {
                self.awaited.get_mut(place).into_iter().for_each(|list| _ = list.remove(at));
            } else {
                at += 1;
            }
        }
    }

    /// Compares the waiting outputs of a pair, oldest first; returns whether all are done.
    fn compare_due(&mut self, number: u32) -> bool {
        let Some(pair) = self.pairs.get_mut(number as usize) else { return true };
        let (slow, fast) = (pair.way, pair.other);
        let Some(due) = pair.due.take() else { return true };
        let ways = self.ways;
        let (Some(watched), Some(other)) = (ways.get(slow.0 as usize), ways.get(fast.0 as usize)) else {
            return true;
        };
        let count = watched.outputs.newest_first().take_while(|sample| sample.validity.to >= due).count();
        for back in (0..count).rev() {
            let Some(&sample) = watched.outputs.newest(back) else { continue };
            let Some(pair) = self.pairs.get_mut(number as usize) else { return true };
            match pair.beside(watched, other, sample.validity) {
                Known::Value(value) => {
                    let (measured, known) = (Measured::of(sample.value), other.measure(value, sample.value));
                    pair.known = Some((sample.validity, known));
                    let (output, known) = if pair.has_branches {
                        nearest_alternatives(watched, measured, other, known, false)
                    } else {
                        (measured, known)
                    };
                    let known = pair.guessed(watched, other, &output, known, sample.validity);
                    let known = pair.without_trend([watched, other], &output, known);
                    let recorded = pair.record(&output, &known, sample.validity, self.now, || None);
                    self.changed |= recorded.changed;
                    if let Some(restless) = recorded.restless {
                        self.index.note(number, restless);
                    }
                    self.rate_late(slow, watched, &measured, &sample);
                }
                Known::Later => {
                    pair.due = Some(sample.validity.to);
                    return false;
                }
                Known::Never => {}
            }
        }
        true
    }

    /// Rates an output in the consensus once all ways that it is compared with have a value.
    fn rate_late(&mut self, way: WayIndex, watched: &WatchedWay, measured: &Measured, sample: &Sample) {
        let pairs = &*self.pairs;
        let of_way =
            || watched.triggers.iter().filter_map(|&number| Some((number, pairs.get(number as usize)?)));
        if of_way().any(|(_, pair)| pair.due.is_some_and(|due| due <= sample.validity.to)) {
            return;
        }
        for (number, pair) in of_way() {
            let remembered = pair.known.filter(|(validity, _)| *validity == sample.validity);
            let again = || {
                let other = self.ways.get(pair.other.0 as usize)?;
                let value = other.beside(watched, sample.validity).value()?;
                Some(other.measure(value, sample.value))
            };
            if let Some(known) = remembered.map(|(_, known)| known).or_else(again) {
                self.consensus.add_value(number as usize, &known);
            }
        }
        self.consensus.rate_values(way, measured, self.now);
    }
}

/// When the newest output of a way ended, where the way is declared to be the faster one of a pair and an output counts for its own moment
/// only.
fn newest_end(way: &WatchedWay) -> Option<Time> {
    way.computation.timing().period.filter(|_| !way.reach.stands)?;
    way.outputs.newest(0).map(|newest| newest.validity.to)
}

/// The alternatives in which two values agree best, where one of them has several. The value beside is taken apart only where it
/// is the faster way's newest output. Complexity: O(alternatives of one times those of the other).
#[inline(never)]
fn nearest_alternatives(
    slower: &WatchedWay,
    output: Measured,
    faster: &WatchedWay,
    known: Measured,
    is_newest: bool,
) -> (Measured, Measured) {
    let evaluated = faster.measured.filter(|_| is_newest).map_or(Interval::EMPTY, |newest| newest.value);
    let beside = faster.alternatives(evaluated, known);
    let all = slower
        .alternatives(output.value, output)
        .flat_map(|one| beside.clone().map(move |other| (one, other)));
    let apart = |(one, other): &(Measured, Measured)| {
        let gap = (one.value.lo() - other.value.hi()).max(other.value.lo() - one.value.hi()).max(0.0);
        (gap, (one.middle() - other.middle()).abs())
    };
    let nearer = |one: &(Measured, Measured), other: &(Measured, Measured)| {
        let ((gap, off), (its_gap, its_off)) = (apart(one), apart(other));
        gap.total_cmp(&its_gap).then(off.total_cmp(&its_off))
    };
    all.min_by(nearer).unwrap_or((output, known))
}

/// Inserts in ascending order, so that it does not matter which pair began to wait first.
pub(super) fn insert(list: &mut Vec<u32>, number: u32) {
    if let Err(at) = list.binary_search(&number) {
        list.insert(at, number);
    }
}
