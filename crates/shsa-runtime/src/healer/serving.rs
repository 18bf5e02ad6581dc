//! Serves needs: sends values, takes over names, reports the state of each need.

use super::Healer;
use crate::outlet::Outlet;
use crate::wiring::{Note, Situation, Takeover};
use serde_json::{Value, json};
use shsa_bridge::Clock;
use shsa_bridge::{Bridge, BridgeError, Quality};
use shsa_core::assurance::{self, Admitted, Lacking};
use shsa_core::engine::{self, NeedAssurance, NeedStatus, Order, Publication, Subject};
use shsa_core::knowledge::{NeedId, SignalId};
use shsa_core::monitor::Symptom;
use shsa_core::time::{Span, Time};
use shsa_core::trust::Verdict;
use shsa_format::event;

/// The result of serving a value.
pub(in super::super) struct Served {
    /// Whether the quality or the level of the need, or who may serve it, has changed with the value.
    pub(in super::super) is_news: bool,
    /// The names under which the value was not sent, with the errors.
    pub(in super::super) failed: Vec<(String, BridgeError)>,
}

/// The part of a need's state whose changes are reported at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in super::super) struct ReportedState {
    quality: Quality,
    admitted: Option<Admitted>,
    /// The stage of its takeover, and the quality under the name that is taken.
    takeover: Option<(&'static str, Quality)>,
}

impl Healer {
    /// Sends a value of a need if this instance serves the need.
    pub(in super::super) fn serve(
        &mut self,
        publication: Publication,
        is_ours: impl Fn(&str) -> bool,
        bridge: &mut dyn Bridge,
    ) -> Served {
        let quality = match publication.quality {
            engine::Quality::Good => Quality::Good,
            engine::Quality::Substitute => Quality::Substitute,
            engine::Quality::Uncertain => Quality::Uncertain,
        };
        let outlet = &mut self.outlets[publication.need];
        let is_isolated = self.workers.as_ref().is_some_and(|workers| workers.is_isolated(&publication));
        let place = match (publication.delegated, is_isolated) {
            (true, _) => ", in a process of its own",
            (false, true) => ", in the engine for now",
            (false, false) => "",
        };
        outlet.credit(&publication.source, place);
        let time = publication.time;
        let standing = |outlet: &Outlet| (outlet.quality(time), outlet.admitted(time), outlet.ability(time));
        let before = standing(outlet);
        outlet.note(&publication, quality);
        outlet.certify(publication.admitted, self.engine.knowledge().contracts().scales());
        let is_ours = is_ours(outlet.topic());
        // The process may have been suspended since the value was computed.
        let is_fresh = outlet.is_fresh(time, bridge.inbox().clock().now());
        self.withheld[publication.need] = (!is_ours).then(|| publication.clone());
        let failed = if is_fresh && is_ours {
            self.send(&publication, None, bridge)
        } else {
            // What is heard of the owner tells when the last value went out.
            let is_heard = !is_ours && self.heard.contains_key(self.outlets[publication.need].topic());
            Some(&mut self.outlets[publication.need]).filter(|_| !is_heard).map(Outlet::leave);
            Vec::new()
        };
        let outlet = &mut self.outlets[publication.need];
        let after = standing(outlet);
        outlet.keep(publication.value);
        Served { is_news: after != before, failed }
    }

    /// The need that has this name, if what others publish under it is heard.
    pub(in super::super) fn heard(&self, topic: &str) -> Option<NeedId> {
        self.heard.get(topic).copied()
    }

    /// Every need, with the age that it allows where what others publish under its name is heard.
    pub(in super::super) fn listened(&self) -> impl Iterator<Item = (Option<Span>, &Outlet)> {
        let age = |outlet: &Outlet| self.heard.get(outlet.topic()).map(|_| outlet.max_age());
        self.outlets.iter().map(move |outlet| (age(outlet), outlet))
    }

    /// The name of a need whose last value was sound and is left to another instance.
    pub(in super::super) fn left(&self, need: NeedId) -> Option<&str> {
        let is_left = self.withheld[need].is_some() && self.outlets[need].can_send();
        is_left.then(|| self.outlets[need].topic())
    }

    /// A value of another instance has arrived under the name of a need.
    pub(in super::super) fn hear(&mut self, need: NeedId, now: Time) {
        self.outlets[need].hear(now);
    }

    /// This process was away.
    pub(in super::super) fn unsettle(&mut self) {
        self.outlets.iter_mut().for_each(Outlet::unsettle);
    }

    /// Sends a value under all names of its need, or only under `only`; returns the failures.
    fn send(
        &mut self,
        publication: &Publication,
        only: Option<&str>,
        bridge: &mut dyn Bridge,
    ) -> Vec<(String, BridgeError)> {
        let clock = bridge.inbox().clock();
        let (stamp, now) = (Outlet::stamp(publication, clock), clock.now());
        let Healer { outlets, takeovers, backlog, engine, .. } = self;
        let outlet = &mut outlets[publication.need];
        // One that is sent again has the level of its own time.
        outlet.certify(publication.admitted, engine.knowledge().contracts().scales());
        let mut failed = Vec::new();
        let mut follow = |name: &str, sent: Result<(), BridgeError>| {
            backlog.follow(name, publication, sent.as_ref().copied(), now);
            failed.extend(sent.err().map(|error| (name.to_owned(), error)));
        };
        let mut is_gate = true;
        for takeover in takeovers.iter_mut().filter(|takeover| takeover.need() == publication.need) {
            // If the need has the name of its own source, only the takeover publishes it.
            is_gate &= takeover.topic().trim_matches('/') != outlet.topic().trim_matches('/');
            // Readers of the source's name get plain numbers, which cannot express bounds.
            let is_certain = publication.quality != engine::Quality::Uncertain;
            if is_certain && only.is_none_or(|only| only == takeover.topic()) {
                let sent = takeover.send(publication, stamp, outlet.provenance(), bridge);
                follow(takeover.topic(), sent);
            }
        }
        if !is_gate {
            outlet.leave();
        } else if only.is_none_or(|only| only == outlet.topic()) {
            let sent = outlet.send(publication, stamp, bridge);
            follow(outlet.topic(), sent);
        }
        failed
    }

    /// The other side has refused a message under this name.
    pub(in super::super) fn refuse(&mut self, name: &str, error: &BridgeError, now: Time) {
        let is_it = |topic: &str| topic.trim_matches('/') == name.trim_matches('/');
        for need in self.outlets.ids() {
            let is_taken = self.takeover_of(need).is_some_and(|takeover| is_it(takeover.topic()));
            if is_taken || is_it(self.outlets[need].topic()) {
                self.outlets[need].refuse(error, now);
            }
        }
    }

    /// Sends the newest values of needs that another instance has served until now; returns the failures.
    pub(in super::super) fn send_withheld(
        &mut self,
        now: Time,
        is_ours: impl Fn(&str) -> bool,
        bridge: &mut dyn Bridge,
    ) -> Vec<(String, BridgeError)> {
        let mut failed = Vec::new();
        for need in self.outlets.ids() {
            let outlet = &self.outlets[need];
            let waits = self.withheld[need].as_ref().is_some_and(|it| outlet.is_fresh(it.time, now));
            if waits
                && is_ours(outlet.topic())
                && let Some(publication) = self.withheld[need].take()
            {
                failed.extend(self.send(&publication, None, bridge));
            }
        }
        failed
    }

    /// Whether a lost value is due to be sent again.
    pub(in super::super) fn has_backlog(&self, now: Time) -> bool {
        self.backlog.due().is_some_and(|due| due <= now)
    }

    /// Sends lost values again while they are fresh; returns the failures.
    pub(in super::super) fn send_again(
        &mut self,
        now: Time,
        is_ours: impl Fn(&str) -> bool,
        bridge: &mut dyn Bridge,
    ) -> Vec<(String, BridgeError)> {
        let mut failed = Vec::new();
        while let Some((name, publication)) = self.backlog.next(now) {
            let outlet = &self.outlets[publication.need];
            if outlet.is_fresh(publication.time, now) && is_ours(outlet.topic()) {
                failed.extend(self.send(&publication, Some(&name), bridge));
            } else {
                self.backlog.forget(&name);
            }
        }
        failed
    }

    /// Whether messages under this name may be another instance's substitutes.
    pub(in super::super) fn takes(&self, topic: &str) -> bool {
        self.takeovers.iter().any(|takeover| takeover.topic() == topic)
    }

    /// Takes the next step of each takeover; returns whether a stage has changed or there is a note, and the notes.
    pub(in super::super) fn take_over(
        &mut self,
        now: Time,
        is_ours: impl Fn(&str) -> bool,
        bridge: &mut dyn Bridge,
    ) -> (bool, Vec<Note>) {
        let mut takeovers = std::mem::take(&mut self.takeovers);
        let (mut is_news, mut notes) = (false, Vec::new());
        for takeover in &mut takeovers {
            let outlet = &self.outlets[takeover.need()];
            let situation = Situation {
                now,
                is_bad: self.is_bad(takeover),
                is_served: outlet.is_served_without(takeover.signal()),
                is_ours: is_ours(outlet.topic()),
                source: &outlet.provenance().source,
            };
            let is_same = |leaving: &&Takeover| leaving.topic() == takeover.topic();
            if self.leaving.iter().find(is_same).is_some_and(Takeover::is_acting) {
                // One action after the other.
                continue;
            }
            let before = takeover.stage();
            takeover.step(&situation, bridge, self.patterns.as_mut());
            is_news |= takeover.stage() != before;
            if takeover.is_silencing() {
                self.leaving.retain(|leaving| leaving.topic() != takeover.topic());
            }
            notes.extend(std::iter::from_fn(|| takeover.note()));
        }
        self.takeovers = takeovers;
        self.leaving.retain_mut(|takeover| {
            let is_over = takeover.leave(now, bridge);
            notes.extend(std::iter::from_fn(|| takeover.note()));
            !is_over
        });
        (is_news || !notes.is_empty(), notes)
    }

    /// Whether the source of a takeover is not trusted.
    fn is_bad(&self, takeover: &Takeover) -> bool {
        let (engine, signal) = (&self.engine, takeover.signal_id());
        let forbidden = || Order::Forbid(Subject::Signal(takeover.signal().to_owned()));
        engine.verdict(signal) == Verdict::Failed
            || engine.absence(signal).is_some()
            // A forbidden signal counts only while something else serves the need.
            || self.outlets[takeover.need()].is_served_without(takeover.signal())
                && engine.standing_orders().contains(&forbidden())
    }

    pub(super) fn quality_of(&self, takeover: &Takeover, now: Time) -> Quality {
        takeover.quality(self.outlets[takeover.need()].quality(now), self.is_bad(takeover))
    }

    /// The takeovers, each with the quality of its name for readers.
    pub(in super::super) fn takeovers(&self, now: Time) -> impl Iterator<Item = (&Takeover, Quality)> {
        self.takeovers.iter().map(move |takeover| (takeover, self.quality_of(takeover, now)))
    }

    /// When the next step of a takeover is due without an event.
    pub(in super::super) fn take_over_due(&self, now: Time) -> Option<Time> {
        self.takeovers.iter().chain(&self.leaving).filter_map(|takeover| takeover.due(now)).min()
    }

    /// Whether an order clears a source whose name is taken, and so lets it back.
    pub(super) fn order_back(&mut self, order: &Order) -> bool {
        let Order::Clear(Subject::Signal(signal)) = order else { return false };
        let takeover = self.takeovers.iter_mut().find(|takeover| takeover.signal() == signal);
        takeover.is_some_and(Takeover::order_back)
    }

    /// The state of all needs and signals.
    pub(in super::super) fn state(&self, now: Time, clock: &Clock) -> Value {
        let needs = self.outlets().map(|(id, outlet)| {
            let NeedStatus { published, longest_gap, assurance, .. } = self.engine.need_status(id);
            let mut status = self.status(id, now, clock);
            if let Some(status) = status.as_object_mut() {
                status.insert("published".to_owned(), json!(published));
                status.insert("longest_gap_s".to_owned(), json!(longest_gap.seconds()));
                status.extend(assurance.map(|it| ("assurance".to_owned(), self.assurance(&it))));
                status.insert("execution_us".to_owned(), self.executions[id].json());
                let workers = self.workers.as_ref().and_then(|workers| workers.state(id));
                status.extend(workers.map(|state| ("isolation".to_owned(), state)));
            }
            (outlet.key().to_owned(), status)
        });
        let signals = self.engine.knowledge().signals().enumerate();
        let signals = signals.map(|(id, signal)| (signal.name.clone(), self.signal(id)));
        json!({ "needs": Value::Object(needs.collect()), "signals": Value::Object(signals.collect()) })
    }

    /// The assurance of a need's source for the state and the page.
    pub(in super::super) fn assurance(&self, assurance: &NeedAssurance) -> Value {
        let scales = self.engine.knowledge().contracts().scales();
        let level = assurance.admitted.and_then(|admitted| admitted.level);
        let name = |it: &Lacking| format!("{}: {}", it.subject, it.name);
        let set = |set: &Vec<Lacking>| set.iter().map(name).collect::<Vec<String>>();
        json!({
            "admitted": assurance.admitted.map(|admitted| admitted.ground.name()),
            "level": level.map(|level| scales.written(level)),
            "verdict": assurance.verdict.map(assurance::Verdict::name),
            "lacking": assurance.lacking.iter().map(set).collect::<Vec<_>>(),
            "overridden": assurance.overridden.is_some(),
        })
    }

    /// The content of a need's status topic.
    pub(in super::super) fn status(&self, need: NeedId, now: Time, clock: &Clock) -> Value {
        let mut status = self.outlets[need].status(now, clock);
        if let (Some(status), Some(takeover)) = (status.as_object_mut(), self.takeover_of(need)) {
            status.insert("takeover".to_owned(), takeover.json(self.quality_of(takeover, now), clock));
        }
        status
    }

    /// The state of every need as far as its changes are reported at once.
    pub(in super::super) fn reported_states(&self, now: Time) -> impl Iterator<Item = ReportedState> + Clone {
        self.outlets.enumerate().map(move |(id, outlet)| ReportedState {
            quality: outlet.quality(now),
            admitted: outlet.admitted(now),
            takeover: self.takeover_of(id).map(|takeover| (takeover.stage(), self.quality_of(takeover, now))),
        })
    }

    fn takeover_of(&self, need: NeedId) -> Option<&Takeover> {
        self.takeovers.iter().find(|takeover| takeover.need() == need)
    }

    fn signal(&self, id: SignalId) -> Value {
        let counts = self.engine.monitor().ports()[id].counts();
        json!({
            "verdict": event::verdict(self.engine.absence(id), self.engine.verdict(id)),
            "symptom": self.engine.fault(id).map(Symptom::name),
            "accepted": counts.accepted,
            "dropped": counts.dropped + counts.duplicates,
            "late": counts.late,
            "out_of_order": counts.out_of_order,
            "invalid": counts.invalid,
            "out_of_range": counts.out_of_range,
            "too_fast": counts.too_fast,
            "unreadable": self.inputs.unreadable(id).0,
            "unreadable_because": self.inputs.unreadable(id).1,
        })
    }
}
