//! Substitutes in processes of their own: a relation that takes too long, or too much memory, harms nobody else.
//!
//! ```text
//! engine -task-> lane -frames-> process (shsa substitute) -frames-> lane -report-> engine -publication-> bus
//! ```
//!
//! The engine brings the inputs to one moment, and judges what comes back as it judges what it computes itself. The process
//! gets the part of the model that it computes, and numbers; it can reach nothing else. While there is none, the engine
//! computes: the need is served without a gap.

mod frame;
mod lane;
mod process;
mod sandbox;
pub(crate) mod worker;

use hdrhistogram::Histogram;
use lane::{Lane, Wish};
use serde_json::Value;
use shsa_bridge::Inbox;
use shsa_core::computation::Task;
use shsa_core::engine::{Engine, Publication, Report};
use shsa_core::knowledge::{KnowledgeBase, NeedId};
use shsa_core::time::{Span, Time};
use shsa_format::model::live::Live;
use shsa_format::recording::parse_span;

/// Where substitutes are computed, where the model does not say.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Place {
    /// Within the run.
    Engine,
    /// Each in a process of its own.
    Process,
}

/// The arguments about it.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Isolation")]
pub(super) struct IsolationArguments {
    /// Where substitutes are computed; a need may ask for a process itself (`isolation: process`).
    #[arg(long, value_name = "PLACE", default_value = "engine")]
    isolation: Place,
    /// The memory that a process may take, MiB.
    #[arg(long, value_name = "MIB", default_value_t = 64)]
    isolation_memory: u64,
    /// The share of a processor that a process may use, percent.
    #[arg(long, value_name = "PERCENT", default_value_t = 50, value_parser = clap::value_parser!(u8).range(1..=100))]
    isolation_cpu: u8,
    /// How long an answer may take; else a period of the fastest input, at most half of the need's greatest age.
    #[arg(long, value_name = "TIME", value_parser = parse_span)]
    isolation_time: Option<Span>,
}

/// What a process is granted.
#[derive(Clone, Debug)]
struct Grant {
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
pub(super) struct Isolation {
    are_all: bool,
    grant: Grant,
    inbox: Inbox,
    lanes: Vec<Lane>,
}

/// What is to be done after looking after the processes.
#[derive(Debug, Default)]
pub(super) struct Wishes {
    /// The engine is to hear these, in this order.
    pub(super) reports: Vec<(NeedId, Report)>,
    /// The run is to tell these: a kind and a reason.
    pub(super) notes: Vec<(&'static str, String)>,
    /// These relations are to be forbidden.
    pub(super) forbid: Vec<String>,
}

impl Isolation {
    /// # Errors
    /// Never: bounds inside are right.
    pub(super) fn new(
        arguments: &IsolationArguments,
        knowledge: &KnowledgeBase,
        inbox: Inbox,
    ) -> anyhow::Result<Isolation> {
        let grant = Grant {
            memory: arguments.isolation_memory << 20,
            share: f64::from(arguments.isolation_cpu) / 100.0,
            time: arguments.isolation_time,
        };
        let are_all = arguments.isolation == Place::Process;
        let mut isolation = Isolation { are_all, grant, inbox, lanes: Vec::new() };
        isolation.renew(knowledge)?;
        Ok(isolation)
    }

    /// The model has changed: what is computed for its needs begins anew.
    ///
    /// # Errors
    /// As [`Isolation::new`].
    pub(super) fn renew(&mut self, knowledge: &KnowledgeBase) -> anyhow::Result<()> {
        let needs = knowledge.needs().enumerate().filter(|(_, need)| self.are_all || need.is_isolated);
        let needs: Vec<NeedId> = needs.map(|(id, _)| id).collect();
        self.lanes.truncate(needs.len());
        for (at, need) in needs.into_iter().enumerate() {
            match self.lanes.get_mut(at) {
                Some(lane) => lane.forget(need),
                None => self.lanes.push(Lane::new(need)?),
            }
        }
        Ok(())
    }

    /// Looks after all processes.
    pub(super) fn supervise(&mut self, engine: &Engine, live: &Live) -> Wishes {
        let mut wishes = Wishes::default();
        for lane in &mut self.lanes {
            for wish in lane.supervise(engine, live, &self.grant, &self.inbox) {
                match wish {
                    Wish::Report(report) => wishes.reports.push((lane.need(), report)),
                    Wish::Tell(kind, because) => wishes.notes.push((kind, because)),
                    Wish::Forbid(relation) => wishes.forbid.push(relation),
                }
            }
        }
        wishes
    }

    /// Hands a task to the process of a need.
    pub(super) fn hand(&mut self, need: NeedId, number: u64, task: Task, engine: &Engine) {
        let now = self.inbox.clock().now();
        if let Some(lane) = self.lanes.iter_mut().find(|lane| lane.need() == need) {
            lane.hand(number, task, engine, now);
        }
    }

    /// Whether a value would be a process's to compute.
    pub(super) fn is_isolated(&self, publication: &Publication) -> bool {
        self.lane(publication.need).is_some_and(Lane::is_at_work)
    }

    /// When processes have to be looked after again, at the latest.
    pub(super) fn due(&self) -> Option<Time> {
        self.lanes.iter().filter_map(Lane::due).min()
    }

    /// What computes the source of a need; `None` where that is always the engine.
    pub(super) fn state(&self, need: NeedId) -> Option<Value> {
        self.lane(need).map(Lane::state)
    }

    /// How often the process of a need was replaced, and how long its answers took, nanoseconds.
    pub(super) fn figures(&self, need: NeedId) -> Option<(u64, &Histogram<u64>)> {
        self.lane(need).map(|lane| (lane.replaced(), lane.round_trip()))
    }

    fn lane(&self, need: NeedId) -> Option<&Lane> {
        self.lanes.iter().find(|lane| lane.need() == need)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_may_take_a_period_and_never_half_of_what_a_value_may_be_old() {
        let grant = |time| Grant { memory: 1, share: 0.5, time };
        let ms = Span::from_millis;
        assert_eq!(grant(None).patience(Some(20.0), ms(300)), ms(50));
        assert_eq!(grant(None).patience(Some(2.0), ms(300)), ms(150));
        assert_eq!(grant(None).patience(None, ms(300)), ms(150));
        assert_eq!(grant(None).patience(Some(1_000.0), ms(300)), ms(5));
        assert_eq!(grant(Some(ms(20))).patience(Some(2.0), ms(300)), ms(20));
    }
}
