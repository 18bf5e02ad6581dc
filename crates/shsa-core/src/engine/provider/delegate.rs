//! A source that another process computes. The engine brings the inputs to one moment, hands them out as a task, and judges the
//! answer like a value of its own. Without such a process, the engine computes the source.

use super::super::message::{Output, PublishedValue, Report};
use super::Provider;
use super::settings::Given;
use crate::alignment::{Port, Sample};
use crate::assurance::Assessments;
use crate::computation::Computed;
use crate::knowledge::{IdVec, KnowledgeBase, NeedId, Shape, SignalId};
use crate::service::Service;
use crate::substitution::Way;
use crate::time::Validity;
use alloc::collections::VecDeque;

/// A source that another process could compute.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Delegation<'a> {
    /// Counts the sources of the need, so that a process ready for an earlier source is not taken for ready.
    pub era: u64,
    /// The source.
    pub way: &'a Way,
}

/// The delegation of the source of a need to another process.
#[derive(Debug, Default)]
pub(super) struct Delegate {
    /// Counts the sources.
    era: u64,
    is_ready: bool,
    /// The number of the newest task.
    given: u64,
    /// The moments of the tasks that are not answered yet, oldest first.
    open: VecDeque<(u64, Validity)>,
    /// The answer that has not been looked at yet.
    answer: Option<Given>,
    /// Whether the last value is from the delegate.
    has_given: bool,
}

/// Tasks that may be open; beyond that, the oldest count as lost.
const MOST_OPEN: usize = 16;

impl Delegate {
    /// Ends the delegation: the need has another source from now on.
    pub(super) fn retire(&mut self) {
        let Delegate { era, given, .. } = *self;
        *self = Delegate { era: era.wrapping_add(1), given, ..Delegate::default() };
    }

    /// Whether the last value is from the delegate.
    pub(super) fn has_given(&self) -> bool {
        self.has_given
    }

    fn hand_out(&mut self, moment: Validity) -> u64 {
        self.given = self.given.wrapping_add(1);
        if self.open.len() >= MOST_OPEN {
            self.open.pop_front();
        }
        self.open.push_back((self.given, moment));
        self.given
    }

    /// The source, where there is something to compute.
    pub(super) fn offer<'w>(&self, way: Option<&'w Way>) -> Option<Delegation<'w>> {
        let way = way.filter(|way| way.direct().is_none())?;
        Some(Delegation { era: self.era, way })
    }

    /// A process is ready to compute the source with this number; `is_offered` tells whether one was offered.
    pub(super) fn begin(&mut self, era: u64, is_offered: bool) {
        self.is_ready = era == self.era && is_offered;
    }

    /// The process has ended: the engine computes the source itself, from the newest open task on, where contracts still admit
    /// it.
    pub(super) fn end(
        &mut self,
        service: &mut Service,
        knowledge: &KnowledgeBase,
        contracts: &Assessments,
        ports: &IdVec<SignalId, Port>,
    ) {
        if !core::mem::take(&mut self.is_ready) {
            return;
        }
        let undone = self.open.pop_back().map(|(_, moment)| moment);
        self.open.clear();
        let Some(way) = contracts.admit(service.way().clone()) else { return };
        let anew = match undone {
            Some(moment) => Service::start_at(knowledge, way, ports, moment),
            None => Service::start(knowledge, way, ports, None),
        };
        if let Some(anew) = anew {
            *service = anew;
        }
    }

    /// The next value of a source: computed here, or answered by the delegate, which gets the next task.
    pub(super) fn next(
        &mut self,
        service: &mut Service,
        need: NeedId,
        ports: &IdVec<SignalId, Port>,
        last: Option<Sample>,
        outputs: &mut VecDeque<Output>,
    ) -> Option<Given> {
        if !self.is_ready {
            let computed = service.compute(ports, last)?;
            self.has_given = false;
            let (value, validity) = computed;
            return Some((owned(value), validity));
        }
        if let Some(task) = service.task(ports, last) {
            let number = self.hand_out(task.moment);
            outputs.push_back(Output::Task { need, number, task });
        }
        let answer = self.answer.take()?;
        self.has_given = true;
        Some(answer)
    }

    /// Takes the answer to a task.
    pub(super) fn take(&mut self, number: u64, result: Option<Given>, shape: Shape) {
        let Some((_, moment)) = self.open.iter().copied().find(|(open, _)| *open == number) else { return };
        self.open.retain(|(open, _)| *open > number);
        self.answer = result.filter(|(value, validity)| is_sound(value, shape) && is_of(*validity, moment));
    }
}

/// Whether a value has the shape of the variable and is not empty.
fn is_sound(value: &PublishedValue, shape: Shape) -> bool {
    match (value, shape) {
        (PublishedValue::Scalar(value), Shape::Scalar) => value.is_bounded() && !value.is_empty(),
        (PublishedValue::Vector(elements), Shape::Vector) => !elements.is_empty(),
        _ => false,
    }
}

/// Whether a value can come from the inputs of a moment: these may be older, not newer.
fn is_of(validity: Validity, moment: Validity) -> bool {
    validity.from <= validity.to && validity.to == moment.to
}

fn owned(computed: Computed<'_>) -> PublishedValue {
    match computed {
        Computed::Scalar(value) => PublishedValue::Scalar(value),
        Computed::Vector(elements) => PublishedValue::Vector(elements.to_vec()),
    }
}

impl Provider {
    /// The source that another process could compute.
    pub(in super::super) fn delegation(&self) -> Option<Delegation<'_>> {
        self.delegate.offer(self.state.way())
    }

    /// A signal has begun anew: sources forget what they have seen of it. What another process has seen it cannot forget, so the
    /// engine computes the source itself until the process has begun anew, too.
    pub(in super::super) fn begin_anew(&mut self, signal: SignalId) {
        self.state.begin_anew(signal);
        if self.state.way().is_some_and(|way| way.inputs().any(|input| input == signal)) {
            self.delegate.retire();
        }
    }

    /// Takes a report of the process that computes the source.
    pub(in super::super) fn take_report(
        &mut self,
        knowledge: &KnowledgeBase,
        ports: &IdVec<SignalId, Port>,
        report: Report,
    ) {
        match report {
            Report::Ready { era } => self.delegate.begin(era, self.delegation().is_some()),
            Report::Answer { number, result } => {
                let shape = knowledge.variables()[self.settings.variable].shape;
                self.delegate.take(number, result, shape);
            }
            Report::Gone => {
                if let Some(serving) = self.state.serving_mut() {
                    self.delegate.end(&mut serving.service, knowledge, &self.contracts, ports);
                }
            }
        }
    }
}
