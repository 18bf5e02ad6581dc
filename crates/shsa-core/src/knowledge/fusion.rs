//! Checked fusions: signals that estimators compute from others.
//!
//! The core knows the inputs of fusions, and when to trust their outputs; `shsa-estimate` computes them.

use super::draft::Place;
use super::ids::SignalId;
use super::{KnowledgeBase, SignalSet};
use crate::expression::Formula;
use crate::time::Span;
use crate::unit::Unit;
use alloc::collections::BTreeSet;
use alloc::string::String;
use alloc::vec::Vec;
use core::fmt;

/// How a fusion estimates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FusionMethod {
    /// The moving average of the inputs.
    Average,
    /// The moving median of the inputs.
    Median,
    /// The average weighted by the inputs' variances.
    Confidence,
    /// Marzullo's fault-tolerant interval.
    Marzullo,
    /// Schmid's fault-tolerant interval, which is continuous.
    Schmid,
    /// The estimate of Brooks and Iyengar.
    BrooksIyengar,
    /// The Kalman filter; formulas that are not linear are linearised.
    Kalman,
    /// The extended Kalman filter: the same filter, under the name for nonlinear formulas.
    ExtendedKalman,
    /// The unscented Kalman filter.
    UnscentedKalman,
    /// A Kalman filter whose outliers count in proportion (Huber).
    Huber,
    /// A Kalman filter whose outliers count for little (Student's distribution).
    Student,
    /// A particle filter.
    Particle,
}

impl FusionMethod {
    /// Every method and its name in models.
    pub const NAMES: [(&str, FusionMethod); 12] = [
        ("average", FusionMethod::Average),
        ("median", FusionMethod::Median),
        ("confidence", FusionMethod::Confidence),
        ("marzullo", FusionMethod::Marzullo),
        ("schmid", FusionMethod::Schmid),
        ("brooks_iyengar", FusionMethod::BrooksIyengar),
        ("kalman", FusionMethod::Kalman),
        ("extended_kalman", FusionMethod::ExtendedKalman),
        ("unscented_kalman", FusionMethod::UnscentedKalman),
        ("huber", FusionMethod::Huber),
        ("student", FusionMethod::Student),
        ("particle", FusionMethod::Particle),
    ];

    /// The method's name in models.
    #[must_use]
    pub fn name(self) -> &'static str {
        FusionMethod::NAMES.iter().find(|(_, method)| *method == self).map_or("", |(name, _)| name)
    }

    /// Whether the method uses the measurements only, without a model of the states.
    #[must_use]
    pub fn is_direct(self) -> bool {
        matches!(
            self,
            FusionMethod::Average
                | FusionMethod::Median
                | FusionMethod::Confidence
                | FusionMethod::Marzullo
                | FusionMethod::Schmid
                | FusionMethod::BrooksIyengar
        )
    }

    /// Whether the method intersects the intervals of its inputs: its output is bounds, and no distribution.
    #[must_use]
    pub fn is_of_intervals(self) -> bool {
        matches!(self, FusionMethod::Marzullo | FusionMethod::Schmid | FusionMethod::BrooksIyengar)
    }
}

/// Several signals fused to new ones. Formulas are in SI; of their symbols the states come first, then the controls.
#[derive(Clone, Debug, PartialEq)]
pub struct Fusion {
    /// Unique among fusions.
    pub name: String,
    /// The places of its parts in the model.
    pub places: FusionPlaces,
    /// The method.
    pub method: FusionMethod,
    /// The estimated quantities.
    pub states: Vec<FusionState>,
    /// The signals that set the control inputs.
    pub controls: Vec<SignalId>,
    /// The measurements of the states.
    pub inputs: Vec<FusionInput>,
    /// The new signals.
    pub outputs: Vec<FusionOutput>,
    /// Signals that predict inputs from the other inputs: witnesses about those inputs.
    pub predictions: Vec<FusionPrediction>,
    /// The settings.
    pub settings: FusionSettings,
}

/// The places of the parts of a fusion in the model. They are not part of its meaning, so all places compare as equal.
#[derive(Clone, Default)]
pub struct FusionPlaces {
    /// The place of the fusion's name.
    pub name: Place,
    /// The places of the states' names.
    pub states: Vec<Place>,
    /// The places of the inputs' names.
    pub inputs: Vec<Place>,
}

impl PartialEq for FusionPlaces {
    fn eq(&self, _: &FusionPlaces) -> bool {
        true
    }
}

impl fmt::Debug for FusionPlaces {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("FusionPlaces")
    }
}

/// A quantity that is estimated.
#[derive(Clone, Debug, PartialEq)]
pub struct FusionState {
    /// Unique in its fusion.
    pub name: String,
    /// The unit for display; `None` where neither the state nor a variable of its name has one.
    pub unit: Option<Unit>,
    /// The turn after which the values repeat, SI.
    pub turn: Option<f64>,
    /// The initial value, SI.
    pub initial: f64,
    /// Standard deviation of the initial value, SI.
    pub spread: f64,
    /// Standard deviation of the state's unmodelled change in a second, SI; grows with the root of time.
    pub noise: Formula,
    /// The state `dt` later; over states, controls and `dt`.
    pub transition: Formula,
}

/// A measurement of the states.
#[derive(Clone, Debug, PartialEq)]
pub struct FusionInput {
    /// The measured signal.
    pub signal: SignalId,
    /// The measured quantity, as a formula.
    pub measures: Formula,
    /// Standard deviation of the noise, SI; `None`: the signal's noise, else its errors.
    pub noise: Option<Formula>,
    /// The turn after which the values repeat, SI.
    pub turn: Option<f64>,
}

/// A prediction of an input from other inputs.
#[derive(Clone, Debug, PartialEq)]
pub struct FusionPrediction {
    /// The signal of the prediction.
    pub signal: SignalId,
    /// The place of the predicted input.
    pub input: usize,
    /// The places of the inputs that are left out, ascending; the predicted input is among them.
    pub without: Vec<usize>,
    /// Whether the other inputs see only how the input changes, so that the prediction starts from the input's earlier values:
    /// then it is derived from the input, and no witness about it.
    pub is_anchored: bool,
}

/// A new signal.
#[derive(Clone, Debug, PartialEq)]
pub struct FusionOutput {
    /// The signal.
    pub signal: SignalId,
    /// Its value.
    pub value: Formula,
    /// The probability that the interval holds the truth, above 0 and below 1.
    pub confidence: f64,
    /// The turn after which the values repeat, and the smallest of them, SI.
    pub turn: Option<(f64, f64)>,
}

/// The settings of a fusion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FusionSettings {
    /// Time between two estimates; one with every input when `None`.
    pub period: Option<Span>,
    /// How far behind the newest measurement a late one still counts.
    pub horizon: Span,
    /// The number of moments kept for late measurements.
    pub moments: usize,
    /// After how long without a measurement the estimate is unknown.
    pub unknown_after: Span,
    /// The share of healthy measurements that count; `None` takes all.
    pub gate: Option<f64>,
    /// How many inputs may be faulty, for fusion of intervals.
    pub faulty: usize,
    /// The number of values of a moving average or median.
    pub window: usize,
    /// The number of particles.
    pub particles: usize,
    /// The seed of the particles' random numbers.
    pub seed: u64,
}

/// The places of the states on which measurements depend, now or later.
pub(crate) fn measured_states<'m>(
    states: &[FusionState],
    measures: impl Iterator<Item = &'m Formula>,
) -> BTreeSet<usize> {
    let places = |formula: &Formula| formula.symbols().into_iter().map(|symbol| symbol.0 as usize);
    let mut open: Vec<usize> = measures.flat_map(places).collect();
    let mut found = BTreeSet::new();
    while let Some(place) = open.pop() {
        if let Some(state) = states.get(place).filter(|_| !found.contains(&place)) {
            found.insert(place);
            open.extend(places(&state.transition));
        }
    }
    found
}

impl Fusion {
    /// The places of the states that move a state, now or later, and its own.
    #[must_use]
    pub fn moved_by(&self, state: usize) -> BTreeSet<usize> {
        let transition = self.states.get(state).map(|it| &it.transition);
        let mut found = measured_states(&self.states, transition.into_iter());
        found.insert(state);
        found
    }
}

impl KnowledgeBase {
    /// All fusions.
    #[must_use]
    pub fn fusions(&self) -> &[Fusion] {
        &self.fusions
    }

    /// Replaces the fusions; they must name only signals of the knowledge base.
    #[must_use]
    pub fn with_fusions(self, fusions: Vec<Fusion>) -> KnowledgeBase {
        let outputs = fusions.iter().flat_map(|fusion| &fusion.outputs).map(|output| output.signal);
        let fused: SignalSet = outputs.collect();
        let predictions = fusions.iter().flat_map(|fusion| &fusion.predictions).map(|it| it.signal);
        let computed = fused.iter().chain(predictions).collect();
        KnowledgeBase { fusions, fused, computed, ..self }
    }

    /// Whether a fusion computes a signal, so that it is on no bus.
    #[must_use]
    pub fn is_computed(&self, signal: SignalId) -> bool {
        self.computed.contains(signal)
    }

    /// Whether a signal predicts an input of a fusion from the other inputs.
    #[must_use]
    pub fn is_prediction(&self, signal: SignalId) -> bool {
        self.is_computed(signal) && !self.is_fused(signal)
    }

    /// Whether a signal is an output of a fusion, which leaves suspects out and so outlasts the loss of some origins.
    #[must_use]
    pub fn is_fused(&self, signal: SignalId) -> bool {
        self.fused.contains(signal)
    }

    /// The signals whose loss loses a signal: its [origins](KnowledgeBase::origins), but for an output of a fusion only itself,
    /// as its estimator leaves suspects out.
    #[must_use]
    pub fn foundations(&self, signal: SignalId) -> SignalSet {
        if !self.fused.is_empty() && self.is_fused(signal) {
            [signal].into_iter().collect()
        } else {
            self.origins(signal)
        }
    }
}
