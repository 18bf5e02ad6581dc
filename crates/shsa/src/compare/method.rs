//! The method that finds a fault in a step: the default monitor with its judge, or the published method.

use super::Settings;
use shsa_core::alignment::Sample;
use shsa_core::diagnosis::{Judge, JudgeOptions};
use shsa_core::interval::Interval;
use shsa_core::knowledge::{KnowledgeBase, SignalId};
use shsa_core::monitor::thesis::{ThesisOptions, ThesisOutput, ThesisRun};
use shsa_core::monitor::{self, Monitor, WatchedWay, WayIndex};
use shsa_core::observation::Observation;
use shsa_core::substitution::Way;
use shsa_core::time::{Time, Validity};
use shsa_core::trust::{Ledger, Verdict};
use shsa_format::event;
use std::num::NonZeroUsize;

/// One output of a way in a step.
pub(super) struct Output {
    pub(super) way: usize,
    pub(super) value: Interval,
    pub(super) validity: Option<Validity>,
}

/// The results of a step.
pub(super) struct Step {
    pub(super) time: Time,
    pub(super) outputs: Vec<Output>,
    pub(super) errors: Vec<f64>,
    pub(super) failed: Option<usize>,
    /// Whether some combinations of inputs were left out.
    pub(super) truncated: bool,
    /// The verdicts of signals that are not healthy.
    pub(super) verdicts: Vec<(String, &'static str)>,
}

pub(super) trait Method {
    fn ways(&self) -> Vec<Way>;
    fn observe(&mut self, observation: &Observation);
    fn step(&mut self, time: Time) -> Step;
}

pub(super) struct Thesis<'a> {
    knowledge: &'a KnowledgeBase,
    run: ThesisRun,
}

impl<'a> Thesis<'a> {
    pub(super) fn new(knowledge: &'a KnowledgeBase, ways: Vec<Way>, settings: &Settings) -> Thesis<'a> {
        let count = |given: Option<NonZeroUsize>| given.map_or(1, NonZeroUsize::get);
        let options = ThesisOptions {
            buffer: count(settings.buffer),
            average: count(settings.average),
            median: count(settings.median),
        };
        Thesis { knowledge, run: ThesisRun::new(knowledge, ways, options) }
    }
}

impl Method for Thesis<'_> {
    fn ways(&self) -> Vec<Way> {
        self.run.ways().cloned().collect()
    }

    fn observe(&mut self, observation: &Observation) {
        self.run.observe(self.knowledge, observation);
    }

    fn step(&mut self, time: Time) -> Step {
        let step = self.run.step(time);
        let output = |output: &ThesisOutput| Output {
            way: output.substitution,
            value: output.value,
            validity: output.validity,
        };
        let outputs = step.outputs.iter().map(output).collect();
        Step {
            time,
            outputs,
            errors: step.errors,
            failed: step.failed,
            truncated: step.truncated,
            verdicts: Vec::new(),
        }
    }
}

/// The default monitor with its judge, without needs.
pub(super) struct Watching<'a> {
    knowledge: &'a KnowledgeBase,
    monitor: Monitor,
    judge: Judge,
    ledger: Ledger,
    outputs: Vec<Output>,
    now: Option<Time>,
}

impl<'a> Watching<'a> {
    pub(super) fn new(knowledge: &'a KnowledgeBase, ways: Vec<Way>) -> Watching<'a> {
        let monitor = Monitor::new(knowledge, ways, monitor::Options::default());
        let options = JudgeOptions::default();
        let (judge, ledger) = (Judge::new(knowledge, options), Ledger::new(knowledge, options.probation));
        Watching { knowledge, monitor, judge, ledger, outputs: Vec::new(), now: None }
    }

    fn settle(&mut self, now: Time) {
        let changed = self.monitor.settle(now);
        if changed || self.judge.next_review().is_some_and(|due| due <= now) {
            self.judge.review(&mut self.ledger, &self.monitor, now);
        }
        let output = |(WayIndex(way), sample): (WayIndex, Sample)| Output {
            way: way as usize,
            value: sample.value,
            validity: Some(sample.validity),
        };
        self.outputs.extend(self.monitor.fresh().map(output));
    }

    fn verdicts(&self, time: Time) -> Vec<(SignalId, Verdict)> {
        let verdict = |signal| (signal, self.judge.verdict(&self.ledger, signal, &self.monitor, time));
        self.knowledge.signals().ids().map(verdict).collect()
    }
}

impl Method for Watching<'_> {
    fn ways(&self) -> Vec<Way> {
        self.monitor.ways().iter().map(|way| way.computation.way().clone()).collect()
    }

    fn observe(&mut self, observation: &Observation) {
        match self.now.replace(observation.received) {
            Some(before) if before < observation.received => self.settle(before),
            _ => {}
        }
        self.monitor.observe(self.knowledge, observation, observation.received);
    }

    fn step(&mut self, time: Time) -> Step {
        self.monitor.pass(time, |_| {});
        self.settle(time);
        let mut errors = vec![0.0; self.monitor.ways().len()];
        for pair in self.monitor.residuals() {
            let (disagreed, compared) = pair.window.counts();
            for way in [pair.way, pair.other] {
                errors[way.0 as usize] += f64::from(disagreed) / f64::from(compared.max(1));
            }
        }
        let verdicts = self.verdicts(time);
        let failed: Vec<SignalId> = verdicts
            .iter()
            .filter(|(_, verdict)| *verdict == Verdict::Failed)
            .map(|(signal, _)| *signal)
            .collect();
        let rests = |way: &WatchedWay| failed.iter().any(|signal| way.rests_on.contains(*signal));
        let failed_ways: Vec<usize> =
            (0..errors.len()).filter(|&way| self.monitor.ways().get(way).is_some_and(rests)).collect();
        let shown = |(signal, verdict): &(SignalId, Verdict)| {
            (
                self.knowledge.signals()[*signal].name.clone(),
                event::verdict(self.monitor.timeouts().absence(*signal), *verdict),
            )
        };
        Step {
            time,
            outputs: std::mem::take(&mut self.outputs),
            errors,
            failed: failed_ways.first().copied().filter(|_| failed_ways.len() == 1),
            truncated: false,
            verdicts: verdicts.iter().map(shown).collect(),
        }
    }
}
