//! The fusions of a model beside the engine: observations go in, estimates come out as observations.
//!
//! A node starts with its first measurement. Each measurement counts at its own time of validity; an output is stamped with its
//! moment in the clock of the inputs. There is no output without an estimate: before the first measurement, after too long
//! without one, while a control input is silent, or during an undecided contradiction of inputs.
//!
//! A node restarts where it could not recover: after a lasting contradiction, as after a power cycle of what it measures, and
//! when all measurements are older than it can go back, as after a jump of the clocks. A stamp further ahead of its reception
//! than the horizon is ignored: it would make all right ones too late.

mod each;
mod build;
mod filters;
mod noise;
mod check;
mod inlet;
mod outputs;
mod uniqueness;
mod nodes;

pub use check::{Observability, check, observability};
pub use nodes::{Nodes, engine};

use crate::Error;
use crate::fusion::{Fusion, Gate, Options, Verdict};
use crate::method::Measurement;
use filters::Filters;
use inlet::{Inlet, Reading, Steering};
use outputs::Outputs;
use shsa_core::engine::{FusionInput, Measurements};
use shsa_core::knowledge::{self, FusionSettings, KnowledgeBase};
use shsa_core::observation::Observation;
use shsa_core::time::{Span, Time};
use std::collections::VecDeque;
use uniqueness::Search;

/// The most numbers of the moments that a filter keeps, 32 MiB: with many particles, late values have a shorter horizon.
const MEMORY: usize = 1 << 22;
/// After this many rejections in a row, other inputs decide about an input.
const PATIENCE: u32 = 5;
/// After this many measurements in a row that are too late, or too far ahead, and none that counts, the clocks have jumped.
const ALL_TOO_LATE: u32 = 12;

/// A running fusion.
struct Node {
    /// The checked fusion, to see whether a change concerns it.
    model: knowledge::Fusion,
    settings: FusionSettings,
    filters: Filters,
    inlets: Vec<Inlet>,
    steering: Vec<Steering>,
    /// See [`Options::reckoned`].
    reckoned: Span,
    outputs: Outputs,
    /// The newest moment of an observation, and when that was received.
    newest: Option<(Time, Time)>,
    /// Whether a measurement has counted since the start.
    has_measured: bool,
    /// When a measurement of a trusted input last came.
    heard: Option<Time>,
    /// The number of measurements in a row that came too late.
    too_late: u32,
    /// How far the clocks of all inputs run ahead of the reception, and the number of stamps in a row that were further ahead.
    lead: Span,
    ahead: u32,
    /// Since when the estimate is unknown although measurements come.
    lost_since: Option<Time>,
    /// When the next estimate is due, for a node with a period.
    due: Option<Time>,
    restarts: u64,
}

impl Node {
    fn new(knowledge: &KnowledgeBase, model: &knowledge::Fusion) -> Result<Node, Error> {
        let settings = model.settings;
        // A direct method must see the values of all inputs together: it tolerates outliers itself.
        let gate =
            settings.gate.filter(|_| !model.method.is_direct()).map(|share| Gate::new(share, PATIENCE));
        let options = Options {
            horizon: settings.horizon,
            moments: settings.moments,
            gate,
            unknown_after: settings.unknown_after,
        };
        let (inputs, controls) = (model.inputs.len(), model.controls.len());
        let make = |options: Options| {
            let method = build::bounded(knowledge, model)?;
            let moments = options.moments.min(MEMORY / method.memory_len().max(1)).max(1);
            let mut fusion = Fusion::new(method, Time(0), inputs, controls, Options { moments, ..options })?;
            if !model.method.is_direct() {
                fusion.set_derived(model.inputs.iter().map(|input| knowledge.is_fused(input.signal)));
            }
            Ok(fusion)
        };
        let witness = || make(Options { gate: None, ..options });
        let mut sets = witnesses(knowledge, model, options.reckoned())?;
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
            heard: None,
            too_late: 0,
            lead: Span::ZERO,
            ahead: 0,
            lost_since: None,
            due: None,
            restarts: 0,
        })
    }

    /// Takes an observation of an input.
    fn measure(&mut self, place: usize, input: FusionInput<'_>, now: Time) {
        let Some(inlet) = self.inlets.get_mut(place) else { return };
        let Some(Reading { at, value, variance, bound }) = inlet.read(input) else { return };
        if !self.is_time(at, now) {
            self.inlets.get_mut(place).into_iter().for_each(Inlet::refuse_ahead);
            return;
        }
        self.inlets.get_mut(place).into_iter().for_each(|inlet| inlet.note_arrival(at));
        if self.newest.is_none() {
            self.begin(at);
        }
        let measurement = Measurement { sensor: place, value, variance, bound };
        self.filters.trust(place, input.is_trusted);
        let verdict = self.filters.measure(at, measurement);
        self.count(verdict, at, now);
        if !matches!(verdict, Verdict::Masked) {
            self.heard = Some(now);
        }
        if !matches!(verdict, Verdict::TooLate | Verdict::Duplicate) {
            self.advance(at, now);
            self.outputs.expect(at, measurement);
        }
    }

    /// Takes an observation of a control input.
    fn steer(&mut self, place: usize, input: FusionInput<'_>, now: Time) {
        let Some(steering) = self.steering.get_mut(place) else { return };
        let most = now + self.lead + self.settings.horizon;
        let Some((at, value)) = steering.read(input, now).filter(|(at, _)| *at <= most) else { return };
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
        // When the clock that runs ahead came first, all others only seem late.
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

    /// Whether a stamp is not too far ahead of its reception. Where all stamps are, the clocks are ahead, and the node restarts.
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

    /// Outputs the estimates that are due.
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
                self.outputs.publish(&estimate, at, now, queue);
                self.publish_before(at, now, queue);
            }
            None => self.look_after(newest, now),
        }
    }

    /// Gives what was unknown at a moment as it was at the newest earlier one at which it is known. An input whose stamps are behind
    /// those of the others counts at its own times: of the newest moments fewer inputs tell than intervals need.
    fn publish_before(&mut self, mut at: Time, now: Time, queue: &mut VecDeque<Observation>) {
        let Node { outputs, filters, .. } = self;
        while outputs.lack(at)
            && let Some((moment, estimate)) = filters.all_mut().estimate_before(at)
        {
            outputs.publish(&estimate, moment, now, queue);
            at = moment;
        }
    }

    /// Notes an unknown estimate: if that lasts while measurements come, the node restarts. A conflict ends before. While no input is
    /// trusted, nothing contradicts the estimate: it goes on from where it was.
    fn look_after(&mut self, newest: Time, now: Time) {
        let receives = self.heard == Some(now) && self.has_measured;
        let decided_within = if self.filters.all().is_undecided() { self.reckoned } else { Span::ZERO };
        let lasts = decided_within + self.settings.unknown_after;
        match self.lost_since {
            None if receives => self.lost_since = Some(now),
            Some(since) if receives && now - since > lasts => self.begin_anew(newest),
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

/// The sets of inputs that predictions leave out, but those without which it is open what they show: these are no witnesses.
fn witnesses(
    knowledge: &KnowledgeBase,
    model: &knowledge::Fusion,
    reckoned: Span,
) -> Result<Vec<Vec<usize>>, Error> {
    let mut sets: Vec<Vec<usize>> = model.predictions.iter().map(|it| it.without.clone()).collect();
    sets.sort_unstable();
    sets.dedup();
    if !sets.is_empty() {
        let mut search = Search::new(build::system(knowledge, model, false)?, model, reckoned);
        sets.retain(|without| !search.is_open(without));
    }
    Ok(sets)
}

/// The first moment of a rhythm after the present.
fn next(due: Time, period: Span, now: Time) -> Time {
    let missed = (now - due).0 / period.0.max(1);
    due + period.times(missed.max(0) + 1)
}
