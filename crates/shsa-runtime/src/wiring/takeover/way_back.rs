//! The last stages of a takeover: lets a silenced source publish again.

use super::Takeover;
use super::stage::{Situation, Stage};
use crate::wiring::action::{Job, Outcome, describe};
use shsa_bridge::Bridge;
use shsa_core::time::Time;

impl Takeover {
    /// Lets the source back by an operator's order; returns whether the name was taken.
    pub(in super::super::super) fn order_back(&mut self) -> bool {
        let is_taken = !matches!(self.stage, Stage::Watching | Stage::Waiting { .. });
        self.is_ordered_back |= is_taken;
        is_taken
    }

    pub(super) fn reason_to_restore(&self, situation: &Situation<'_>) -> Option<&'static str> {
        let Situation { now, is_bad, .. } = *situation;
        let is_probed = self.settings.probe.is_some_and(|probe| now - self.since >= probe);
        match () {
            () if self.is_released || now < self.not_before => None,
            () if self.is_ordered_back => Some("by order of the operator"),
            () if !is_bad => Some("no evidence is against it any more"),
            () if is_probed => Some("it gets another chance"),
            () => None,
        }
    }

    /// Lets the source back after a change of the model that removed the takeover; returns whether this is done.
    pub(in super::super::super) fn leave(&mut self, now: Time, bridge: &mut dyn Bridge) -> bool {
        // A running action ends first.
        if let Stage::Silencing(job) | Stage::Restoring(job) = &self.stage {
            let Some(outcome) = job.outcome() else { return false };
            match &self.stage {
                Stage::Restoring(_) => self.restored(outcome, now),
                _ => self.enter(Stage::Taken, now),
            }
        }
        if self.is_silencing() && now >= self.not_before {
            self.restore(
                "the model has changed, and its name is not taken any more",
                "it is not served",
                now,
                bridge,
            );
        }
        !self.is_silencing()
    }

    pub(super) fn restore(&mut self, why: &str, meanwhile: &str, now: Time, bridge: &mut dyn Bridge) {
        let (signal, topic) = (&self.signal, self.topic());
        let Some(action) = &self.settings.restore else {
            let because = format!(
                "{signal} may publish {topic} again ({why}), but there is no action `restore`: let it publish by hand"
            );
            self.is_released = true;
            return self.report("returning", because);
        };
        let because = format!(
            "{signal} is let publish {topic} again by {} ({why}); until it is heard, {meanwhile}",
            describe(action)
        );
        let job = Job::begin(action, bridge);
        self.enter(Stage::Restoring(job), now);
        self.report("returning", because);
    }

    pub(super) fn restored(&mut self, outcome: Outcome, now: Time) {
        self.enter(Stage::Taken, now);
        match outcome {
            Ok(_) => (self.is_released, self.is_silenced) = (true, false),
            Err(why) => {
                self.counts.refused += 1;
                self.not_before = now + self.settings.retry;
                let because = format!("{} cannot be let publish again: {why}", self.signal);
                self.report("refused", because);
            }
        }
    }
}
