//! The run without the injected faults beside the one with them, over the same samples.

use super::observation;
use shsa_core::engine::{Input, Options};
use shsa_core::knowledge::{KnowledgeBase, SignalId};
use shsa_format::drive::{Given, Run};
use shsa_recording::{Sample, Session};
use shsa_report::recorded::Injection;
use shsa_report::replay::NeedErrors;
use std::convert::Infallible;

/// The run without faults, and what is found by it.
pub(super) struct Clean<'a> {
    knowledge: &'a KnowledgeBase,
    session: &'a Session,
    run: Run,
    errors: NeedErrors,
    /// Which of the faults have struck a sample.
    struck: &'a mut [bool],
}

impl<'a> Clean<'a> {
    pub(super) fn new(
        knowledge: &'a KnowledgeBase,
        session: &'a Session,
        options: Options,
        struck: &'a mut [bool],
    ) -> Clean<'a> {
        let run = Run::with(knowledge, options, session.span.0);
        Clean { knowledge, session, run, errors: NeedErrors::default(), struck }
    }

    /// Takes in the next sample of the whole session.
    pub(super) fn take(&mut self, sample: &Sample, signals: &[SignalId], injections: &[Injection<'_>]) {
        if !self.session.part.holds(self.session.origin, sample) {
            return;
        }
        for (struck, injection) in self.struck.iter_mut().zip(injections) {
            *struck = *struck || injection.hits(sample, self.session.origin);
        }
        if let Some(observation) = observation(signals, sample.clone()) {
            let Ok(()) = self.run.pass_until(observation.received, &mut unrecorded);
            self.run.give(Given::Input(&Input::Observation(observation)));
            self.hand_over();
        }
    }

    /// Compares the values that the run with faults has just published.
    pub(super) fn compare(&mut self, broken: &Run) {
        for publication in &broken.publications {
            self.errors.value(self.knowledge, publication);
        }
    }

    /// The errors when both runs are over.
    pub(super) fn end(mut self) -> NeedErrors {
        let end = self.session.span.1.max(self.run.last);
        let Ok(()) = self.run.pass_until(end, &mut unrecorded);
        self.run.give(Given::Input(&Input::Tick(end)));
        self.hand_over();
        self.errors.end();
        self.errors
    }

    /// Gives the published values to the comparison, and keeps nothing.
    fn hand_over(&mut self) {
        for publication in &self.run.publications {
            self.errors.reference(self.knowledge, publication);
        }
        self.run.forget();
    }
}

fn unrecorded(_: Given<'_>) -> Result<(), Infallible> {
    Ok(())
}
