//! One knowledge base at work on a bus: messages become observations, publications become messages.

use super::journal::{Bounds, Journal, Missing};
use super::memory::Memory;
use super::outlet::{Form, Outlet};
use super::wires::Wires;
use crate::show;
use anyhow::Context;
use serde_json::{Value, json};
use shsa_bridge::{Bridge, Clock, Message, Quality};
use shsa_core::engine::{self, Engine, Event, EventKind, Input, NeedStatus, Order, Output, Publication};
use shsa_core::knowledge::{Draft, IdVec, KnowledgeBase, NeedId, SignalId};
use shsa_core::monitor::Symptom;
use shsa_core::time::Time;
use shsa_format::drive::{Era, Given};
use shsa_format::model::live::{Live, Written};
use shsa_format::model::write;
use std::fs;
use std::path::{Path, PathBuf};

/// What a healer has done since it was last asked.
pub(super) enum Deed {
    /// It has decided something.
    Decided(Event),
    /// It has served a need.
    Served(Publication),
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
    form: Form,
    journal: Option<Journal>,
    memory: Option<Memory>,
    /// Whether something was decided that is not remembered yet.
    has_decided: bool,
    outlets: IdVec<NeedId, Outlet>,
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
        form: Form,
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
            form,
            journal: None,
            memory: None,
            has_decided: false,
            outlets: IdVec::new(),
        };
        healer.connect(bridge)?;
        Ok(healer)
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
        if let Some(snapshot) = snapshot {
            give(
                &mut self.engine,
                &mut self.journal,
                Input::Restore { time: now, snapshot: Box::new(snapshot) },
            );
        }
        self.remember_all();
        Ok(())
    }

    fn connect(&mut self, bridge: &mut dyn Bridge) -> anyhow::Result<()> {
        let knowledge = self.engine.knowledge();
        self.wires = Wires::new(knowledge)?;
        for topic in self.wires.topics() {
            bridge.subscribe(topic, None).with_context(|| format!("subscribing to {topic}"))?;
        }
        let before = std::mem::take(&mut self.outlets);
        for need in knowledge.needs().ids() {
            let outlet = Outlet::new(knowledge, need, self.form)?;
            let same = before.iter().find(|before| before.topic() == outlet.topic());
            self.outlets.push(same.map_or(outlet.clone(), |before| outlet.succeeding(before)));
        }
        Ok(())
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
            let mut status = outlet.status(now, clock);
            if let Some(status) = status.as_object_mut() {
                status.insert("published".to_owned(), json!(published));
                status.insert("longest_gap_s".to_owned(), json!(longest_gap.seconds()));
            }
            (outlet.variable().to_owned(), status)
        });
        let signals = self.engine.knowledge().signals().enumerate();
        let signals = signals.map(|(id, signal)| (signal.name.clone(), self.signal(id)));
        json!({ "needs": Value::Object(needs.collect()), "signals": Value::Object(signals.collect()) })
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
        let (engine, journal) = (&mut self.engine, &mut self.journal);
        self.wires.read(message, clock, |observation| give(engine, journal, Input::Observation(observation)));
    }

    /// Lets time pass, and takes together what has come.
    pub(super) fn pass(&mut self, now: Time) {
        let mut before = None;
        while let Some(due) = self.engine.next_deadline().filter(|due| *due <= now && before != Some(*due)) {
            give(&mut self.engine, &mut self.journal, Input::Tick(due));
            before = Some(due);
        }
        if let Some(journal) = &mut self.journal {
            journal.hand_over();
        }
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
        self.engine.order(order, now).map_err(|refusal| refusal.to_string())?;
        self.record(&Input::Order { time: now, order: order.clone() });
        Ok(())
    }

    /// Saves what must outlast the process, if that has changed.
    pub(super) fn remember(&mut self) {
        if let Some(memory) = self.memory.as_mut().filter(|_| self.has_decided) {
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
        self.take_over(name, text, now)?;
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
        self.take_over("parts", &text, now)?;
        self.own = (text != write::yaml(own.draft())).then_some(own);
        Ok(())
    }

    fn take_over(&mut self, name: &str, text: &str, now: Time) -> Result<(), String> {
        let mut live = self.live.clone();
        live.change(Written { name, text }).map_err(|report| report.render(false))?;
        Wires::new(live.knowledge()).map_err(|error| format!("{error:#}"))?;
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
    /// When the bus refuses a topic of a model that has just taken over.
    pub(super) fn poll(&mut self, bridge: &mut dyn Bridge) -> anyhow::Result<Option<Deed>> {
        while let Some(output) = self.engine.poll() {
            match output {
                Output::Event(event) => {
                    self.follow(&event);
                    self.has_decided = true;
                    return Ok(Some(Deed::Decided(event)));
                }
                Output::Publication(publication) => return Ok(Some(Deed::Served(publication))),
                Output::Reloaded(_) => {
                    self.told = self.engine.knowledge().clone();
                    self.connect(bridge)?;
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
    ///
    /// # Errors
    /// Those of the bus.
    pub(super) fn serve(
        &mut self,
        publication: &Publication,
        is_ours: impl Fn(&str) -> bool,
        bridge: &mut dyn Bridge,
    ) -> anyhow::Result<()> {
        let quality = match publication.quality {
            engine::Quality::Good => Quality::Good,
            engine::Quality::Substitute => Quality::Substitute,
        };
        let outlet = &mut self.outlets[publication.need];
        if !outlet.has_source() {
            outlet.follow(EventKind::Restored, self.engine.need_status(publication.need).source);
        }
        outlet.note(publication, quality);
        if !is_ours(outlet.topic()) {
            return Ok(());
        }
        let clock = bridge.inbox().clock().clone();
        outlet.send(publication, &clock, bridge)
    }
}

/// Gives an input to the engine, and to the journal before.
fn give(engine: &mut Engine, journal: &mut Option<Journal>, input: Input) {
    if let Some(journal) = journal {
        // What cannot be written is counted by the journal itself.
        let _ = journal.record(Given::Input(&input));
    }
    engine.handle(input);
}
