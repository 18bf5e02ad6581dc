//! What the tests of small models have in common: parts of a draft, and an engine that is driven by hand.

use shsa_core::engine::{Engine, Input, Options, Output, Publication};
use shsa_core::knowledge::{
    Bounds, Draft, Id, KnowledgeBase, NeedDraft, Severity, SignalDraft, SignalId, Text, VariableDraft, build,
};
use shsa_core::observation::{Observation, RawValue};
use shsa_core::time::Time;
use shsa_core::trust::Verdict;

/// Nanoseconds of a millisecond.
pub(crate) const MS: i64 = 1_000_000;

/// A text without a place.
pub(crate) fn text(text: impl Into<String>) -> Text {
    Text { text: text.into(), ..Text::default() }
}

/// A rate by its period.
pub(crate) fn rate(period_ms: i64) -> Text {
    text(format!("{} Hz", 1_000.0 / period_ms as f64))
}

/// A variable of which only its name is known.
pub(crate) fn variable(name: impl Into<String>) -> VariableDraft {
    VariableDraft { name: text(name), ..VariableDraft::default() }
}

/// A signal of a variable, with an error of its values.
pub(crate) fn signal(name: impl Into<String>, variable: &str, error: impl Into<String>) -> SignalDraft {
    SignalDraft {
        name: text(name),
        variable: Some(text(variable)),
        value_error: Some(Bounds::One(text(error))),
        ..SignalDraft::default()
    }
}

/// A need of a variable.
pub(crate) fn need(variable: &str, max_age_ms: i64) -> NeedDraft {
    let max_age = Some(text(format!("{max_age_ms} ms")));
    NeedDraft { variable: text(variable), max_age, ..NeedDraft::default() }
}

/// A knowledge base without errors.
#[track_caller]
pub(crate) fn knowledge(draft: &Draft) -> KnowledgeBase {
    let (knowledge, problems) = build(draft);
    assert!(problems.iter().all(|it| it.severity != Severity::Error), "{problems:?}");
    knowledge
}

/// An engine that ticks whenever it is due.
pub(crate) struct Driven {
    engine: Engine,
}

impl Driven {
    pub(crate) fn new(knowledge: KnowledgeBase) -> Driven {
        Driven { engine: Engine::new(knowledge, Options::default()) }
    }

    /// Ticks up to a time.
    pub(crate) fn pass(&mut self, now: Time) {
        while let Some(due) = self.engine.next_deadline().filter(|due| *due <= now) {
            self.engine.handle(Input::Tick(due));
        }
    }

    /// Ticks at a time, whether the engine is due or not.
    pub(crate) fn tick(&mut self, now: Time) {
        self.engine.handle(Input::Tick(now));
    }

    /// A value of a signal, by its place in the model.
    pub(crate) fn give(&mut self, signal: usize, (stamp, received): (Time, Time), value: f64) {
        let (signal, value) = (SignalId::from_index(signal), RawValue::Number(value));
        self.engine.handle(Input::Observation(Observation { signal, stamp, received, value }));
    }

    /// Another input.
    pub(crate) fn handle(&mut self, input: Input) {
        self.engine.handle(input);
    }

    /// The verdict on a signal, by its place in the model.
    pub(crate) fn verdict(&self, signal: usize) -> Verdict {
        self.engine.verdict(SignalId::from_index(signal))
    }

    /// All that came out since it was asked last.
    pub(crate) fn outputs(&mut self) -> impl Iterator<Item = Output> {
        std::iter::from_fn(|| self.engine.poll())
    }

    /// The publications among all that came out since it was asked last.
    pub(crate) fn publications(&mut self) -> impl Iterator<Item = Publication> {
        self.outputs().filter_map(|output| match output {
            Output::Publication(publication) => Some(publication),
            _ => None,
        })
    }
}
