//! The first detector: a lasting departure of the mean difference of two ways from its usual value.

use super::{Noise, TrendOptions, approach};
use crate::numbers::{DRIFT_ENOUGH, DRIFT_STEP, EARLY, HALF, NEAR, WILD};
use crate::time::{Span, Time};

/// The mean difference of two ways, and how near it is to a drift.
#[derive(Clone, Copy, Debug)]
pub(super) struct Drift {
    /// A difference up to this share of the tolerance does not count.
    allowance: f64,
    /// Cumulative sums (CUSUM, E. S. Page, Continuous Inspection Schemes, 1954, doi:10.1093/biomet/41.1-2.100) of
    /// differences beyond the allowance, above and below; an alarm at 1.
    pub(super) sums: [f64; 2],
    /// The usual difference, learnt at the beginning, SI: two sensors may differ for good within their errors.
    pub(super) usual: Option<f64>,
    /// When `usual` became final; before that it follows the mean, once the mean has enough weight.
    pub(super) settled: Option<Time>,
    /// The weight that the mean needs.
    enough: f64,
    /// The mean difference, SI, weighted exponentially.
    pub(super) mean: f64,
    /// The weight of this mean and of those of a shift in time, up to 1.
    pub(super) weight: f64,
    /// The sum of the differences since a cumulative sum left zero, SI, and their number: since the change, as far as that is known.
    since_change: (f64, f64),
    /// How near to an alarm the drift was when single comparisons began to disagree.
    begun: f64,
}

impl Drift {
    pub(super) fn new(options: &TrendOptions, noise: Noise) -> Drift {
        Drift {
            allowance: options.allowance,
            sums: [0.0; 2],
            usual: None,
            settled: None,
            enough: if matches!(noise, Noise::Known(_)) { EARLY } else { HALF },
            mean: 0.0,
            weight: 0.0,
            since_change: (0.0, 0.0),
            begun: 0.0,
        }
    }

    /// Adds the excess over the allowance; a disagreement is left to the single comparisons.
    // Part of every comparison: `inline` alone would not inline it.
    #[inline(always)]
    pub(super) fn accumulate(&mut self, difference: f64, share: f64, shares: f64, gain: f64) {
        let [above, below] = self.sums;
        if share.abs() <= self.allowance && above + below == 0.0 {
            // The most frequent case: the sums are zero and stay so.
            return;
        }
        self.add_excess(difference, share, shares, gain);
    }

    #[inline(never)]
    fn add_excess(&mut self, difference: f64, share: f64, shares: f64, gain: f64) {
        let allowance = self.allowance;
        let Some(usual) = self.usual.filter(|_| share.abs() <= 1.0) else { return self.settle() };
        let share = common(share, share - usual * shares);
        for (sum, share) in self.sums.iter_mut().zip([share, -share]) {
            *sum = (*sum + gain * (share - allowance) / allowance).clamp(0.0, 1.0);
        }
        self.follow_change(difference);
    }

    /// Takes a difference into the mean since the change; that begins anew where both sums are zero.
    #[inline(always)]
    fn follow_change(&mut self, difference: f64) {
        let (sum, count) = self.since_change;
        self.since_change = match self.sums {
            [0.0, 0.0] => (0.0, 0.0),
            _ => (sum + difference, count + 1.0),
        };
    }

    /// Adds the excess over the known noise, from the usual difference; a disagreement is left to the single comparisons.
    /// `scatter` is the variance of the differences as a multiple of that noise's.
    pub(super) fn accumulate_beyond(
        &mut self,
        difference: f64,
        share: f64,
        per_deviation: f64,
        scatter: f64,
    ) {
        let Some(usual) = self.usual.filter(|_| share.abs() <= 1.0) else { return self.settle() };
        let beyond = ((difference - usual) * per_deviation).clamp(-WILD, WILD);
        // Too large a scatter would reach the sum by chance.
        let step = DRIFT_STEP * scatter.max(1.0);
        for (sum, beyond) in self.sums.iter_mut().zip([beyond, -beyond]) {
            *sum = (*sum + (beyond - step) / DRIFT_ENOUGH).clamp(0.0, 1.0);
        }
        self.follow_change(difference);
    }

    /// The usual difference, SI; 0 until it is known.
    pub(super) fn usual(&self) -> f64 {
        self.usual.unwrap_or(0.0)
    }

    /// Takes a difference into the mean.
    #[inline(always)]
    pub(super) fn average(&mut self, difference: f64, gain: f64) {
        approach(&mut self.mean, difference, gain);
        approach(&mut self.weight, 1.0, gain);
    }

    /// Learns the usual difference from a comparison that agrees, until it is final: when enough is known, or a departure from it
    /// begins. What a fault shows must not be taken for usual, or the return to what is sound would be a drift.
    #[inline(always)]
    pub(super) fn learn(&mut self, time: Time) {
        if self.rests_on_enough() {
            self.usual = Some(self.mean / self.weight);
            self.settled = (self.weight > HALF || !self.stays_calm()).then_some(time);
        }
    }

    /// Makes what is known of the usual difference final, as single comparisons begin to disagree.
    #[cold]
    pub(super) fn settle(&mut self) {
        self.settled = self.settled.or(self.usual.map(|_| Time::MIN));
    }

    /// Keeps the usual difference of before: it must not be learnt anew from a fault.
    pub(super) fn keep_usual(&mut self, old: &Drift) {
        self.usual = old.usual;
        self.settled = old.settled.or(old.usual.map(|_| Time::MIN));
    }

    /// Notes that single comparisons begin to disagree.
    pub(super) fn note(&mut self) {
        self.begun = self.nearness();
    }

    /// Whether the means have enough weight.
    #[inline(always)]
    pub(super) fn rests_on_enough(&self) -> bool {
        self.weight > self.enough
    }

    /// How near the drift is to an alarm, in 0..1.
    pub(super) fn nearness(&self) -> f64 {
        let [above, below] = self.sums;
        above.max(below)
    }

    /// Whether the drift may become an alarm.
    pub(super) fn is_open(&self) -> bool {
        self.nearness() > NEAR
    }

    /// Whether the drift is far from an alarm.
    #[inline(always)]
    pub(super) fn stays_calm(&self) -> bool {
        let [above, below] = self.sums;
        above <= NEAR && below <= NEAR
    }

    /// Whether a drift is why single comparisons disagree.
    pub(super) fn had_begun(&self) -> bool {
        self.begun > NEAR
    }

    /// The mean difference, SI: recently, or since it began to depart from the usual one, whichever is further from that. The one
    /// lags behind the beginning of a drift, the other behind a drift that goes on.
    pub(super) fn mean(&self) -> f64 {
        let recent = self.recent();
        let usual = self.usual.unwrap_or(0.0);
        match self.since_change {
            (sum, count) if (sum / count - usual).abs() > (recent - usual).abs() => sum / count,
            _ => recent,
        }
    }

    /// The recent mean difference, SI.
    fn recent(&self) -> f64 {
        if self.weight > 0.0 { self.mean / self.weight } else { 0.0 }
    }

    /// The time until the mean difference reaches the tolerance (SI), at its pace since the usual difference was final.
    pub(super) fn parts_in(&self, tolerance: f64, now: Time) -> Option<Span> {
        // When it became final is not known after a conflict.
        let (usual, settled) = (self.usual?, self.settled.filter(|settled| *settled > Time::MIN)?);
        let mean = self.recent();
        let pace = (mean - usual) / (now - settled).seconds();
        let seconds = (tolerance - mean.abs()) / (pace * mean.signum());
        (seconds.is_finite() && seconds > 0.0).then(|| Span::from_seconds(seconds))
    }
}

/// The smaller of two numbers of the same sign; 0 for different signs.
fn common(one: f64, other: f64) -> f64 {
    if one * other <= 0.0 {
        0.0
    } else if one.abs() < other.abs() {
        one
    } else {
        other
    }
}
