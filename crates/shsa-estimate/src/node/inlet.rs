//! What inputs and controls of a node say, as numbers at times.

use super::build::deviation;
use shsa_core::circle;
use shsa_core::engine::Heard;
use shsa_core::interval::Interval;
use shsa_core::knowledge::{Fusion, KnowledgeBase, Signal};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::{Span, Time};

/// A share of the width of an interval of equally likely values that is their standard deviation.
const UNIFORM: f64 = 0.288_675_134_594_812_9;

/// An input that measures.
pub(super) struct Inlet {
    signal: Signal,
    /// Whether the model gives its noise by a formula.
    has_formula: bool,
    /// The newest moment that it has said something about.
    newest: Option<Time>,
    refused: u64,
    ahead: u64,
}

impl Inlet {
    pub(super) fn all(knowledge: &KnowledgeBase, fusion: &Fusion) -> Vec<Inlet> {
        let inlet = |input: &shsa_core::knowledge::FusionInput| Inlet {
            signal: knowledge.signals()[input.signal].clone(),
            has_formula: input.noise.is_some(),
            newest: None,
            refused: 0,
            ahead: 0,
        };
        fusion.inputs.iter().map(inlet).collect()
    }

    /// When it was measured, the value, and its standard deviation; that of the model's formula where it is `None`.
    ///
    /// What the monitor has refused is no measurement, but where it is only late or said again, so that it is counted. A value
    /// that stands was measured when it was said first.
    pub(super) fn read(&mut self, heard: Heard<'_>) -> Option<(Time, f64, Option<f64>)> {
        let Heard { observation, is_kept, is_repeated, .. } = heard;
        if is_repeated {
            return None;
        }
        let (at, interval) = read(&self.signal, observation)?;
        let is_late = self.newest.is_some_and(|newest| at <= newest);
        let own = self.deviation(observation, interval);
        if !is_kept && !is_late || own.is_some_and(|own| own <= 0.0) {
            self.refused = self.refused.saturating_add(1);
            return None;
        }
        Some((at, interval.midpoint(), own))
    }

    /// What comes with the value counts before what the signal says, and that before its bounds.
    fn deviation(&self, observation: &Observation, interval: Interval) -> Option<f64> {
        let is_wide = matches!(observation.value, RawValue::Interval { lo, hi } if lo < hi);
        match (self.has_formula, is_wide) {
            (_, true) => Some(interval.width() * UNIFORM),
            (true, false) => None,
            (false, false) if self.signal.noise.is_some() => Some(deviation(&self.signal)),
            (false, false) => Some(interval.width() * UNIFORM),
        }
    }

    /// It has spoken about a moment.
    pub(super) fn hear(&mut self, at: Time) {
        self.newest = self.newest.max(Some(at));
    }

    /// A stamp was too far ahead of its reception.
    pub(super) fn refuse_ahead(&mut self) {
        self.ahead = self.ahead.saturating_add(1);
    }

    /// How many stamps were.
    pub(super) fn ahead(&self) -> u64 {
        self.ahead
    }

    /// How much was refused before it came to the filters.
    pub(super) fn refused(&self) -> u64 {
        self.refused
    }
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

    /// From when on it has which value, if it is trusted; received `now`.
    pub(super) fn read(&mut self, heard: Heard<'_>, now: Time) -> Option<(Time, f64)> {
        if !heard.is_kept || !heard.is_trusted {
            return None;
        }
        let (at, interval) = read(&self.signal, heard.observation)?;
        let beside = self.last.map(|(_, value)| Interval::point(value));
        let value = match self.turn.zip(beside) {
            Some((turn, beside)) => circle::nearest(interval, beside, turn).midpoint(),
            None => interval.midpoint(),
        };
        self.last = Some((now, value));
        Some((at, value))
    }

    /// Whether it has said something of late, or what it has said stands.
    pub(super) fn is_fresh(&self, now: Time, within: Span) -> bool {
        self.last.is_some_and(|(last, _)| self.signal.holds || now - last <= within)
    }

    pub(super) fn value(&self) -> Option<f64> {
        self.last.map(|(_, value)| value)
    }
}

/// The moment and the values of an observation, SI; `None` of what is no number.
fn read(signal: &Signal, observation: &Observation) -> Option<(Time, Interval)> {
    let interval = match observation.value {
        RawValue::Number(value) => signal.enclose(value),
        RawValue::Interval { lo, hi } => signal.enclose_bounds(lo, hi),
        RawValue::Vector(_) => return None,
    };
    let is_number = !interval.is_empty() && interval.is_bounded();
    is_number.then(|| (signal.validity(observation.stamp).centre(), interval))
}
