//! Substitutes in processes of their own: a relation that takes too much time or memory harms nothing else.
//!
//! ```text
//! engine -task-> worker -frames-> process (substitute) -frames-> worker -report-> engine -publication-> bus
//! ```
//!
//! The engine brings the inputs to one moment, and judges the answer like its own results. The process gets the needed part of
//! the model, and numbers; it has access to nothing else. While there is no process, the engine computes, so the need is served
//! without a gap.

mod frame;
mod process;
mod worker;
mod confine;
mod substitute;

pub use substitute::substitute;

use crate::error::{RuntimeError, unfit};
use hdrhistogram::Histogram;
use serde_json::Value;
use shsa_bridge::Inbox;
use shsa_core::computation::Task;
use shsa_core::engine::{Engine, Publication, Report};
use shsa_core::knowledge::{KnowledgeBase, NeedId};
use shsa_core::time::{Span, Time};
use shsa_model::live::Live;
use std::ffi::OsString;
use worker::{Consequence, Worker};

/// Substitutes in processes of their own.
#[derive(Clone, Debug)]
pub struct SandboxOptions {
    /// Whether every need gets a process, not only those that ask for it (`isolation: process`).
    pub is_for_all: bool,
    /// The program that calls [`substitute`], with its arguments; `--memory BYTES` is added. If empty, there are no processes,
    /// and a model that asks for one is refused.
    pub program: Vec<OsString>,
    /// The memory that a process may allocate beyond the program itself, bytes.
    pub memory: u64,
    /// The share of a processor that a process may use, 0 to 1.
    pub share: f64,
    /// The time limit of an answer; `None`: a period of the fastest input, at most half of the need's greatest age.
    pub time: Option<Span>,
}

impl Default for SandboxOptions {
    fn default() -> SandboxOptions {
        SandboxOptions { is_for_all: false, program: Vec::new(), memory: 64 << 20, share: 0.5, time: None }
    }
}

/// The program of a process, and its limits.
#[derive(Clone, Debug)]
struct Grant {
    program: Vec<OsString>,
    /// Memory beyond the program itself, bytes.
    memory: u64,
    /// The share of one processor.
    share: f64,
    time: Option<Span>,
}

/// The least time limit: an operating system without real time does not keep a shorter one.
const SHORTEST: Span = Span::from_millis(5);

impl Grant {
    /// The time limit of an answer, for inputs of this rate.
    fn patience(&self, rate_hz: Option<f64>, max_age: Span) -> Span {
        let most = Span(max_age.0 / 2);
        let usual = rate_hz.map_or(most, |rate| Span::from_seconds(1.0 / rate).min(most));
        self.time.unwrap_or(usual).max(SHORTEST)
    }
}

/// The workers of one model: the needs whose substitutes processes compute.
pub(super) struct Workers {
    is_for_all: bool,
    grant: Grant,
    inbox: Inbox,
    workers: Vec<Worker>,
}

/// The consequences of supervising the processes.
#[derive(Debug, Default)]
pub(super) struct Consequences {
    /// Reports for the engine, in this order.
    pub(super) reports: Vec<(NeedId, Report)>,
    /// Notes for the run to report: kind and text.
    pub(super) notes: Vec<(&'static str, String)>,
    /// Relations to forbid.
    pub(super) forbid: Vec<String>,
}

impl Workers {
    /// # Errors
    /// When a need asks for a process, and there is no program.
    pub(super) fn new(
        options: &SandboxOptions,
        knowledge: &KnowledgeBase,
        inbox: Inbox,
    ) -> Result<Workers, RuntimeError> {
        let SandboxOptions { is_for_all, program, memory, share, time } = options.clone();
        let wanted = knowledge.needs().iter().find(|need| is_for_all || need.is_isolated);
        if let Some(need) = wanted.filter(|_| program.is_empty()) {
            let need = &need.signal;
            return Err(unfit(format!(
                "the substitutes of {need} belong in a process, and no program is set for it"
            )));
        }
        let grant = Grant { program, memory, share, time };
        let mut all = Workers { is_for_all, grant, inbox, workers: Vec::new() };
        all.renew(knowledge)?;
        Ok(all)
    }

    /// Replaces the workers after a change of the model.
    ///
    /// # Errors
    /// Never: the bounds of the histograms are valid.
    pub(super) fn renew(&mut self, knowledge: &KnowledgeBase) -> Result<(), RuntimeError> {
        let needs = knowledge.needs().enumerate().filter(|(_, need)| self.is_for_all || need.is_isolated);
        // Without a program, the engine computes for a new model that asks for a process.
        let needs = needs.filter(|_| !self.grant.program.is_empty());
        let needs: Vec<NeedId> = needs.map(|(id, _)| id).collect();
        self.workers.truncate(needs.len());
        for (at, need) in needs.into_iter().enumerate() {
            match self.workers.get_mut(at) {
                Some(worker) => worker.forget(need),
                None => self.workers.push(Worker::new(need)?),
            }
        }
        Ok(())
    }

    /// Supervises all processes.
    pub(super) fn supervise(&mut self, engine: &Engine, live: &Live) -> Consequences {
        let mut consequences = Consequences::default();
        for worker in &mut self.workers {
            for consequence in worker.supervise(engine, live, &self.grant, &self.inbox) {
                match consequence {
                    Consequence::Report(report) => consequences.reports.push((worker.need(), report)),
                    Consequence::Note(kind, because) => consequences.notes.push((kind, because)),
                    Consequence::Forbid(relation) => consequences.forbid.push(relation),
                }
            }
        }
        consequences
    }

    /// Passes a task to the process of a need.
    pub(super) fn hand(&mut self, need: NeedId, number: u64, task: Task, engine: &Engine) {
        let now = self.inbox.clock().now();
        if let Some(worker) = self.workers.iter_mut().find(|worker| worker.need() == need) {
            worker.hand(number, task, engine, now);
        }
    }

    /// Whether a process should have computed this value.
    pub(super) fn is_isolated(&self, publication: &Publication) -> bool {
        self.worker(publication.need).is_some_and(Worker::is_at_work)
    }

    /// When the processes must be supervised again, at the latest.
    pub(super) fn due(&self) -> Option<Time> {
        self.workers.iter().filter_map(Worker::due).min()
    }

    /// The state of a need's process; `None` for a need without a worker.
    pub(super) fn state(&self, need: NeedId) -> Option<Value> {
        self.worker(need).map(Worker::state)
    }

    /// How often the process of a need was replaced, and the times of its answers, nanoseconds.
    pub(super) fn figures(&self, need: NeedId) -> Option<(u64, &Histogram<u64>)> {
        self.worker(need).map(|worker| (worker.replaced(), worker.round_trip()))
    }

    fn worker(&self, need: NeedId) -> Option<&Worker> {
        self.workers.iter().find(|worker| worker.need() == need)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_may_take_a_period_and_never_half_of_what_a_value_may_be_old() {
        let granted = |time| Grant { program: Vec::new(), memory: 1, share: 0.5, time };
        let ms = Span::from_millis;
        assert_eq!(granted(None).patience(Some(20.0), ms(300)), ms(50));
        assert_eq!(granted(None).patience(Some(2.0), ms(300)), ms(150));
        assert_eq!(granted(None).patience(None, ms(300)), ms(150));
        assert_eq!(granted(None).patience(Some(1_000.0), ms(300)), ms(5));
        assert_eq!(granted(Some(ms(20))).patience(Some(2.0), ms(300)), ms(20));
    }
}
