//! What a run does in its turns: messages in, values and decisions out, requests answered in between.

use super::control::bus::Tally;
use super::control::{Call, Guard, Order, Reply, Request};
use super::event_log::EventLog;
use super::federation::Federation;
use super::figures::Figures;
use super::healer::{Effect, Healer, Served, Standing};
use super::metrics;
use super::ownership::{Handover, Ownership};
use super::runtime::Ending;
use super::wiring::Note;
use crate::error::RuntimeError;
use serde_json::{Map, Value, json};
use shsa_bridge::{Absence, Bridge, Clock, Link, Losses, Message, Outgoing, Payload, Quality};
use shsa_core::time::{Span, Time};
use shsa_format::comparisons::{compared, notes};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::time::Duration;

/// Messages that are heard before the time, requests and the run itself get their turn.
const BATCH: usize = 256;
/// How often the run looks at itself: link, losses, status.
const REPORTED_EVERY: Span = Span::from_millis(1_000);
/// How often it is looked which comparisons are not made.
const COMPARED: Span = Span::from_millis(60_000);

/// A run under way.
pub(super) struct Session {
    pub(super) name: String,
    pub(super) bridge: Box<dyn Bridge>,
    pub(super) healers: Vec<Healer>,
    pub(super) log: EventLog,
    pub(super) figures: Figures,
    pub(super) requests: Receiver<Call>,
    pub(super) stop: Arc<AtomicBool>,
    /// When it ends by itself.
    pub(super) until: Option<Time>,
    /// When something is due though nothing arrives.
    pub(super) rests_until: Time,
    /// Who else serves needs; `None` where the bus does not tell, and then all needs are ours.
    pub(super) ownership: Option<Ownership>,
    /// What others know; `None`: nobody is asked.
    pub(super) federation: Option<Federation>,
    /// What was told last about the run itself.
    pub(super) reported: Reported,
    /// What became of requests over the bus.
    pub(super) tally: Arc<Tally>,
    /// Who looks at tokens.
    pub(super) guard: Guard,
}

/// What was told last about the run itself, so that only what changes is told.
#[derive(Debug)]
pub(super) struct Reported {
    next: Time,
    link: Link,
    losses: BTreeMap<Arc<str>, u64>,
    /// Inputs that are not in the journals, and states that were not saved.
    missing: u64,
    /// How each need stood when that was told on the bus last, model by model.
    standings: Vec<Vec<Standing>>,
    /// From when on a quality may be another one; until then nobody has to look at all needs in every turn.
    doubt: Time,
    /// When it is looked next which comparisons are not made, and what was told of them.
    compared: (Time, BTreeSet<String>),
}

impl Reported {
    pub(super) fn new() -> Reported {
        let (next, doubt) = (Time::MIN, Time::MIN);
        let (losses, standings) = (BTreeMap::new(), Vec::new());
        Reported {
            next,
            link: Link::Up,
            losses,
            missing: 0,
            standings,
            doubt,
            compared: (Time::MIN, BTreeSet::new()),
        }
    }
}

impl Session {
    /// Looks once at everything that may have to be done, and does it; the answer is how long nothing more is due.
    ///
    /// # Errors
    /// When the bus refuses a model that has just taken over.
    pub(super) fn turn(&mut self) -> Result<Duration, RuntimeError> {
        self.heed()?;
        self.send_again();
        self.answer()?;
        self.healers.iter_mut().for_each(Healer::remember);
        let now = self.now();
        self.share(now);
        self.take_over(now);
        self.join(now)?;
        self.report(now);
        let now = self.now();
        self.rests_until = self.due(now);
        Ok(Duration::from_nanos(u64::try_from((self.rests_until - now).0).unwrap_or(0)))
    }

    /// What cannot wait: hears what has come, and serves what comes of it.
    ///
    /// # Errors
    /// As [`Session::turn`].
    pub(super) fn heed(&mut self) -> Result<(), RuntimeError> {
        self.follow_clock();
        self.hear()?;
        self.pass()?;
        self.bridge.flush();
        Ok(())
    }

    /// Whether there is nothing to be done before its rest is over: nothing that waits, nothing new to tell or to take over, and
    /// nothing that is due earlier.
    pub(super) fn may_rest(&self) -> bool {
        let now = self.now();
        let is_quiet = self.bridge.inbox().is_empty() && now < self.reported.doubt;
        is_quiet && !self.healers.iter().any(Healer::takes_over) && self.rests_until <= self.due(now)
    }

    /// Ends the run; the answer is no when a need is unserved.
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

    fn hear(&mut self) -> Result<(), RuntimeError> {
        let clock = self.clock();
        for _ in 0..BATCH {
            let Some(mut message) = self.bridge.receive() else { return Ok(()) };
            self.mark(&mut message);
            let began = clock.now();
            for healer in &mut self.healers {
                healer.hear(&message, &clock);
            }
            self.deliver()?;
            self.figures.heard(clock.now() - began);
        }
        Ok(())
    }

    /// Where a message does not say itself that it is a substitute of another instance, its publisher does.
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

    fn pass(&mut self) -> Result<(), RuntimeError> {
        let now = self.now();
        for healer in &mut self.healers {
            healer.pass(now);
        }
        self.deliver()
    }

    /// Publishes what the healers have done, remembers and tells it: a substitute does not wait until it is told why it is one.
    fn deliver(&mut self) -> Result<(), RuntimeError> {
        let Session { bridge, healers, log, figures, ownership, reported, .. } = self;
        let mut entries = Vec::new();
        for healer in healers.iter_mut() {
            while let Some(effect) = healer.poll(bridge.as_mut())? {
                match effect {
                    Effect::Decided(event) => {
                        figures.decided(event.kind);
                        reported.doubt = Time::MIN;
                        entries.push(log.entry(healer.told(), &event));
                    }
                    Effect::Noted(kind, because) => {
                        let now = bridge.inbox().clock().now();
                        log.noted(now, kind, &because, bridge.as_mut());
                    }
                    Effect::Served(publication) => {
                        let is_ours =
                            |need: &str| ownership.as_ref().is_none_or(|ownership| ownership.is_ours(need));
                        let Served { is_news, failed } = healer.serve(&publication, is_ours, bridge.as_mut());
                        if is_news {
                            reported.doubt = Time::MIN;
                        }
                        if failed.is_empty() {
                            figures.served(bridge.inbox().clock().now() - publication.time);
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
        // What was told is known after a crash, and a substitute waits for neither.
        bridge.flush();
        healers.iter_mut().for_each(Healer::remember);
        entries.into_iter().for_each(|entry| log.tell(entry, bridge.as_mut()));
        Ok(())
    }

    /// Sends again what was lost on its way.
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

    fn answer(&mut self) -> Result<(), RuntimeError> {
        while let Ok(Call { request, reply }) = self.requests.try_recv() {
            reply(match request {
                Request::State => Reply::Json(self.state()),
                Request::Health => Reply::Json(self.health()),
                Request::Events(since) => Reply::Json(Value::Array(self.log.since(since))),
                Request::Metrics => Reply::Text(self.metrics()?),
                Request::Order { order, caller } => self.order(&order, &caller)?,
                Request::Denied(news) => {
                    let now = self.now();
                    self.log.noted(now, "denied", &news, self.bridge.as_mut());
                    Reply::Json(Value::Null)
                }
            });
        }
        Ok(())
    }

    fn metrics(&self) -> Result<String, RuntimeError> {
        let now = self.now();
        metrics::text(
            &self.figures,
            &self.tally,
            &self.guard,
            &self.log,
            &self.healers,
            self.bridge.as_ref(),
            now,
        )
    }

    /// Carries an order out and tells it, or says why not.
    fn order(&mut self, order: &Order, caller: &str) -> Result<Reply, RuntimeError> {
        let now = self.now();
        let done = match order {
            Order::Reload => self.reload(),
            Order::Change { model, text } => self.change(model.as_deref(), text),
            Order::Engine { model, order } => {
                let healer = find(&mut self.healers, model.as_deref());
                healer.and_then(|healer| healer.order(order, now)).map(|()| order.to_string())
            }
        };
        let reply = match done {
            Ok(done) => {
                let told = format!("{done} (from {caller})");
                self.log.noted(now, "ordered", &told, self.bridge.as_mut());
                Reply::Json(json!({ "done": done }))
            }
            Err(why) => Reply::Refused(why),
        };
        self.deliver()?;
        self.reported.doubt = Time::MIN;
        Ok(reply)
    }

    /// Reads the files of all models again; the first that is wrong stops it, and those before it have changed.
    fn reload(&mut self) -> Result<String, String> {
        let now = self.now();
        self.healers.iter_mut().try_for_each(|healer| healer.reload(now))?;
        Ok("the models were read again by order of the operator".into())
    }

    fn change(&mut self, model: Option<&str>, text: &str) -> Result<String, String> {
        let now = self.now();
        let healer = find(&mut self.healers, model)?;
        healer.change("order", text, now)?;
        Ok(format!("the model {} was changed by order of the operator", healer.name()))
    }

    /// Tells other instances what we can serve, and hears what they can.
    fn share(&mut self, now: Time) {
        let Session { ownership: Some(ownership), healers, bridge, log, reported, .. } = self else { return };
        if now >= reported.doubt {
            for (_, outlet) in healers.iter().flat_map(Healer::outlets) {
                if let Err(error) = ownership.tell(outlet.topic(), outlet.is_able(now), bridge.as_ref()) {
                    log.undelivered(outlet.topic(), &error, bridge.as_mut());
                }
            }
        }
        for handover in ownership.follow() {
            let (kind, because) = match handover {
                Handover::Taken { need } => {
                    ("responsible", format!("{need} is served by this instance from now on"))
                }
                Handover::Given { need, to } => ("released", format!("{need} is served by {to} from now on")),
            };
            log.noted(now, kind, &because, bridge.as_mut());
        }
    }

    /// Takes the names of failed sources over where that is set, and tells what comes of it.
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

    /// Announces what we know, and joins what others do.
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

    fn report(&mut self, now: Time) {
        if now >= self.reported.doubt {
            self.tell_standings(now);
        }
        if now < self.reported.next {
            return;
        }
        self.reported.next = now + REPORTED_EVERY;
        self.tell_link(now);
        for trouble in self.bridge.troubles() {
            self.log.noted(now, "trouble", &trouble.to_string(), self.bridge.as_mut());
        }
        self.tell_absence(now);
        self.tell_losses(now);
        self.tell_missing(now);
        self.tell_compared(now);
        if let Some(told) = self.log.troubles(now) {
            self.log.noted(now, "terminal", &told, self.bridge.as_mut());
        }
        self.reported.standings.clear();
        self.reported.doubt = Time::MIN;
    }

    /// Looked at in every turn: a stamp that is read by the clock of before a step is wrong by all of it.
    fn follow_clock(&mut self) {
        let Some(step) = self.clock().follow() else { return };
        let now = self.now();
        let because =
            format!("the wall clock was stepped by {:.3} s; stamps are corrected", step as f64 / 1e9);
        self.log.noted(now, "clock", &because, self.bridge.as_mut());
    }

    fn tell_link(&mut self, now: Time) {
        let link = self.bridge.link();
        if link == self.reported.link {
            return;
        }
        let (kind, because) = match &link {
            Link::Up => ("connected", "the bus is there again".to_owned()),
            Link::Down(why) => {
                self.figures.disconnections += 1;
                ("disconnected", format!("the bus is gone: {why}; trying again"))
            }
        };
        self.reported.link = link;
        self.log.noted(now, kind, &because, self.bridge.as_mut());
    }

    /// What waits on its way while nobody is here may be of any age.
    fn tell_absence(&mut self, now: Time) {
        let Some(Absence { away, waited }) = self.bridge.inbox().absence() else { return };
        let because = format!(
            "nobody was here for {:.1} s: {waited} messages may have waited; those without a stamp of their own are left aside",
            away.seconds()
        );
        self.log.noted(now, "absent", &because, self.bridge.as_mut());
    }

    fn tell_losses(&mut self, now: Time) {
        for Losses { topic, dropped } in self.bridge.inbox().losses() {
            let told = self.reported.losses.insert(topic.clone(), dropped).unwrap_or(0);
            if dropped > told {
                let lost = dropped - told;
                let because =
                    format!("{topic} comes faster than it is read: {lost} messages made room for newer ones");
                self.log.noted(now, "overload", &because, self.bridge.as_mut());
            }
        }
    }

    fn tell_missing(&mut self, now: Time) {
        let missing = self.healers.iter().flat_map(Healer::missing);
        let (inputs, because) = missing.fold((0, String::new()), |(inputs, because), missing| {
            (inputs + missing.inputs, if missing.inputs > 0 { missing.because } else { because })
        });
        let told = std::mem::replace(&mut self.reported.missing, inputs);
        if inputs == told {
            return;
        }
        let because = format!("{} could not be written: {because}", inputs - told);
        self.log.noted(now, "disk", &because, self.bridge.as_mut());
    }

    /// Tells once of each comparison that is never or rarely made though there are values enough, and of each that shows
    /// something that accuses nobody.
    fn tell_compared(&mut self, now: Time) {
        let (next, told) = &mut self.reported.compared;
        if now < *next {
            return;
        }
        // There is nothing to be said in the first minute.
        let is_first = *next == Time::MIN;
        *next = now + COMPARED;
        if is_first {
            return;
        }
        let engines = self.healers.iter().map(Healer::engine);
        let seen = engines.clone().flat_map(|engine| compared(std::iter::once(engine)));
        let new = seen.filter_map(|pair| Some(("uncompared", pair.name(), pair.warning()?)));
        let noted = engines.flat_map(notes).map(|note| ("within_errors", note.name(), note.text()));
        let new: Vec<(&str, String)> = new
            .chain(noted)
            .filter(|(kind, name, _)| told.insert(format!("{kind} {name}")))
            .map(|(kind, _, text)| (kind, text))
            .collect();
        for (kind, text) in new {
            self.log.noted(now, kind, &text, self.bridge.as_mut());
        }
    }

    /// Tells on the bus how each need is served, when that has changed, and now and then although it has not.
    fn tell_standings(&mut self, now: Time) {
        let Session { name, bridge, healers, reported, ownership, log, .. } = self;
        let clock = bridge.inbox().clock().clone();
        reported.standings.resize(healers.len(), Vec::new());
        for (healer, told) in healers.iter().zip(&mut reported.standings) {
            let standings = healer.standings(now);
            if standings.clone().eq(told.iter().copied()) {
                continue;
            }
            for (at, ((id, outlet), standing)) in healer.outlets().zip(standings.clone()).enumerate() {
                let is_ours = ownership.as_ref().is_none_or(|ownership| ownership.is_ours(outlet.topic()));
                if told.get(at) == Some(&standing) || !is_ours {
                    continue;
                }
                let topic = format!("shsa/{name}/need/{}", outlet.key().trim_matches('/'));
                let payload = Payload::Bytes(healer.status(id, now, &clock).to_string().into());
                let message = Outgoing { retain: true, ..Outgoing::new(&topic, clock.by_wall(now), payload) };
                if let Err(error) = bridge.publish(message) {
                    // The next one is due in a second.
                    log.undelivered(&topic, &error, bridge.as_mut());
                }
            }
            *told = standings.collect();
        }
        let last = healers.iter().flat_map(Healer::outlets).map(|(_, outlet)| outlet.lasts_until(now));
        reported.doubt = last.fold(Time::MAX, Time::min);
    }

    /// When something is due though nothing arrives.
    fn due(&self, now: Time) -> Time {
        let dues = self.healers.iter().filter_map(Healer::due);
        let dues = dues.chain(self.healers.iter().filter_map(|healer| healer.take_over_due(now)));
        dues.chain(self.until).fold(self.reported.next, Time::min)
    }

    fn health(&self) -> Value {
        let now = self.now();
        let outlets = || self.healers.iter().flat_map(Healer::outlets);
        let needs =
            outlets().map(|(_, outlet)| (outlet.topic().to_owned(), json!(outlet.quality(now).name())));
        let all_served = outlets().all(|(_, outlet)| outlet.quality(now) != Quality::Bad);
        let taken = || self.healers.iter().flat_map(|healer| healer.takeovers(now));
        let all_served = all_served && taken().all(|(_, quality)| quality != Quality::Bad);
        let taken = taken().map(|(takeover, quality)| (takeover.topic().to_owned(), json!(quality.name())));
        let connected = self.bridge.link() == Link::Up;
        json!({
            "ok": all_served && connected,
            "connected": connected,
            "needs": Value::Object(needs.chain(taken).collect()),
        })
    }

    fn state(&self) -> Value {
        let (now, clock) = (self.now(), self.clock());
        let models = self.healers.iter().map(|healer| (healer.name().to_owned(), healer.state(now, &clock)));
        let needs = self.healers.iter().flat_map(Healer::outlets).map(|(_, outlet)| outlet.topic());
        let able = |ownership: &Ownership| -> Value {
            needs.map(|need| (need.to_owned(), json!(ownership.able(need)))).collect::<Map<_, _>>().into()
        };
        let losses = self.bridge.inbox().losses();
        let losses = losses.iter().map(|loss| (loss.topic.to_string(), json!(loss.dropped)));
        json!({
            "name": self.name,
            "version": env!("CARGO_PKG_VERSION"),
            "time_ns": clock.by_wall(now).0,
            "link": match self.bridge.link() {
                Link::Up => json!({ "up": true }),
                Link::Down(why) => json!({ "up": false, "because": why }),
            },
            "models": Value::Object(models.collect()),
            "instances": self.ownership.as_ref().map(able),
            "parts": self.federation.as_ref().map(Federation::state),
            "dropped": Value::Object(losses.collect()),
            "unwritten_lines": self.log.unwritten(),
            "undelivered": self.log.not_taken().json(),
            "requests": self.tally.counts().into_iter().collect::<BTreeMap<_, _>>(),
            "figures": self.figures.json(),
        })
    }
}

/// The healer of this model, or the only one.
fn find<'h>(healers: &'h mut [Healer], model: Option<&str>) -> Result<&'h mut Healer, String> {
    let names: Vec<&str> = healers.iter().map(Healer::name).collect();
    let known = names.join(", ");
    let at = match model {
        Some(model) => names
            .iter()
            .position(|name| *name == model)
            .ok_or_else(|| format!("no model '{model}'; there are: {known}"))?,
        None if names.len() == 1 => 0,
        None => return Err(format!("say which model: {known}")),
    };
    healers.get_mut(at).ok_or_else(|| "no model".to_owned())
}
