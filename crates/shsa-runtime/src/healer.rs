//! One knowledge base at work on a bus: messages become observations, publications become messages.

mod model;
mod serving;

pub(super) use serving::{Served, Standing};

use super::bindings::{Carriers, OutputOptions};
use super::execution::Execution;
use super::held_back::HeldBack;
use super::inputs::Inputs;
use super::journal::{Bounds, Journal, Missing};
use super::options::Model;
use super::outlet::Outlet;
use super::sandbox::{Consequences, SandboxOptions, Workers};
use super::state_file::StateFile;
use super::undelivered::Backlog;
use super::wiring::{Patterns, Takeover};
use crate::error::{Context, RuntimeError};
use shsa_bridge::{Bridge, Clock, Inbox, Message};
use shsa_core::diagnosis::Verdict;
use shsa_core::engine::{self, Engine, Event, EventKind, Input, Order, Output, Publication, Subject, Ticks};
use shsa_core::knowledge::{IdVec, KnowledgeBase, NeedId, SignalId};
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use shsa_format::drive::Given;
use shsa_format::model::live::Live;
use shsa_format::words;
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// What a healer has done since it was last asked.
pub(super) enum Effect {
    /// It has decided something.
    Decided(Event),
    /// It has served a need.
    Served(Publication),
    /// Something has happened to a process of its: a kind and the reason.
    Noted(&'static str, String),
}

/// One knowledge base at work.
pub(super) struct Healer {
    name: String,
    /// Where it is read again from; `None`: nowhere.
    path: Option<PathBuf>,
    live: Live,
    /// What it knows of its own, where parts of others are joined to that.
    own: Option<Live>,
    engine: Engine,
    /// What the ids of the next output belong to.
    told: KnowledgeBase,
    inputs: Inputs,
    output_options: OutputOptions,
    journal: Option<Journal>,
    state_file: Option<StateFile>,
    patterns: Option<Patterns>,
    /// Whether something was decided that is not remembered yet.
    has_decided: bool,
    outlets: IdVec<NeedId, Outlet>,
    /// Values that were lost on their way.
    backlog: Backlog,
    /// The newest value of each need that another instance had to send.
    withheld: IdVec<NeedId, Option<Publication>>,
    /// How long it took to compute each need's values.
    executions: IdVec<NeedId, Execution>,
    /// How long the engine took for the latest input.
    work: Duration,
    workers: Option<Workers>,
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
        model: Model,
        options: engine::Options,
        output_options: OutputOptions,
        bridge: &mut dyn Bridge,
    ) -> Result<Healer, RuntimeError> {
        let Model { name, path, live } = model;
        let knowledge = live.knowledge().clone();
        let mut healer = Healer {
            name,
            path,
            live,
            own: None,
            engine: shsa_estimate::node::engine(knowledge.clone(), options),
            told: knowledge,
            inputs: Inputs::default(),
            output_options,
            journal: None,
            state_file: None,
            patterns: None,
            has_decided: false,
            outlets: IdVec::new(),
            backlog: Backlog::default(),
            withheld: IdVec::new(),
            executions: IdVec::new(),
            work: Duration::ZERO,
            workers: None,
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
    /// When a need asks for a process, and no program is set that is one.
    pub(super) fn isolate(&mut self, options: &SandboxOptions, inbox: Inbox) -> Result<(), RuntimeError> {
        self.workers = Some(Workers::new(options, self.engine.knowledge(), inbox)?);
        Ok(())
    }

    /// Writes every input to a journal from now on.
    ///
    /// # Errors
    /// When it cannot be begun.
    pub(super) fn keep_journal(&mut self, folder: &Path, bounds: Bounds) -> Result<(), RuntimeError> {
        let journal = Journal::begin(folder, &self.name, bounds, self.engine.knowledge());
        self.journal = Some(journal.with_context(|| format!("writing a journal in {}", folder.display()))?);
        Ok(())
    }

    /// Goes on from the state of an earlier run, if there is one, and saves its own from now on.
    ///
    /// # Errors
    /// When the state is none, or cannot be written.
    pub(super) fn keep_state(&mut self, folder: &Path, now: Time) -> Result<(), RuntimeError> {
        let (state_file, snapshot) = StateFile::open(folder, &self.name)?;
        self.state_file = Some(state_file);
        self.patterns = Some(Patterns::open(folder, &self.name));
        if let Some(snapshot) = snapshot {
            self.give(Input::Restore { time: now, snapshot: Box::new(snapshot) });
        }
        self.remember_all();
        Ok(())
    }

    /// What it is called.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// Every need with the way it goes out.
    pub(super) fn outlets(&self) -> impl Iterator<Item = (NeedId, &Outlet)> + Clone {
        self.outlets.enumerate()
    }

    pub(super) fn engine(&self) -> &Engine {
        &self.engine
    }

    /// What the ids of its effects belong to.
    pub(super) fn told(&self) -> &KnowledgeBase {
        &self.told
    }

    /// Hears a message, if it is about one of its signals.
    pub(super) fn hear(&mut self, message: &Message, clock: &Clock) {
        self.takeovers.iter_mut().for_each(|takeover| takeover.heard(message));
        let Healer { engine, journal, work, heard, .. } = self;
        heard.clear();
        self.inputs.read(message, clock, |observation| {
            if !matches!(observation.value, RawValue::Number(value) if value.is_nan()) {
                heard.push(observation.signal);
            }
            tick(engine, journal, work, Ticks::before(observation.received));
            *work = give(engine, journal, Input::Observation(observation));
        });
        let copied = self.outlets.iter_mut().filter_map(Outlet::template);
        let copied = copied.chain(self.takeovers.iter_mut().map(Takeover::template));
        for template in copied.filter(|template| self.heard.contains(&template.signal())) {
            if self.engine.verdict(template.signal()) != Verdict::Failed {
                template.learn(message);
            }
        }
    }

    /// What is to be told of signals that came back with messages that may have waited.
    pub(super) fn backlogs(&mut self, now: Time) -> Vec<String> {
        let knowledge = self.engine.knowledge();
        let words = |(signal, HeldBack { silence, count }): (SignalId, HeldBack)| {
            format!(
                "{} was silent for {:.1} s: {count} messages without a stamp of their own have come at once after it, and are left aside",
                knowledge.signals()[signal].name,
                silence.seconds()
            )
        };
        self.inputs.backlogs(now).map(words).collect()
    }

    /// Lets time pass, and takes together what has come.
    pub(super) fn pass(&mut self, now: Time) {
        tick(&mut self.engine, &mut self.journal, &mut self.work, Ticks::up_to(now));
        self.supervise(now);
        if let Some(journal) = &mut self.journal {
            journal.hand_over();
        }
    }

    /// Looks after the processes, and hears from them.
    fn supervise(&mut self, now: Time) {
        let Some(workers) = &mut self.workers else { return };
        let Consequences { reports, notes, forbid } = workers.supervise(&self.engine, &self.live);
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
        let workers = self.workers.as_ref().and_then(Workers::due);
        self.engine.next_deadline().into_iter().chain(workers).chain(self.backlog.due()).min()
    }

    /// How long it took to compute a need's values: in the engine, nanoseconds.
    pub(super) fn execution(&self, need: NeedId) -> &Execution {
        &self.executions[need]
    }

    /// The processes of its needs.
    pub(super) fn workers(&self) -> Option<&Workers> {
        self.workers.as_ref()
    }

    fn give(&mut self, input: Input) {
        self.work = give(&mut self.engine, &mut self.journal, input);
    }

    /// What its journal and its state lack.
    pub(super) fn missing(&self) -> impl Iterator<Item = Missing> {
        let journal = self.journal.as_ref().map(Journal::missing);
        journal.into_iter().chain(self.state_file.as_ref().map(|state_file| state_file.missing().clone()))
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
        self.engine.order(order, now).map_err(|refusal| words::refusal(&refusal))?;
        self.record(&Input::Order { time: now, order: order.clone() });
        Ok(())
    }

    /// Whether names of failed sources may be taken over, or are to be given back.
    pub(super) fn takes_over(&self) -> bool {
        !self.takeovers.is_empty() || !self.leaving.is_empty()
    }

    /// Saves what must outlast the process, if that has changed, or could not be saved.
    pub(super) fn remember(&mut self) {
        if let Some(state_file) =
            self.state_file.as_mut().filter(|state_file| self.has_decided || state_file.is_due())
        {
            state_file.save(&self.engine.snapshot());
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

    /// What it has done, one by one.
    ///
    /// # Errors
    /// When a model that has just taken over does not fit a bus, which was looked at before.
    pub(super) fn poll(&mut self, bridge: &mut dyn Bridge) -> Result<Option<Effect>, RuntimeError> {
        if let Some((kind, because)) = self.notes.pop_front() {
            return Ok(Some(Effect::Noted(kind, because)));
        }
        while let Some(output) = self.engine.poll() {
            match output {
                Output::Event(event) => {
                    self.follow(&event);
                    self.has_decided = true;
                    return Ok(Some(Effect::Decided(event)));
                }
                Output::Publication(publication) => {
                    if !publication.delegated {
                        self.executions[publication.need].took(self.work);
                    }
                    return Ok(Some(Effect::Served(publication)));
                }
                Output::Task { need, number, task } => {
                    if let Some(workers) = &mut self.workers {
                        workers.hand(need, number, task, &self.engine);
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
        if event.kind == EventKind::Refused {
            // What may not serve a need changes nothing about what does.
            return;
        }
        let needs = self.told.needs().enumerate();
        for (id, _) in needs.filter(|(id, need)| {
            Some(need.variable) == event.variable && event.need.is_none_or(|need| need == *id)
        }) {
            // An event tells of a stand-in, too, which is no source of its own.
            let status = self.engine.need_status(id);
            let source = event.substitution.clone().filter(|_| event.need == Some(id)).or(status.source);
            self.outlets[id].follow(event.kind, source.as_ref());
        }
    }
}

/// Gives the engine the ticks that have fallen due; how long it took over the last one.
fn tick(engine: &mut Engine, journal: &mut Option<Journal>, work: &mut Duration, mut ticks: Ticks) {
    while let Some(due) = ticks.next(engine) {
        *work = give(engine, journal, Input::Tick(due));
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
