//! How estimators are driven beside the stages: what their inputs say goes in, what they compute comes in like any observation.
//!
//! The estimators themselves are in `shsa-estimate`, above the core. What they say is told with the moment that it came of: once
//! a moment, whatever the order of what was observed in it.

use super::Engine;
use super::Options;
use crate::knowledge::{KnowledgeBase, Lineage};
use crate::monitor::Observed;
use crate::observation::Observation;
use crate::time::Time;
use alloc::boxed::Box;

/// What became of an input's measurements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Measurements {
    /// Those that count.
    pub used: u64,
    /// Those heard before.
    pub duplicate: u64,
    /// Those older than can be gone back to.
    pub too_late: u64,
    /// Those too far off, or no numbers.
    pub rejected: u64,
    /// Those of a signal that was not trusted.
    pub masked: u64,
    /// Those whose stamp is further ahead of the reception than the horizon.
    pub ahead: u64,
    /// How often the estimator was begun anew, for all inputs alike.
    pub restarts: u64,
}

/// An observation, and what is thought of it.
#[derive(Clone, Copy, Debug)]
pub struct Heard<'o> {
    /// What was observed.
    pub observation: &'o Observation,
    /// Whether the monitor has taken it in: what it has refused is no measurement.
    pub is_kept: bool,
    /// Whether it says again what stands: no new measurement either, but nothing is wrong with it.
    pub is_repeated: bool,
    /// Whether its signal may be used now.
    pub is_trusted: bool,
}

/// The estimators of a knowledge base.
pub trait Fuse: core::fmt::Debug + Send {
    /// Hears what an input or a control says; of other signals nothing comes.
    fn observe(&mut self, heard: Heard<'_>, now: Time);

    /// Computes what is known at this moment.
    fn settle(&mut self, now: Time);

    /// What was computed, one by one: observations of the signals that it computes, received now.
    fn poll(&mut self) -> Option<Observation>;

    /// When something is to be told without any input.
    fn next_deadline(&self) -> Option<Time>;

    /// Goes on with a changed knowledge base: what is still the same keeps its state.
    fn reload(&mut self, knowledge: &KnowledgeBase, lineage: &Lineage);

    /// What became of the measurements of an input of a fusion, by their places.
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

    /// What became of the measurements of an input of a fusion, by their places; nothing without estimators.
    #[must_use]
    pub fn measurements(&self, fusion: usize, input: usize) -> Measurements {
        let estimators = self.estimators.as_ref();
        estimators.map(|it| it.measurements(fusion, input)).unwrap_or_default()
    }

    /// Whether what is observed concerns estimators.
    #[inline]
    pub(super) fn fuses(&self) -> bool {
        self.has_fusions && self.estimators.is_some()
    }

    /// Lets the estimators hear an observation.
    #[inline(never)]
    pub(super) fn let_hear(&mut self, observation: &Observation, observed: Observed, now: Time) {
        let is_trusted =
            self.knowledge.is_available(observation.signal) && self.judge.trusts(observation.signal);
        if let Some(estimators) = &mut self.estimators {
            let Observed { kept: is_kept, repeated: is_repeated, .. } = observed;
            estimators.observe(Heard { observation, is_kept, is_repeated, is_trusted }, now);
        }
    }

    /// Takes in what the estimators say now.
    pub(super) fn fuse(&mut self, now: Time) {
        let Some(estimators) = &mut self.estimators else { return };
        estimators.settle(now);
        while let Some(observation) = self.estimators.as_mut().and_then(|it| it.poll()) {
            self.observe(&observation);
        }
    }

    /// Goes on with the estimators of the engine before.
    pub(super) fn inherit_estimators(&mut self, old: &mut Engine, lineage: &Lineage) {
        self.estimators = old.estimators.take();
        if let Some(estimators) = &mut self.estimators {
            estimators.reload(&self.knowledge, lineage);
        }
    }
}
