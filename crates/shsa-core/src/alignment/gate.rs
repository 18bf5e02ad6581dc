//! The gate before a port: a reading that could not have followed the one before it waits outside.
//!
//! A single outlier is kept out and leaves no trace. When outliers have become the rule, whoever judges the signal opens
//! the gate ([`Gate::set_open`]): then each reading is measured by the one before it, whatever that was, so that a level
//! which has come to stay is let in and no glitch is let out.
//!
//! A value that is repeated exactly may be one that is held: rows of a log, or a bus that sends more often than it measures.
//! It is as old as its first repetition, but not older than the signal may be silent.

use super::history::{Jump, Sample};
use crate::knowledge::Signal;
use crate::time::Span;

/// Measures the readings of one signal. O(1) a reading, nothing allocated.
///
/// All readings of one moment of reception are measured by those of earlier moments, so their order does not matter.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Gate {
    max_rate: Option<f64>,
    /// How long a value may be held.
    max_hold: Span,
    /// What the readings of this moment are measured by.
    anchor: Option<Sample>,
    /// The newest reading of this moment that was let in, or any while the gate is open.
    next: Option<Sample>,
    /// The newest reading of this moment that was kept out.
    refused: Option<Sample>,
    is_open: bool,
}

impl Gate {
    pub(super) fn new(signal: &Signal) -> Gate {
        let max_hold = signal.timeout.unwrap_or(Span::MAX);
        Gate { max_rate: signal.limits.max_rate, max_hold, ..Gate::default() }
    }

    /// A later moment has come.
    #[inline]
    pub(super) fn turn(&mut self) {
        if self.max_rate.is_none() {
            return;
        }
        self.refused = None;
        let Some(mut next) = self.next.take() else { return };
        if let Some(held) = self.anchor.filter(|held| held.value == next.value) {
            let since = held.validity.from.max(next.validity.to - self.max_hold);
            next.validity.from = next.validity.from.min(since);
        }
        self.anchor = Some(next);
    }

    /// Measures a reading: why it may not come in.
    #[inline]
    pub(super) fn measure(&mut self, sample: Sample) -> Option<Jump> {
        let max_rate = self.max_rate?;
        let jump = self.anchor.and_then(|anchor| jump(anchor, sample, max_rate));
        let side = if jump.is_some() && !self.is_open { &mut self.refused } else { &mut self.next };
        *side = Some(side.map_or(sample, |other| newer(other, sample)));
        jump
    }

    /// Opens or closes it after a moment: open, it goes on from what it has kept out last.
    pub(super) fn set_open(&mut self, open: bool) {
        if open && !self.is_open {
            self.next = self.refused.or(self.next);
        }
        self.is_open = open;
    }

    /// Goes on from the gate of the same signal before a change.
    pub(super) fn inherit(&mut self, old: Gate) {
        *self = Gate { max_rate: self.max_rate, max_hold: self.max_hold, ..old };
    }
}

#[inline]
fn jump(anchor: Sample, sample: Sample, max_rate: f64) -> Option<Jump> {
    // As most often: what overlaps needs no time in between.
    if anchor.value.overlaps(sample.value) {
        return None;
    }
    let (one, other) = (anchor.validity, sample.validity);
    let within = (other.to - one.from).max(one.to - other.from);
    let reach = anchor.value.widened((max_rate * within.seconds()).next_up());
    (!reach.overlaps(sample.value)).then_some(Jump { from: anchor.value, to: sample.value, within, max_rate })
}

/// Of two readings of one moment the same one, in whichever order they come.
fn newer(one: Sample, other: Sample) -> Sample {
    let later = (one.validity.to, one.validity.from).cmp(&(other.validity.to, other.validity.from));
    let larger =
        one.value.lo().total_cmp(&other.value.lo()).then(one.value.hi().total_cmp(&other.value.hi()));
    if later.then(larger).is_lt() { other } else { one }
}
