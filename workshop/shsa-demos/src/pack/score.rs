//! The score: what was shown, measured against the truth, which only the simulation knows.

use super::faults::Fault;
use super::values::Values;
use shsa_core::engine::EventKind;
use shsa_core::time::{Span, Time};
use shsa_demo::Decision;
use std::time::Duration;

/// The results of a trial.
#[derive(Clone, Debug, Default)]
pub struct Score {
    /// The signal of the faulty sensor, if one is faulty.
    pub faulty: Option<String>,
    /// The time from the fault until its signal was called silent or failed.
    pub named_after: Option<Span>,
    /// Signals that were called silent or failed, and were neither.
    pub wrongly_named: Vec<String>,
    /// Relations that were said to hold no longer.
    pub broken: u32,
    /// The largest errors before the fault, from 60 s on.
    pub before: Values,
    /// The largest errors from the fault until it was named.
    pub until_named: Values,
    /// The largest errors from then on; without a faulty sensor, from half-way on.
    pub after: Values,
    /// The longest time without a new value of a need, from 10 s on.
    pub longest_gap: Span,
    /// How long a cell was below its limit, s.
    pub below_limit_s: f64,
    /// The lowest voltage that a cell had, V.
    pub lowest_v: f64,
    /// The charge at the end, a share.
    pub charge: f64,
    /// Readings of the sensors.
    pub readings: u64,
    /// What the engine took for them.
    pub engine: Duration,
    pub(super) fault_at: Option<Time>,
}

impl Score {
    /// The fault begins.
    pub(super) fn fault_begins(&mut self, at: Time, faulty: Option<String>) {
        self.fault_at = Some(at);
        self.faulty = faulty;
    }

    /// Takes in errors.
    pub(super) fn erred(&mut self, errors: Values) {
        let is_open = self.faulty.is_some() && self.named_after.is_none();
        let worst = match self.fault_at {
            None => &mut self.before,
            Some(_) if is_open => &mut self.until_named,
            Some(_) => &mut self.after,
        };
        *worst = worst.worse(errors);
    }

    /// Takes in a decision.
    pub(super) fn decided(&mut self, decision: &Decision) {
        if !matches!(decision.kind, EventKind::Failed | EventKind::Silent) {
            return;
        }
        let Some(signal) = &decision.signal else {
            self.broken += 1;
            return;
        };
        match self.fault_at.filter(|_| self.faulty.as_ref() == Some(signal)) {
            Some(at) => _ = self.named_after.get_or_insert(decision.time - at),
            None => self.wrongly_named.push(signal.clone()),
        }
    }

    /// The largest errors from the fault on, named or not.
    #[must_use]
    pub fn since(&self) -> Values {
        self.until_named.worse(self.after)
    }

    /// Whether it went as it should: who is faulty is named, nobody else is, and no cell was below its limit.
    #[must_use]
    pub fn is_good(&self, fault: Fault) -> bool {
        let is_named = self.named_after.is_some() || !fault.is_of_a_sensor();
        is_named && self.wrongly_named.is_empty() && self.below_limit_s == 0.0
    }
}
