//! One engine on a bus: turns messages into observations, and publications into messages.

mod model;
mod serving;

pub(super) use serving::{ReportedState, Served};

use super::bindings::{BusTraits, Carriers, OutputOptions};
use super::execution::Execution;
use super::files::Files;
use super::held_back::HeldBack;
use super::input_log::InputLog;
use super::inputs::Inputs;
use super::journal::Missing;
use super::options::{JournalOptions, Model};
use super::outlet::Outlet;
use super::recording::{Recording, RunRecorder};
use super::sandbox::{Consequences, SandboxOptions, Workers};
use super::state_file::Earlier;
use super::undelivered::Backlog;
use super::wiring::{Patterns, Takeover};
use crate::error::{Context, RuntimeError};
use shsa_bridge::{Bridge, Clock, Inbox, Message};
use shsa_core::engine::{
    self, Engine, Event, EventKind, Input, Order, Output, Publication, Snapshot, Subject, Ticks,
};
use shsa_core::knowledge::{IdVec, KnowledgeBase, NeedId, SignalId};
use shsa_core::observation::RawValue;
use shsa_core::time::Time;
use shsa_core::trust::Verdict;
use shsa_format::drive::Given;
use shsa_format::words;
use shsa_model::live::Live;
use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// An output of a healer since the last poll.
pub(super) enum Effect {
    /// A decision.
    Decided(Event),
    /// A value for a need.
    Served(Publication),
    /// An event of one of its processes or takeovers: kind and text.
    Noted(&'static str, String),
}

/// A healer: the engine of one model with its inputs, outlets and files.
pub(super) struct Healer {
    name: String,
    /// The model's file, for a reload; `None`: there is none.
    path: Option<PathBuf>,
    live: Live,
    /// The model without the parts of others; `None` if no part was joined.
    own: Option<Live>,
    engine: Engine,
    /// The knowledge base of the ids in the next output.
    reported_model: KnowledgeBase,
    inputs: Inputs,
    output_options: OutputOptions,
    files: Files,
    patterns: Option<Patterns>,
    outlets: IdVec<NeedId, Outlet>,
    /// Values to be sent again.
    backlog: Backlog,
    /// The newest value of each need that another instance serves.
    withheld: IdVec<NeedId, Option<Publication>>,
    /// The execution times of each need's values.
    executions: IdVec<NeedId, Execution>,
    /// The engine's time for the latest input.
    work: Duration,
    workers: Option<Workers>,
    notes: VecDeque<(&'static str, String)>,
    /// The signal that serves a need in the fault-free state, by the names of both.
    carriers: Carriers,
    takeovers: Vec<Takeover>,
    /// Takeovers whose needs the new model lacks; each stays until its source is let back.
    leaving: Vec<Takeover>,
    /// What the model needs to know of the bus.
    bus: BusTraits,
    /// Whether what others publish under the names of needs is heard, and the needs by these names.
    hears: bool,
    heard: BTreeMap<String, NeedId>,
    /// The signals for which the last message carried an observation; kept only where messages are copied.
    observed: Vec<SignalId>,
}

impl Healer {
    /// Subscribes to the signals of a model; and to its needs, if what others publish under their names is heard.
    ///
    /// # Errors
    /// When a signal's source names no topic and field, or the bus refuses.
    pub(super) fn new(
        model: Model,
        options: engine::Options,
        output_options: OutputOptions,
        hears: bool,
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
            reported_model: knowledge,
            inputs: Inputs::default(),
            output_options,
            files: Files::default(),
            patterns: None,
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
            observed: Vec::new(),
            bus: BusTraits::of(bridge),
            hears,
            heard: BTreeMap::new(),
        };
        match healer.connect(bridge)?.pop() {
            Some((topic, error)) => Err(error).with_context(|| format!("subscribing to {topic}")),
            None => Ok(healer),
        }
    }

    /// Lets processes of their own compute the substitutes of the needs that ask for it.
    ///
    /// # Errors
    /// When a need asks for a process, and the options name no program.
    pub(super) fn isolate(&mut self, options: &SandboxOptions, inbox: Inbox) -> Result<(), RuntimeError> {
        self.workers = Some(Workers::new(options, self.engine.knowledge(), inbox)?);
        Ok(())
    }

    /// Writes every input to a journal from now on. A disk that refuses is told, and the run goes on without.
    ///
    /// # Errors
    /// When there can be no thread.
    pub(super) fn keep_journal(&mut self, options: &JournalOptions) -> Result<(), RuntimeError> {
        let knowledge = self.engine.knowledge();
        let refused = self.files.keep_journal(options, &self.name, knowledge)?;
        self.notes.extend(refused.map(|because| ("degraded", because)));
        Ok(())
    }

    /// Has every input recorded from now on.
    ///
    /// # Errors
    /// When there can be no thread.
    pub(super) fn keep_record(&mut self, recorder: Box<dyn RunRecorder>) -> Result<(), RuntimeError> {
        let recording = Recording::begin(recorder);
        self.files.input_log.recording = Some(recording.context("starting a recorder")?);
        Ok(())
    }

    /// Restores the state of an earlier run, if there is one, and saves the state from now on. What cannot be read or saved is told,
    /// and the run goes on without.
    ///
    /// # Errors
    /// When there can be no thread.
    pub(super) fn keep_state(&mut self, folder: &Path, now: Time) -> Result<(), RuntimeError> {
        let Earlier { snapshot, degraded } = self.files.keep_state(folder, &self.name)?;
        self.patterns = Some(Patterns::open(folder, &self.name));
        if let Some(snapshot) = snapshot {
            self.give(Input::Restore { time: now, snapshot: Box::new(snapshot) });
        }
        self.remember_all();
        let words =
            |it: &Missing| format!("the state is not saved in {} yet: {}", folder.display(), it.because);
        let unsaved = self.files.unsaved().map(words);
        self.notes.extend(degraded.into_iter().chain(unsaved).map(|because| ("degraded", because)));
        Ok(())
    }

    pub(super) fn files(&self) -> &Files {
        &self.files
    }

    /// Saves the state if a decision has changed it, or if the last attempt has failed.
    pub(super) fn remember(&mut self) {
        self.files.remember(&self.engine);
    }

    /// Saves the state again if its file was removed.
    pub(super) fn look_after_state(&mut self) {
        self.files.look_after_state();
    }

    /// Saves the state at the end of the run.
    pub(super) fn remember_all(&mut self) {
        self.files.decided();
        self.remember();
    }

    /// Restores a part of another instance's state: what was computed without it goes nowhere.
    pub(super) fn restore(&mut self, snapshot: Snapshot, now: Time) {
        self.give(Input::Restore { time: now, snapshot: Box::new(snapshot) });
        self.withheld.iter_mut().for_each(|value| *value = None);
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// Every need with its outlet.
    pub(super) fn outlets(&self) -> impl Iterator<Item = (NeedId, &Outlet)> + Clone {
        self.outlets.enumerate()
    }

    pub(super) fn engine(&self) -> &Engine {
        &self.engine
    }

    /// The knowledge base of the ids in its effects.
    pub(super) fn reported_model(&self) -> &KnowledgeBase {
        &self.reported_model
    }

    /// Takes in a message about any of its signals.
    pub(super) fn receive(&mut self, message: &Message, clock: &Clock) {
        self.takeovers.iter_mut().for_each(|takeover| takeover.note_message(message));
        let Healer { engine, files: Files { input_log, .. }, work, observed, .. } = self;
        observed.clear();
        self.inputs.read(message, clock, |observation| {
            if !matches!(observation.value, RawValue::Number(value) if value.is_nan()) {
                observed.push(observation.signal);
            }
            tick(engine, input_log, work, Ticks::before(observation.received));
            *work = give(engine, input_log, Input::Observation(observation));
        });
        let copied = self.outlets.iter_mut().filter_map(Outlet::template);
        let copied = copied.chain(self.takeovers.iter_mut().map(Takeover::template));
        for template in copied.filter(|template| self.observed.contains(&template.signal())) {
            if self.engine.verdict(template.signal()) != Verdict::Failed {
                template.learn(message);
            }
        }
    }

    /// Notes about signals that came back with messages of unknown age.
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

    /// Advances the time, and collects the results.
    pub(super) fn pass(&mut self, now: Time) {
        tick(&mut self.engine, &mut self.files.input_log, &mut self.work, Ticks::up_to(now));
        self.supervise(now);
        self.files.input_log.hand_over();
    }

    /// Supervises the processes, and takes in their reports.
    fn supervise(&mut self, now: Time) {
        let Some(workers) = &mut self.workers else { return };
        let Consequences { reports, notes, forbid } = workers.supervise(&self.engine, &self.live);
        for (need, report) in reports {
            self.give(Input::Report { time: now, need, report });
        }
        self.notes.extend(notes);
        for relation in forbid {
            // The relation may already be forbidden, for another need.
            let _ = self.order(&Order::Forbid(Subject::Relation(relation)), now);
        }
    }

    /// When the next action is due without a message.
    pub(super) fn due(&self) -> Option<Time> {
        let workers = self.workers.as_ref().and_then(Workers::due);
        self.engine.next_deadline().into_iter().chain(workers).chain(self.backlog.due()).min()
    }

    /// The execution times of a need's values in the engine, nanoseconds.
    pub(super) fn execution(&self, need: NeedId) -> &Execution {
        &self.executions[need]
    }

    /// The processes that compute for its needs.
    pub(super) fn workers(&self) -> Option<&Workers> {
        self.workers.as_ref()
    }

    fn give(&mut self, input: Input) {
        self.work = give(&mut self.engine, &mut self.files.input_log, input);
    }

    /// Carries out an operator's order.
    ///
    /// # Errors
    /// The reason of a refusal; nothing has changed then.
    pub(super) fn order(&mut self, order: &Order, now: Time) -> Result<(), String> {
        if self.order_back(order) {
            // A silenced source publishes nothing, so there is no evidence to clear yet.
            return Ok(());
        }
        self.engine.order(order, now).map_err(|refusal| words::refusal(&refusal))?;
        self.files.input_log.record(Given::Input(&Input::Order { time: now, order: order.clone() }));
        Ok(())
    }

    /// Whether the name of a failed source may be taken over, or a source must be let back.
    pub(super) fn takes_over(&self) -> bool {
        !self.takeovers.is_empty() || !self.leaving.is_empty()
    }

    /// The next output.
    ///
    /// # Errors
    /// When a model that has just taken over does not fit the bus, which was checked before.
    pub(super) fn poll(&mut self, bridge: &mut dyn Bridge) -> Result<Option<Effect>, RuntimeError> {
        if let Some((kind, because)) = self.notes.pop_front() {
            return Ok(Some(Effect::Noted(kind, because)));
        }
        while let Some(output) = self.engine.poll() {
            match output {
                Output::Event(event) if !event.kind.is_decision() => {
                    return Ok(Some(Effect::Noted(event.kind.name(), self.noted(&event))));
                }
                Output::Event(event) => {
                    self.follow(&event);
                    self.files.decided();
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
                    self.reported_model = self.engine.knowledge().clone();
                    for (topic, error) in self.connect(bridge)? {
                        self.notes.push_back(("trouble", format!("subscribing to {topic}: {error}")));
                    }
                    return self.poll(bridge);
                }
            }
        }
        Ok(None)
    }

    /// What an event that is no decision tells.
    fn noted(&self, event: &Event) -> String {
        let signal = event.signal.map(|signal| &*self.reported_model.signals()[signal].name);
        format!("{}: {}", signal.unwrap_or_default(), words::reasons(&event.because))
    }

    /// Updates the outlets: after an event about a variable, its needs may have another source.
    fn follow(&mut self, event: &Event) {
        if event.kind == EventKind::Refused {
            // A refused candidate does not change the source.
            return;
        }
        let needs = self.reported_model.needs().enumerate();
        for (id, _) in needs.filter(|(id, need)| {
            Some(need.variable) == event.variable && event.need.is_none_or(|need| need == *id)
        }) {
            // An event may name a stand-in, which is no source of the need's status.
            let status = self.engine.need_status(id);
            let source = event.substitution.clone().filter(|_| event.need == Some(id)).or(status.source);
            self.outlets[id].follow(event.kind, source.as_ref());
        }
    }
}

/// Passes due ticks to the engine; `work` is the time for the last one.
fn tick(engine: &mut Engine, input_log: &mut InputLog, work: &mut Duration, mut ticks: Ticks) {
    while let Some(due) = ticks.next(engine) {
        *work = give(engine, input_log, Input::Tick(due));
    }
}

/// Writes an input down and passes it to the engine; returns the engine's time.
fn give(engine: &mut Engine, input_log: &mut InputLog, input: Input) -> Duration {
    input_log.record(Given::Input(&input));
    let began = Instant::now();
    engine.handle(input);
    began.elapsed()
}
