//! Reports of a run about itself: its link, losses, missing comparisons, and the state of each need.

use super::Session;
use crate::diagnostics;
use crate::discovery::Discovery;
use crate::healer::{Healer, ReportedState};
use crate::journal::Missing;
use crate::neighbours::Neighbours;
use shsa_bridge::{Absence, Losses, Outgoing, Payload};
use shsa_core::time::{Span, Time};
use shsa_format::comparisons::{compared, notes};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// How often the run looks at itself: link, losses, status.
const REPORTED_EVERY: Span = Span::from_millis(1_000);

/// How often the run looks for comparisons that are not made.
const COMPARED: Span = Span::from_millis(60_000);

/// What was reported last about the run itself, so that only changes are reported.
#[derive(Debug)]
pub(in super::super) struct Reported {
    pub(super) next: Time,
    losses: BTreeMap<Arc<str>, u64>,
    /// What is missing in each journal, record and state.
    missing: Vec<Missing>,
    /// Whether a journal waits for the disk.
    waits: bool,
    /// The state of each need as published last, by model.
    reported_states: Vec<Vec<ReportedState>>,
    /// The earliest time at which the quality of a need may change by itself; until then no turn has to check the needs.
    pub(super) doubt: Time,
    /// The time of the next look for missing comparisons, and the remarks already reported.
    compared: (Time, BTreeSet<String>),
}

impl Reported {
    pub(in super::super) fn new() -> Reported {
        let (next, doubt) = (Time::MIN, Time::MIN);
        let (losses, reported_states) = (BTreeMap::new(), Vec::new());
        Reported {
            next,
            losses,
            missing: Vec::new(),
            waits: false,
            reported_states,
            doubt,
            compared: (Time::MIN, BTreeSet::new()),
        }
    }
}

impl Session {
    pub(super) fn report(&mut self, now: Time) {
        if now >= self.reported.doubt {
            self.report_states(now);
            self.report_entities(now);
        }
        if now < self.reported.next {
            return;
        }
        self.reported.next = now + REPORTED_EVERY;
        self.neighbours.iter_mut().for_each(Neighbours::follow);
        self.report_link(now);
        for trouble in self.bridge.troubles() {
            self.log.noted(now, "trouble", &trouble.to_string(), self.bridge.as_mut());
        }
        self.report_absence(now);
        self.report_backlogs(now);
        self.report_losses(now);
        self.report_strangers(now);
        self.report_missing(now);
        self.report_compared(now);
        self.report_diagnostics(now);
        if let Some(reported_model) = self.log.troubles(now) {
            self.log.noted(now, "terminal", &reported_model, self.bridge.as_mut());
        }
        self.reported.reported_states.clear();
        self.reported.doubt = Time::MIN;
    }

    fn report_diagnostics(&mut self, now: Time) {
        let Session { name, bridge, healers, ownership, log, .. } = self;
        let stamp = bridge.inbox().clock().by_wall(now);
        let mut states = || diagnostics::of(name, healers, ownership.as_ref(), now);
        if let Err(error) = bridge.diagnose(stamp, &mut states) {
            log.undelivered("diagnostics", &error, bridge.as_mut());
        }
    }

    /// Tells Home Assistant.
    fn report_entities(&mut self, now: Time) {
        let Session { discovery: Some(discovery), bridge, healers, ownership, log, .. } = self else {
            return;
        };
        let is_others = |need: &str| ownership.as_ref().is_some_and(|ownership| ownership.is_others(need));
        if let Err((topic, error)) = discovery.report(healers, is_others, now, bridge.as_mut()) {
            log.undelivered(&topic, &error, bridge.as_mut());
        }
    }

    fn report_link(&mut self, now: Time) {
        let (link, outage) = (self.bridge.link(), self.bridge.outage());
        for (kind, because) in self.connection.follow(link, outage, now) {
            if kind == "connected" {
                self.discovery.iter_mut().for_each(Discovery::tell_again);
            }
            self.log.noted(now, kind, &because, self.bridge.as_mut());
        }
        (self.figures.disconnections, self.figures.disconnected) = self.connection.figures(now);
    }

    /// Messages that waited on the bus while this process was away may be of any age.
    fn report_absence(&mut self, now: Time) {
        let Some(Absence { away, waited }) = self.bridge.inbox().absence() else { return };
        let because = format!(
            "nobody was here for {:.1} s: {waited} messages may have waited; those without a stamp of their own are left aside",
            away.seconds()
        );
        self.log.noted(now, "absent", &because, self.bridge.as_mut());
    }

    fn report_backlogs(&mut self, now: Time) {
        for because in self.healers.iter_mut().flat_map(|healer| healer.backlogs(now)) {
            self.log.noted(now, "backlog", &because, self.bridge.as_mut());
        }
    }

    fn report_strangers(&mut self, now: Time) {
        let is_instance =
            |publisher| self.ownership.as_ref().is_some_and(|ownership| ownership.has_met(publisher));
        for because in self.strangers.notes(is_instance, now) {
            self.log.noted(now, "stranger", &because, self.bridge.as_mut());
        }
    }

    fn report_losses(&mut self, now: Time) {
        for Losses { topic, dropped } in self.bridge.inbox().losses() {
            let reported_model = self.reported.losses.insert(topic.clone(), dropped).unwrap_or(0);
            if dropped > reported_model {
                let lost = dropped - reported_model;
                let because =
                    format!("{topic} comes faster than it is read: {lost} messages made room for newer ones");
                self.log.noted(now, "overload", &because, self.bridge.as_mut());
            }
        }
    }

    fn report_missing(&mut self, now: Time) {
        self.healers.iter_mut().for_each(Healer::look_after_state);
        let Session { healers, reported, log, bridge, .. } = self;
        let waiting = healers.iter().find_map(|healer| healer.files().waiting());
        if std::mem::replace(&mut reported.waits, waiting.is_some()) != waiting.is_some() {
            let because = match waiting {
                Some(Missing { because, .. }) => {
                    format!("the journal waits in memory, as the disk refuses it: {because}")
                }
                None => "what waited of the journal is written".to_owned(),
            };
            log.noted(now, "disk", &because, bridge.as_mut());
        }
        let files = healers.iter().flat_map(|healer| healer.files().missing());
        for (at, (file, missing)) in files.enumerate() {
            reported.missing.resize(reported.missing.len().max(at + 1), Missing::default());
            let known = std::mem::replace(&mut reported.missing[at], missing.clone());
            for because in file.notes(&known, &missing) {
                log.noted(now, "disk", &because, bridge.as_mut());
            }
        }
    }

    /// Tells once of each comparison that is never or rarely made although there are enough values, and of each residual that
    /// shows a deviation but accuses nobody.
    fn report_compared(&mut self, now: Time) {
        let (next, reported_model) = &mut self.reported.compared;
        if now < *next {
            return;
        }
        // In the first minute there are too few comparisons to judge.
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
            .filter(|(kind, name, _)| reported_model.insert(format!("{kind} {name}")))
            .map(|(kind, _, text)| (kind, text))
            .collect();
        for (kind, text) in new {
            self.log.noted(now, kind, &text, self.bridge.as_mut());
        }
    }

    /// Publishes the state of each need when it has changed, and once a second.
    fn report_states(&mut self, now: Time) {
        let Session { name, bridge, healers, reported, ownership, log, connection, .. } = self;
        let clock = bridge.inbox().clock().clone();
        reported.reported_states.resize(healers.len(), Vec::new());
        for (healer, reported_model) in healers.iter().zip(&mut reported.reported_states) {
            let reported_states = healer.reported_states(now);
            if reported_states.clone().eq(reported_model.iter().copied()) {
                continue;
            }
            for (at, ((id, outlet), standing)) in healer.outlets().zip(reported_states.clone()).enumerate() {
                let is_others =
                    ownership.as_ref().is_some_and(|ownership| ownership.is_others(outlet.topic()));
                if reported_model.get(at) == Some(&standing) || is_others {
                    continue;
                }
                bridge.rate(outlet.topic(), clock.by_wall(now), outlet.quality(now));
                let topic = format!("shsa/{name}/need/{}", outlet.key().trim_matches('/'));
                let mut status = healer.status(id, now, &clock);
                status["last_outage"] = connection.json(&clock);
                let payload = Payload::Bytes(status.to_string().into());
                let message = Outgoing { retain: true, ..Outgoing::new(&topic, clock.by_wall(now), payload) };
                if let Err(error) = bridge.publish(message) {
                    // The next attempt is due in a second.
                    log.undelivered(&topic, &error, bridge.as_mut());
                }
            }
            *reported_model = reported_states.collect();
        }
        let last = healers.iter().flat_map(Healer::outlets).map(|(_, outlet)| outlet.lasts_until(now));
        reported.doubt = last.fold(Time::MAX, Time::min);
    }
}
