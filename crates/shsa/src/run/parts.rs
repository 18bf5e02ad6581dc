//! Parts of the knowledge: every instance announces what it knows, and joins what others know about the same things.
//!
//! An instance holds the token `shsa/parts/INSTANCE/MODEL/HASH` while it is there and answers queries of
//! `shsa/parts/INSTANCE/MODEL` with the model's text, without needs. Parts come from strangers: they are bounded, checked as
//! every model is, and add only what is not known yet. Where one contradicts what is known, it is not joined, and it is told why.
//! All join in the order of the parts' names, so that those who know the same before know the same afterwards.

use super::healer::Healer;
use super::shares::{hash, instance};
use super::wires::Wires;
use anyhow::Context;
use serde_json::{Value, json};
use shsa_bridge::{Attendance, Bridge, BridgeError, Presence, Question};
use shsa_core::knowledge::{self, Draft, Model, Section, Severity};
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

/// A name in its section.
type Entry = (Section, String);

/// What we announce, and what others do.
pub(super) struct Parts {
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

/// What one of our models has of others.
#[derive(Default)]
struct Joins {
    /// The version of our knowledge that the parts were joined with.
    version: Option<u64>,
    /// What each part has brought.
    brought: BTreeMap<String, BTreeSet<Entry>>,
    /// Parts that could not be joined, and why.
    refused: BTreeMap<String, String>,
}

/// Something to tell: its kind, and what has happened.
pub(super) type Note = (&'static str, String);

impl Parts {
    /// `None` where the bus does not tell who is there.
    ///
    /// # Errors
    /// When a name cannot be part of a key.
    pub(super) fn new(
        name: &str,
        healers: &[Healer],
        bridge: &mut dyn Bridge,
    ) -> anyhow::Result<Option<Parts>> {
        let attendance = bridge.attendance(&format!("{PARTS}/**")).context("looking for parts of others")?;
        let Some(attendance) = attendance else { return Ok(None) };
        let instance = instance(name, bridge);
        let ours = healers.iter().map(|healer| announced(&instance, healer, bridge));
        Ok(Some(Parts {
            ours: ours.collect::<anyhow::Result<_>>()?,
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
fn announced(instance: &str, healer: &Healer, bridge: &mut dyn Bridge) -> anyhow::Result<Announced> {
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
    Wires::new(live.knowledge()).map_err(|why| format!("{why:#}"))?;
    Ok(without_needs(live.draft()))
}

impl Joins {
    /// Joins what is offered to what a healer knows of its own.
    fn settle(
        &mut self,
        healer: &mut Healer,
        offers: &BTreeMap<String, Offer>,
        now: Time,
        notes: &mut Vec<Note>,
    ) {
        let known = offers.iter().filter_map(|(name, offer)| Some((name.as_str(), &offer.said.as_ref()?.1)));
        let Settled { whole, brought, refused } = settle(healer.own(), &known.collect());
        let after = entries(&whole);
        if let Err(why) = healer.join(&whole, now) {
            notes.push(("refused", format!("the parts of others are not joined: {why}")));
            return;
        }
        let before: BTreeSet<&Entry> = self.brought.values().flatten().collect();
        for (name, entries) in &brought {
            let new = entries.iter().filter(|entry| !before.contains(entry));
            let text = told(new).map(|new| format!("{new} is known from {name} from now on"));
            notes.extend(text.map(|text| ("joined", text)));
        }
        for (name, entries) in &self.brought {
            let lost = entries.iter().filter(|entry| !after.contains(*entry));
            let text =
                told(lost).map(|lost| format!("{lost} is not known any more: {name} has gone or changed"));
            notes.extend(text.map(|text| ("parted", text)));
        }
        for (name, why) in refused.iter().filter(|(name, why)| self.refused.get(*name) != Some(why)) {
            notes.push(("refused", format!("the part {name} is not joined: {why}")));
        }
        (self.brought, self.refused) = (brought, refused);
    }
}

/// `signal gnss, relation steered`; of many, how many more. `None` of none.
fn told<'e>(entries: impl DoubleEndedIterator<Item = &'e Entry> + Clone) -> Option<String> {
    const SHOWN: usize = 6;
    let names = entries.clone().rev().take(SHOWN);
    let mut names: Vec<String> =
        names.map(|(section, name)| format!("{} {name}", section.singular())).collect();
    let more = entries.count().saturating_sub(SHOWN);
    if more > 0 {
        names.push(format!("{more} more"));
    }
    (!names.is_empty()).then(|| names.join(", "))
}

/// Parts joined to our own knowledge.
struct Settled {
    whole: Draft,
    brought: BTreeMap<String, BTreeSet<Entry>>,
    refused: BTreeMap<String, String>,
}

/// Joins the parts that name a variable that is known, in the order of their names, again and again until none is left: one
/// part may know what connects another.
fn settle(own: &Draft, parts: &BTreeMap<&str, &Draft>) -> Settled {
    let mut settled = Settled { whole: own.clone(), brought: BTreeMap::new(), refused: BTreeMap::new() };
    let mut left: Vec<(&str, &Draft)> = parts.iter().map(|(name, part)| (*name, *part)).collect();
    loop {
        let known: BTreeSet<&str> = names(&settled.whole);
        let is_related = |(_, part): &(&str, &Draft)| names(part).iter().any(|name| known.contains(name));
        let Some(at) = left.iter().position(is_related) else { return settled };
        let (name, part) = left.remove(at);
        match joined(&settled.whole, part) {
            Ok((_, entries)) if entries.is_empty() => {}
            Ok((whole, entries)) => {
                settled.whole = whole;
                settled.brought.insert(name.to_owned(), entries);
            }
            Err(why) => drop(settled.refused.insert(name.to_owned(), why)),
        }
    }
}

fn names(draft: &Draft) -> BTreeSet<&str> {
    draft.variables.iter().map(|variable| variable.name.text.as_str()).collect()
}

/// What is known with a part, and what the part has brought. What is known already stays as it is, in every detail.
fn joined(whole: &Draft, part: &Draft) -> Result<(Draft, BTreeSet<Entry>), String> {
    knowledge::join(&[whole.clone(), part.clone()]).map_err(|found| {
        found.first().map_or_else(String::new, |found| format!("{}; ours stays", found.message))
    })?;
    let known = entries(whole);
    let is_new = |section: Section, name: &str| !known.contains(&(section, name.to_owned()));
    let mut next = whole.clone();
    let Draft { variables, constants, functions, relations, signals, .. } = part.clone();
    next.variables.extend(variables.into_iter().filter(|it| is_new(Section::Variables, &it.name.text)));
    next.constants.extend(constants.into_iter().filter(|it| is_new(Section::Constants, &it.0.text)));
    next.functions.extend(functions.into_iter().filter(|it| is_new(Section::Functions, head(&it.0.text))));
    next.relations.extend(relations.into_iter().filter(|it| is_new(Section::Relations, &it.name.text)));
    next.signals.extend(signals.into_iter().filter(|it| is_new(Section::Signals, &it.name.text)));
    let brought = entries(&next).difference(&known).cloned().collect();
    match Model::new(next.clone()) {
        Ok(_) => Ok((next, brought)),
        Err(found) => {
            let wrong = found.into_iter().find(|found| found.severity == Severity::Error);
            Err(wrong.map_or_else(String::new, |found| found.message))
        }
    }
}

/// Every name of a draft but those of needs.
fn entries(draft: &Draft) -> BTreeSet<Entry> {
    let variables = draft.variables.iter().map(|it| (Section::Variables, it.name.text.as_str()));
    let constants = draft.constants.iter().map(|it| (Section::Constants, it.0.text.as_str()));
    let functions = draft.functions.iter().map(|it| (Section::Functions, head(&it.0.text)));
    let relations = draft.relations.iter().map(|it| (Section::Relations, it.name.text.as_str()));
    let signals = draft.signals.iter().map(|it| (Section::Signals, it.name.text.as_str()));
    let all = variables.chain(constants).chain(functions).chain(relations).chain(signals);
    all.map(|(section, name)| (section, name.to_owned())).collect()
}

/// The name of a function: `clamp` of `clamp(x)`.
fn head(text: &str) -> &str {
    text.split('(').next().unwrap_or_default().trim()
}

#[cfg(test)]
mod tests {
    use super::*;

    const OWN: &str = "
shsa: 1
variables: { speed: { unit: m/s } }
signals: { wheel: { variable: speed, unit: m/s, rate: 10 Hz } }
needs: { speed: { signal: /speed } }
";

    fn draft(text: &str) -> Draft {
        let (live, _) = Live::load(Written { name: "a", text })
            .unwrap_or_else(|report| panic!("{}", report.render(false)));
        without_needs(live.draft())
    }

    fn part(rest: &str) -> Draft {
        draft(&format!("shsa: 1\n{rest}"))
    }

    /// What comes of our own part and these, by name.
    #[track_caller]
    fn check(parts: &[(&str, &Draft)], brought: &[&str], refused: &[(&str, &str)]) -> Settled {
        let settled = settle(&draft(OWN), &parts.iter().copied().collect());
        assert_eq!(settled.brought.keys().collect::<Vec<_>>(), brought, "{:?}", settled.refused);
        assert_eq!(settled.refused.len(), refused.len(), "{:?}", settled.refused);
        for (name, why) in refused {
            assert!(settled.refused[*name].contains(why), "{:?}", settled.refused);
        }
        settled
    }

    #[test]
    fn what_names_a_known_variable_is_joined_with_all_that_hangs_on_it() {
        let near = part(
            "variables: { speed: { unit: m/s }, rpm: { unit: Hz } }\nrelations: { gear: { equation: speed = 0.1 m * rpm } }",
        );
        let far = part(
            "variables: { rpm: { unit: Hz } }\nsignals: { tacho: { variable: rpm, unit: Hz, rate: 10 Hz } }",
        );
        let other = part(
            "variables: { height: { unit: m } }\nsignals: { baro: { variable: height, unit: m, rate: 10 Hz } }",
        );
        // The one that connects has the later name.
        let settled = check(&[("a", &far), ("b", &near), ("c", &other)], &["a", "b"], &[]);
        assert_eq!(told(settled.brought["a"].iter()).unwrap(), "signal tacho");
        assert_eq!(told(settled.brought["b"].iter()).unwrap(), "relation gear, variable rpm");
        check(&[("a", &far), ("c", &other)], &[], &[]);
    }

    #[test]
    fn what_contradicts_is_refused_and_ours_stays() {
        let unit = part(
            "variables: { speed: { unit: km/h } }\nsignals: { gnss: { variable: speed, unit: m/s, rate: 10 Hz } }",
        );
        let name = part(
            "variables: { speed: { unit: m/s } }\nsignals: { wheel: { variable: speed, unit: m/s, rate: 99 Hz } }",
        );
        let right = part(
            "variables: { speed: { unit: m/s } }\nsignals: { gnss: { variable: speed, unit: m/s, rate: 10 Hz } }",
        );
        let settled = check(
            &[("a", &unit), ("b", &name), ("c", &right)],
            &["c"],
            &[("a", "`speed` differently"), ("b", "`wheel` differently")],
        );
        assert!(
            write::yaml(&settled.whole)
                .starts_with(write::yaml(&draft(OWN)).split("signals:").next().unwrap())
        );
    }

    #[test]
    fn a_part_adds_no_detail_to_what_is_known() {
        let more = part(
            "variables: { speed: { unit: m/s, range: [0, 1] } }\nsignals: { gnss: { variable: speed, unit: m/s, rate: 10 Hz } }",
        );
        let settled = check(&[("a", &more)], &["a"], &[]);
        assert!(settled.whole.variables[0].range.is_none());
    }

    #[test]
    fn the_same_parts_give_the_same_knowledge_in_whatever_order_they_came() {
        let one = part(
            "variables: { speed: { unit: m/s } }\nsignals: { one: { variable: speed, unit: m/s, rate: 10 Hz } }",
        );
        let two = part(
            "variables: { speed: { unit: m/s } }\nsignals: { two: { variable: speed, unit: m/s, rate: 10 Hz } }",
        );
        let text = |parts: &[(&str, &Draft)]| write::yaml(&check(parts, &["a", "b"], &[]).whole);
        assert_eq!(text(&[("a", &one), ("b", &two)]), text(&[("b", &two), ("a", &one)]));
    }

    #[test]
    fn strangers_texts_are_bounded_and_checked() {
        let many: String = (0..=MOST_ENTRIES).map(|n| format!("v{n}: {{}}, ")).collect();
        let many = format!("shsa: 1\nvariables: {{ {many} }}");
        for (text, why) in [
            ("", "nothing in it"),
            ("shsa: 1\nvariables: 7", ""),
            ("shsa: 1\nvariables: { a: {} }\nsignals: { s: { variable: b } }", "b"),
            (many.as_str(), "entries, more than"),
        ] {
            let refused = read("a", &hash_of(text), text.as_bytes()).map(|_| ()).unwrap_err();
            assert!(refused.contains(why), "{refused}");
        }
        let text = write::yaml(&draft(OWN));
        assert!(read("a", "0", text.as_bytes()).unwrap_err().contains("not the one that was announced"));
        assert!(read("a", &hash_of(&text), text.as_bytes()).is_ok());
    }
}
