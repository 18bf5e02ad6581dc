//! Federation: every instance announces its model as a part, and joins the parts of other instances about the same variables.
//!
//! An instance holds the token `shsa/parts/INSTANCE/MODEL/HASH` while it is there and answers queries of
//! `shsa/parts/INSTANCE/MODEL` with the model's text, without needs. Parts come from strangers, so they are bounded and checked
//! like every model, and only add entries. A part that contradicts the known model is refused with the reason. All instances join
//! in the order of the parts' names, so equal knowledge stays equal.

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
use shsa_model::live::{Live, Written};
use shsa_model::write;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::mpsc::{Receiver, channel};
use std::sync::{Arc, Mutex, PoisonError};

/// The prefix of all names.
const PARTS: &str = "shsa/parts";
/// How long a part outlasts its instance: the connection may come back, and the part's entries may be in use.
const GRACE: Span = Span::from_millis(5_000);
/// An unanswered query is repeated after this time.
const PATIENCE: Span = Span::from_millis(5_000);
/// The shortest time between two changes of the joined model.
const PACE: Span = Span::from_millis(1_000);
/// The longest text of a part, bytes.
const LONGEST: usize = 256 * 1024;
/// The most variables, constants, functions, relations and signals of a part together.
const MOST_ENTRIES: usize = 1_000;
/// The largest number of parts; further ones are not asked for.
const MOST_PARTS: usize = 32;

/// Our parts, and the parts of other instances.
pub(super) struct Federation {
    /// Our name, unique on the network.
    instance: String,
    attendance: Attendance,
    ours: Vec<Announced>,
    /// By `INSTANCE/MODEL`.
    offers: BTreeMap<String, Offer>,
    /// For each of our models, its parts of others.
    joins: Vec<Joins>,
    /// Whether an offer has changed since the last join.
    has_changed: bool,
    /// The time of the next join: an instance that comes and goes all the time must not keep us busy.
    next: Time,
    is_full: bool,
}

/// Our part of one model.
struct Announced {
    text: Arc<Mutex<String>>,
    hash: String,
    _token: Option<Box<dyn Send>>,
}

/// A part of another instance.
struct Offer {
    hash: String,
    /// The hash and the content of the last text received. It stays in use until the text of the new hash has arrived.
    received_draft: Option<(String, Draft)>,
    asked: Option<(Time, Receiver<Vec<u8>>)>,
    /// Since when the instance of the part is gone.
    gone: Option<Time>,
}

impl Offer {
    fn is_known(&self) -> bool {
        self.received_draft.as_ref().is_some_and(|(hash, _)| *hash == self.hash)
    }
}

/// A note to report: its kind and its text.
pub(super) type Note = (&'static str, String);

impl Federation {
    /// `None` where the bus does not list the present instances.
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

    /// Announces our parts, takes in those of others and joins them; returns notes to report.
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
                let offer = Offer { hash: hash.to_owned(), received_draft: None, asked: None, gone: None };
                self.offers.insert(name.to_owned(), offer);
            }
            (Presence::Alive(_), None) => {
                let is_reported = std::mem::replace(&mut self.is_full, true);
                let why = format!(
                    "there are more than {MOST_PARTS} parts; {name} and further ones are not looked at"
                );
                return (!is_reported).then_some(("refused", why));
            }
            (Presence::Gone(_), Some(offer)) if offer.hash == hash => offer.gone = Some(now),
            (Presence::Gone(_), _) => {}
        }
        None
    }

    /// Asks for parts whose text is not known yet, and takes in the answers.
    fn ask(&mut self, now: Time, bridge: &dyn Bridge) -> Result<Vec<Note>, BridgeError> {
        let mut notes = Vec::new();
        for (name, offer) in self.offers.iter_mut().filter(|(_, offer)| !offer.is_known()) {
            let answer = offer.asked.as_ref().and_then(|(_, answers)| answers.try_recv().ok());
            match answer.map(|bytes| read(name, &offer.hash, &bytes)) {
                Some(read) => {
                    // An invalid part counts as empty until its text changes.
                    let draft = read.unwrap_or_else(|why| {
                        notes.push(("refused", format!("the part {name} is not joined: {why}")));
                        Draft::default()
                    });
                    offer.received_draft = Some((offer.hash.clone(), draft));
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

    /// The entries that each part has added to any of our models.
    pub(super) fn state(&self) -> Value {
        let brought = self.joins.iter().flat_map(|joins| &joins.brought);
        let names = |entries: &BTreeSet<Entry>| -> Vec<String> {
            entries.iter().map(|(section, name)| format!("{} {name}", section.singular())).collect()
        };
        let parts = brought.map(|(name, entries)| (name.clone(), json!(names(entries))));
        parts.collect::<serde_json::Map<_, _>>().into()
    }

    /// Drops the parts whose instances have been gone for too long.
    fn forget(&mut self, now: Time) {
        let before = self.offers.len();
        self.offers.retain(|_, offer| offer.gone.is_none_or(|since| now - since < GRACE));
        self.has_changed |= self.offers.len() < before;
    }
}

impl Announced {
    /// Announces our part if it has changed.
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

/// Serves the part of a model from now on, and announces it.
fn announced(instance: &str, healer: &Healer, bridge: &mut dyn Bridge) -> Result<Announced, RuntimeError> {
    let text: Arc<Mutex<String>> = Arc::default();
    let described = text.clone();
    let respond = move |question: Question| {
        // Only a query gets the text, because it is long.
        if !question.is_addressed {
            return;
        }
        let text = described.lock().unwrap_or_else(PoisonError::into_inner).clone();
        question.answer(text.into());
    };
    let name = format!("{PARTS}/{instance}/{}", healer.name());
    bridge.serve(&name, &format!("{name}/answer"), Arc::new(respond)).context("announcing what is known")?;
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

/// The draft of a part's text, if the text is a valid part.
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
