//! The fusions of a model at work beside the engine: what is observed goes in, estimates come out as observations.
//!
//! A node begins with its first measurement. Each measurement counts at its own time of validity; what is told is stamped with the
//! moment that it speaks about, in the clock of its inputs. Nothing is told that is not known: before the first measurement, after
//! too long without one, with a control input that says nothing, or while inputs contradict each other and nothing decides.
//!
//! A node is begun anew where it could not find back: after a contradiction that has lasted, as after a power cycle of what it
//! rests on, and where all that comes is older than it can go back to, as after a jump of the clocks. A stamp that is further ahead
//! of its reception than the horizon is not taken for time: it would make all right ones too late.

mod each;
mod build;
mod filters;
mod check;
mod inlet;
mod told;
mod nodes;

pub use check::check;
pub use nodes::{Nodes, engine};

use crate::Error;
use crate::fusion::{Fusion, Gate, Options, Verdict};
use crate::method::Measurement;
use filters::Filters;
use inlet::{Inlet, Steering};
use shsa_core::engine::{Heard, Measurements};
use shsa_core::knowledge::{self, FusionSettings, KnowledgeBase};
use shsa_core::observation::Observation;
use shsa_core::time::{Span, Time};
use std::collections::VecDeque;
use told::Outputs;

/// After so many rejections in a row others decide about an input.
const PATIENCE: u32 = 5;
/// After so many measurements that come too late, or are too far ahead, with none between them that counts, the clocks have jumped.
const ALL_TOO_LATE: u32 = 12;

/// One fusion at work.
struct Node {
    /// As it was checked, to see whether a change concerns it.
    model: knowledge::Fusion,
    settings: FusionSettings,
    filters: Filters,
    inlets: Vec<Inlet>,
    steering: Vec<Steering>,
    /// See [`Options::reckoned`].
    reckoned: Span,
    outputs: Outputs,
    /// The newest moment that anything was said about, and when that was received.
    newest: Option<(Time, Time)>,
    /// Whether a measurement has counted since it began.
    has_measured: bool,
    /// Measurements in a row that came too late.
    too_late: u32,
    /// By how much the clocks of all inputs run ahead of the reception, and what in a row was further ahead.
    lead: Span,
    ahead: u32,
    /// Since when nothing is known though measurements come.
    lost_since: Option<Time>,
    /// When the next estimate is due, of a node with a period.
    due: Option<Time>,
    restarts: u64,
}

impl Node {
    fn new(knowledge: &KnowledgeBase, model: &knowledge::Fusion) -> Result<Node, Error> {
        let settings = model.settings;
        // What combines the values of several inputs must see them together: it has no outliers of its own.
        let gate =
            settings.gate.filter(|_| !model.method.is_direct()).map(|share| Gate::new(share, PATIENCE));
        let options = Options {
            horizon: settings.horizon,
            moments: settings.moments,
            gate,
            unknown_after: settings.unknown_after,
        };
        let (inputs, controls) = (model.inputs.len(), model.controls.len());
        let make =
            |options| Fusion::new(build::method(knowledge, model)?, Time(0), inputs, controls, options);
        let witness = || make(Options { gate: None, ..options });
        let mut sets: Vec<Vec<usize>> = model.predictions.iter().map(|it| it.without.clone()).collect();
        if !sets.is_empty() {
            sets.push(Vec::new());
        }
        sets.sort_unstable();
        sets.dedup();
        Ok(Node {
            filters: Filters::new(model.inputs.len(), &sets, || make(options), witness)?,
            inlets: Inlet::all(knowledge, model),
            steering: Steering::all(knowledge, model),
            outputs: Outputs::new(knowledge, model, &sets, options.reckoned())?,
            reckoned: options.reckoned(),
            model: model.clone(),
            settings,
            newest: None,
            has_measured: false,
            too_late: 0,
            lead: Span::ZERO,
            ahead: 0,
            lost_since: None,
            due: None,
            restarts: 0,
        })
    }

    /// An input says something.
    fn measure(&mut self, place: usize, heard: Heard<'_>, now: Time) {
        let Some(inlet) = self.inlets.get_mut(place) else { return };
        let Some((at, value, deviation)) = inlet.read(heard) else { return };
        if !self.is_time(at, now) {
            self.inlets.get_mut(place).into_iter().for_each(Inlet::refuse_ahead);
            return;
        }
        self.inlets.get_mut(place).into_iter().for_each(|inlet| inlet.hear(at));
        if self.newest.is_none() {
            self.begin(at);
        }
        let variance = deviation.or_else(|| self.outputs.deviation(place)).map(|it| it * it);
        let measurement = Measurement { sensor: place, value, variance };
        self.filters.trust(place, heard.is_trusted);
        let verdict = self.filters.measure(at, measurement);
        self.count(verdict, at, now);
        if !matches!(verdict, Verdict::TooLate | Verdict::Duplicate) {
            self.advance(at, now);
            self.outputs.expect(at, measurement);
        }
    }

    /// A control input says something.
    fn steer(&mut self, place: usize, heard: Heard<'_>, now: Time) {
        let Some(steering) = self.steering.get_mut(place) else { return };
        let most = now + self.lead + self.settings.horizon;
        let Some((at, value)) = steering.read(heard, now).filter(|(at, _)| *at <= most) else { return };
        if self.newest.is_none() {
            self.begin(at);
        }
        self.filters.control(at, place, value);
        self.outputs.control(place, value);
        self.advance(at, now);
    }

    fn begin(&mut self, at: Time) {
        self.filters.restart(at);
        (self.newest, self.has_measured, self.too_late, self.lost_since) = (None, false, 0, None);
        self.outputs.forget();
    }

    fn begin_anew(&mut self, at: Time) {
        self.begin(at);
        self.restarts = self.restarts.saturating_add(1);
        for (place, steering) in self.steering.iter().enumerate() {
            if let Some(value) = steering.value() {
                self.filters.control(at, place, value);
            }
        }
    }

    fn count(&mut self, verdict: Verdict, at: Time, now: Time) {
        // Where the one that runs ahead came first, all others seem late, and are not.
        let is_right = self.lead > Span::ZERO && at - now <= self.settings.horizon;
        match verdict {
            Verdict::Used => {
                self.has_measured = true;
                self.too_late = if self.lead > Span::ZERO && !is_right { self.too_late } else { 0 };
            }
            Verdict::TooLate => self.too_late += 1,
            _ => {}
        }
        if self.too_late >= ALL_TOO_LATE {
            self.lead = Span::ZERO;
            self.begin_anew(at);
        }
    }

    /// Whether a stamp is not too far ahead of its reception. Where all are, the clocks are, and it begins anew with that.
    fn is_time(&mut self, at: Time, now: Time) -> bool {
        let lead = at - now;
        if lead <= self.lead + self.settings.horizon {
            self.ahead = 0;
            return true;
        }
        self.ahead += 1;
        let are_all = self.ahead >= ALL_TOO_LATE;
        if are_all {
            (self.lead, self.ahead) = (lead, 0);
            self.begin_anew(at);
        }
        are_all
    }

    fn advance(&mut self, at: Time, now: Time) {
        if self.newest.is_none_or(|(newest, _)| at > newest) {
            self.newest = Some((at, now));
        }
    }

    /// Tells what is known, where something is due.
    fn settle(&mut self, now: Time, queue: &mut VecDeque<Observation>) {
        let Node { outputs, filters, .. } = self;
        outputs.predict(filters, now, queue);
        let Some((newest, received)) = self.newest else { return };
        let at = match (self.settings.period, self.due) {
            (None, _) => newest,
            (Some(period), due) => {
                if due.is_some_and(|due| due > now) {
                    return;
                }
                self.due = Some(next(due.unwrap_or(now), period, now));
                newest + (now - received)
            }
        };
        let is_steered = self.steering.iter().all(|it| it.is_fresh(now, self.settings.unknown_after));
        let is_known = self.has_measured && is_steered;
        let fusion = is_known.then(|| self.filters.all_mut());
        let estimate = fusion.and_then(|fusion| fusion.estimate(at));
        match estimate {
            Some(estimate) => {
                self.lost_since = None;
                self.outputs.tell(&estimate, at, now, queue);
            }
            None => self.look_after(newest, received, now),
        }
    }

    /// Nothing is known: where measurements come all the same and that lasts, the node is begun anew. A conflict ends before.
    fn look_after(&mut self, newest: Time, received: Time, now: Time) {
        let hears = received == now && self.has_measured;
        let decided_within = if self.filters.all().is_undecided() { self.reckoned } else { Span::ZERO };
        let lasts = decided_within + self.settings.unknown_after;
        match self.lost_since {
            None if hears => self.lost_since = Some(now),
            Some(since) if hears && now - since > lasts => self.begin_anew(newest),
            _ => {}
        }
    }

    fn measurements(&self, input: usize) -> Measurements {
        let counts = self.filters.all().counts(input).unwrap_or_default();
        let refused = self.inlets.get(input).map_or(0, Inlet::refused);
        let ahead = self.inlets.get(input).map_or(0, Inlet::ahead);
        Measurements {
            used: counts.used,
            duplicate: counts.duplicate,
            too_late: counts.too_late,
            rejected: counts.rejected.saturating_add(refused),
            masked: counts.masked,
            ahead,
            restarts: self.restarts,
        }
    }
}

/// The first moment of a rhythm behind the present.
fn next(due: Time, period: Span, now: Time) -> Time {
    let missed = (now - due).0 / period.0.max(1);
    due + period.times(missed.max(0) + 1)
}
