//! The generic service: inputs, a program, an output. A substitute is one.
//!
//! Starting one costs no I/O and no waiting: it has its own short past of its inputs from the moment on at which
//! it is started, and computes whenever its fastest input delivers, the others brought to that moment.

use crate::alignment::{Port, Sample};
use crate::computation::{Computation, Computed};
use crate::knowledge::{IdVec, KnowledgeBase, SignalId};
use crate::observation::Observation;
use crate::substitution::Way;
use crate::time::Validity;

/// A way of knowing that is provided as an output.
#[derive(Debug)]
pub struct Service {
    computation: Computation,
    /// Validity of the trigger's newest observation that is not computed yet.
    pending: Option<Validity>,
}

impl Service {
    /// Starts the service of a way; `None` when the way is structure only.
    #[must_use]
    pub fn start(knowledge: &KnowledgeBase, way: Way) -> Option<Service> {
        let computation = Computation::new(knowledge, way, Computation::fastest_input)?;
        Some(Service { computation, pending: None })
    }

    /// What it computes.
    #[must_use]
    pub fn way(&self) -> &Way {
        self.computation.way()
    }

    /// Notes an observation; it computes by [`Service::compute`].
    pub fn observe(&mut self, knowledge: &KnowledgeBase, observation: &Observation) {
        if self.computation.trigger() == Some(observation.signal) {
            self.pending = Some(knowledge.signals()[observation.signal].validity(observation.stamp));
        }
    }

    /// The output when the fastest input has delivered since the last call and all inputs are known.
    ///
    /// `last` is the last value of the output variable, for formulas that go on from it.
    pub fn compute<'a>(
        &'a mut self,
        ports: &'a IdVec<SignalId, Port>,
        last: Option<Sample>,
    ) -> Option<(Computed<'a>, Validity)> {
        let moment = self.pending.take()?;
        self.computation.evaluate(ports, moment, last)
    }
}
