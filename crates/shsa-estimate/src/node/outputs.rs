//! The outputs of a node: its estimates, and predictions of inputs by the other inputs.

use super::build;
use super::filters::Filters;
use crate::Error;
use crate::continuous::Continuous;
use crate::fusion::Estimate;
use crate::kernel::dot;
use crate::matrix::multiply;
use crate::method::{Innovation, Measurement};
use crate::normal::two_sided;
use crate::system::System;
use shsa_core::circle;
use shsa_core::interval::Interval;
use shsa_core::knowledge::{Fusion, KnowledgeBase, SignalId};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::{Span, Time};
use shsa_core::unit::Unit;
use std::collections::VecDeque;

/// The probability that a prediction's interval holds the truth: as witnesses, predictions must rarely be wrong.
const CERTAIN: f64 = 0.999_9;
/// A prediction this many times less certain than the measurement is no evidence about it.
const VAGUE: f64 = 10.0;

/// A computed signal.
#[derive(Clone, Debug)]
struct Computed {
    signal: SignalId,
    unit: Option<Unit>,
    /// The turn and its begin, for a value that wraps.
    turn: Option<(f64, f64)>,
    /// The half-width of the interval, in standard deviations.
    reach: f64,
}

impl Computed {
    fn new(knowledge: &KnowledgeBase, signal: SignalId, reach: f64) -> Computed {
        let made = &knowledge.signals()[signal];
        let variable = &knowledge.variables()[made.variable];
        let turn = variable.wraps.map(|turn| (turn, variable.turn_begins()));
        Computed { signal, unit: made.unit.clone(), turn, reach }
    }

    /// The value, which may be off by a bound and by noise of a variance, as an observation; `None` if one of these is not a number, or it
    /// may be anywhere on the circle.
    fn observed(&self, value: f64, bound: f64, variance: f64, at: Time, now: Time) -> Option<Observation> {
        if variance.is_nan() || bound.is_nan() {
            return None;
        }
        let reach = bound + self.reach * variance.max(0.0).sqrt();
        let interval = Interval::new((value - reach).next_down(), (value + reach).next_up());
        let is_anywhere = self.turn.is_some_and(|(turn, _)| interval.width() >= turn);
        if interval.is_empty() || !interval.is_bounded() || is_anywhere {
            return None;
        }
        let shown = self.turn.map_or(interval, |(turn, from)| circle::brought_back(interval, from, turn));
        let shown = self.unit.as_ref().map_or(shown, |unit| unit.from_si_interval(shown));
        let value = RawValue::Interval { lo: shown.lo(), hi: shown.hi() };
        Some(Observation { signal: self.signal, stamp: at, received: now, value })
    }
}

/// A prediction of an input.
struct Prediction {
    computed: Computed,
    input: usize,
    /// The place of the filter.
    set: usize,
    is_anchored: bool,
    /// Since when the prediction contradicts the measurements.
    contradicts_since: Option<Time>,
    /// How long a reckoning without the input bears witness about it, and when the input last spoke.
    reckoned: Span,
    last_input: Option<Time>,
    /// Whether the reckoning was too long to bear witness, and waits for an estimate to restart from.
    is_void: bool,
}

/// An anchored prediction restarts when the last innovation of the filter over all inputs is this many times less uncertain, in
/// variance.
const BETTER: f64 = 4.0;

/// The squared number of standard deviations from which on a prediction contradicts.
const CONTRADICTS: f64 = 9.0;
/// A contradicting prediction restarts after this time: enough to isolate the faulty input.
const LONGEST: Span = Span::from_millis(10_000);

impl Prediction {
    /// Notes a measurement of the input; whether the reckoning bears no witness about it: the input returns after too long a
    /// gap and does not fit, or did so before and nothing was there to restart from.
    fn is_void_at(&mut self, at: Time, contradicts: bool) -> bool {
        let before = self.last_input.replace(at);
        let is_back = before.is_some_and(|before| at - before > self.reckoned);
        self.is_void |= self.is_anchored && is_back && contradicts;
        self.is_void
    }

    /// Restarts the prediction's filter where it has become vague beside the filter over all inputs and no contradiction is lost,
    /// or where it has contradicted for long: then it only shows the past.
    fn anchor(&mut self, known: Option<Innovation>, at: Time, filters: &mut Filters) {
        let best = filters.all().innovation(self.input).map_or(f64::INFINITY, |(_, best)| best.uncertainty());
        let is_better = |it: Innovation| it.uncertainty() > BETTER * best.max(0.0);
        let is_vague = known.is_none_or(|it| is_better(it) && it.contradiction() < 1.0);
        let contradicts = known.is_some_and(|it| it.contradiction() > CONTRADICTS);
        let since = *self.contradicts_since.get_or_insert(at);
        if !contradicts {
            self.contradicts_since = None;
        }
        if is_vague && filters.is_calm() || contradicts && at - since > LONGEST {
            filters.anchor(self.set, at);
            self.contradicts_since = None;
        }
    }
}

/// The outputs of a node.
pub(super) struct Outputs {
    /// The model: the inputs as sensors, followed by the outputs.
    reader: Continuous,
    inputs: usize,
    outputs: Vec<Computed>,
    predictions: Vec<Prediction>,
    /// The measurement of each input at this moment.
    expected: Vec<Option<(Time, Measurement)>>,
    controls: Vec<f64>,
    mean: Vec<f64>,
    gradient: Vec<f64>,
    work: Vec<f64>,
    /// The newest moment of which each output was given.
    latest: Vec<Option<Time>>,
}

impl Outputs {
    pub(super) fn new(
        knowledge: &KnowledgeBase,
        model: &Fusion,
        sets: &[Vec<usize>],
        reckoned: Span,
    ) -> Result<Outputs, Error> {
        let outputs = model.outputs.iter();
        let outputs = outputs.map(|output| {
            // What intersects intervals gives an interval, whatever the confidence.
            let reach =
                if model.method.is_of_intervals() { build::REACH } else { two_sided(output.confidence) };
            Computed::new(knowledge, output.signal, reach)
        });
        let predictions = model.predictions.iter().filter_map(|it| {
            let computed = Computed::new(knowledge, it.signal, two_sided(CERTAIN));
            let set = sets.binary_search(&it.without).ok()?;
            let is_anchored = it.is_anchored;
            let (contradicts_since, last_input) = (None, None);
            Some(Prediction {
                computed,
                input: it.input,
                set,
                is_anchored,
                contradicts_since,
                reckoned,
                last_input,
                is_void: false,
            })
        });
        let n = model.states.len();
        Ok(Outputs {
            reader: build::system(knowledge, model, true)?,
            inputs: model.inputs.len(),
            outputs: outputs.collect(),
            predictions: predictions.collect(),
            expected: vec![None; model.inputs.len()],
            controls: vec![0.0; model.controls.len()],
            mean: model.states.iter().map(|state| state.initial).collect(),
            gradient: vec![0.0; n],
            work: vec![0.0; n],
            latest: vec![None; model.outputs.len()],
        })
    }

    pub(super) fn forget(&mut self) {
        self.latest.fill(None);
        self.expected.fill(None);
        self.predictions.iter_mut().for_each(|it| (it.last_input, it.is_void) = (None, false));
    }

    pub(super) fn control(&mut self, place: usize, value: f64) {
        if let Some(control) = self.controls.get_mut(place) {
            *control = value;
        }
    }

    /// Notes a measurement of an input: its prediction is due.
    pub(super) fn expect(&mut self, at: Time, measurement: Measurement) {
        if let Some(expected) = self.expected.get_mut(measurement.sensor) {
            *expected = Some((at, measurement));
        }
    }

    /// Outputs the predictions for the measurements of this moment.
    pub(super) fn predict(&mut self, filters: &mut Filters, now: Time, queue: &mut VecDeque<Observation>) {
        let mut measured = self.expected.iter().flatten();
        let is_one = measured.all(|(_, measurement)| filters.fits_together(measurement, CONTRADICTS));
        for prediction in &mut self.predictions {
            let Some((at, measurement)) = self.expected.get(prediction.input).copied().flatten() else {
                continue;
            };
            let known =
                filters.innovation(prediction.set, prediction.input).filter(|(about, _)| *about == at);
            let contradicts = known.is_some_and(|(_, it)| it.contradiction() > CONTRADICTS);
            if prediction.is_void_at(at, contradicts) {
                if is_one {
                    filters.anchor_together(prediction.set, at);
                    prediction.is_void = false;
                }
                continue;
            }
            if let Some((_, innovation)) = known
                && innovation.uncertainty() <= VAGUE * VAGUE * innovation.noise
            {
                let value = measurement.value - innovation.value;
                let noise_alone = (0.0, innovation.uncertainty());
                let (bound, variance) = innovation.errors.map_or(noise_alone, |it| (it.expected, it.random));
                queue.extend(prediction.computed.observed(value, bound, variance, at, now));
            }
            if prediction.is_anchored {
                prediction.anchor(known.map(|(_, it)| it), at, filters);
            }
        }
        self.expected.fill(None);
    }

    /// Gives the outputs that are known at a moment and were not given of it or of a later one.
    pub(super) fn publish(
        &mut self,
        estimate: &Estimate<'_>,
        at: Time,
        now: Time,
        queue: &mut VecDeque<Observation>,
    ) {
        self.mean.copy_from_slice(estimate.mean);
        for place in 0..self.outputs.len() {
            if !self.is_older(place, at) {
                continue;
            }
            let (value, (bound, variance)) = self.value(place, estimate);
            let computed = self.outputs.get(place);
            if let Some(observation) = computed.and_then(|it| it.observed(value, bound, variance, at, now)) {
                self.latest.get_mut(place).into_iter().for_each(|latest| *latest = Some(at));
                queue.push_back(observation);
            }
        }
    }

    /// Whether some output was not given of this moment or of a later one.
    pub(super) fn lack(&self, at: Time) -> bool {
        (0..self.outputs.len()).any(|place| self.is_older(place, at))
    }

    fn is_older(&self, place: usize, at: Time) -> bool {
        self.latest.get(place).is_some_and(|latest| latest.is_none_or(|latest| latest < at))
    }

    /// An output, how far it may be off within bounds, and its variance by noise.
    fn value(&mut self, place: usize, estimate: &Estimate<'_>) -> (f64, (f64, f64)) {
        let Outputs { reader, inputs, mean, controls, gradient, work, .. } = self;
        let value = reader.gradient(*inputs + place, mean, controls, gradient);
        multiply(estimate.spread, gradient, work);
        (value, estimate.errors(gradient, dot(gradient, work)))
    }
}
