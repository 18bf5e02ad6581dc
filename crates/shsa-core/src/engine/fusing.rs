//! How the engine drives estimators: observations of their inputs go in, their outputs come in like any observation.
//!
//! The estimators are in `shsa-estimate`, above the core. Their outputs are taken once a moment, so that the order of the
//! observations within a moment does not matter.

use super::Engine;
use super::Options;
use crate::knowledge::{KnowledgeBase, Lineage};
use crate::monitor::Observed;
use crate::observation::Observation;
use crate::time::Time;
use alloc::boxed::Box;

/// How many measurements of an input were used, and why others were not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Measurements {
    /// Measurements that count.
    pub used: u64,
    /// Measurements that had been received before.
    pub duplicate: u64,
    /// Measurements older than the estimator can go back.
    pub too_late: u64,
    /// Measurements too far off, or not numbers.
    pub rejected: u64,
    /// Measurements of a signal that was not trusted.
    pub masked: u64,
    /// Measurements whose stamp is further ahead of the reception than the horizon.
    pub ahead: u64,
    /// How often the estimator was begun anew, for all inputs alike.
    pub restarts: u64,
}

/// An observation, and whether an estimator may use it.
#[derive(Clone, Copy, Debug)]
pub struct FusionInput<'o> {
    /// The observation.
    pub observation: &'o Observation,
    /// Whether the monitor has accepted the observation: a refused observation is no measurement.
    pub is_kept: bool,
    /// Whether the observation repeats the last one before a new answer is due: no new measurement, and no fault.
    pub is_repeated: bool,
    /// Whether its signal may be used now.
    pub is_trusted: bool,
}

/// The estimators of a knowledge base.
pub trait Fuse: core::fmt::Debug + Send {
    /// Takes an observation of an input or a control; ignores other signals.
    fn observe(&mut self, input: FusionInput<'_>, now: Time);

    /// Begins to compute the outputs of this moment.
    fn settle(&mut self, now: Time);

    /// The next computed observation, received now. Each is given to [`Fuse::observe`] before the next is asked for: another
    /// estimator may read it.
    fn poll(&mut self) -> Option<Observation>;

    /// When an output is due without any input.
    fn next_deadline(&self) -> Option<Time>;

    /// Goes on with a changed knowledge base: unchanged fusions keep their state.
    fn reload(&mut self, knowledge: &KnowledgeBase, lineage: &Lineage);

    /// The counts of an input of a fusion, by their places.
    fn measurements(&self, fusion: usize, input: usize) -> Measurements;
}

impl Engine {
    /// As [`Engine::new`] with estimators, which must be those of the knowledge base.
    #[must_use]
    pub fn with_estimators(knowledge: KnowledgeBase, options: Options, estimators: Box<dyn Fuse>) -> Engine {
        let mut engine = Engine::new(knowledge, options);
        engine.estimators = Some(estimators);
        engine
    }

    /// The counts of an input of a fusion, by their places; zero without estimators.
    #[must_use]
    pub fn measurements(&self, fusion: usize, input: usize) -> Measurements {
        let estimators = self.estimators.as_ref();
        estimators.map(|it| it.measurements(fusion, input)).unwrap_or_default()
    }

    /// Whether the engine drives estimators.
    #[inline]
    pub(super) fn fuses(&self) -> bool {
        self.has_fusions && self.estimators.is_some()
    }

    /// Hands an observation to the estimators.
    #[inline(never)]
    pub(super) fn feed(&mut self, observation: &Observation, observed: Observed, now: Time) {
        let is_trusted =
            self.knowledge.is_available(observation.signal) && self.ledger.trusts(observation.signal);
        if let Some(estimators) = &mut self.estimators {
            let Observed { kept: is_kept, repeated: is_repeated, .. } = observed;
            estimators.observe(FusionInput { observation, is_kept, is_repeated, is_trusted }, now);
        }
    }

    /// Takes the estimators' outputs of this moment.
    pub(super) fn fuse(&mut self, now: Time) {
        let Some(estimators) = &mut self.estimators else { return };
        estimators.settle(now);
        while let Some(observation) = self.estimators.as_mut().and_then(|it| it.poll()) {
            self.observe(&observation);
        }
    }

    /// Takes over the estimators of the engine before.
    pub(super) fn inherit_estimators(&mut self, old: &mut Engine, lineage: &Lineage) {
        self.estimators = old.estimators.take();
        if let Some(estimators) = &mut self.estimators {
            estimators.reload(&self.knowledge, lineage);
        }
    }
}
