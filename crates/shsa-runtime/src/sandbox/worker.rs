//! One need whose source a process computes: starts, supervises and replaces the process.
//!
//! ```text
//! absent -> starting -> working -> (overrun, killed, out of its grant) -> absent for a while -> starting -> ..
//! ```

use super::Grant;
use super::frame::{Order, Reply, Word};
use super::process::{News, Process};
use crate::error::RuntimeError;
use crate::figures::{histogram, times};
use hdrhistogram::Histogram;
use serde_json::{Value, json};
use shsa_bridge::Inbox;
use shsa_core::computation::Task;
use shsa_core::engine::{Engine, Report};
use shsa_core::knowledge::NeedId;
use shsa_core::time::{Span, Time};
use shsa_model::live::Live;
use std::collections::VecDeque;

/// After this many failures within [`WINDOW`], the process is given up.
const MOST_FAILURES: usize = 6;
const WINDOW: Span = Span::from_millis(60_000);
/// The first replacement starts at once; the second after this time, which doubles for each further one.
const FIRST_PAUSE: Span = Span::from_millis(100);
/// The time limit for a process to be ready.
const STARTING: Span = Span::from_millis(10_000);
/// The period over which the processor time of a process is measured.
const MEASURED: Span = Span::from_millis(1_000);
/// The tolerance of the processor time in that period: the scheduler does not count exactly.
const INEXACT: Span = Span::from_millis(20);
/// The processor time that the kernel grants until the next measurement.
const UNSEEN: Span = Span::from_millis(2_000);

/// An action that a worker asks for.
#[derive(Debug)]
pub(super) enum Consequence {
    /// Passes a report to the engine.
    Report(Report),
    /// Lets the run report a note.
    Note(&'static str, String),
    /// Forbids a relation whose process fails again and again.
    Forbid(String),
}

/// The worker of one need.
pub(super) struct Worker {
    need: NeedId,
    /// The era of the source that was handled last.
    seen: Option<u64>,
    /// The computation; `None` if there is none.
    assignment: Option<Assignment>,
    process: Option<Running>,
    /// The earliest time for starting another process.
    not_before: Time,
    failures: VecDeque<Time>,
    figures: Figures,
}

/// A computation that is assigned to a process.
struct Assignment {
    era: u64,
    source: String,
    /// The relation that gives the need's variable.
    relation: String,
    order: Order,
    /// The time limit of an answer.
    patience: Span,
}

/// The process of an assignment.
struct Running {
    process: Process,
    since: Time,
    is_ready: bool,
    /// Whether it has received the past inputs.
    has_begun: bool,
    /// The open tasks: number, and time of handing over.
    open: VecDeque<(u64, Time)>,
    /// The last measurement of its processor time: when, and how much.
    measured: (Time, Span),
}

/// Counts and times so far.
struct Figures {
    started: u64,
    replaced: u64,
    answers: u64,
    late: u64,
    because: Option<String>,
    /// From handing over a task to its answer, nanoseconds.
    round_trip: Histogram<u64>,
    /// From starting a process until it was ready, nanoseconds.
    start: Histogram<u64>,
}

impl Worker {
    /// # Errors
    /// Never: the bounds of the histograms are valid.
    pub(super) fn new(need: NeedId) -> Result<Worker, RuntimeError> {
        let figures = Figures {
            started: 0,
            replaced: 0,
            answers: 0,
            late: 0,
            because: None,
            round_trip: histogram()?,
            start: histogram()?,
        };
        let failures = VecDeque::new();
        Ok(Worker {
            need,
            seen: None,
            assignment: None,
            process: None,
            not_before: Time::MIN,
            failures,
            figures,
        })
    }

    pub(super) fn need(&self) -> NeedId {
        self.need
    }

    /// Starts anew after a change of the model, which changes the meaning of ids.
    pub(super) fn forget(&mut self, need: NeedId) {
        (self.need, self.seen, self.assignment, self.process) = (need, None, None, None);
    }

    /// Supervises the process; returns the consequences.
    pub(super) fn supervise(
        &mut self,
        engine: &Engine,
        live: &Live,
        grant: &Grant,
        inbox: &Inbox,
    ) -> Vec<Consequence> {
        let now = inbox.clock().now();
        let mut consequences = Vec::new();
        self.follow(engine, live, grant);
        self.listen(now, grant, &mut consequences);
        if let Some(why) = self.fault(now, grant) {
            self.fail(why, now, grant, &mut consequences);
        }
        if self.assignment.is_some() && self.process.is_none() && self.not_before <= now {
            self.start(now, grant, inbox, &mut consequences);
        }
        consequences
    }

    /// Follows the source of the need. A new source ends the process of the previous one.
    fn follow(&mut self, engine: &Engine, live: &Live, grant: &Grant) {
        let delegation = engine.delegation(self.need);
        let era = delegation.map(|it| it.era);
        if era == self.seen {
            return;
        }
        self.seen = era;
        self.process = None;
        self.not_before = Time::MIN;
        self.failures.clear();
        self.assignment = delegation.and_then(|delegation| {
            let (knowledge, way) = (engine.knowledge(), delegation.way);
            let last = way.substitution.steps.last()?;
            let rates = way.inputs().filter_map(|signal| knowledge.signals()[signal].rate_hz);
            let max_age = knowledge.needs()[self.need].max_age;
            Some(Assignment {
                era: delegation.era,
                source: way.describe(knowledge),
                relation: knowledge.relations()[last.relation].name.clone(),
                order: Order::new(way, live).ok()?,
                patience: grant.patience(rates.reduce(f64::max), max_age),
            })
        });
    }

    fn listen(&mut self, now: Time, grant: &Grant, consequences: &mut Vec<Consequence>) {
        loop {
            let (Some(running), Some(assignment)) = (&mut self.process, &self.assignment) else { return };
            match running.process.news() {
                News::Nothing => return,
                News::Over => return self.fail(None, now, grant, consequences),
                News::Reply(Reply::Refused(why)) => {
                    return self.fail(Some(format!("it refuses: {why}")), now, grant, consequences);
                }
                News::Reply(Reply::Ready) => {
                    running.is_ready = true;
                    record(&mut self.figures.start, now - running.since);
                    consequences.push(Consequence::Report(Report::Ready { era: assignment.era }));
                }
                News::Reply(Reply::Answer { number, result }) => {
                    let Some(at) = running.open.iter().position(|(open, _)| *open == number) else {
                        let why = format!("it answers what it was not asked (task {number})");
                        return self.fail(Some(why), now, grant, consequences);
                    };
                    let asked = running.open.get(at).map_or(now, |(_, asked)| *asked);
                    running.open.drain(..=at);
                    self.figures.answers += 1;
                    record(&mut self.figures.round_trip, now - asked);
                    consequences.push(Consequence::Report(Report::Answer { number, result }));
                }
            }
        }
    }

    /// The visible fault of the process, if it has one.
    fn fault(&mut self, now: Time, grant: &Grant) -> Option<Option<String>> {
        let (Some(running), Some(assignment)) = (&mut self.process, &self.assignment) else { return None };
        if !running.is_ready {
            let is_slow = now - running.since > STARTING;
            return is_slow.then(|| Some(format!("not ready after {} s", STARTING.seconds())));
        }
        let ms = |span: Span| span.seconds() * 1e3;
        if let Some((_, asked)) = running.open.front().filter(|(_, asked)| now - *asked > assignment.patience)
        {
            self.figures.late += 1;
            return Some(Some(format!(
                "overran: no answer for {:.1} ms, where {:.1} ms are granted",
                ms(now - *asked),
                ms(assignment.patience)
            )));
        }
        let (since, before) = running.measured;
        let time = now - since;
        if time < MEASURED {
            return None;
        }
        let used = running.process.used()?;
        running.measured = (now, used);
        running.process.limit(used + UNSEEN);
        let most = Span::from_seconds(time.seconds() * grant.share) + INEXACT;
        let taken = used - before;
        (taken > most).then(|| {
            Some(format!(
                "it used {:.0} ms of the processor within {:.0} ms, where {:.0} % are granted",
                ms(taken),
                ms(time),
                grant.share * 100.0
            ))
        })
    }

    /// Ends the process, and allows another one at once, later, or never.
    fn fail(&mut self, why: Option<String>, now: Time, grant: &Grant, consequences: &mut Vec<Consequence>) {
        let Some(running) = self.process.take() else { return };
        let id = running.process.id();
        let ending = running.process.end();
        let why = why.unwrap_or(ending);
        consequences.push(Consequence::Report(Report::Gone));
        self.figures.replaced += 1;
        self.failures.retain(|failure| now - *failure <= WINDOW);
        self.failures.push_back(now);
        let Some(assignment) = &self.assignment else { return };
        let failures = self.failures.len();
        self.figures.because = Some(why.clone());
        let source = &assignment.source;
        if failures >= MOST_FAILURES {
            let because = format!(
                "process {id} of {source}: {why}; it is given up after {failures} failures within {} s, and its relation \
                 {} is forbidden until an operator allows it",
                WINDOW.seconds(),
                assignment.relation
            );
            consequences.push(Consequence::Note("given_up", because));
            consequences.push(Consequence::Forbid(assignment.relation.clone()));
            self.not_before = Time::MAX;
            return;
        }
        let pause = match failures {
            0 | 1 => Span::ZERO,
            _ => FIRST_PAUSE.times(1 << (failures - 2)),
        };
        self.not_before = now + pause;
        let next = match pause {
            Span::ZERO => "at once".to_owned(),
            pause => format!("in {:.1} s", pause.seconds()),
        };
        let because = format!(
            "process {id} of {source}: {why}; another one is started {next}, until then the engine computes (memory {} MiB)",
            grant.memory >> 20
        );
        consequences.push(Consequence::Note("restarted", because));
    }

    fn start(&mut self, now: Time, grant: &Grant, inbox: &Inbox, consequences: &mut Vec<Consequence>) {
        let Some(assignment) = &self.assignment else { return };
        let mut frames = Vec::new();
        Word::Order(assignment.order.clone()).write(&mut frames);
        self.figures.started += 1;
        match Process::start(grant, inbox.clone()) {
            Ok(process) => {
                process.limit(UNSEEN);
                process.hand(frames);
                let (open, measured) = (VecDeque::new(), (now, Span::ZERO));
                let (is_ready, has_begun) = (false, false);
                self.process = Some(Running { process, since: now, is_ready, has_begun, open, measured });
            }
            Err(error) => {
                self.not_before = now + STARTING;
                consequences.push(Consequence::Note(
                    "restarted",
                    format!("no process for {}: {}", assignment.source, error.chain()),
                ));
            }
        }
    }

    /// Passes a task to the process; a new process gets the past inputs first.
    pub(super) fn hand(&mut self, number: u64, task: Task, engine: &Engine, now: Time) {
        let Some(running) = self.process.as_mut().filter(|running| running.is_ready) else { return };
        let mut frames = Vec::new();
        if !std::mem::replace(&mut running.has_begun, true) {
            for past in engine.past(self.need, task.moment) {
                Word::Task(past, 0, true).write(&mut frames);
            }
        }
        Word::Task(task, number, false).write(&mut frames);
        // A task that finds no room stays unanswered, and so counts as overrun.
        running.process.hand(frames);
        running.open.push_back((number, now));
    }

    /// When the process must be supervised again, at the latest.
    pub(super) fn due(&self) -> Option<Time> {
        let assignment = self.assignment.as_ref()?;
        let Some(running) = &self.process else {
            return (self.not_before < Time::MAX).then_some(self.not_before);
        };
        let overrun = running.open.front().map(|(_, asked)| *asked + assignment.patience + Span(1));
        let start = (!running.is_ready).then(|| running.since + STARTING + Span(1));
        [overrun, start, Some(running.measured.0 + MEASURED)].into_iter().flatten().min()
    }

    /// Whether there is a computation.
    pub(super) fn is_at_work(&self) -> bool {
        self.assignment.is_some()
    }

    /// The state of the process.
    pub(super) fn state(&self) -> Value {
        let state = match (&self.assignment, &self.process) {
            (None, _) => "nothing to compute",
            (_, Some(running)) if running.is_ready => "working",
            (_, Some(_)) => "starting",
            _ if self.not_before == Time::MAX => "given up",
            _ => "waiting",
        };
        let Figures { started, replaced, answers, late, because, round_trip, start } = &self.figures;
        json!({
            "state": state,
            "process": self.process.as_ref().map(|running| running.process.id()),
            "patience_ms": self.assignment.as_ref().map(|assignment| assignment.patience.seconds() * 1e3),
            "started": started,
            "replaced": replaced,
            "answers": answers,
            "late": late,
            "last_failure": because,
            "round_trip_us": times(round_trip),
            "start_us": times(start),
        })
    }

    pub(super) fn replaced(&self) -> u64 {
        self.figures.replaced
    }

    /// The times of answers, nanoseconds.
    pub(super) fn round_trip(&self) -> &Histogram<u64> {
        &self.figures.round_trip
    }
}

fn record(histogram: &mut Histogram<u64>, span: Span) {
    histogram.saturating_record(u64::try_from(span.0).unwrap_or(0).max(1));
}
