//! Parts of the knowledge: every instance announces what it knows, and joins what others know about the same things.
//!
//! An instance holds the token `shsa/parts/INSTANCE/MODEL/HASH` while it is there and answers queries of
//! `shsa/parts/INSTANCE/MODEL` with the model's text, without needs. Parts come from strangers: they are bounded, checked as
//! every model is, and add only what is not known yet. Where one contradicts what is known, it is not joined, and it is told why.
//! All join in the order of the parts' names, so that those who know the same before know the same afterwards.

mod joining;

use super::healer::Healer;
use super::inputs::Inputs;
use super::ownership::{hash, instance};
use crate::error::{Context, RuntimeError};
use joining::{Entry, Joins, entries};
use serde_json::{Value, json};
use shsa_bridge::{Attendance, Bridge, BridgeError, Presence, Question};
use shsa_core::knowledge::{Draft, Severity};
use shsa_core::time::{Span, Time};
use shsa_format::model::live::{Live, Written};
use shsa_format::model::write;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex, PoisonError};

/// What all names begin with.
const PARTS: &str = "shsa/parts";
/// How long a part outlasts its instance: a connection may come back, and what it brought may be in use.
const GRACE: Span = Span::from_millis(5_000);
/// When nobody answers, it is asked again.
const PATIENCE: Span = Span::from_millis(5_000);
/// The shortest time between two changes of what is joined.
const PACE: Span = Span::from_millis(1_000);
/// The longest text of a part, bytes.
const LONGEST: usize = 256 * 1024;
/// The most variables, constants, functions, relations and signals of a part together.
const MOST_ENTRIES: usize = 1_000;
/// The most parts that are looked at; others are not asked for.
const MOST_PARTS: usize = 32;

/// What we announce, and what others do.
pub(super) struct Federation {
    /// What we are called, unique on the network.
    instance: String,
    attendance: Attendance,
    ours: Vec<Announced>,
    /// By `INSTANCE/MODEL`.
    offers: BTreeMap<String, Offer>,
    /// What each of our models has of others.
    joins: Vec<Joins>,
    /// Whether the offers are not what they were when they were joined last.
    has_changed: bool,
    /// Until then they are not joined again: who comes and goes all the time must not keep us busy.
    next: Time,
    is_full: bool,
}

/// Our part of one model.
struct Announced {
    text: Arc<Mutex<String>>,
    hash: String,
    _token: Option<Box<dyn Send>>,
}

/// A part of somebody else.
struct Offer {
    hash: String,
    /// What it says, and of which hash: what it said before stands until it is known what it says now.
    said: Option<(String, Draft)>,
    asked: Option<(Time, Receiver<Vec<u8>>)>,
    /// Since when its instance is gone.
    gone: Option<Time>,
}

impl Offer {
    fn is_known(&self) -> bool {
        self.said.as_ref().is_some_and(|(hash, _)| *hash == self.hash)
    }
}

/// Something to tell: its kind, and what has happened.
pub(super) type Note = (&'static str, String);

impl Federation {
    /// `None` where the bus does not tell who is there.
    ///
    /// # Errors
    /// When a name cannot be part of a key.
    pub(super) fn new(
        name: &str,
        healers: &[Healer],
        bridge: &mut dyn Bridge,
    ) -> Result<Option<Federation>, RuntimeError> {
        let attendance = bridge.attendance(&format!("{PARTS}/**")).context("looking for parts of others")?;
        let Some(attendance) = attendance else { return Ok(None) };
        let instance = instance(name, bridge);
        let ours = healers.iter().map(|healer| announced(&instance, healer, bridge));
        Ok(Some(Federation {
            ours: ours.collect::<Result<_, RuntimeError>>()?,
            joins: healers.iter().map(|_| Joins::default()).collect(),
            instance,
            attendance,
            offers: BTreeMap::new(),
            has_changed: false,
            next: Time::MIN,
            is_full: false,
        }))
    }

    /// Announces what we know now, takes in what others do, and joins it; what is to be told of that.
    ///
    /// # Errors
    /// When a name cannot be part of a key.
    pub(super) fn follow(
        &mut self,
        now: Time,
        healers: &mut [Healer],
        bridge: &dyn Bridge,
    ) -> Result<Vec<Note>, BridgeError> {
        let mut notes = Vec::new();
        while let Some(presence) = (self.attendance)() {
            notes.extend(self.take_in(&presence, now));
        }
        notes.extend(self.ask(now, bridge)?);
        self.forget(now);
        let is_due = self.has_changed && now >= self.next;
        if is_due {
            (self.has_changed, self.next) = (false, now + PACE);
        }
        for (at, healer) in healers.iter_mut().enumerate() {
            let version = Some(healer.version());
            let joins = &mut self.joins[at];
            if is_due || joins.version != version {
                joins.settle(healer, &self.offers, now, &mut notes);
                joins.version = Some(healer.version());
                self.ours[at].announce(&self.instance, healer, bridge)?;
            }
        }
        Ok(notes)
    }

    fn take_in(&mut self, presence: &Presence, now: Time) -> Option<Note> {
        let (Presence::Alive(token) | Presence::Gone(token)) = presence;
        let (name, hash) = token.strip_prefix(PARTS)?.strip_prefix('/')?.rsplit_once('/')?;
        let instance = name.split('/').next()?;
        if instance == self.instance {
            return None;
        }
        let is_room = self.offers.len() < MOST_PARTS;
        let known = self.offers.get_mut(name);
        match (presence, known) {
            (Presence::Alive(_), Some(offer)) => {
                offer.gone = None;
                if offer.hash != hash {
                    (offer.hash, offer.asked) = (hash.to_owned(), None);
                }
            }
            (Presence::Alive(_), None) if is_room => {
                let offer = Offer { hash: hash.to_owned(), said: None, asked: None, gone: None };
                self.offers.insert(name.to_owned(), offer);
            }
            (Presence::Alive(_), None) => {
                let is_told = std::mem::replace(&mut self.is_full, true);
                let why = format!(
                    "there are more than {MOST_PARTS} parts; {name} and further ones are not looked at"
                );
                return (!is_told).then_some(("refused", why));
            }
            (Presence::Gone(_), Some(offer)) if offer.hash == hash => offer.gone = Some(now),
            (Presence::Gone(_), _) => {}
        }
        None
    }

    /// Asks for what is not known yet, and takes the answers in.
    fn ask(&mut self, now: Time, bridge: &dyn Bridge) -> Result<Vec<Note>, BridgeError> {
        let mut notes = Vec::new();
        for (name, offer) in self.offers.iter_mut().filter(|(_, offer)| !offer.is_known()) {
            let answer = offer.asked.as_ref().and_then(|(_, answers)| answers.try_recv().ok());
            match answer.map(|bytes| read(name, &offer.hash, &bytes)) {
                Some(read) => {
                    // What cannot be joined is as good as empty, until it says something else.
                    let draft = read.unwrap_or_else(|why| {
                        notes.push(("refused", format!("the part {name} is not joined: {why}")));
                        Draft::default()
                    });
                    offer.said = Some((offer.hash.clone(), draft));
                    self.has_changed = true;
                }
                None if offer.asked.as_ref().is_none_or(|(at, _)| now - *at >= PATIENCE) => {
                    let (sender, answers) = channel();
                    let take = move |bytes: Vec<u8>| drop(sender.send(bytes));
                    bridge.ask(&format!("{PARTS}/{name}"), LONGEST, Box::new(take))?;
                    offer.asked = Some((now, answers));
                }
                None => {}
            }
        }
        Ok(notes)
    }

    /// What each part has brought to one of our models or another.
    pub(super) fn state(&self) -> Value {
        let brought = self.joins.iter().flat_map(|joins| &joins.brought);
        let names = |entries: &BTreeSet<Entry>| -> Vec<String> {
            entries.iter().map(|(section, name)| format!("{} {name}", section.singular())).collect()
        };
        let parts = brought.map(|(name, entries)| (name.clone(), json!(names(entries))));
        parts.collect::<serde_json::Map<_, _>>().into()
    }

    /// Lets go of the parts whose instances have been gone for too long.
    fn forget(&mut self, now: Time) {
        let before = self.offers.len();
        self.offers.retain(|_, offer| offer.gone.is_none_or(|since| now - since < GRACE));
        self.has_changed |= self.offers.len() < before;
    }
}

impl Announced {
    /// Says what we know now, if that has changed.
    fn announce(&mut self, instance: &str, healer: &Healer, bridge: &dyn Bridge) -> Result<(), BridgeError> {
        let text = write::yaml(&without_needs(healer.own()));
        let hash = hash_of(&text);
        if hash == self.hash {
            return Ok(());
        }
        *self.text.lock().unwrap_or_else(PoisonError::into_inner) = text;
        self._token = bridge.attend(&format!("{PARTS}/{instance}/{}/{hash}", healer.name()))?;
        self.hash = hash;
        Ok(())
    }
}

/// Answers with the part of a model from now on; nothing is announced yet.
fn announced(instance: &str, healer: &Healer, bridge: &mut dyn Bridge) -> Result<Announced, RuntimeError> {
    let text: Arc<Mutex<String>> = Arc::default();
    let told = text.clone();
    let tell = move |question: Question| {
        // Only who has asked gets it: it is long.
        if !question.is_addressed {
            return;
        }
        let text = told.lock().unwrap_or_else(PoisonError::into_inner).clone();
        question.answer(text.into());
    };
    let name = format!("{PARTS}/{instance}/{}", healer.name());
    bridge.serve(&name, &format!("{name}/answer"), Arc::new(tell)).context("announcing what is known")?;
    let mut announced = Announced { text, hash: String::new(), _token: None };
    announced.announce(instance, healer, bridge)?;
    Ok(announced)
}

fn hash_of(text: &str) -> String {
    format!("{:016x}", hash(text.bytes()))
}

fn without_needs(draft: &Draft) -> Draft {
    Draft { needs: Vec::new(), utility: None, ..draft.clone() }
}

/// What a part says, if it can be one.
fn read(name: &str, announced: &str, bytes: &[u8]) -> Result<Draft, String> {
    let text = std::str::from_utf8(bytes).map_err(|_| "it is no text".to_owned())?;
    if hash_of(text) != announced {
        return Err("its text is not the one that was announced".to_owned());
    }
    let (live, _) = Live::load(Written { name, text }).map_err(|report| {
        let first = report.diagnostics.iter().find(|found| found.severity == Severity::Error);
        first.map_or("it is no model".to_owned(), |found| found.message.clone())
    })?;
    let count = entries(live.draft()).len();
    if count > MOST_ENTRIES {
        return Err(format!("it has {count} entries, more than {MOST_ENTRIES}"));
    }
    Inputs::new(live.knowledge()).map_err(|why| why.chain())?;
    Ok(without_needs(live.draft()))
}
