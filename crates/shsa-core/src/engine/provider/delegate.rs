//! A source that somebody else computes, such as a process of its own. The engine brings the inputs to one moment, hands them out
//! as a task, and judges the answer like a value that it has computed itself. While nobody is there, the engine computes.

use super::super::message::{Output, PublishedValue};
use super::settings::Given;
use crate::alignment::{Port, Sample};
use crate::assurance::Assessments;
use crate::computation::Computed;
use crate::knowledge::{IdVec, KnowledgeBase, NeedId, Shape, SignalId};
use crate::service::Service;
use crate::substitution::Way;
use crate::time::Validity;
use alloc::collections::VecDeque;

/// What somebody else could compute.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Delegation<'a> {
    /// Counts the sources of the need, so that who is ready for one is not taken for another.
    pub era: u64,
    /// The source.
    pub way: &'a Way,
}

/// Who computes the source of a need instead of the engine.
#[derive(Debug, Default)]
pub(super) struct Delegate {
    /// Counts the sources.
    era: u64,
    is_ready: bool,
    /// The number of the newest task.
    given: u64,
    /// The moments of the tasks that are not answered yet, oldest first.
    open: VecDeque<(u64, Validity)>,
    /// What was answered and not looked at yet.
    answer: Option<Given>,
    /// Whether what was looked at last is from there.
    has_given: bool,
}

/// Tasks that may be open; of more, the oldest are taken for lost.
const MOST_OPEN: usize = 16;

impl Delegate {
    /// The source is another one from now on.
    pub(super) fn retire(&mut self) {
        let Delegate { era, given, .. } = *self;
        *self = Delegate { era: era.wrapping_add(1), given, ..Delegate::default() };
    }

    /// Whether the value that was looked at last is not the engine's own.
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

    /// What could be computed, where there is something to compute.
    pub(super) fn offer<'w>(&self, way: Option<&'w Way>) -> Option<Delegation<'w>> {
        let way = way.filter(|way| way.direct().is_none())?;
        Some(Delegation { era: self.era, way })
    }

    /// Somebody is ready to compute the source with this number, of which a way was offered or none.
    pub(super) fn begin(&mut self, era: u64, is_offered: bool) {
        self.is_ready = era == self.era && is_offered;
    }

    /// Nobody is there any more: computes the source here from now on, as if it had always been so, where contracts still admit
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

    /// The next value of a source: computed, or answered; in the latter case what is to be computed next is handed out.
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

    /// Hears the answer to a task.
    pub(super) fn take(&mut self, number: u64, result: Option<Given>, shape: Shape) {
        let Some((_, moment)) = self.open.iter().copied().find(|(open, _)| *open == number) else { return };
        self.open.retain(|(open, _)| *open > number);
        self.answer = result.filter(|(value, validity)| is_sound(value, shape) && is_of(*validity, moment));
    }
}

/// Whether a value says something.
fn is_sound(value: &PublishedValue, shape: Shape) -> bool {
    match (value, shape) {
        (PublishedValue::Scalar(value), Shape::Scalar) => value.is_bounded() && !value.is_empty(),
        (PublishedValue::Vector(elements), Shape::Vector) => !elements.is_empty(),
        _ => false,
    }
}

/// Whether a value can be from the inputs of a moment: it may rest on earlier ones, and on no later ones.
fn is_of(validity: Validity, moment: Validity) -> bool {
    validity.from <= validity.to && validity.to == moment.to
}

fn owned(computed: Computed<'_>) -> PublishedValue {
    match computed {
        Computed::Scalar(value) => PublishedValue::Scalar(value),
        Computed::Vector(elements) => PublishedValue::Vector(elements.to_vec()),
    }
}
