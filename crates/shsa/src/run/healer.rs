//! One knowledge base at work on a bus: messages become observations, publications become messages.

use super::execution::Execution;
use super::fittings::{Carriers, Fittings, Outgoings};
use super::isolation::{Isolation, IsolationArguments, Wishes};
use super::journal::{Bounds, Journal, Missing};
use super::memory::Memory;
use super::outlet::Outlet;
use super::undelivered::Backlog;
use super::wires::Wires;
use super::wiring::{Note, Patterns, Situation, Takeover};
use crate::show;
use anyhow::Context;
use serde_json::{Value, json};
use shsa_bridge::{Bridge, BridgeError, Clock, Inbox, Message, Quality};
use shsa_core::diagnosis::Verdict;
use shsa_core::engine::{
    self, Engine, Event, EventKind, Input, NeedStatus, Order, Output, Publication, Subject,
};
use shsa_core::knowledge::{Draft, IdVec, KnowledgeBase, NeedId, SignalId};
use shsa_core::monitor::Symptom;
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use shsa_format::drive::{Era, Given};
use shsa_format::model::live::{Live, Written};
use shsa_format::model::write;
use std::collections::VecDeque;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// What a healer has done since it was last asked.
pub(super) enum Deed {
    /// It has decided something.
    Decided(Event),
    /// It has served a need.
    Served(Publication),
    /// Something has happened to a process of its: a kind and the reason.
    Noted(&'static str, String),
}

/// What has become of a value.
pub(super) struct Served {
    /// Whether the need is served better or worse by it than before.
    pub(super) is_news: bool,
    /// The names under which it was not sent, and why.
    pub(super) failed: Vec<(String, BridgeError)>,
}

/// How a need stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Standing {
    quality: Quality,
    /// How far its takeover is, and the quality under the name that is taken over.
    takeover: Option<(&'static str, Quality)>,
}

/// One knowledge base at work.
pub(super) struct Healer {
    name: String,
    path: PathBuf,
    live: Live,
    /// What it knows of its own, where parts of others are joined to that.
    own: Option<Live>,
    engine: Engine,
    /// What the ids of the next output belong to.
    told: KnowledgeBase,
    wires: Wires,
    outgoings: Outgoings,
    journal: Option<Journal>,
    memory: Option<Memory>,
    patterns: Option<Patterns>,
    /// Whether something was decided that is not remembered yet.
    has_decided: bool,
    outlets: IdVec<NeedId, Outlet>,
    /// Values that were lost on their way.
    backlog: Backlog,
    /// How long it took to compute each need's values.
    executions: IdVec<NeedId, Execution>,
    /// How long the engine took for the latest input.
    work: Duration,
    isolation: Option<Isolation>,
    notes: VecDeque<(&'static str, String)>,
    /// The signal that serves a need when nothing is wrong, by the names of both.
    carriers: Carriers,
    takeovers: Vec<Takeover>,
    /// Those whose needs have gone with the model before, until their sources are let back.
    leaving: Vec<Takeover>,
    /// Whether the bus is sure which messages are ours.
    knows_own: bool,
    /// Of the last message, the signals of which it was a value; only where messages are copied.
    heard: Vec<SignalId>,
}

impl Healer {
    /// Subscribes to the signals of a model.
    ///
    /// # Errors
    /// When a signal's source cannot be found on a bus, or the bus refuses.
    pub(super) fn new(
        path: &Path,
        live: Live,
        options: engine::Options,
        outgoings: Outgoings,
        bridge: &mut dyn Bridge,
    ) -> anyhow::Result<Healer> {
        let knowledge = live.knowledge().clone();
        let mut healer = Healer {
            name: path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
            path: path.to_owned(),
            live,
            own: None,
            engine: Engine::new(knowledge.clone(), options),
            told: knowledge,
            wires: Wires::default(),
            outgoings,
            journal: None,
            memory: None,
            patterns: None,
            has_decided: false,
            outlets: IdVec::new(),
            backlog: Backlog::default(),
            executions: IdVec::new(),
            work: Duration::ZERO,
            isolation: None,
            notes: VecDeque::new(),
            carriers: Carriers::new(),
            takeovers: Vec::new(),
            leaving: Vec::new(),
            heard: Vec::new(),
            knows_own: bridge.knows_own(),
        };
        match healer.connect(bridge)?.pop() {
            Some((topic, error)) => Err(error).with_context(|| format!("subscribing to {topic}")),
            None => Ok(healer),
        }
    }

    /// Lets processes of their own compute the substitutes of needs that ask for it.
    ///
    /// # Errors
    /// Never: bounds inside are right.
    pub(super) fn isolate(&mut self, arguments: &IsolationArguments, inbox: Inbox) -> anyhow::Result<()> {
        self.isolation = Some(Isolation::new(arguments, self.engine.knowledge(), inbox)?);
        Ok(())
    }

    /// Writes every input to a journal from now on.
    ///
    /// # Errors
    /// When it cannot be begun.
    pub(super) fn keep_journal(&mut self, folder: &Path, bounds: Bounds) -> anyhow::Result<()> {
        let journal = Journal::begin(folder, &self.name, bounds, self.engine.knowledge());
        self.journal = Some(journal.with_context(|| format!("writing a journal in {}", folder.display()))?);
        Ok(())
    }

    /// Goes on from the state of an earlier run, if there is one, and saves its own from now on.
    ///
    /// # Errors
    /// When the state is none, or cannot be written.
    pub(super) fn keep_state(&mut self, folder: &Path, now: Time) -> anyhow::Result<()> {
        let (memory, snapshot) = Memory::open(folder, &self.name)?;
        self.memory = Some(memory);
        self.patterns = Some(Patterns::open(folder, &self.name));
        if let Some(snapshot) = snapshot {
            self.give(Input::Restore { time: now, snapshot: Box::new(snapshot) });
        }
        self.remember_all();
        Ok(())
    }

    /// What its model needs on the bus; `serving` tells which signal serves a need now.
    fn fittings(
        &self,
        knowledge: &KnowledgeBase,
        serving: impl Fn(NeedId) -> Option<SignalId>,
    ) -> anyhow::Result<Fittings> {
        Fittings::new(knowledge, &self.outgoings, &self.carriers, serving, self.knows_own)
    }

    /// Fits it to the model that its engine works with now; the topics that the bus refuses, and why.
    ///
    /// # Errors
    /// When the model does not fit a bus; it was looked at before, unless it is the first.
    fn connect(&mut self, bridge: &mut dyn Bridge) -> anyhow::Result<Vec<(Arc<str>, BridgeError)>> {
        let knowledge = self.engine.knowledge();
        let serving =
            |need| self.engine.need_status(need).source.and_then(|source| knowledge.signal(&source));
        let fittings = self.fittings(knowledge, serving).or_else(|_| self.fittings(knowledge, |_| None))?;
        let Fittings { wires, outlets, takeovers, carriers } = fittings;
        let subscribed = wires.topics().map(|topic| (topic.clone(), bridge.subscribe(topic, None)));
        let refused = subscribed.filter_map(|(topic, done)| Some((topic, done.err()?))).collect();
        let before = std::mem::take(&mut self.outlets);
        for outlet in outlets.iter() {
            let same = before.iter().find(|before| before.topic() == outlet.topic());
            self.outlets.push(same.map_or_else(|| outlet.clone(), |before| outlet.succeeding(before)));
        }
        let mut taken = std::mem::take(&mut self.takeovers);
        for takeover in takeovers {
            let same = taken.iter().position(|before| takeover.is_same(before)).map(|at| taken.remove(at));
            self.takeovers.push(match same {
                Some(before) => takeover.succeeding(before),
                None => takeover,
            });
        }
        self.leaving.extend(taken.into_iter().filter(Takeover::is_silencing));
        self.backlog.clear();
        self.executions.clear();
        for _ in knowledge.needs() {
            self.executions.push(Execution::new()?);
        }
        if let Some(isolation) = &mut self.isolation {
            isolation.renew(knowledge)?;
        }
        (self.wires, self.carriers) = (wires, carriers);
        Ok(refused)
    }

    /// What it is called: its file without folders and extension.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// Every need with the way it goes out.
    pub(super) fn outlets(&self) -> impl Iterator<Item = (NeedId, &Outlet)> + Clone {
        self.outlets.enumerate()
    }

    /// How everything stands.
    pub(super) fn state(&self, now: Time, clock: &Clock) -> Value {
        let needs = self.outlets().map(|(id, outlet)| {
            let NeedStatus { published, longest_gap, .. } = self.engine.need_status(id);
            let mut status = self.status(id, now, clock);
            if let Some(status) = status.as_object_mut() {
                status.insert("published".to_owned(), json!(published));
                status.insert("longest_gap_s".to_owned(), json!(longest_gap.seconds()));
                status.insert("execution_us".to_owned(), self.executions[id].json());
                let isolation = self.isolation.as_ref().and_then(|isolation| isolation.state(id));
                status.extend(isolation.map(|state| ("isolation".to_owned(), state)));
            }
            (outlet.variable().to_owned(), status)
        });
        let signals = self.engine.knowledge().signals().enumerate();
        let signals = signals.map(|(id, signal)| (signal.name.clone(), self.signal(id)));
        json!({ "needs": Value::Object(needs.collect()), "signals": Value::Object(signals.collect()) })
    }

    /// The words of a need's status topic.
    pub(super) fn status(&self, need: NeedId, now: Time, clock: &Clock) -> Value {
        let mut status = self.outlets[need].status(now, clock);
        if let (Some(status), Some(takeover)) = (status.as_object_mut(), self.takeover_of(need)) {
            status.insert("takeover".to_owned(), takeover.json(self.quality_of(takeover, now), clock));
        }
        status
    }

    /// How every need stands: what changes here is told at once.
    pub(super) fn standings(&self, now: Time) -> impl Iterator<Item = Standing> + Clone {
        self.outlets.enumerate().map(move |(id, outlet)| Standing {
            quality: outlet.quality(now),
            takeover: self.takeover_of(id).map(|takeover| (takeover.stage(), self.quality_of(takeover, now))),
        })
    }

    fn takeover_of(&self, need: NeedId) -> Option<&Takeover> {
        self.takeovers.iter().find(|takeover| takeover.need() == need)
    }

    fn signal(&self, id: SignalId) -> Value {
        let counts = self.engine.monitor().ports()[id].counts();
        json!({
            "verdict": show::verdict(self.engine.absence(id), self.engine.verdict(id)),
            "symptom": self.engine.fault(id).map(Symptom::name),
            "accepted": counts.accepted,
            "dropped": counts.dropped + counts.duplicates,
            "late": counts.late,
            "out_of_order": counts.out_of_order,
            "invalid": counts.invalid,
            "out_of_range": counts.out_of_range,
            "too_fast": counts.too_fast,
            "unreadable": self.wires.unreadable(id).0,
            "unreadable_because": self.wires.unreadable(id).1,
        })
    }

    pub(super) fn engine(&self) -> &Engine {
        &self.engine
    }

    /// What the ids of its deeds belong to.
    pub(super) fn told(&self) -> &KnowledgeBase {
        &self.told
    }

    /// Hears a message, if it is about one of its signals.
    pub(super) fn hear(&mut self, message: &Message, clock: &Clock) {
        self.takeovers.iter_mut().for_each(|takeover| takeover.heard(message));
        let Healer { engine, journal, work, heard, .. } = self;
        heard.clear();
        self.wires.read(message, clock, |observation| {
            if !matches!(observation.value, RawValue::Number(value) if value.is_nan()) {
                heard.push(observation.signal);
            }
            *work = give(engine, journal, Input::Observation(observation));
        });
        let copied = self.outlets.iter_mut().filter_map(Outlet::likeness);
        let copied = copied.chain(self.takeovers.iter_mut().map(Takeover::likeness));
        for likeness in copied.filter(|likeness| self.heard.contains(&likeness.signal())) {
            if self.engine.verdict(likeness.signal()) != Verdict::Failed {
                likeness.learn(message);
            }
        }
    }

    /// Whether messages under this name may be somebody else's substitutes.
    pub(super) fn takes(&self, topic: &str) -> bool {
        self.takeovers.iter().any(|takeover| takeover.topic() == topic)
    }

    /// Goes on with what it takes over: whether that has changed how it stands, and what is to be told.
    pub(super) fn take_over(
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
            // What serves the need is not forbidden.
            || self.outlets[takeover.need()].is_served_without(takeover.signal())
                && engine.standing_orders().contains(&forbidden())
    }

    fn quality_of(&self, takeover: &Takeover, now: Time) -> Quality {
        takeover.quality(self.outlets[takeover.need()].quality(now), self.is_bad(takeover))
    }

    /// The takeovers, each with how far who reads its name can trust that.
    pub(super) fn takeovers(&self, now: Time) -> impl Iterator<Item = (&Takeover, Quality)> {
        self.takeovers.iter().map(move |takeover| (takeover, self.quality_of(takeover, now)))
    }

    /// When it goes on with one of them, unless something happens before.
    pub(super) fn take_over_due(&self, now: Time) -> Option<Time> {
        self.takeovers.iter().chain(&self.leaving).filter_map(|takeover| takeover.due(now)).min()
    }

    /// Lets time pass, and takes together what has come.
    pub(super) fn pass(&mut self, now: Time) {
        let mut before = None;
        while let Some(due) = self.engine.next_deadline().filter(|due| *due <= now && before != Some(*due)) {
            self.give(Input::Tick(due));
            before = Some(due);
        }
        self.supervise(now);
        if let Some(journal) = &mut self.journal {
            journal.hand_over();
        }
    }

    /// Looks after the processes, and hears from them.
    fn supervise(&mut self, now: Time) {
        let Some(isolation) = &mut self.isolation else { return };
        let Wishes { reports, notes, forbid } = isolation.supervise(&self.engine, &self.live);
        for (need, report) in reports {
            self.give(Input::Report { time: now, need, report });
        }
        self.notes.extend(notes);
        for relation in forbid {
            // It may be forbidden already, for another need.
            let _ = self.order(&Order::Forbid(Subject::Relation(relation)), now);
        }
    }

    /// When something is due without any message.
    pub(super) fn due(&self) -> Option<Time> {
        let isolation = self.isolation.as_ref().and_then(Isolation::due);
        self.engine.next_deadline().into_iter().chain(isolation).chain(self.backlog.due()).min()
    }

    /// How long it took to compute a need's values: in the engine, nanoseconds.
    pub(super) fn execution(&self, need: NeedId) -> &Execution {
        &self.executions[need]
    }

    /// The processes of its needs.
    pub(super) fn isolation(&self) -> Option<&Isolation> {
        self.isolation.as_ref()
    }

    fn give(&mut self, input: Input) {
        self.work = give(&mut self.engine, &mut self.journal, input);
    }

    /// What its journal and its state lack.
    pub(super) fn missing(&self) -> impl Iterator<Item = Missing> {
        let journal = self.journal.as_ref().map(Journal::missing);
        journal.into_iter().chain(self.memory.as_ref().map(|memory| memory.missing().clone()))
    }

    /// Does what the operator orders.
    ///
    /// # Errors
    /// Why it cannot be done; nothing has changed then.
    pub(super) fn order(&mut self, order: &Order, now: Time) -> Result<(), String> {
        if self.order_back(order) {
            // A source that was silenced has nothing that could be vouched for yet.
            return Ok(());
        }
        self.engine.order(order, now).map_err(|refusal| refusal.to_string())?;
        self.record(&Input::Order { time: now, order: order.clone() });
        Ok(())
    }

    /// Whether an operator vouches for a source whose name is taken.
    fn order_back(&mut self, order: &Order) -> bool {
        let Order::Clear(Subject::Signal(signal)) = order else { return false };
        let takeover = self.takeovers.iter_mut().find(|takeover| takeover.signal() == signal);
        takeover.is_some_and(Takeover::order_back)
    }

    /// Saves what must outlast the process, if that has changed, or could not be saved.
    pub(super) fn remember(&mut self) {
        if let Some(memory) = self.memory.as_mut().filter(|memory| self.has_decided || memory.is_due()) {
            memory.save(&self.engine.snapshot());
            self.has_decided = false;
        }
    }

    /// Saves what must outlast the process, at its end.
    pub(super) fn remember_all(&mut self) {
        self.has_decided = true;
        self.remember();
    }

    fn record(&mut self, input: &Input) {
        if let Some(journal) = &mut self.journal {
            // What cannot be written is counted by the journal itself.
            let _ = journal.record(Given::Input(input));
        }
    }

    /// Lets the model that its file holds now take over.
    ///
    /// # Errors
    /// What is wrong with it; nothing has changed then.
    pub(super) fn reload(&mut self, now: Time) -> Result<(), String> {
        let text = fs::read_to_string(&self.path);
        let text = text.map_err(|error| format!("{}: {error}", self.path.display()))?;
        self.change(&self.path.display().to_string(), &text, now)
    }

    /// Lets a change of the model, or a whole new one, take over.
    ///
    /// # Errors
    /// What is wrong with it; nothing has changed then.
    pub(super) fn change(&mut self, name: &str, text: &str, now: Time) -> Result<(), String> {
        let mut own = self.own.clone();
        if let Some(own) = &mut own {
            own.change(Written { name, text }).map_err(|report| report.render(false))?;
        }
        self.adopt(name, text, now)?;
        self.own = own;
        Ok(())
    }

    /// What it knows without the parts of others.
    pub(super) fn own(&self) -> &Draft {
        self.own.as_ref().unwrap_or(&self.live).draft()
    }

    /// Another one whenever what it knows of its own is.
    pub(super) fn version(&self) -> u64 {
        self.own.as_ref().unwrap_or(&self.live).knowledge().version()
    }

    /// Lets its own knowledge with parts of others take over.
    ///
    /// # Errors
    /// What is wrong with it; nothing has changed then.
    pub(super) fn join(&mut self, whole: &Draft, now: Time) -> Result<(), String> {
        let text = write::yaml(whole);
        if text == write::yaml(self.live.draft()) {
            return Ok(());
        }
        let own = self.own.clone().unwrap_or_else(|| self.live.clone());
        self.adopt("parts", &text, now)?;
        self.own = (text != write::yaml(own.draft())).then_some(own);
        Ok(())
    }

    /// Works with another model from now on.
    fn adopt(&mut self, name: &str, text: &str, now: Time) -> Result<(), String> {
        let mut live = self.live.clone();
        live.change(Written { name, text }).map_err(|report| report.render(false))?;
        self.fittings(live.knowledge(), |_| None).map_err(|error| format!("{error:#}"))?;
        let change = Some((name.to_owned(), text.to_owned()));
        let era = Era { from: now, knowledge: live.knowledge().clone(), change, inputs: Vec::new() };
        if let Some(journal) = &mut self.journal {
            journal.record(Given::Era(&era)).map_err(|error| error.to_string())?;
        }
        self.engine.reload(era.knowledge, now);
        self.live = live;
        Ok(())
    }

    /// What it has done, one by one.
    ///
    /// # Errors
    /// When a model that has just taken over does not fit a bus, which was looked at before.
    pub(super) fn poll(&mut self, bridge: &mut dyn Bridge) -> anyhow::Result<Option<Deed>> {
        if let Some((kind, because)) = self.notes.pop_front() {
            return Ok(Some(Deed::Noted(kind, because)));
        }
        while let Some(output) = self.engine.poll() {
            match output {
                Output::Event(event) => {
                    self.follow(&event);
                    self.has_decided = true;
                    return Ok(Some(Deed::Decided(event)));
                }
                Output::Publication(publication) => {
                    if !publication.delegated {
                        self.executions[publication.need].took(self.work);
                    }
                    return Ok(Some(Deed::Served(publication)));
                }
                Output::Task { need, number, task } => {
                    if let Some(isolation) = &mut self.isolation {
                        isolation.hand(need, number, task, &self.engine);
                    }
                }
                Output::Reloaded(_) => {
                    self.told = self.engine.knowledge().clone();
                    for (topic, error) in self.connect(bridge)? {
                        self.notes.push_back(("trouble", format!("subscribing to {topic}: {error}")));
                    }
                    return self.poll(bridge);
                }
            }
        }
        Ok(None)
    }

    /// An event about a variable may mean that its needs are served from elsewhere.
    fn follow(&mut self, event: &Event) {
        let needs = self.told.needs().enumerate();
        for (id, _) in needs.filter(|(_, need)| Some(need.variable) == event.variable) {
            let status = self.engine.need_status(id);
            self.outlets[id].follow(event.kind, status.source);
        }
    }

    /// Sends a value of a need, where that is ours to serve.
    pub(super) fn serve(
        &mut self,
        publication: &Publication,
        is_ours: impl Fn(&str) -> bool,
        bridge: &mut dyn Bridge,
    ) -> Served {
        let quality = match publication.quality {
            engine::Quality::Good => Quality::Good,
            engine::Quality::Substitute => Quality::Substitute,
        };
        let outlet = &mut self.outlets[publication.need];
        if !outlet.has_source() {
            outlet.follow(EventKind::Restored, self.engine.need_status(publication.need).source);
        }
        let is_isolated = self.isolation.as_ref().is_some_and(|isolation| isolation.is_isolated(publication));
        outlet.place(match (publication.delegated, is_isolated) {
            (true, _) => ", in a process of its own",
            (false, true) => ", in the engine for now",
            (false, false) => "",
        });
        let time = publication.time;
        let before = (outlet.quality(time), outlet.is_able(time));
        outlet.note(publication, quality);
        let failed = if is_ours(outlet.topic()) {
            self.send(publication, None, bridge)
        } else {
            outlet.leave();
            Vec::new()
        };
        let outlet = &self.outlets[publication.need];
        Served { is_news: (outlet.quality(time), outlet.is_able(time)) != before, failed }
    }

    /// Sends a value under all names of its need, or only this one; what was not sent.
    fn send(
        &mut self,
        publication: &Publication,
        only: Option<&str>,
        bridge: &mut dyn Bridge,
    ) -> Vec<(String, BridgeError)> {
        let clock = bridge.inbox().clock();
        let (stamp, now) = (Outlet::stamp(publication, clock), clock.now());
        let Healer { outlets, takeovers, backlog, .. } = self;
        let outlet = &mut outlets[publication.need];
        let mut failed = Vec::new();
        let mut follow = |name: &str, sent: Result<(), BridgeError>| {
            backlog.follow(name, publication, sent.as_ref().copied(), now);
            failed.extend(sent.err().map(|error| (name.to_owned(), error)));
        };
        let mut is_gate = true;
        for takeover in takeovers.iter_mut().filter(|takeover| takeover.need() == publication.need) {
            // A need of the name of its own source has no other publisher beside that.
            is_gate &= takeover.topic().trim_matches('/') != outlet.topic().trim_matches('/');
            if only.is_none_or(|only| only == takeover.topic()) {
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

    /// Whether something that was lost on its way is to be sent again now.
    pub(super) fn has_backlog(&self, now: Time) -> bool {
        self.backlog.due().is_some_and(|due| due <= now)
    }

    /// Sends again what was lost on its way, while it is not too old; what was not sent.
    pub(super) fn send_again(
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
}

/// Gives an input to the engine, and to the journal before; how long the engine took.
fn give(engine: &mut Engine, journal: &mut Option<Journal>, input: Input) -> Duration {
    if let Some(journal) = journal {
        // What cannot be written is counted by the journal itself.
        let _ = journal.record(Given::Input(&input));
    }
    let began = Instant::now();
    engine.handle(input);
    began.elapsed()
}
