//! The first stages of a takeover: the source is silenced, and its name is watched until it is quiet.

use super::stage::Stage;
use super::{Takeover, seconds};
use crate::wiring::action::{Job, Outcome, describe};
use crate::wiring::patterns::Patterns;
use shsa_bridge::Bridge;
use shsa_core::knowledge::{KnowledgeBase, SignalId};
use shsa_core::time::{Span, Time};

/// The number of periods of its signal for which a name must be quiet, where the wiring sets no time.
const PERIODS: f64 = 5.0;

/// The shortest and the longest time for which a name must be quiet, where the wiring sets none.
const CHECK: (Span, Span) = (Span::from_millis(100), Span::from_millis(10_000));

/// The time for which a name must be quiet where its signal has neither rate nor timeout.
const CHECK_USUAL: Span = Span::from_millis(1_000);

/// A source that is not quiet after this many times the check ignores the action.
pub(super) const PATIENCE: i64 = 3;

impl Takeover {
    pub(super) fn silence(
        &mut self,
        now: Time,
        bridge: &mut dyn Bridge,
        mut patterns: Option<&mut Patterns>,
    ) {
        self.is_released = false;
        self.is_ordered_back = false;
        if !self.template.is_known()
            && let Some(message) =
                patterns.as_ref().and_then(|patterns| patterns.message(&self.signal, self.topic()))
        {
            self.template.learn(&message);
        }
        if !self.template.is_known() {
            return self.refuse("no message of it was heard yet, so nobody knows how to write one", now);
        }
        if let (Some(patterns), Some(message)) = (&mut patterns, self.template.remembered()) {
            // The kept message is only needed after a restart, which reports when it is missing.
            let _ = patterns.keep(&self.signal, &message);
        }
        let job = Job::begin(&self.settings.silence, bridge);
        self.is_silenced = true;
        self.enter(Stage::Silencing(job), now);
    }

    pub(super) fn silenced(&mut self, outcome: Outcome, now: Time) {
        match outcome {
            Ok(output) => {
                self.output = output;
                self.enter(Stage::Checking { last_message: None, count: 0 }, now);
            }
            Err(why) => self.refuse(&why, now),
        }
    }

    /// Takes the name when it has become quiet; waits for the next attempt when it stays loud for too long.
    pub(super) fn look(&mut self, last_message: Option<Time>, count: u64, now: Time, source: &str) {
        let action = describe(&self.settings.silence);
        if now - last_message.unwrap_or(self.since) >= self.check {
            self.counts.silenced += 1;
            let output = if self.output.is_empty() { String::new() } else { format!(" ({})", self.output) };
            let because = format!(
                "{} was silenced by {action}{output}, and nobody else was heard under {} for {}: its name is served from {source}",
                self.signal,
                self.topic(),
                seconds(self.check)
            );
            self.enter(Stage::Taken, now);
            self.taken = now;
            self.report("silenced", because);
        } else if now - self.since >= Span(self.check.0.saturating_mul(PATIENCE)) {
            let why =
                format!("it goes on after {action} ({count} messages in {})", seconds(now - self.since));
            self.refuse(&why, now);
        }
    }

    fn refuse(&mut self, why: &str, now: Time) {
        self.counts.refused += 1;
        let pause = self.pause();
        let because = format!(
            "{} cannot be replaced under its name {}: {why}; tried again in {}",
            self.signal,
            self.topic(),
            seconds(pause)
        );
        self.wait(now, pause);
        self.report("refused", because);
    }
}

pub(super) fn usual_check(knowledge: &KnowledgeBase, signal: SignalId) -> Span {
    let signal = &knowledge.signals()[signal];
    let by_rate = signal.rate_hz.map(|rate| Span::from_seconds(PERIODS / rate));
    by_rate.or(signal.timeout).unwrap_or(CHECK_USUAL).clamp(CHECK.0, CHECK.1)
}
