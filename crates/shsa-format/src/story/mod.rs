//! Stories: a model, observations, expectations and the reason why they matter; each is a test, documentation and a demo.
//!
//! `text -> read -> Story -> trace -> run -> expect -> Outcome`. The shape is described in `stories/README.md`.

mod curve;
mod trace;
mod change;
mod run;
mod expect;
mod read;

use crate::drive::{Era, Given, Run};
use expect::{Evidence, Expectation};
use shsa_core::engine::{Engine, Event};
use shsa_core::knowledge::KnowledgeBase;
use shsa_core::time::Time;
use shsa_model::Report;
use std::path::Path;
use trace::Trace;

/// A story that can be run.
#[derive(Clone, Debug)]
pub struct Story {
    /// The events, in one sentence.
    pub title: String,
    /// The requirement that the story covers.
    pub why: String,
    /// The system of the story.
    pub knowledge: KnowledgeBase,
    trace: Trace,
    /// Later knowledge bases, in the order of time.
    changes: Vec<Era>,
    expectations: Vec<Written>,
}

/// An expectation with its words in the file.
#[derive(Clone, Debug)]
struct Written {
    text: String,
    line: usize,
    expectation: Expectation,
}

/// A story as far as it is valid, and its problems.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// `None` when the report has errors.
    pub story: Option<Story>,
    /// All problems, in file order; those of a model in a file of its own come last.
    pub report: Report,
}

/// The result of a story.
#[derive(Debug)]
pub struct Outcome {
    /// The engine at the end, with all events and published values; their ids belong to the model of the story.
    pub run: Run,
    /// The expectations with their results, in file order.
    pub checks: Vec<Check>,
}

/// An expectation with its result.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Check {
    /// The expectation as written.
    pub expected: String,
    /// Its line in the file, counted from 1.
    pub line: usize,
    /// The observed result in words.
    pub found: String,
    /// Whether the expectation is met.
    pub met: bool,
}

impl Outcome {
    /// Whether every expectation is met.
    #[must_use]
    pub fn is_met(&self) -> bool {
        self.checks.iter().all(|check| check.met)
    }
}

impl Story {
    /// Runs the story from begin to end; every run is the same, byte for byte.
    #[must_use]
    pub fn run(&self) -> Outcome {
        let looking: Vec<(usize, Time)> = self
            .expectations
            .iter()
            .enumerate()
            .filter_map(|(at, written)| Some((at, written.expectation.moment()?)))
            .collect();
        let moments: Vec<Time> = looking.iter().map(|(_, time)| *time).collect();
        let mut seen = vec![None; self.expectations.len()];
        let look = |moment: usize, engine: &Engine| {
            let at = looking[moment].0;
            seen[at] = self.expectations[at].expectation.look(&self.knowledge, engine);
        };
        let mut run = run::drive(self, &moments, look, |_| ());
        (run.events, run.publications) = change::in_first_names(&run, &self.knowledge);
        run.past.clear();
        let evidence = Evidence { knowledge: &self.knowledge, run: &run, seen };
        let check = |(at, written): (usize, &Written)| {
            let (met, found) = written.expectation.check(at, &evidence);
            Check { expected: written.text.clone(), line: written.line, found, met }
        };
        let checks = self.expectations.iter().enumerate().map(check).collect();
        Outcome { run, checks }
    }
}

impl Story {
    /// All inputs of the run, ticks included, as a journal holds them.
    #[must_use]
    pub fn journal(&self) -> Vec<Era> {
        let mut eras = vec![Era::only(self.knowledge.clone(), Vec::new())];
        let record = |given: Given<'_>| match (given, eras.last_mut()) {
            (Given::Input(input), Some(era)) => era.inputs.push(input.clone()),
            (Given::Era(era), _) => eras.push(era.clone()),
            (Given::Input(_), None) => {}
        };
        run::drive(self, &[], |_, _| (), record);
        eras
    }
}

/// An event in a line, without its reason: `failed /a at 16.20 s`.
#[must_use]
pub fn headline(knowledge: &KnowledgeBase, event: &Event) -> String {
    expect::headline(knowledge, event)
}

/// Reads and checks a story. `name` is the file name in the report; models in other files are found relative to `folder`. Never
/// fails: the report holds the problems.
#[must_use]
pub fn load(text: &str, name: &str, folder: &Path) -> Loaded {
    read::load(text, name, folder)
}

/// As [`load`] for a file.
#[must_use]
pub fn load_file(path: &Path) -> Loaded {
    let name = path.display().to_string();
    match shsa_model::read_text(path, "story") {
        Ok(text) => load(&text, &name, path.parent().unwrap_or(Path::new("."))),
        Err(report) => Loaded { story: None, report },
    }
}

#[cfg(test)]
mod tests;
