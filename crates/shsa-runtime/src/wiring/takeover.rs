//! The takeover of a failed source's name: silence it, see that it is quiet, publish in its place, and let it back.
//!
//! ```text
//! watching -lost-> silencing -> checking -quiet-> taken -order, trust, probe-> restoring -> taken
//!     ^                |failed      |not quiet      |somebody else is heard
//!     +----trusted--- waiting <-----+---------------+        (at once: never two)
//!                        |still lost: silencing again
//! ```

mod status;
mod way_back;

use super::action::{Job, Outcome, describe};
use super::patterns::Patterns;
use crate::error::{RuntimeError, unfit};
use crate::message_template::MessageTemplate;
use shsa_bridge::{Bridge, BridgeError, Link, Message, Outgoing, Provenance, Quality};
use shsa_core::engine::Publication;
use shsa_core::knowledge::{KnowledgeBase, NeedId, SignalId};
use shsa_core::time::{Span, Time};
use shsa_format::wiring;
use std::collections::VecDeque;

/// A name must be quiet for so many periods of its signal, where no other time is set.
const PERIODS: f64 = 5.0;
/// Bounds of that time.
const CHECK: (Span, Span) = (Span::from_millis(100), Span::from_millis(10_000));
/// Where the signal has neither rate nor timeout.
const CHECK_USUAL: Span = Span::from_millis(1_000);
/// A source that is not quiet after so many of these times does not obey.
const PATIENCE: i64 = 3;
/// The longest time between two attempts, in the first one's.
const RETRY_MAX: i64 = 20;

/// Something to be told.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in super::super) struct Note {
    /// `silenced`, `refused`, `returning`, `returned`.
    pub(in super::super) kind: &'static str,
    /// Why, in words.
    pub(in super::super) because: String,
}

/// How it stands with the need, as far as its takeover has to know.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Situation<'a> {
    pub(in super::super) now: Time,
    /// Whether the source is not trusted.
    pub(in super::super) is_bad: bool,
    /// Whether something else serves the need.
    pub(in super::super) is_served: bool,
    /// Whether the need is ours to serve.
    pub(in super::super) is_ours: bool,
    /// What serves the need.
    pub(in super::super) source: &'a str,
}

/// The takeover of the name of one source for one need.
#[derive(Debug)]
pub(in super::super) struct Takeover {
    need: NeedId,
    /// The signal whose source is silenced.
    signal: String,
    settings: wiring::Takeover,
    check: Span,
    template: MessageTemplate,
    stage: Stage,
    /// When the stage began.
    since: Time,
    /// When the name was taken.
    taken: Time,
    /// Attempts in a row that did not last.
    failures: u32,
    /// Whether the need is ours to serve.
    is_ours: bool,
    /// What the action has said that silenced the source.
    said: String,
    /// Whether an action has begun to silence the source, which has neither been heard nor let back since.
    is_silenced: bool,
    /// The source may publish again; until it does, its name is served.
    is_released: bool,
    is_ordered_back: bool,
    /// Before that the source is not given back again.
    not_before: Time,
    /// The last that was told.
    last: Option<Note>,
    notes: VecDeque<Note>,
    counts: Counts,
    /// Why the last value could not be written or sent.
    unwritten: Option<String>,
}

/// How often since the beginning.
#[derive(Clone, Copy, Debug, Default)]
pub(in super::super) struct Counts {
    pub(in super::super) silenced: u64,
    pub(in super::super) refused: u64,
    pub(in super::super) returned: u64,
}

#[derive(Debug)]
enum Stage {
    /// The source publishes itself.
    Watching,
    Silencing(Job),
    /// When the name was last heard, and how often.
    Checking {
        heard: Option<Time>,
        count: u64,
    },
    /// The name is ours.
    Taken,
    /// The name is ours until the source is heard again.
    Restoring(Job),
    /// It did not work, or the source is back: it is looked at again then.
    Waiting {
        until: Time,
    },
}

impl Stage {
    fn name(&self) -> &'static str {
        match self {
            Stage::Watching => "watching",
            Stage::Silencing(_) => "silencing",
            Stage::Checking { .. } => "checking",
            Stage::Taken => "taken",
            Stage::Restoring(_) => "restoring",
            Stage::Waiting { .. } => "waiting",
        }
    }
}

impl Takeover {
    /// For the need's own source, or the signal that is named.
    ///
    /// # Errors
    /// When the signal's messages carry others, too, or its source names no topic.
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
            said: String::new(),
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

    /// Whether it is of the same name as another, from before the model has changed.
    pub(in super::super) fn is_same(&self, before: &Takeover) -> bool {
        self.signal == before.signal && self.topic() == before.topic() && self.settings == before.settings
    }

    /// Goes on where one of the same name was.
    pub(in super::super) fn succeeding(self, before: Takeover) -> Takeover {
        let Takeover { need, check, template, .. } = self;
        let template = match before.template.remembered() {
            Some(message) => template.taught(&message),
            None => template,
        };
        Takeover { need, check, template, ..before }
    }

    /// Whether the source may be silent because of us.
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

    /// The name that is taken.
    pub(in super::super) fn topic(&self) -> &str {
        self.template.topic()
    }

    pub(in super::super) fn template(&mut self) -> &mut MessageTemplate {
        &mut self.template
    }

    pub(in super::super) fn counts(&self) -> Counts {
        self.counts
    }

    /// What it is doing, in a word.
    pub(in super::super) fn stage(&self) -> &'static str {
        self.stage.name()
    }

    /// What has happened since it was last asked.
    pub(in super::super) fn note(&mut self) -> Option<Note> {
        self.notes.pop_front()
    }

    /// Somebody else has published under some name; what is marked as a substitute is another instance's, and what was
    /// kept may be of any age.
    pub(in super::super) fn heard(&mut self, message: &Message) {
        let is_source = !message.retained && message.quality.is_none_or(|quality| quality == Quality::Good);
        if message.topic != *self.template.topic() || !is_source {
            return;
        }
        match &mut self.stage {
            Stage::Silencing(_) => {}
            Stage::Checking { heard, count } if message.received > self.since => {
                *heard = Some(message.received);
                *count += 1;
            }
            Stage::Checking { .. } => {}
            Stage::Taken | Stage::Restoring(_) => self.step_back(message.received),
            Stage::Watching | Stage::Waiting { .. } => self.is_silenced = false,
        }
    }

    /// The source is back: at once it is alone again.
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
        self.tell("returned", because);
    }

    /// Goes on as far as is possible now.
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
            // Whoever is responsible now silences the source again, and lets it back.
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
            // Who is cut off hears nobody.
            Stage::Checking { .. } if bridge.link() != Link::Up => {
                self.enter(Stage::Checking { heard: None, count: 0 }, now);
            }
            Stage::Checking { heard, count } => self.look(*heard, *count, now, source),
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

    fn tell(&mut self, kind: &'static str, because: String) {
        let note = Note { kind, because };
        self.last = Some(note.clone());
        self.notes.push_back(note);
    }

    /// How long it is waited before the next attempt.
    fn pause(&self) -> Span {
        let times = 1_i64.checked_shl(self.failures).unwrap_or(RETRY_MAX).clamp(1, RETRY_MAX);
        Span(self.settings.retry.0.saturating_mul(times))
    }

    fn wait(&mut self, now: Time, pause: Span) {
        self.failures = self.failures.saturating_add(1).min(16);
        self.enter(Stage::Waiting { until: now + pause }, now);
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
        self.tell("refused", because);
    }

    fn silence(&mut self, now: Time, bridge: &mut dyn Bridge, mut patterns: Option<&mut Patterns>) {
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
            // Only needed after a restart, and then its absence is told.
            let _ = patterns.keep(&self.signal, &message);
        }
        let job = Job::begin(&self.settings.silence, bridge);
        self.is_silenced = true;
        self.enter(Stage::Silencing(job), now);
    }

    fn silenced(&mut self, outcome: Outcome, now: Time) {
        match outcome {
            Ok(said) => {
                self.said = said;
                self.enter(Stage::Checking { heard: None, count: 0 }, now);
            }
            Err(why) => self.refuse(&why, now),
        }
    }

    /// Whether it has become quiet under the name.
    fn look(&mut self, heard: Option<Time>, count: u64, now: Time, source: &str) {
        let action = describe(&self.settings.silence);
        if now - heard.unwrap_or(self.since) >= self.check {
            self.counts.silenced += 1;
            let said = if self.said.is_empty() { String::new() } else { format!(" ({})", self.said) };
            let because = format!(
                "{} was silenced by {action}{said}, and nobody else was heard under {} for {}: its name is served from {source}",
                self.signal,
                self.topic(),
                seconds(self.check)
            );
            self.enter(Stage::Taken, now);
            self.taken = now;
            self.tell("silenced", because);
        } else if now - self.since >= Span(self.check.0.saturating_mul(PATIENCE)) {
            let why =
                format!("it goes on after {action} ({count} messages in {})", seconds(now - self.since));
            self.refuse(&why, now);
        }
    }

    /// When it has to be looked at again, unless something happens before: what was due already waits for that.
    pub(in super::super) fn due(&self, now: Time) -> Option<Time> {
        let due = match &self.stage {
            Stage::Checking { heard, .. } => {
                let quiet = heard.unwrap_or(self.since) + self.check;
                Some(quiet.min(self.since + Span(self.check.0.saturating_mul(PATIENCE))))
            }
            Stage::Taken if self.is_released => None,
            Stage::Taken => {
                let probe = self.settings.probe.map(|probe| self.since + probe);
                let due = probe.into_iter().chain([self.not_before]);
                due.filter(|due| *due > now).min()
            }
            Stage::Waiting { until } => Some(*until),
            // The end of an action wakes us.
            Stage::Watching | Stage::Silencing(_) | Stage::Restoring(_) => None,
        };
        due.filter(|due| *due > now)
    }

    /// Sends a value under the name, where it is ours and the value can be written.
    ///
    /// # Errors
    /// Those of the bus.
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
}

fn usual_check(knowledge: &KnowledgeBase, signal: SignalId) -> Span {
    let signal = &knowledge.signals()[signal];
    let by_rate = signal.rate_hz.map(|rate| Span::from_seconds(PERIODS / rate));
    by_rate.or(signal.timeout).unwrap_or(CHECK_USUAL).clamp(CHECK.0, CHECK.1)
}

fn seconds(span: Span) -> String {
    let seconds = span.seconds();
    if seconds < 1.0 { format!("{:.0} ms", seconds * 1e3) } else { format!("{seconds:.1} s") }
}

#[cfg(test)]
mod tests;
