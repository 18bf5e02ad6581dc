//! The turns of a run: takes messages in, publishes values and decisions, and answers requests in between.

mod report;
mod requests;

pub(super) use report::Reported;
pub(super) use requests::Questions;

use crate::connection::Connection;
use crate::control::Guard;
use crate::control::bus::Tally;
use crate::discovery::Discovery;
use crate::error::RuntimeError;
use crate::event_log::EventLog;
use crate::explained::Explained;
use crate::federation::Federation;
use crate::figures::Figures;
use crate::healer::{Effect, Healer, Served};
use crate::neighbours::Neighbours;
use crate::ownership::{Handover, Ownership};
use crate::runtime::Ending;
use crate::shared_verdicts::SharedVerdicts;
use crate::strangers::Strangers;
use crate::wiring::Note;
use shsa_bridge::{Bridge, Clock, Message, Quality};
use shsa_core::time::{Span, Time};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// The number of messages handled in a row; then ticks, requests and reports get their turn.
const BATCH: usize = 256;
/// A turn that is so late shows that the process was away: a busy machine delays a thread for less.
const AWAY: Span = Span::from_millis(1_000);

/// A run under way.
pub(super) struct Session {
    pub(super) name: String,
    pub(super) bridge: Box<dyn Bridge>,
    pub(super) healers: Vec<Healer>,
    pub(super) log: EventLog,
    /// The names and the pages of other instances.
    pub(super) other_pages: Vec<(String, String)>,
    /// The evidence behind the latest accusations.
    pub(super) explained: Explained,
    pub(super) figures: Figures,
    pub(super) requests: Questions,
    pub(super) stop: Arc<AtomicBool>,
    /// The time at which the run ends by itself.
    pub(super) until: Option<Time>,
    /// When the next action is due without a message.
    pub(super) rests_until: Time,
    /// The owners of the needs; `None` where the bus does not list instances; then this instance owns all needs.
    pub(super) ownership: Option<Ownership>,
    /// The verdicts of other instances; `None` where the bus does not list them.
    pub(super) shared_verdicts: Option<SharedVerdicts>,
    /// Others that publish under the names of needs.
    pub(super) strangers: Strangers,
    /// The parts of other instances; `None` where none are joined.
    pub(super) federation: Option<Federation>,
    /// The other instances; `None` where the bus does not list them.
    pub(super) neighbours: Option<Neighbours>,
    /// What Home Assistant is told; `None`: nothing.
    pub(super) discovery: Option<Discovery>,
    /// The connection and its outages.
    pub(super) connection: Connection,
    /// What was reported last about the run itself.
    pub(super) reported: Reported,
    /// Counts of requests over the bus, by outcome.
    pub(super) tally: Arc<Tally>,
    /// Checks tokens.
    pub(super) guard: Guard,
}

impl Session {
    /// Does all that is due now; returns the time until the next action is due.
    ///
    /// # Errors
    /// When the bus refuses a model that has just taken over.
    pub(super) fn turn(&mut self) -> Result<Duration, RuntimeError> {
        self.come_back();
        self.heed()?;
        self.take_back();
        self.send_again();
        self.answer()?;
        self.healers.iter_mut().for_each(Healer::remember);
        let now = self.now();
        self.tell();
        self.share(now);
        self.take_over(now);
        self.join(now)?;
        self.report(now);
        let now = self.now();
        self.rests_until = self.due(now);
        Ok(Duration::from_nanos(u64::try_from((self.rests_until - now).0).unwrap_or(0)))
    }

    /// An instance that was away knows less than others: what it has not heard may have shown who lies.
    fn come_back(&mut self) {
        let now = self.now();
        if self.rests_until > Time::MIN && now - self.rests_until > AWAY {
            self.healers.iter_mut().for_each(Healer::unsettle);
            self.reported.doubt = Time::MIN;
        }
    }

    /// Does the urgent part: takes in waiting messages, and publishes the values that follow from them.
    ///
    /// # Errors
    /// As [`Session::turn`].
    pub(super) fn heed(&mut self) -> Result<(), RuntimeError> {
        self.follow_clock();
        self.listen();
        self.receive()?;
        self.pass()?;
        self.bridge.flush();
        Ok(())
    }

    /// Whether nothing has to be done before the rest is over: no message waits, nothing is to be reported or taken over, and
    /// nothing is due earlier.
    pub(super) fn may_rest(&self) -> bool {
        let now = self.now();
        let is_alone = !self.ownership.as_ref().is_some_and(Ownership::has_news);
        let is_quiet = is_alone && self.bridge.inbox().is_empty() && now < self.reported.doubt;
        is_quiet && !self.healers.iter().any(Healer::takes_over) && self.rests_until <= self.due(now)
    }

    /// Ends the run, and returns whether all needs were served at its end.
    pub(super) fn finish(mut self) -> Ending {
        self.healers.iter_mut().for_each(Healer::remember_all);
        let now = self.now();
        let outlets = self.healers.iter().flat_map(Healer::outlets);
        let all_served =
            outlets.map(|(_, outlet)| outlet.quality(now)).all(|quality| quality != Quality::Bad);
        if all_served { Ending::Served } else { Ending::Unserved }
    }

    pub(super) fn is_over(&self) -> bool {
        self.stop.load(Ordering::Acquire) || self.until.is_some_and(|until| self.now() >= until)
    }

    fn clock(&self) -> Clock {
        self.bridge.inbox().clock().clone()
    }

    fn now(&self) -> Time {
        self.bridge.inbox().clock().now()
    }

    fn receive(&mut self) -> Result<(), RuntimeError> {
        let clock = self.clock();
        for _ in 0..BATCH {
            let Some(mut message) = self.bridge.receive() else { return Ok(()) };
            self.mark(&mut message);
            self.hear(&message);
            self.discovery.iter_mut().for_each(|discovery| discovery.hear(&message));
            let began = clock.now();
            for healer in &mut self.healers {
                healer.receive(&message, &clock);
            }
            self.deliver()?;
            self.figures.count_message(clock.now() - began);
        }
        Ok(())
    }

    /// Marks a message of another instance as a substitute, if the message itself has no quality.
    fn mark(&self, message: &mut Message) {
        let Some(publisher) = message.publisher.filter(|_| message.quality.is_none()) else { return };
        let is_healer = || {
            let ownership = self.ownership.as_ref();
            publisher == self.bridge.publisher()
                || ownership.is_some_and(|ownership| ownership.is_instance(publisher))
        };
        if self.healers.iter().any(|healer| healer.takes(&message.topic)) && is_healer() {
            message.quality = Some(Quality::Substitute);
        }
    }

    /// Takes in a message under the name of a need: of the instance that serves it, or of a stranger.
    fn hear(&mut self, message: &Message) {
        let Session { ownership: Some(ownership), healers, strangers, .. } = self else { return };
        let topic = &*message.topic;
        for healer in healers {
            let Some(need) = healer.heard(topic) else { continue };
            let is_ours = ownership.is_ours(topic);
            if !ownership.hear(topic, message.publisher, message.received) {
                // The owner tells of it.
                if is_ours || !ownership.is_others(topic) {
                    strangers.count(topic, message.publisher);
                }
            } else if !is_ours {
                healer.hear(need, message.received);
            }
        }
    }

    fn pass(&mut self) -> Result<(), RuntimeError> {
        let now = self.now();
        for healer in &mut self.healers {
            healer.pass(now);
        }
        self.deliver()
    }

    /// Publishes the values of the healers, saves their decisions and reports them, in this order: a value does not wait for its
    /// report.
    fn deliver(&mut self) -> Result<(), RuntimeError> {
        let Session {
            bridge,
            healers,
            log,
            explained,
            figures,
            ownership,
            shared_verdicts,
            discovery,
            reported,
            ..
        } = self;
        let mut entries = Vec::new();
        for (at, healer) in healers.iter_mut().enumerate() {
            while let Some(effect) = healer.poll(bridge.as_mut())? {
                match effect {
                    Effect::Decided(event) => {
                        figures.decided(event.kind);
                        let model = healer.reported_model();
                        discovery.iter_mut().for_each(|it| it.follow(healer.name(), model, &event));
                        reported.doubt = Time::MIN;
                        shared_verdicts.iter_mut().for_each(|shared| shared.is_due = true);
                        entries.push((log.entry(healer.reported_model(), &event), at, event));
                    }
                    Effect::Noted(kind, because) => {
                        let now = bridge.inbox().clock().now();
                        log.noted(now, kind, &because, bridge.as_mut());
                    }
                    Effect::Served(publication) => {
                        let is_ours =
                            |need: &str| ownership.as_ref().is_none_or(|ownership| ownership.is_ours(need));
                        let (time, need) = (publication.time, publication.need);
                        let Served { is_news, failed } = healer.serve(publication, is_ours, bridge.as_mut());
                        if is_news {
                            reported.doubt = Time::MIN;
                        }
                        if let (Some(ownership), Some(name)) = (ownership.as_mut(), healer.left(need)) {
                            ownership.want(name, bridge.inbox().clock().now());
                        }
                        if failed.is_empty() {
                            figures.served(bridge.inbox().clock().now() - time);
                        }
                        for (name, error) in failed {
                            log.undelivered(&name, &error, bridge.as_mut());
                        }
                    }
                }
            }
        }
        if entries.is_empty() {
            return Ok(());
        }
        // A decision is saved before it is reported, so that it survives a crash; values go out before both.
        bridge.flush();
        healers.iter_mut().for_each(Healer::remember);
        for (entry, at, event) in entries {
            let number = log.next();
            log.publish(entry, bridge.as_mut());
            healers.get(at).into_iter().for_each(|healer| explained.keep(number, healer, &event));
        }
        Ok(())
    }

    /// What the other side has refused was not published.
    fn take_back(&mut self) {
        for (name, error) in self.bridge.refusals() {
            let now = self.now();
            self.healers.iter_mut().for_each(|healer| healer.refuse(&name, &error, now));
            self.log.undelivered(&name, &error, self.bridge.as_mut());
            self.reported.doubt = Time::MIN;
        }
    }

    /// Sends lost values again.
    fn send_again(&mut self) {
        let now = self.now();
        let Session { bridge, healers, log, ownership, reported, .. } = self;
        for healer in healers.iter_mut().filter(|healer| healer.has_backlog(now)) {
            let is_ours = |need: &str| ownership.as_ref().is_none_or(|ownership| ownership.is_ours(need));
            reported.doubt = Time::MIN;
            for (name, error) in healer.send_again(now, is_ours, bridge.as_mut()) {
                log.undelivered(&name, &error, bridge.as_mut());
            }
        }
    }

    /// Takes in what other instances have found, before values that are judged by it.
    fn listen(&mut self) {
        let now = self.now();
        let Session { shared_verdicts: Some(shared), healers, bridge, log, .. } = self else { return };
        for note in shared.listen(healers, now) {
            log.noted(now, "accused", &note, bridge.as_mut());
        }
    }

    /// Tells other instances whom this one accuses.
    fn tell(&mut self) {
        let Session { shared_verdicts: Some(shared), healers, bridge, log, .. } = self else { return };
        if let Err(error) = shared.tell(healers, bridge.as_ref()) {
            log.undelivered("shsa/accused", &error, bridge.as_mut());
        }
    }

    /// Tells other instances which needs this one can serve, and takes in theirs.
    fn share(&mut self, now: Time) {
        let Session { ownership: Some(ownership), healers, bridge, log, reported, .. } = self else { return };
        let (is_news, handovers) = ownership.follow(now);
        if is_news || now >= reported.doubt {
            reported.doubt = Time::MIN;
            for (listened, outlet) in healers.iter().flat_map(Healer::listened) {
                ownership.listen(outlet.topic(), listened);
                if let Err(error) = ownership.announce(outlet.topic(), outlet.ability(now), bridge.as_ref()) {
                    log.undelivered(outlet.topic(), &error, bridge.as_mut());
                }
            }
        }
        if handovers.iter().any(|handover| matches!(handover, Handover::Taken { .. })) {
            let is_ours = |need: &str| ownership.is_ours(need);
            for healer in healers.iter_mut() {
                for (name, error) in healer.send_withheld(now, is_ours, bridge.as_mut()) {
                    log.undelivered(&name, &error, bridge.as_mut());
                }
            }
            bridge.flush();
        }
        for handover in handovers {
            let (kind, because) = match handover {
                Handover::Taken { need, unheard: None } => {
                    ("responsible", format!("{need} is served by this instance from now on"))
                }
                Handover::Taken { need, unheard: Some(other) } => {
                    let because = "of which no value has arrived here for the age that the need allows";
                    (
                        "responsible",
                        format!("{need} is served by this instance from now on, not by {other}, {because}"),
                    )
                }
                Handover::Given { need, to } => ("released", format!("{need} is served by {to} from now on")),
            };
            log.noted(now, kind, &because, bridge.as_mut());
        }
    }

    /// Takes over the names of failed sources as the wiring demands, and reports the steps.
    fn take_over(&mut self, now: Time) {
        let Session { ownership, healers, bridge, log, reported, .. } = self;
        let is_ours = |need: &str| ownership.as_ref().is_none_or(|ownership| ownership.is_ours(need));
        for healer in healers {
            let (is_news, notes) = healer.take_over(now, is_ours, bridge.as_mut());
            if is_news {
                reported.doubt = Time::MIN;
            }
            for Note { kind, because } in notes {
                log.noted(now, kind, &because, bridge.as_mut());
            }
        }
    }

    /// Announces our models, and joins the parts of other instances.
    fn join(&mut self, now: Time) -> Result<(), RuntimeError> {
        let Session { federation: Some(federation), healers, bridge, log, .. } = self else { return Ok(()) };
        let notes = match federation.follow(now, healers, bridge.as_ref()) {
            Ok(notes) => notes,
            Err(error) => {
                log.undelivered("shsa/parts", &error, bridge.as_mut());
                return Ok(());
            }
        };
        for (kind, because) in notes {
            log.noted(now, kind, &because, bridge.as_mut());
        }
        self.deliver()
    }

    /// Follows a step of the wall clock. Every turn does this: stamps read before are wrong by the whole step.
    fn follow_clock(&mut self) {
        let Some(step) = self.clock().follow() else { return };
        let now = self.now();
        let because =
            format!("the wall clock was stepped by {:.3} s; stamps are corrected", step as f64 / 1e9);
        self.log.noted(now, "clock", &because, self.bridge.as_mut());
    }

    /// When the next action is due without a message.
    fn due(&self, now: Time) -> Time {
        let dues = self.healers.iter().filter_map(Healer::due);
        let dues = dues.chain(self.healers.iter().filter_map(|healer| healer.take_over_due(now)));
        let dues = dues.chain(self.ownership.as_ref().and_then(Ownership::due));
        dues.chain(self.until).chain(self.requests.due(now)).fold(self.reported.next, Time::min)
    }
}
