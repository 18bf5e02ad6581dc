//! Substitutes in processes of their own: a relation that takes too long, or too much memory, harms nobody else.
//!
//! ```text
//! engine -task-> worker -frames-> process (substitute) -frames-> worker -report-> engine -publication-> bus
//! ```
//!
//! The engine brings the inputs to one moment, and judges what comes back as it judges what it computes itself. The process
//! gets the part of the model that it computes, and numbers; it can reach nothing else. While there is none, the engine
//! computes: the need is served without a gap.

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
use shsa_format::model::live::Live;
use std::ffi::OsString;
use worker::{Consequence, Worker};

/// Substitutes in processes of their own.
#[derive(Clone, Debug)]
pub struct SandboxOptions {
    /// Whether every need has one, and not only those that ask for it (`isolation: process`).
    pub is_for_all: bool,
    /// The program that calls [`substitute`], with its arguments; `--memory BYTES` is added. Empty: there are no processes, and a
    /// model that asks for one is refused.
    pub program: Vec<OsString>,
    /// The memory that a process may take beyond the program itself, bytes.
    pub memory: u64,
    /// The share of a processor that a process may use, 0 to 1.
    pub share: f64,
    /// How long an answer may take; `None`: a period of the fastest input, at most half of the need's greatest age.
    pub time: Option<Span>,
}

impl Default for SandboxOptions {
    fn default() -> SandboxOptions {
        SandboxOptions { is_for_all: false, program: Vec::new(), memory: 64 << 20, share: 0.5, time: None }
    }
}

/// What a process is, and what it is granted.
#[derive(Clone, Debug)]
struct Grant {
    program: Vec<OsString>,
    /// Beyond the program itself, bytes.
    memory: u64,
    /// Of one processor.
    share: f64,
    time: Option<Span>,
}

/// A shorter time is not kept by an operating system without real time.
const SHORTEST: Span = Span::from_millis(5);

impl Grant {
    /// How long an answer may take, where the inputs come at this rate.
    fn patience(&self, rate_hz: Option<f64>, max_age: Span) -> Span {
        let most = Span(max_age.0 / 2);
        let usual = rate_hz.map_or(most, |rate| Span::from_seconds(1.0 / rate).min(most));
        self.time.unwrap_or(usual).max(SHORTEST)
    }
}

/// The needs of one model whose substitutes are computed in processes.
pub(super) struct Workers {
    is_for_all: bool,
    grant: Grant,
    inbox: Inbox,
    workers: Vec<Worker>,
}

/// What is to be done after looking after the processes.
#[derive(Debug, Default)]
pub(super) struct Consequences {
    /// The engine is to hear these, in this order.
    pub(super) reports: Vec<(NeedId, Report)>,
    /// The run is to tell these: a kind and a reason.
    pub(super) notes: Vec<(&'static str, String)>,
    /// These relations are to be forbidden.
    pub(super) forbid: Vec<String>,
}

impl Workers {
    /// # Errors
    /// When a need is to have a process, and there is no program for it.
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

    /// The model has changed: what is computed for its needs begins anew.
    ///
    /// # Errors
    /// Never: bounds inside are right.
    pub(super) fn renew(&mut self, knowledge: &KnowledgeBase) -> Result<(), RuntimeError> {
        let needs = knowledge.needs().enumerate().filter(|(_, need)| self.is_for_all || need.is_isolated);
        // A model that asks for a process later, where there is no program, is computed here.
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

    /// Looks after all processes.
    pub(super) fn supervise(&mut self, engine: &Engine, live: &Live) -> Consequences {
        let mut consequences = Consequences::default();
        for worker in &mut self.workers {
            for consequence in worker.supervise(engine, live, &self.grant, &self.inbox) {
                match consequence {
                    Consequence::Report(report) => consequences.reports.push((worker.need(), report)),
                    Consequence::Tell(kind, because) => consequences.notes.push((kind, because)),
                    Consequence::Forbid(relation) => consequences.forbid.push(relation),
                }
            }
        }
        consequences
    }

    /// Hands a task to the process of a need.
    pub(super) fn hand(&mut self, need: NeedId, number: u64, task: Task, engine: &Engine) {
        let now = self.inbox.clock().now();
        if let Some(worker) = self.workers.iter_mut().find(|worker| worker.need() == need) {
            worker.hand(number, task, engine, now);
        }
    }

    /// Whether a value would be a process's to compute.
    pub(super) fn is_isolated(&self, publication: &Publication) -> bool {
        self.worker(publication.need).is_some_and(Worker::is_at_work)
    }

    /// When processes have to be looked after again, at the latest.
    pub(super) fn due(&self) -> Option<Time> {
        self.workers.iter().filter_map(Worker::due).min()
    }

    /// What computes the source of a need; `None` where that is always the engine.
    pub(super) fn state(&self, need: NeedId) -> Option<Value> {
        self.worker(need).map(Worker::state)
    }

    /// How often the process of a need was replaced, and how long its answers took, nanoseconds.
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
