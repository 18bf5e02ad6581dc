//! The generic service: inputs, a program, an output. A substitute is such a service.
//!
//! Starting a service costs no I/O and no waiting, as the past of its inputs is known. It computes whenever its fastest input
//! delivers, with the others brought to that moment.

use crate::alignment::{Port, Sample};
use crate::assurance::Assured;
use crate::computation::{Computation, Computed, Task, Timing};
use crate::interval::Interval;
use crate::knowledge::{IdVec, KnowledgeBase, Lineage, SignalId, VariableId};
use crate::observation::Observation;
use crate::substitution::Way;
use crate::time::{Span, Time, Validity};
use alloc::vec::Vec;

/// A way of knowing that is computed as an output.
#[derive(Debug)]
pub struct Service {
    computation: Computation,
    /// The validity of the trigger's newest observation, if it is not computed yet.
    pending: Option<Validity>,
}

impl Service {
    /// Starts the service of a way that contracts admit now; `None` when the way is structure only.
    ///
    /// What the ports remember of its inputs is computed first, so that windows are full from the first output on. Where the
    /// output is owed since a time, the first one is what was last known, if that is newer: it does not wait for the next
    /// observation. What stands is owed although it is older.
    #[must_use]
    pub fn start(
        knowledge: &KnowledgeBase,
        way: Assured<'_, Way>,
        ports: &IdVec<SignalId, Port>,
        owed_since: Option<Time>,
    ) -> Option<Service> {
        let mut computation = Computation::new(knowledge, way.into_value(), Computation::fastest_input)?;
        let mut pending = None;
        let stands = computation.stands(knowledge);
        if let Some(trigger) = computation.trigger() {
            let mut moments = ports[trigger].moments().peekable();
            while let Some(moment) = moments.next() {
                let is_owed = owed_since.is_some_and(|since| moment.to > since);
                match moments.peek() {
                    None if is_owed => pending = Some(moment),
                    None if stands => pending = owed_since.map(Validity::at),
                    _ => _ = computation.evaluate(ports, moment, None),
                }
            }
        }
        Some(Service { computation, pending })
    }

    /// The same, after another process has computed the service and left this moment undone: it is computed next.
    #[must_use]
    pub fn start_at(
        knowledge: &KnowledgeBase,
        way: Assured<'_, Way>,
        ports: &IdVec<SignalId, Port>,
        undone: Validity,
    ) -> Option<Service> {
        let mut computation = Computation::new(knowledge, way.into_value(), Computation::fastest_input)?;
        if let Some(trigger) = computation.trigger() {
            for moment in ports[trigger].moments().filter(|moment| moment.to < undone.to) {
                computation.evaluate(ports, moment, None);
            }
        }
        Some(Service { computation, pending: Some(undone) })
    }

    /// The task that [`Service::compute`] would compute now, for another process.
    pub fn task(&mut self, ports: &IdVec<SignalId, Port>, last: Option<Sample>) -> Option<Task> {
        let moment = self.pending.take()?;
        self.computation.task(ports, moment, last)
    }

    /// Tasks for the past inputs in the ports before a moment, oldest first: another process begins with them, so that windows
    /// are full.
    pub fn past(&self, ports: &IdVec<SignalId, Port>, before: Validity) -> Vec<Task> {
        let moments = self.computation.trigger().into_iter().flat_map(|trigger| ports[trigger].moments());
        let moments = moments.filter(|moment| moment.to < before.to);
        moments.filter_map(|moment| self.computation.task(ports, moment, None)).collect()
    }

    /// Takes over the memory of the same way's service from before a change of the knowledge base. Returns whether it does: only
    /// when both compute the same.
    pub fn inherit(&mut self, old: &mut Service, lineage: &Lineage) -> bool {
        let is_same = self.computation.inherit(&mut old.computation, lineage);
        if is_same {
            self.pending = old.pending;
        }
        is_same
    }

    /// Sets the present value of a constant that is learned.
    pub fn set_constant(&mut self, variable: VariableId, value: Interval) {
        self.computation.set_constant(variable, value);
    }

    /// Forgets what it has seen, where it reads a signal that has begun anew.
    pub fn begin_anew(&mut self, signal: SignalId) {
        self.computation.begin_anew(signal);
    }

    /// The age of a way's outputs when its service gives them.
    #[must_use]
    pub fn lag(knowledge: &KnowledgeBase, way: &Way) -> Span {
        Computation::lag(knowledge, way, Computation::fastest_input)
    }

    /// How the way is computed.
    pub(crate) fn computation(&self) -> &Computation {
        &self.computation
    }

    /// The computed way.
    #[must_use]
    pub fn way(&self) -> &Way {
        self.computation.way()
    }

    /// The relation of its outputs to time.
    #[must_use]
    pub fn timing(&self) -> Timing {
        self.computation.timing()
    }

    /// Whether a value stands until the next one; see [`Computation::stands`].
    #[must_use]
    pub fn stands(&self, knowledge: &KnowledgeBase) -> bool {
        self.computation.stands(knowledge)
    }

    /// Notes an observation; it computes by [`Service::compute`].
    pub fn observe(&mut self, knowledge: &KnowledgeBase, observation: &Observation) {
        if self.computation.trigger() == Some(observation.signal) {
            self.pending = Some(knowledge.signals()[observation.signal].validity(observation.stamp));
        }
    }

    /// The output, when the fastest input has delivered since the last call and all inputs are known.
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
