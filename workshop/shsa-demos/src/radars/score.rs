//! The score: where vehicles were said to be, and how many, against the truth, which only the simulation knows.

use super::faults::Fault;
use shsa_core::engine::EventKind;
use shsa_core::time::{Span, Time};
use shsa_demo::Decision;

/// Errors of positions and counts over a stretch of time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Errors {
    /// The sum of the squares of the errors of positions, and how many there were.
    squares: f64,
    count: u32,
    /// The largest error of a position, m.
    pub worst_m: f64,
    /// The time in which a vehicle was at a border and its position was not known, s, over all borders.
    pub unknown_s: f64,
    /// The time in which a vehicle was at a border, s, over all borders.
    pub there_s: f64,
}

impl Errors {
    /// The root of the mean square of the errors of positions, m.
    #[must_use]
    pub fn rms_m(&self) -> f64 {
        (self.squares / f64::from(self.count.max(1))).sqrt()
    }

    /// Takes in the error of a position, m.
    pub(super) fn erred(&mut self, error_m: f64) {
        self.squares += error_m * error_m;
        self.count += 1;
        self.worst_m = self.worst_m.max(error_m.abs());
    }

    /// Takes in a moment at which a vehicle is at a border.
    pub(super) fn there(&mut self, is_known: bool, span_s: f64) {
        self.there_s += span_s;
        self.unknown_s += if is_known { 0.0 } else { span_s };
    }
}

/// The results of a trial.
#[derive(Clone, Debug, Default)]
pub struct Score {
    /// The time from the fault until a signal of the faulty radar was called silent or failed.
    pub named_after: Option<Span>,
    /// Signals that were called silent or failed, of radars that are sound.
    pub wrongly_named: Vec<String>,
    /// Before the fault.
    pub before: Errors,
    /// From the fault until the radar was named.
    pub until_named: Errors,
    /// From then on; without a fault, from half-way on.
    pub after: Errors,
    /// Pairs of tracks that were associated, and how many of them were of two vehicles.
    pub pairs: u32,
    /// Pairs of tracks of different vehicles.
    pub wrong_pairs: u32,
    pub(super) fault: Option<(Fault, Time)>,
}

impl Score {
    /// The errors of the present stretch of time.
    pub(super) fn errors(&mut self) -> &mut Errors {
        match self.fault {
            None => &mut self.before,
            Some((fault, _)) if fault.radar().is_some() && self.named_after.is_none() => {
                &mut self.until_named
            }
            Some(_) => &mut self.after,
        }
    }

    /// Takes in a decision.
    pub(super) fn decided(&mut self, decision: &Decision) {
        if !matches!(decision.kind, EventKind::Failed | EventKind::Silent) {
            return;
        }
        let signal = decision.signal.clone().unwrap_or_default();
        let is_of = |radar: usize| signal.starts_with(&format!("/radar/{}/", radar + 1));
        match self.fault.filter(|(fault, _)| fault.radar().is_some_and(is_of)) {
            Some((_, at)) => _ = self.named_after.get_or_insert(decision.time - at),
            None => self.wrongly_named.push(signal),
        }
    }

    /// The errors from half-way on, where nobody is named.
    #[must_use]
    pub fn since(&self) -> &Errors {
        if self.after.there_s > 0.0 { &self.after } else { &self.until_named }
    }

    /// Whether it went as it should: the faulty radar is named, and nobody else.
    #[must_use]
    pub fn is_good(&self, fault: Fault) -> bool {
        (self.named_after.is_some() || fault.radar().is_none()) && self.wrongly_named.is_empty()
    }
}
