//! Announces needs and verdicts to Home Assistant by its discovery over MQTT: each need is a sensor, each signal a binary sensor.
//!
//! Configurations and states are retained messages under topics of their own. They wait here while there is no connection, and go out
//! a few at a time, so that they do not displace values. States are written once a second, and with each decision.
//!
//! The messages: <https://www.home-assistant.io/integrations/mqtt/#mqtt-discovery>.

mod entity;
mod unit;

use crate::healer::Healer;
use entity::{Because, Entity, Place, Standing, Subject, Verdict};
use shsa_bridge::{Bridge, BridgeError, Link, Message, Outgoing, Payload, Quality};
use shsa_core::engine::{Event, EventKind};
use shsa_core::knowledge::KnowledgeBase;
use shsa_core::time::{Span, Time};
use shsa_format::words;
use std::collections::{BTreeMap, BTreeSet};

/// How often values are written.
const WRITTEN_EVERY: Span = Span::from_millis(1_000);
/// The most messages at once; further ones wait for the next time.
const AT_ONCE: usize = 256;

/// What Home Assistant knows of a run.
#[derive(Debug)]
pub(super) struct Discovery {
    prefix: String,
    /// The topic on which Home Assistant says that it has been started.
    birth_topic: String,
    instance: String,
    models: Vec<Described>,
    /// The last decision about an entity.
    because: BTreeMap<String, Because>,
    /// What is retained under each topic, as far as this run knows.
    told: BTreeMap<String, String>,
    /// The messages that wait, in the order of their topics; an empty one removes what is retained.
    waiting: BTreeMap<(Stage, String), String>,
    /// What each state was written for last.
    standing: BTreeMap<String, Standing>,
    /// When values are written next.
    next: Time,
    /// Whether everything is to be told again then.
    is_lost: bool,
}

/// The entities of a model.
#[derive(Debug, Default)]
struct Described {
    /// The version of the model that they describe; `None`: they are to be described again.
    version: Option<u64>,
    needs: Vec<Entity>,
    signals: Vec<Entity>,
}

/// The order in which messages go out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Stage {
    Configuration,
    State,
}

impl Discovery {
    /// # Errors
    /// When the bus refuses the prefix.
    pub(super) fn new(
        prefix: &str,
        instance: &str,
        bridge: &mut dyn Bridge,
    ) -> Result<Discovery, BridgeError> {
        let birth_topic = format!("{prefix}/status");
        bridge.subscribe(&birth_topic, None)?;
        Ok(Discovery {
            prefix: prefix.to_owned(),
            birth_topic,
            instance: instance.to_owned(),
            models: Vec::new(),
            because: BTreeMap::new(),
            told: BTreeMap::new(),
            waiting: BTreeMap::new(),
            standing: BTreeMap::new(),
            next: Time::MIN,
            is_lost: false,
        })
    }

    /// Takes in a message: once Home Assistant has been started, everything is due again.
    pub(super) fn hear(&mut self, message: &Message) {
        let is_online = || matches!(&message.payload, Payload::Bytes(words) if **words == *b"online");
        self.is_lost |= *message.topic == *self.birth_topic && is_online();
    }

    /// Whoever keeps retained messages may have lost them.
    pub(super) fn tell_again(&mut self) {
        self.is_lost = true;
    }

    /// Takes in a decision about a model.
    pub(super) fn follow(&mut self, model: &str, knowledge: &KnowledgeBase, event: &Event) {
        if event.kind == EventKind::Refused {
            return;
        }
        let because = Because { kind: event.kind.name(), reasons: words::reasons(&event.because) };
        // What is decided about a signal is no decision about the needs of its variable.
        let is_about = |need| match (event.need, event.signal) {
            (Some(about), _) => about == need,
            (None, signal) => signal.is_none() && event.variable == Some(knowledge.needs()[need].variable),
        };
        let needs = knowledge.needs().ids().filter(|need| is_about(*need)).map(Subject::Need);
        for subject in needs.chain(event.signal.map(Subject::Signal)) {
            let id = subject.id(model, knowledge);
            self.standing.remove(&id);
            self.because.insert(id, because.clone());
        }
    }

    /// Writes what has changed: entities, states, once a second values. `is_others` tells whether another instance serves the need of
    /// this name.
    ///
    /// # Errors
    /// The topic of the first message that the bus refuses, and why; the others go out the next time.
    pub(super) fn report(
        &mut self,
        healers: &[Healer],
        is_others: impl Fn(&str) -> bool,
        now: Time,
        bridge: &mut dyn Bridge,
    ) -> Result<(), (String, BridgeError)> {
        if bridge.link() != Link::Up {
            return Ok(());
        }
        let is_due = now >= self.next;
        if is_due {
            self.next = now + WRITTEN_EVERY;
            self.forget();
        }
        self.describe(healers);
        self.observe(healers, is_others, is_due, now);
        for _ in 0..AT_ONCE {
            let Some(((_, topic), text)) = self.waiting.pop_first() else { break };
            let payload = Payload::Bytes(text.clone().into());
            let stamp = bridge.inbox().clock().by_wall(now);
            let message = Outgoing { retain: true, ..Outgoing::new(&topic, stamp, payload) };
            if let Err(error) = bridge.publish(message) {
                return Err((topic, error));
            }
            match text.is_empty() {
                true => drop(self.told.remove(&topic)),
                false => drop(self.told.insert(topic, text)),
            }
        }
        Ok(())
    }

    /// Forgets what is retained, if that may be lost.
    fn forget(&mut self) {
        if std::mem::take(&mut self.is_lost) {
            self.told.clear();
            self.standing.clear();
            self.models.iter_mut().for_each(|described| described.version = None);
        }
    }

    /// Has a message sent, unless it is retained already.
    fn tell(&mut self, stage: Stage, topic: &str, text: String) {
        if self.told.get(topic).map_or("", |told| told) == text && !text.is_empty() {
            self.waiting.remove(&(stage, topic.to_owned()));
        } else {
            self.waiting.insert((stage, topic.to_owned()), text);
        }
    }

    /// Describes the entities of models that have changed, and removes those that are no more.
    fn describe(&mut self, healers: &[Healer]) {
        let version = |healer: &Healer| Some(healer.engine().knowledge().version());
        let known = self.models.iter().map(|described| described.version);
        if known.eq(healers.iter().map(version)) {
            return;
        }
        let Discovery { prefix, instance, .. } = &*self;
        let describe = |healer: &Healer| {
            let place = Place { prefix, instance, model: healer.name() };
            let (needs, signals) = (Entity::needs(place, healer), Entity::signals(place, healer));
            Described { version: version(healer), needs, signals }
        };
        let models: Vec<_> = healers.iter().map(describe).collect();
        let before = std::mem::replace(&mut self.models, models);
        let now: Vec<Entity> = self.models.iter().flat_map(Described::all).cloned().collect();
        let ids: BTreeSet<&str> = now.iter().map(|entity| &*entity.id).collect();
        let all = before.iter().flat_map(Described::all);
        for Entity { id, topic, state_topic, .. } in all.filter(|entity| !ids.contains(&*entity.id)) {
            self.tell(Stage::Configuration, topic, String::new());
            self.tell(Stage::State, state_topic, String::new());
            self.because.remove(id);
            self.standing.remove(id);
        }
        for Entity { topic, configuration, .. } in now {
            self.tell(Stage::Configuration, &topic, configuration);
        }
    }

    /// Writes the states: those whose standing has changed, and values when they are due.
    fn observe(&mut self, healers: &[Healer], is_others: impl Fn(&str) -> bool, is_due: bool, now: Time) {
        let models = std::mem::take(&mut self.models);
        for (Described { needs, signals, .. }, healer) in models.iter().zip(healers) {
            let knowledge = healer.engine().knowledge();
            for (entity, (need, outlet)) in needs.iter().zip(healer.outlets()) {
                let (quality, is_others) = (outlet.quality(now), is_others(outlet.topic()));
                if self.stands(entity, Standing::Need(quality, is_others)) && !is_due {
                    continue;
                }
                let is_here = quality != Quality::Bad && !is_others;
                let because = self.because.get(&entity.id);
                let state = entity::need(outlet, entity::shape(knowledge, need), is_here, quality, because);
                self.tell(Stage::State, &entity.state_topic, state.to_string());
            }
            for (entity, signal) in signals.iter().zip(knowledge.signals().ids()) {
                let verdict = Verdict::on(signal, healer);
                if self.stands(entity, Standing::Signal(verdict)) {
                    continue;
                }
                let state = entity::signal(verdict, self.because.get(&entity.id));
                self.tell(Stage::State, &entity.state_topic, state.to_string());
            }
        }
        self.models = models;
    }

    /// Whether a state was written for this already.
    fn stands(&mut self, entity: &Entity, standing: Standing) -> bool {
        self.standing.insert(entity.id.clone(), standing) == Some(standing)
    }
}

impl Described {
    fn all(&self) -> impl Iterator<Item = &Entity> {
        self.needs.iter().chain(&self.signals)
    }
}
