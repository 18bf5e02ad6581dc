//! Makes the comparisons: each output of the slower of two ways with what the faster one says about its moment.
//!
//! Where the faster way does not tell yet what was at that moment, the comparison waits for it. So two ways are compared at
//! moments about which both say something, and what nothing bounds is not extrapolated.

use super::consensus::Consensus;
use super::index::Index;
use super::trend::Measured;
use super::{Fresh, Residual, WatchedWay, WayIndex};
use crate::alignment::{Known, Sample};
use crate::time::{Span, Time, Validity};
use alloc::vec::Vec;

/// The comparisons of one moment of reception.
pub(super) struct Round<'m> {
    pub(super) ways: &'m [WatchedWay],
    pub(super) pairs: &'m mut [Residual],
    pub(super) consensus: &'m mut Consensus,
    pub(super) index: &'m mut Index,
    /// For each way, the pairs that wait for an output of it.
    pub(super) awaited: &'m mut [Vec<u32>],
    pub(super) now: Time,
    /// Whether a relationship has changed.
    pub(super) changed: bool,
}

impl Round<'_> {
    /// Compares an output with all that its way is compared with, as far as that is known.
    #[inline]
    pub(super) fn compare(&mut self, fresh: &Fresh) {
        let Fresh { way, validity, ref measured } = *fresh;
        let Some(watched) = self.ways.get(way.0 as usize) else { return };
        let is_of_moment = watched.mean_over() == Span::ZERO;
        let mut waits = false;
        for &number in &watched.triggers {
            let Some(pair) = self.pairs.get_mut(number as usize) else { continue };
            let Some(other) = self.ways.get(pair.other.0 as usize) else { continue };
            if pair.due.is_some() {
                // Earlier outputs are compared first.
                waits = true;
                continue;
            }
            // As most often, and not by way of what is not known.
            let newest = if is_of_moment { other.newest_about(validity) } else { None };
            let known = match newest {
                Some(known) => known,
                None => match other.beside(watched, validity) {
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
            self.consensus.hear(number as usize, &known);
            if !is_of_moment {
                // Means are dear, and may be heard again when all others have spoken.
                pair.known = Some((validity, known));
            }
            let guessed = guessed(pair, other, known, validity);
            let recorded = pair.record(measured, &guessed, validity, self.now);
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

    /// Makes the comparisons that have waited for an output of a way.
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

    /// Compares the outputs of a pair that have waited, oldest first; whether all are done.
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
            match other.beside(watched, sample.validity) {
                Known::Value(value) => {
                    let (measured, known) = (Measured::of(sample.value), other.measure(value, sample.value));
                    let Some(pair) = self.pairs.get_mut(number as usize) else { return true };
                    pair.known = Some((sample.validity, known));
                    let guessed = guessed(pair, other, known, sample.validity);
                    let recorded = pair.record(&measured, &guessed, sample.validity, self.now);
                    self.changed |= recorded.changed;
                    if let Some(restless) = recorded.restless {
                        self.index.note(number, restless);
                    }
                    self.rate_late(slow, watched, &measured, &sample);
                }
                Known::Later => {
                    self.pairs
                        .get_mut(number as usize)
                        .into_iter()
                        .for_each(|pair| pair.due = Some(sample.validity.to));
                    return false;
                }
                Known::Never => {}
            }
        }
        true
    }

    /// Once all that an output was to be compared with has spoken, they are heard together.
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
                self.consensus.hear(number as usize, &known);
            }
        }
        self.consensus.rate_heard(way, measured, self.now);
    }
}

/// What is known beside an output, around its best guess where statistics go by that.
#[inline]
fn guessed(pair: &Residual, other: &WatchedWay, known: Measured, moment: Validity) -> Measured {
    if pair.trend.goes_by_noise() { known.with_guess(other.guess(moment)) } else { known }
}

/// Keeps a list in ascending order, so that it does not matter who began to wait first.
pub(super) fn insert(list: &mut Vec<u32>, number: u32) {
    if let Err(at) = list.binary_search(&number) {
        list.insert(at, number);
    }
}
