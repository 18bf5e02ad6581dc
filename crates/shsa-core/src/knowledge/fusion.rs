//! Fusions: signals that estimators compute from others, checked.
//!
//! The core knows what they are derived from and when to trust them; how they are computed, `shsa-estimate` knows.

use super::draft::Place;
use super::ids::SignalId;
use super::{KnowledgeBase, SignalSet};
use crate::expression::Formula;
use crate::time::Span;
use crate::unit::Unit;
use alloc::string::String;
use alloc::vec::Vec;
use core::fmt;

/// How a fusion estimates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FusionMethod {
    /// The moving average of what the inputs say.
    Average,
    /// The moving median.
    Median,
    /// The average weighted by the inputs' variances.
    Confidence,
    /// Marzullo's fault-tolerant interval.
    Marzullo,
    /// Schmid's, which is continuous.
    Schmid,
    /// The estimate of Brooks and Iyengar.
    BrooksIyengar,
    /// The Kalman filter; formulas that are not linear are linearised.
    Kalman,
    /// The extended Kalman filter: the same, by the name that tells of formulas that are not linear.
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
    /// Every method with its word.
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

    /// Its word.
    #[must_use]
    pub fn name(self) -> &'static str {
        FusionMethod::NAMES.iter().find(|(_, method)| *method == self).map_or("", |(name, _)| name)
    }

    /// Whether it looks at what is measured only, not at the model of how the states go on.
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
}

/// Several signals fused to new ones. Formulas are in SI; of their symbols the states come first, then the controls.
#[derive(Clone, Debug, PartialEq)]
pub struct Fusion {
    /// Unique among fusions.
    pub name: String,
    /// Where its parts stand in the model.
    pub places: FusionPlaces,
    /// How it estimates.
    pub method: FusionMethod,
    /// What is estimated.
    pub states: Vec<FusionState>,
    /// The signals that set the control inputs.
    pub controls: Vec<SignalId>,
    /// What measures the states.
    pub inputs: Vec<FusionInput>,
    /// The new signals.
    pub outputs: Vec<FusionOutput>,
    /// Signals that say what an input would measure, by others: witnesses about it.
    pub predictions: Vec<FusionPrediction>,
    /// Its settings.
    pub settings: FusionSettings,
}

/// Where the parts of a fusion stand in the model that it was read from: no part of what it says, so all are equal.
#[derive(Clone, Default)]
pub struct FusionPlaces {
    /// Its name.
    pub name: Place,
    /// The names of its states.
    pub states: Vec<Place>,
    /// The names of its inputs.
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
    /// For people; `None` when neither it nor a variable of its name has one.
    pub unit: Option<Unit>,
    /// The turn after which its values are the same again, SI.
    pub turn: Option<f64>,
    /// What it is at first, SI.
    pub initial: f64,
    /// Standard deviation of that, SI.
    pub spread: f64,
    /// Standard deviation of what the transition does not know, SI, in a second: it grows with the root of time.
    pub noise: Formula,
    /// What it is `dt` later; over states, controls and `dt`.
    pub transition: Formula,
}

/// What measures the states.
#[derive(Clone, Debug, PartialEq)]
pub struct FusionInput {
    /// A measured signal.
    pub signal: SignalId,
    /// What it measures.
    pub measures: Formula,
    /// Standard deviation of its noise, SI; `None` takes that of the signal, else what its errors say.
    pub noise: Option<Formula>,
    /// The turn after which its values are the same again, SI.
    pub turn: Option<f64>,
}

/// What an input would measure, by the inputs that are left.
#[derive(Clone, Debug, PartialEq)]
pub struct FusionPrediction {
    /// The new signal.
    pub signal: SignalId,
    /// Of which input, by its place.
    pub input: usize,
    /// The inputs that are left out, by their places, ascending; that input is among them.
    pub without: Vec<usize>,
    /// Whether the others see no more than how it changes, so that the prediction begins from what was known with it: then it is
    /// derived from that input, too, and no witness for it.
    pub is_anchored: bool,
}

/// A new signal.
#[derive(Clone, Debug, PartialEq)]
pub struct FusionOutput {
    /// Which.
    pub signal: SignalId,
    /// Its value.
    pub value: Formula,
    /// The share of probability within its interval, above 0 and below 1.
    pub confidence: f64,
    /// The turn after which its values are the same again, and the least one of them, SI.
    pub turn: Option<(f64, f64)>,
}

/// How a fusion takes measurements in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FusionSettings {
    /// Time between two estimates; one with every input when `None`.
    pub period: Option<Span>,
    /// How far behind the newest measurement a late one still counts.
    pub horizon: Span,
    /// How many moments are kept for that.
    pub moments: usize,
    /// After how long without a measurement nothing is known.
    pub unknown_after: Span,
    /// The share of healthy measurements that count; `None` takes all.
    pub gate: Option<f64>,
    /// How many inputs may lie, for fusion of intervals.
    pub faulty: usize,
    /// How many values a moving average or median goes over.
    pub window: usize,
    /// How many particles there are.
    pub particles: usize,
    /// Of the particles' random numbers.
    pub seed: u64,
}

impl KnowledgeBase {
    /// All fusions.
    #[must_use]
    pub fn fusions(&self) -> &[Fusion] {
        &self.fusions
    }

    /// The same with these fusions; they must name only its signals.
    #[must_use]
    pub fn with_fusions(self, fusions: Vec<Fusion>) -> KnowledgeBase {
        let outputs = fusions.iter().flat_map(|fusion| &fusion.outputs).map(|output| output.signal);
        let fused: SignalSet = outputs.collect();
        let predictions = fusions.iter().flat_map(|fusion| &fusion.predictions).map(|it| it.signal);
        let computed = fused.iter().chain(predictions).collect();
        KnowledgeBase { fusions, fused, computed, ..self }
    }

    /// Whether a signal is computed by a fusion, and not found on any bus.
    #[must_use]
    pub fn is_computed(&self, signal: SignalId) -> bool {
        self.computed.contains(signal)
    }

    /// Whether a signal tells what an input of a fusion would measure, by the others.
    #[must_use]
    pub fn is_prediction(&self, signal: SignalId) -> bool {
        self.is_computed(signal) && !self.is_fused(signal)
    }

    /// Whether a signal is an output of a fusion: it leaves suspects out, and is there without some of what it is derived from.
    #[must_use]
    pub fn is_fused(&self, signal: SignalId) -> bool {
        self.fused.contains(signal)
    }

    /// The signals without any of which a signal is lost: as [`KnowledgeBase::origins`], but one that is fused only rests on
    /// itself, as its estimator leaves suspects out.
    #[must_use]
    pub fn foundations(&self, signal: SignalId) -> SignalSet {
        if !self.fused.is_empty() && self.is_fused(signal) {
            [signal].into_iter().collect()
        } else {
            self.origins(signal)
        }
    }
}
