//! Another process computes the source of a need: with right answers, the publications are the engine's own; with late, wrong or
//! missing answers, the engine computes the source itself.

use crate::models::System;
use shsa_core::computation::{Computation, Computed, Task};
use shsa_core::engine::{
    Engine, Input, Options, Order, Output, Publication, PublishedValue, Report, Subject,
};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{Id, NeedId};
use shsa_core::time::{Span, Time, Validity};
use std::collections::BTreeMap;

/// The delegates of an engine, in the same process.
struct Delegates {
    /// For each need: the number of the source, its computation, and whether that has seen the past.
    at_work: BTreeMap<usize, (u64, Computation, bool)>,
    /// Changes an answer, or drops it.
    twist: fn(Report, u64) -> Option<Report>,
}

struct Stage {
    engine: Engine,
    delegates: Option<Delegates>,
    now: Time,
    published: Vec<Publication>,
    /// The number of tasks without an answer.
    unanswered: usize,
}

fn no_twist(report: Report, _: u64) -> Option<Report> {
    Some(report)
}

impl Stage {
    fn new(system: &System, twist: Option<fn(Report, u64) -> Option<Report>>) -> Stage {
        let engine = Engine::new(system.knowledge.clone(), Options::default());
        let delegates = twist.map(|twist| Delegates { at_work: BTreeMap::new(), twist });
        Stage { engine, delegates, now: Time(0), published: Vec::new(), unanswered: 0 }
    }

    fn give(&mut self, input: Input) {
        self.now = self.now.max(input.time());
        self.engine.handle(input);
        self.listen();
        let (now, mut before) = (self.now, None);
        while let Some(due) = self.engine.next_deadline().filter(|due| *due <= now && before != Some(*due)) {
            before = Some(due);
            self.engine.handle(Input::Tick(due));
            self.listen();
        }
        self.delegation();
    }

    /// Starts the delegate of each need at once.
    fn delegation(&mut self) {
        let Some(delegates) = &mut self.delegates else { return };
        for need in self.engine.knowledge().needs().ids() {
            let Some(delegation) = self.engine.delegation(need) else { continue };
            let known = delegates.at_work.get(&need.index()).map(|(era, ..)| *era);
            if known == Some(delegation.era) {
                continue;
            }
            let (era, way) = (delegation.era, delegation.way.clone());
            let computation =
                Computation::new(self.engine.knowledge(), way, Computation::fastest_input).unwrap();
            delegates.at_work.insert(need.index(), (era, computation, false));
            self.engine.handle(Input::Report { time: self.now, need, report: Report::Ready { era } });
        }
        self.listen();
    }

    fn listen(&mut self) {
        while let Some(output) = self.engine.poll() {
            match output {
                Output::Publication(publication) => self.published.push(publication),
                Output::Task { need, number, task } => self.compute(need, number, &task),
                Output::Event(_) | Output::Reloaded(_) => {}
            }
        }
    }

    fn compute(&mut self, need: NeedId, number: u64, task: &Task) {
        let Some(delegates) = &mut self.delegates else { panic!("a task for nobody") };
        let (_, computation, has_begun) = delegates.at_work.get_mut(&need.index()).unwrap();
        if !std::mem::replace(has_begun, true) {
            for past in self.engine.past(need, task.moment) {
                assert!(past.moment.to < task.moment.to);
                computation.carry_out(&past);
            }
        }
        let result = computation.carry_out(task).map(|(computed, validity)| {
            let value = match computed {
                Computed::Scalar(value) => PublishedValue::Scalar(value),
                Computed::Vector(elements) => PublishedValue::Vector(elements.to_vec()),
            };
            (value, validity)
        });
        match (delegates.twist)(Report::Answer { number, result }, number) {
            Some(report) => self.engine.handle(Input::Report { time: self.now, need, report }),
            None => self.unanswered += 1,
        }
    }

    /// Seconds of a run in which these signals are forbidden after two seconds.
    fn run(&mut self, system: &System, forbidden: &[&str]) {
        system.inputs(0, 2).into_iter().for_each(|input| self.give(input));
        for name in forbidden {
            let order = Order::Forbid(Subject::Signal((*name).to_owned()));
            self.give(Input::Order { time: self.now, order });
        }
        system.inputs(2, 6).into_iter().for_each(|input| self.give(input));
    }
}

/// The publications without their delegation flags, need by need.
fn shown(published: &[Publication]) -> Vec<String> {
    let shown = |it: &&Publication| format!("{:?}", Publication { delegated: false, ..(*it).clone() });
    let mut published: Vec<&Publication> = published.iter().collect();
    published.sort_by_key(|it| it.need);
    published.iter().map(shown).collect()
}

/// Checks that publications are the same with and without delegates; returns how many values came from delegates.
#[track_caller]
fn check(system: &System, forbidden: &[&str]) -> usize {
    let [mut alone, mut helped] =
        [None, Some(no_twist as fn(Report, u64) -> _)].map(|twist| Stage::new(system, twist));
    alone.run(system, forbidden);
    helped.run(system, forbidden);
    let (alone, delegated) =
        (shown(&alone.published), helped.published.iter().filter(|it| it.delegated).count());
    let helped = shown(&helped.published);
    let differs = alone.iter().zip(&helped).position(|(one, other)| one != other);
    if let Some(at) = differs {
        panic!("value {at}:\n{}\n{}", alone[at], helped[at]);
    }
    assert_eq!(alone.len(), helped.len());
    delegated
}

#[test]
fn what_is_delegated_is_what_the_engine_would_compute() {
    // The minimum of a vector; a difference quotient over a second; reckoning from the last value.
    assert!(check(&crate::models::rover(), &[]) > 50);
    assert!(check(&crate::models::rover(), &["lidar"]) > 50);
    assert!(check(&crate::models::climber(), &["climb_1", "climb_2"]) > 80);
    assert!(check(&crate::models::climber(), &["barometer"]) > 200);
    assert_eq!(check(&crate::models::car(), &["wheel_1"]), 0, "a signal by itself is not computed");
}

/// The times at which a need was served after three seconds.
fn longest_gap(published: &[Publication]) -> Span {
    let times: Vec<Time> = published.iter().map(|it| it.time).filter(|at| at.seconds() > 3.0).collect();
    times.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap_or(Span::MAX)
}

#[test]
fn who_is_gone_leaves_no_gap() {
    let system = crate::models::rover();
    let mut stage =
        Stage::new(&system, Some(|report, number| if number == 20 { None } else { Some(report) }));
    let mut gone = 0;
    for input in system.inputs(0, 8) {
        stage.give(input);
        if stage.unanswered == 1 && gone < 3 {
            gone += 1;
        } else if gone == 3 {
            // Some inputs after the unanswered task.
            gone += 1;
            let (time, need) = (stage.now, NeedId::from_index(0));
            let before = stage.published.len();
            stage.engine.handle(Input::Report { time, need, report: Report::Gone });
            stage.listen();
            assert_eq!(stage.published.len(), before + 1, "the open task is done by the engine");
            assert!(!stage.published[before].delegated);
        }
    }
    assert_eq!(gone, 4);
    assert!(stage.published.len() > 75, "{}", stage.published.len());
    assert!(longest_gap(&stage.published) < Span::from_millis(210), "{:?}", longest_gap(&stage.published));
}

#[test]
fn a_wrong_answer_is_not_published() {
    fn twist(report: Report, number: u64) -> Option<Report> {
        let Report::Answer { result: Some((PublishedValue::Scalar(value), valid)), .. } = report.clone()
        else {
            return Some(report);
        };
        let scalar = |lo: f64, hi: f64| PublishedValue::Scalar(Interval::new(lo, hi));
        let later = Validity { to: valid.to + Span(1), ..valid };
        let reversed = Validity { from: valid.to + Span(1), to: valid.to };
        let result = match number % 24 {
            0 => (scalar(f64::NEG_INFINITY, 0.0), valid),
            1 => (scalar(2.0, 1.0), valid),
            2 => (PublishedValue::Vector(vec![value]), valid),
            3 => (scalar(value.lo(), value.hi()), later),
            4 => (scalar(value.lo(), value.hi()), reversed),
            // Sound by itself, but contradicted by the sonar and the image.
            5 => (scalar(value.lo() + 9.0, value.hi() + 9.0), valid),
            6 => return Some(Report::Answer { number: number + 1, result: Some((scalar(0.0, 0.1), valid)) }),
            _ => return Some(report),
        };
        Some(Report::Answer { number, result: Some(result) })
    }
    let system = crate::models::rover();
    let mut stage = Stage::new(&system, Some(twist));
    stage.run(&system, &[]);
    let (delegated, own): (Vec<_>, Vec<_>) =
        stage.published.iter().filter(|it| it.time.seconds() > 2.0).partition(|it| it.delegated);
    assert!(!delegated.is_empty() && !own.is_empty(), "{} {}", delegated.len(), own.len());
    for publication in &stage.published {
        let PublishedValue::Scalar(value) = publication.value else { panic!("a list") };
        let truth = 5.0 + 2.0 * (publication.time.seconds() / 6.0).cos();
        assert!((value.midpoint() - truth).abs() < 0.5, "{publication:?}");
    }
}
