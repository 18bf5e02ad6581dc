//! The takeover of a failed source's name: silences the source, checks that it is quiet, publishes in its place, and lets it
//! back.
//!
//! ```text
//! watching -lost-> silencing -> checking -quiet-> taken -order, trust, probe-> restoring -> taken
//!     ^                |failed      |not quiet      |somebody else is heard
//!     +----trusted--- waiting <-----+---------------+        (at once: never two)
//!                        |still lost: silencing again
//! ```

mod stage;
mod silencing;
mod way_back;

pub(in super::super) use stage::{Counts, Note, Situation};

use super::action::describe;
use super::patterns::Patterns;
use crate::error::{RuntimeError, unfit};
use crate::message_template::MessageTemplate;
use serde_json::{Value, json};
use shsa_bridge::Clock;
use shsa_bridge::{Bridge, BridgeError, Link, Message, Outgoing, Provenance, Quality};
use shsa_core::engine::Publication;
use shsa_core::knowledge::{KnowledgeBase, NeedId, SignalId};
use shsa_core::time::{Span, Time};
use shsa_format::wiring;
use silencing::{PATIENCE, usual_check};
use stage::Stage;
use std::collections::VecDeque;

/// The longest time between two attempts, as a multiple of the first.
const RETRY_MAX: i64 = 20;

/// The takeover of one source's name for one need.
#[derive(Debug)]
pub(in super::super) struct Takeover {
    need: NeedId,
    /// The signal of the silenced source.
    signal: String,
    settings: wiring::Takeover,
    check: Span,
    template: MessageTemplate,
    stage: Stage,
    /// When the stage began.
    since: Time,
    /// When the name was taken.
    taken: Time,
    /// Attempts in a row that failed or did not last.
    failures: u32,
    /// Whether this instance serves the need.
    is_ours: bool,
    /// The output of the action that silenced the source.
    output: String,
    /// Whether an action to silence the source has begun, and the source has neither sent a message nor got its name back since.
    is_silenced: bool,
    /// Whether the source may publish again; until it does, its name is served.
    is_released: bool,
    is_ordered_back: bool,
    /// The source is not let back before this moment.
    not_before: Time,
    /// The note that was reported last.
    last: Option<Note>,
    notes: VecDeque<Note>,
    counts: Counts,
    /// Why the last value could not be written or sent.
    unwritten: Option<String>,
}

impl Takeover {
    /// The takeover of the need's own source, or of the signal that the wiring names.
    ///
    /// # Errors
    /// When the signal's messages carry other signals, too, or its source names no topic.
    pub(in super::super) fn new(
        knowledge: &KnowledgeBase,
        need: NeedId,
        signal: SignalId,
        settings: &wiring::Takeover,
    ) -> Result<Takeover, RuntimeError> {
        let template = MessageTemplate::new(knowledge, signal)?;
        let name = &knowledge.signals()[signal].name;
        for other in knowledge.signals().ids().filter(|other| *other != signal) {
            if MessageTemplate::new(knowledge, other)?.topic() == template.topic() {
                return Err(unfit(format!(
                    "takeover of {name}: {} comes under the name {}, too, and would be silenced with it; \
                     wire the need as a gate",
                    knowledge.signals()[other].name,
                    template.topic()
                )));
            }
        }
        Ok(Takeover {
            need,
            signal: name.clone(),
            settings: settings.clone(),
            check: settings.check.unwrap_or_else(|| usual_check(knowledge, signal)),
            template,
            stage: Stage::Watching,
            since: Time::MIN,
            taken: Time::MIN,
            failures: 0,
            is_ours: true,
            output: String::new(),
            is_silenced: false,
            is_released: false,
            is_ordered_back: false,
            not_before: Time::MIN,
            last: None,
            notes: VecDeque::new(),
            counts: Counts::default(),
            unwritten: None,
        })
    }

    /// Whether it has the same signal, name and settings as a takeover from before a change of the model.
    pub(in super::super) fn is_same(&self, before: &Takeover) -> bool {
        self.signal == before.signal && self.topic() == before.topic() && self.settings == before.settings
    }

    /// Continues the previous takeover of the same name.
    pub(in super::super) fn succeeding(self, before: Takeover) -> Takeover {
        let Takeover { need, check, template, .. } = self;
        let template = match before.template.remembered() {
            Some(message) => template.taught(&message),
            None => template,
        };
        Takeover { need, check, template, ..before }
    }

    /// Whether the source may be silent because of this takeover.
    pub(in super::super) fn is_silencing(&self) -> bool {
        self.is_silenced && !self.is_released
    }

    /// Whether an action is under way.
    pub(in super::super) fn is_acting(&self) -> bool {
        matches!(self.stage, Stage::Silencing(_) | Stage::Restoring(_))
    }

    pub(in super::super) fn need(&self) -> NeedId {
        self.need
    }

    /// The name of the signal whose source is silenced.
    pub(in super::super) fn signal(&self) -> &str {
        &self.signal
    }

    pub(in super::super) fn signal_id(&self) -> SignalId {
        self.template.signal()
    }

    /// The taken name.
    pub(in super::super) fn topic(&self) -> &str {
        self.template.topic()
    }

    pub(in super::super) fn template(&mut self) -> &mut MessageTemplate {
        &mut self.template
    }

    pub(in super::super) fn counts(&self) -> Counts {
        self.counts
    }

    /// The name of the stage.
    pub(in super::super) fn stage(&self) -> &'static str {
        self.stage.name()
    }

    /// The next note that was not reported yet.
    pub(in super::super) fn note(&mut self) -> Option<Note> {
        self.notes.pop_front()
    }

    /// Takes in a message of another publisher. It is the source's unless it is marked as a substitute (of another instance), or
    /// was retained by the broker and may be of any age.
    pub(in super::super) fn note_message(&mut self, message: &Message) {
        let is_source = !message.retained && message.quality.is_none_or(|quality| quality == Quality::Good);
        if message.topic != *self.template.topic() || !is_source {
            return;
        }
        match &mut self.stage {
            Stage::Silencing(_) => {}
            Stage::Checking { last_message, count } if message.received > self.since => {
                *last_message = Some(message.received);
                *count += 1;
            }
            Stage::Checking { .. } => {}
            Stage::Taken | Stage::Restoring(_) => self.step_back(message.received),
            Stage::Watching | Stage::Waiting { .. } => self.is_silenced = false,
        }
    }

    /// The source is back: leaves the name to it at once.
    fn step_back(&mut self, now: Time) {
        self.counts.returned += 1;
        self.is_silenced = false;
        let pause = self.pause();
        let because = format!(
            "{} publishes {} again, so its name is left to it at once; if it is still not trusted in {}, it is silenced again",
            self.signal,
            self.topic(),
            seconds(pause)
        );
        self.wait(now, pause);
        self.report("returned", because);
    }

    /// Takes the next possible steps.
    pub(in super::super) fn step(
        &mut self,
        situation: &Situation<'_>,
        bridge: &mut dyn Bridge,
        patterns: Option<&mut Patterns>,
    ) {
        let Situation { now, is_bad, is_served, is_ours, source } = *situation;
        let is_lost = is_bad && is_served;
        self.is_ours = is_ours;
        if !is_ours {
            // The new owner of the need silences the source again, and lets it back.
            self.is_silenced = false;
            return if !matches!(self.stage, Stage::Watching) {
                self.enter(Stage::Watching, now)
            };
        }
        match &self.stage {
            Stage::Watching if is_lost => self.silence(now, bridge, patterns),
            Stage::Watching => {}
            Stage::Silencing(job) => {
                if let Some(outcome) = job.outcome() {
                    self.silenced(outcome, now);
                }
            }
            // Without a connection, silence proves nothing.
            Stage::Checking { .. } if bridge.link() != Link::Up => {
                self.enter(Stage::Checking { last_message: None, count: 0 }, now);
            }
            Stage::Checking { last_message, count } => self.look(*last_message, *count, now, source),
            Stage::Taken => {
                if let Some(why) = self.reason_to_restore(situation) {
                    self.restore(why, "its name is served", now, bridge);
                }
            }
            Stage::Restoring(job) => {
                if let Some(outcome) = job.outcome() {
                    self.restored(outcome, now);
                }
            }
            Stage::Waiting { .. } if !is_bad => {
                self.failures = 0;
                self.enter(Stage::Watching, now);
            }
            Stage::Waiting { until } if is_lost && *until <= now => self.silence(now, bridge, patterns),
            Stage::Waiting { .. } => {}
        }
    }

    fn enter(&mut self, stage: Stage, now: Time) {
        self.stage = stage;
        self.since = now;
    }

    fn report(&mut self, kind: &'static str, because: String) {
        let note = Note { kind, because };
        self.last = Some(note.clone());
        self.notes.push_back(note);
    }

    /// The pause before the next attempt.
    fn pause(&self) -> Span {
        let times = 1_i64.checked_shl(self.failures).unwrap_or(RETRY_MAX).clamp(1, RETRY_MAX);
        Span(self.settings.retry.0.saturating_mul(times))
    }

    fn wait(&mut self, now: Time, pause: Span) {
        self.failures = self.failures.saturating_add(1).min(16);
        self.enter(Stage::Waiting { until: now + pause }, now);
    }

    /// When the next step is due without an event; `None` when only an event can lead on.
    pub(in super::super) fn due(&self, now: Time) -> Option<Time> {
        let due = match &self.stage {
            Stage::Checking { last_message, .. } => {
                let quiet = last_message.unwrap_or(self.since) + self.check;
                Some(quiet.min(self.since + Span(self.check.0.saturating_mul(PATIENCE))))
            }
            Stage::Taken if self.is_released => None,
            Stage::Taken => {
                let probe = self.settings.probe.map(|probe| self.since + probe);
                let due = probe.into_iter().chain([self.not_before]);
                due.filter(|due| *due > now).min()
            }
            Stage::Waiting { until } => Some(*until),
            // The end of an action wakes the run.
            Stage::Watching | Stage::Silencing(_) | Stage::Restoring(_) => None,
        };
        due.filter(|due| *due > now)
    }

    /// Sends a value under the name if this instance has taken it and the value can be written.
    ///
    /// # Errors
    /// Errors of the bus.
    pub(in super::super) fn send(
        &mut self,
        publication: &Publication,
        stamp: Time,
        provenance: &Provenance,
        bridge: &mut dyn Bridge,
    ) -> Result<(), BridgeError> {
        let is_ours = matches!(self.stage, Stage::Taken | Stage::Restoring(_));
        if !is_ours || provenance.source == self.signal {
            return Ok(());
        }
        let topic = self.template.topic().clone();
        let sent = match self.template.message(&topic, &publication.value, stamp, provenance, bridge) {
            Ok(Some(payload)) => {
                let message = Outgoing::new(&topic, stamp, payload);
                bridge.publish(Outgoing { provenance: Some(provenance), ..message })
            }
            Ok(None) => return Ok(()),
            Err(why) => {
                self.unwritten = Some(why);
                return Ok(());
            }
        };
        self.unwritten = sent.as_ref().err().map(ToString::to_string);
        sent
    }

    /// The quality of the last message under the name; `quality` is that of the need.
    pub(in super::super) fn quality(&self, quality: Quality, is_bad: bool) -> Quality {
        match &self.stage {
            Stage::Taken | Stage::Restoring(_) if self.unwritten.is_none() => quality,
            // Another instance serves the need.
            Stage::Watching if !self.is_ours => quality,
            // The source itself publishes.
            Stage::Watching | Stage::Waiting { .. } if !is_bad && quality != Quality::Bad => Quality::Good,
            _ => Quality::Bad,
        }
    }

    /// The state of the takeover as JSON.
    pub(in super::super) fn json(&self, quality: Quality, clock: &Clock) -> Value {
        let is_taken = matches!(self.stage, Stage::Taken | Stage::Restoring(_));
        let since = if is_taken { self.taken } else { self.since };
        let since = (!matches!(self.stage, Stage::Watching)).then(|| clock.by_wall(since).0);
        let again = match &self.stage {
            Stage::Waiting { until } => Some(clock.by_wall(*until).0),
            _ => None,
        };
        json!({
            "signal": self.signal,
            "name": self.topic(),
            "stage": self.stage(),
            "quality": quality.name(),
            "since_ns": since,
            "again_ns": again,
            "silenced_by": is_taken.then(|| describe(&self.settings.silence)),
            "released": self.is_released && is_taken,
            "last": self.last.as_ref().map(|note| note.kind),
            "because": self.unwritten.as_ref().or(self.last.as_ref().map(|note| &note.because)),
            "silenced": self.counts.silenced,
            "refused": self.counts.refused,
            "returned": self.counts.returned,
        })
    }
}

fn seconds(span: Span) -> String {
    let seconds = span.seconds();
    if seconds < 1.0 { format!("{:.0} ms", seconds * 1e3) } else { format!("{seconds:.1} s") }
}

#[cfg(test)]
mod tests;
