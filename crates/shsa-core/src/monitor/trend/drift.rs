//! The first detector: the mean difference of two ways has left what is usual between them, and lasts.

use super::{Noise, TrendOptions, approach};
use crate::time::{Span, Time};

/// Where the noise is declared, a difference that is further from what is usual than so many deviations comes together,
const STEP: f64 = 0.75;
/// to a drift when it is so many in all: white noise comes to that once in some hundred million comparisons (the average run
/// length of a cumulative sum, D. Siegmund, Sequential Analysis, 1985, doi:10.1007/978-1-4757-1862-1).
const ENOUGH: f64 = 12.0;
/// No single difference counts as more deviations than this: what is wild once is neither a drift nor scatter.
pub(super) const WILD: f64 = 4.0;
/// Means that rest on less are none.
const FULL: f64 = 0.5;
/// Where the noise is declared, a quarter of them says early what is usual, as the noise says how wrong that may be.
const EARLY: f64 = 0.2;
/// A drift that has come so far towards an alarm may yet become one.
const OPEN: f64 = 0.25;
/// A drift that had come so far when comparisons began to disagree is why they do.
const BEGUN: f64 = 0.25;

/// The mean difference of two ways, and how far it has come towards a drift.
#[derive(Clone, Copy, Debug)]
pub(super) struct Drift {
    /// A difference up to this share of the tolerance is none.
    allowance: f64,
    /// Cumulative sums (CUSUM, E. S. Page, Continuous Inspection Schemes, 1954, doi:10.1093/biomet/41.1-2.100) of
    /// differences beyond the allowance, above and below; an alarm at 1.
    pub(super) sums: [f64; 2],
    /// The mean difference at the beginning, SI: two sensors may differ for good within their errors.
    pub(super) usual: Option<f64>,
    /// Since when that is known for good; until then it follows the mean once that rests on enough.
    pub(super) settled: Option<Time>,
    /// How much the mean must rest on.
    enough: f64,
    /// The mean of differences, SI, weighted exponentially.
    pub(super) mean: f64,
    /// How much the means rest on, this one and those of a shift in time: 1 when they are full.
    pub(super) weight: f64,
    /// What it had come to when single comparisons began to disagree.
    begun: f64,
}

impl Drift {
    pub(super) fn new(options: &TrendOptions, noise: Noise) -> Drift {
        Drift {
            allowance: options.allowance,
            sums: [0.0; 2],
            usual: None,
            settled: None,
            enough: if matches!(noise, Noise::Known(_)) { EARLY } else { FULL },
            mean: 0.0,
            weight: 0.0,
            begun: 0.0,
        }
    }

    /// Adds what exceeds the allowance; what disagrees outright is for the single comparisons to tell.
    // A part of what is done for every comparison: by a hint alone it would be called.
    #[inline(always)]
    pub(super) fn accumulate(&mut self, share: f64, shares: f64, gain: f64) {
        let [above, below] = self.sums;
        if share.abs() <= self.allowance && above + below == 0.0 {
            // Most often: there is nothing to add, whatever is usual, and nothing to take from.
            return;
        }
        self.add_excess(share, shares, gain);
    }

    #[inline(never)]
    fn add_excess(&mut self, share: f64, shares: f64, gain: f64) {
        let allowance = self.allowance;
        let Some(usual) = self.usual.filter(|_| share.abs() <= 1.0) else { return };
        let share = common(share, share - usual * shares);
        for (sum, share) in self.sums.iter_mut().zip([share, -share]) {
            *sum = (*sum + gain * (share - allowance) / allowance).clamp(0.0, 1.0);
        }
    }

    /// Adds what exceeds the declared noise, from what is usual; what disagrees outright is for the single comparisons to tell.
    /// `scatter` is how the differences scatter, as a multiple of that noise.
    pub(super) fn accumulate_beyond(
        &mut self,
        difference: f64,
        share: f64,
        per_deviation: f64,
        scatter: f64,
    ) {
        let Some(usual) = self.usual.filter(|_| share.abs() <= 1.0) else { return };
        let beyond = ((difference - usual) * per_deviation).clamp(-WILD, WILD);
        // What scatters more than it should comes together by chance.
        let step = STEP * scatter.max(1.0);
        for (sum, beyond) in self.sums.iter_mut().zip([beyond, -beyond]) {
            *sum = (*sum + (beyond - step) / ENOUGH).clamp(0.0, 1.0);
        }
    }

    /// Takes a difference into the mean.
    #[inline(always)]
    pub(super) fn average(&mut self, difference: f64, gain: f64) {
        approach(&mut self.mean, difference, gain);
        approach(&mut self.weight, 1.0, gain);
    }

    /// Learns what is usual, until that is known for good.
    #[inline(always)]
    pub(super) fn learn(&mut self, time: Time) {
        if self.settled.is_none() && self.rests_on_enough() {
            self.usual = Some(self.mean / self.weight);
            self.settled = (self.weight > FULL).then_some(time);
        }
    }

    /// What is usual outlasts everything else: it is not learnt anew from what follows a fault.
    pub(super) fn keep_usual(&mut self, old: &Drift) {
        self.usual = old.usual;
        self.settled = old.settled.or(old.usual.map(|_| Time::MIN));
    }

    /// Single comparisons begin to disagree.
    pub(super) fn note(&mut self) {
        self.begun = self.nearness();
    }

    /// Whether the means rest on enough: a mean over few comparisons is none.
    #[inline(always)]
    pub(super) fn rests_on_enough(&self) -> bool {
        self.weight > self.enough
    }

    /// How far it has come towards an alarm, in 0..1.
    pub(super) fn nearness(&self) -> f64 {
        let [above, below] = self.sums;
        above.max(below)
    }

    /// Whether it may become an alarm.
    pub(super) fn is_open(&self) -> bool {
        self.nearness() > OPEN
    }

    /// Whether it is far from an alarm.
    #[inline(always)]
    pub(super) fn stays_calm(&self) -> bool {
        let [above, below] = self.sums;
        above <= OPEN && below <= OPEN
    }

    /// Whether it is why single comparisons disagree.
    pub(super) fn had_begun(&self) -> bool {
        self.begun > BEGUN
    }

    /// The mean difference of late, SI.
    pub(super) fn mean(&self) -> f64 {
        if self.weight > 0.0 { self.mean / self.weight } else { 0.0 }
    }

    /// How long it takes until the mean difference is as large as the tolerance (SI), at its pace since what is usual was
    /// learnt.
    pub(super) fn parts_in(&self, tolerance: f64, now: Time) -> Option<Span> {
        let (usual, settled) = (self.usual?, self.settled?);
        let mean = self.mean();
        let pace = (mean - usual) / (now - settled).seconds();
        let seconds = (tolerance - mean.abs()) / (pace * mean.signum());
        (seconds.is_finite() && seconds > 0.0).then(|| Span::from_seconds(seconds))
    }
}

/// What two numbers have in common: nothing when they have different signs, else the smaller one.
fn common(one: f64, other: f64) -> f64 {
    if one * other <= 0.0 {
        0.0
    } else if one.abs() < other.abs() {
        one
    } else {
        other
    }
}
