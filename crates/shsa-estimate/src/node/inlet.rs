//! The observations of a node's inputs and controls, as numbers at times.

use super::build::REACH;
use crate::normal::two_sided;
use shsa_core::circle;
use shsa_core::engine::FusionInput;
use shsa_core::interval::Interval;
use shsa_core::knowledge::{Fusion, FusionMethod, KnowledgeBase, Signal, SignalId, ValueError};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::{Span, Time};

/// The standard deviation of a uniform distribution, as a share of its width.
const UNIFORM: f64 = 0.288_675_134_594_812_9;

/// What an input has measured.
pub(super) struct Reading {
    pub(super) at: Time,
    pub(super) value: f64,
    /// The variance that counts; `None` stands for the model's formula.
    pub(super) variance: Option<f64>,
    /// How far the value may be off by an error that need not average out.
    pub(super) bound: f64,
}

/// A measuring input.
pub(super) struct Inlet {
    signal: Signal,
    /// Whether the model gives its noise by a formula.
    has_formula: bool,
    /// Whether its intervals are intersected with those of the others.
    is_of_intervals: bool,
    /// Whether it is an estimate of another fusion.
    is_derived: bool,
    /// The standard deviation of a value with an interval, as a share of the width.
    share: f64,
    /// The newest moment of its observations.
    newest: Option<Time>,
    refused: u64,
    ahead: u64,
}

impl Inlet {
    pub(super) fn all(knowledge: &KnowledgeBase, fusion: &Fusion) -> Vec<Inlet> {
        let is_of_intervals = fusion.method.is_of_intervals();
        let inlet = |input: &shsa_core::knowledge::FusionInput| Inlet {
            signal: knowledge.signals()[input.signal].clone(),
            has_formula: input.noise.is_some(),
            is_of_intervals,
            is_derived: knowledge.is_fused(input.signal),
            share: if is_of_intervals {
                0.5 / REACH
            } else {
                share(knowledge, input.signal) * alike(knowledge, fusion)
            },
            newest: None,
            refused: 0,
            ahead: 0,
        };
        fusion.inputs.iter().map(inlet).collect()
    }

    /// What was measured; `None` for what is no measurement.
    ///
    /// A value that the monitor has refused is no measurement. A value that is only late or a duplicate is passed on, so that
    /// it is counted. A held value was measured at its first occurrence.
    pub(super) fn read(&mut self, input: FusionInput<'_>) -> Option<Reading> {
        let FusionInput { observation, is_kept, is_repeated, .. } = input;
        if is_repeated {
            return None;
        }
        let (at, interval) = read(&self.signal, observation)?;
        // Of a bound only intervals are made.
        if !self.is_of_intervals && self.signal.limits.is_at_end(interval) {
            return None;
        }
        let is_late = self.newest.is_some_and(|newest| at <= newest);
        let (own, bound) = self.errors(observation, interval);
        if !is_kept && !is_late || own.is_some_and(|own| own <= 0.0) {
            self.refused = self.refused.saturating_add(1);
            return None;
        }
        Some(Reading { at, value: interval.midpoint(), variance: own.map(|own| own * own), bound })
    }

    /// The deviation that comes with the value counts before the fusion's formula. After that, bounds count first where intervals
    /// are intersected, and noise first where they are not. The second number is the bound where it counts, and need not average out:
    /// that of a value that was not estimated.
    fn errors(&self, observation: &Observation, interval: Interval) -> (Option<f64>, f64) {
        let has_own = matches!(observation.value, RawValue::Interval { lo, hi } if lo < hi);
        if self.has_formula && !has_own {
            return (None, 0.0);
        }
        let Signal { noise, value_error: ValueError { lo, hi, relative }, .. } = self.signal;
        // A conversion of units alone widens the interval, too.
        let is_bounded = has_own || lo != hi || relative != 0.0;
        let bounds = is_bounded.then(|| interval.width() * self.share);
        let is_bound_first = has_own || self.is_of_intervals;
        let own = if is_bound_first { bounds.or(noise) } else { noise.or(bounds) };
        let counts = is_bounded && (is_bound_first || noise.is_none());
        let is_bound = counts && !self.is_of_intervals && !self.is_derived;
        (Some(own.unwrap_or(0.0)), if is_bound { 0.5 * interval.width() } else { 0.0 })
    }

    /// Notes the moment of an observation.
    pub(super) fn note_arrival(&mut self, at: Time) {
        self.newest = self.newest.max(Some(at));
    }

    /// Counts a stamp too far ahead of its reception.
    pub(super) fn refuse_ahead(&mut self) {
        self.ahead = self.ahead.saturating_add(1);
    }

    /// The number of stamps too far ahead.
    pub(super) fn ahead(&self) -> u64 {
        self.ahead
    }

    /// The number of observations refused before the filters.
    pub(super) fn refused(&self) -> u64 {
        self.refused
    }
}

/// The standard deviation of a signal's interval as a share of its width: a filter's estimate is normal.
fn share(knowledge: &KnowledgeBase, signal: SignalId) -> f64 {
    let estimated = knowledge.fusions().iter().filter(|it| !it.method.is_of_intervals());
    let output = estimated.flat_map(|it| &it.outputs).find(|it| it.signal == signal);
    output.map_or(UNIFORM, |it| 0.5 / two_sided(it.confidence))
}

/// How many times as large the deviations of a direct fusion's inputs count where some are estimates of other fusions: the errors of all
/// that is averaged may be alike, and the mean of n values errs as their root mean square does then, not as its n-th root.
fn alike(knowledge: &KnowledgeBase, fusion: &Fusion) -> f64 {
    let is_derived = fusion.inputs.iter().any(|it| knowledge.is_fused(it.signal));
    let averaged = match fusion.method {
        FusionMethod::Average | FusionMethod::Median => fusion.settings.window,
        FusionMethod::Confidence => fusion.inputs.len(),
        _ => 1,
    };
    if is_derived { (averaged as f64).sqrt() } else { 1.0 }
}

/// A control input.
pub(super) struct Steering {
    signal: Signal,
    turn: Option<f64>,
    last: Option<(Time, f64)>,
}

impl Steering {
    pub(super) fn all(knowledge: &KnowledgeBase, fusion: &Fusion) -> Vec<Steering> {
        let steering = |id: &shsa_core::knowledge::SignalId| {
            let signal = knowledge.signals()[*id].clone();
            Steering { turn: signal.limits.turn, signal, last: None }
        };
        fusion.controls.iter().map(steering).collect()
    }

    /// A trusted observation, received `now`: the time from which on the input has the value, and the value.
    pub(super) fn read(&mut self, input: FusionInput<'_>, now: Time) -> Option<(Time, f64)> {
        if !input.is_kept || !input.is_trusted {
            return None;
        }
        let (at, interval) = read(&self.signal, input.observation)?;
        let beside = self.last.map(|(_, value)| Interval::point(value));
        let value = match self.turn.zip(beside) {
            Some((turn, beside)) => circle::nearest(interval, beside, turn).midpoint(),
            None => interval.midpoint(),
        };
        self.last = Some((now, value));
        Some((at, value))
    }

    /// Whether the input has a recent value, or a value that still holds.
    pub(super) fn is_fresh(&self, now: Time, within: Span) -> bool {
        self.last.is_some_and(|(last, _)| self.signal.holds || now - last <= within)
    }

    pub(super) fn value(&self) -> Option<f64> {
        self.last.map(|(_, value)| value)
    }
}

/// The moment and the interval of an observation, SI; `None` for a vector or an invalid value.
fn read(signal: &Signal, observation: &Observation) -> Option<(Time, Interval)> {
    let interval = match observation.value {
        RawValue::Number(value) => signal.enclose(value),
        RawValue::Interval { lo, hi } => signal.enclose_bounds(lo, hi),
        RawValue::Vector(_) => return None,
    };
    let is_number = !interval.is_empty() && interval.is_bounded();
    is_number.then(|| (signal.validity(observation.stamp).centre(), interval))
}
