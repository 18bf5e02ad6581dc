//! Several instances on one network share the needs: one of the able instances serves each need.
//!
//! An instance that can serve a need holds a token for it, which vanishes with the instance. After the need's probation it holds
//! a second token. All instances see the same tokens and choose by the same rule, without asking: the owner has the highest hash
//! of name and need among the holders of both tokens, else among the holders of the first. An instance just started does not know
//! yet which signals are wrong, so it takes no need from an instance that serves it; it takes the first token only if nobody else
//! holds one. When a divided network is whole again, the instances that served the same need see each other's tokens, and all but
//! one stop.
//!
//! A token alone gives no need away and keeps none: see [`watch`].

mod watch;

use crate::error::{Context, RuntimeError};
use shsa_bridge::{Attendance, Bridge, BridgeError, Presence, PublisherId};
use shsa_core::time::{Span, Time};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};
use watch::Watch;

/// The prefix of the tokens of able instances; the instance and the need's name on the bus follow.
const ABLE: &str = "shsa/healer";
/// The prefix of the tokens of settled instances.
const SETTLED: &str = "shsa/settled";
/// The most instances whose marks are remembered after they are gone.
const MET_MAX: usize = 1024;

/// The owner of each need.
pub(super) struct Ownership {
    /// Our name, unique on the network.
    instance: String,
    attendances: [Attendance; 2],
    /// The able instances, by the need's name on the bus.
    able: BTreeMap<String, BTreeSet<String>>,
    /// The settled instances, by the need's name on the bus.
    settled: BTreeMap<String, BTreeSet<String>>,
    /// Our tokens, by need.
    tokens: BTreeMap<String, Tokens>,
    /// The needs that this instance serves.
    ours: BTreeSet<String>,
    /// What is heard under the names of needs, where this instance hears it.
    watches: BTreeMap<String, Watch>,
    /// Whether another instance was heard under the name of a need that this one serves, since [`Ownership::follow`].
    has_news: bool,
    /// The marks of all instances that have held a token: their last values may arrive after they are gone.
    met: BTreeSet<u32>,
    /// Whether the middleware shows who publishes.
    shows_publishers: bool,
}

/// Our tokens for a need.
struct Tokens {
    _able: Box<dyn Send>,
    settled: Option<Box<dyn Send>>,
}

/// Whether this instance can serve a need.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ability {
    /// There is no fresh value.
    Unable,
    /// There are values, but only since a moment, or they are uncertain.
    Able,
    /// There have been sound values for the probation.
    Settled,
}

/// A change of a need's owner.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Handover {
    /// This instance serves the need now; `unheard`: the instance that should serve it, whose values do not arrive.
    Taken { need: String, unheard: Option<String> },
    /// The instance `to` serves the need now.
    Given { need: String, to: String },
}

impl Ownership {
    /// `None` where the bus does not list the present instances.
    ///
    /// # Errors
    /// When the name cannot be part of a token.
    pub(super) fn new(name: &str, bridge: &dyn Bridge) -> Result<Option<Ownership>, RuntimeError> {
        let look =
            |tokens: &str| bridge.attendance(&format!("{tokens}/**")).context("looking for other instances");
        // The settled tokens are looked up first, so that no settled instance is mistaken for a new one.
        let (settled, able) = (look(SETTLED)?, look(ABLE)?);
        let instance = instance(name, bridge);
        Ok(settled.zip(able).map(|(settled, able)| Ownership {
            instance,
            attendances: [settled, able],
            able: BTreeMap::new(),
            settled: BTreeMap::new(),
            tokens: BTreeMap::new(),
            ours: BTreeSet::new(),
            watches: BTreeMap::new(),
            has_news: false,
            met: BTreeSet::new(),
            shows_publishers: bridge.knows_own(),
        }))
    }

    /// Whether what is published under the name of a need is heard here: it must not be older than `max_age`. `None`: it is not
    /// heard.
    pub(super) fn listen(&mut self, need: &str, max_age: Option<Span>) {
        let need = key(need);
        match max_age {
            Some(max_age) if !self.watches.get(need).is_some_and(|watch| watch.is_of(max_age)) => {
                self.watches.insert(need.to_owned(), Watch::new(max_age));
            }
            Some(_) => {}
            None => drop(self.watches.remove(need)),
        }
    }

    /// Takes in a message that another publisher has sent under the name of a need. Returns whether it is of an instance.
    pub(super) fn hear(&mut self, need: &str, publisher: Option<PublisherId>, now: Time) -> bool {
        let need = key(need);
        let publisher = publisher.map(short);
        if publisher.is_none() && self.shows_publishers {
            return false;
        }
        let mut others = self.able.get(need).into_iter().flatten().filter(|able| **able != self.instance);
        let is_able = others.any(|able| publisher.is_none() || mark_of(able) == publisher);
        if let Some(watch) = self.watches.get_mut(need).filter(|_| is_able) {
            watch.hear(publisher, now);
            self.has_news |= self.ours.contains(need);
        }
        publisher.map_or(is_able, |mark| self.met.contains(&mark))
    }

    /// This instance has a value for a need that it leaves to the owner.
    pub(super) fn want(&mut self, need: &str, now: Time) {
        self.watches.get_mut(key(need)).into_iter().for_each(|watch| watch.want(now));
    }

    /// Whether an instance with this identity has ever held a token.
    pub(super) fn has_met(&self, publisher: PublisherId) -> bool {
        self.met.contains(&short(publisher))
    }

    /// Whether another instance is heard beside this one, so that the owner has to be chosen now.
    pub(super) fn has_news(&self) -> bool {
        self.has_news
    }

    /// When an owner that is not heard is due to be replaced.
    pub(super) fn due(&self) -> Option<Time> {
        let others = self.watches.iter().filter(|(need, _)| !self.ours.contains(*need));
        others.filter_map(|(_, watch)| watch.due()).min()
    }

    /// Whether this instance serves a need; it stays the owner while no instance is able.
    pub(super) fn is_ours(&self, need: &str) -> bool {
        self.ours.contains(key(need))
    }

    /// Whether another instance serves a need.
    pub(super) fn is_others(&self, need: &str) -> bool {
        !self.is_ours(need) && self.able.get(key(need)).is_some_and(|able| !able.is_empty())
    }

    /// Whether an instance that serves needs has this identity.
    pub(super) fn is_instance(&self, publisher: PublisherId) -> bool {
        let mark = mark(publisher);
        self.able.values().flatten().any(|instance| instance.ends_with(&mark))
    }

    /// The able instances, the owner first.
    pub(super) fn able(&self, need: &str) -> Vec<&str> {
        let need = key(need);
        let settled = self.settled.get(need);
        let is_settled = |instance: &str| settled.is_some_and(|settled| settled.contains(instance));
        let mut able: Vec<&str> = self.able.get(need).into_iter().flatten().map(String::as_str).collect();
        able.sort_by_key(|instance| Reverse((is_settled(instance), rank(instance, need))));
        able
    }

    /// Announces our ability to serve a need.
    ///
    /// # Errors
    /// When the need's name cannot be part of a token.
    pub(super) fn announce(
        &mut self,
        need: &str,
        ability: Ability,
        bridge: &dyn Bridge,
    ) -> Result<(), BridgeError> {
        let need = key(need);
        let hold = |tokens: &str| bridge.attend(&format!("{tokens}/{}/{need}", self.instance));
        let others = self.able.get(need).into_iter().flatten().filter(|able| **able != self.instance);
        let held = self.tokens.get_mut(need);
        match (ability, held) {
            (Ability::Unable, _) => drop(self.tokens.remove(need)),
            (Ability::Able, None) if others.count() > 0 => {}
            (Ability::Settled, Some(held)) if held.settled.is_none() => held.settled = hold(SETTLED)?,
            (Ability::Able | Ability::Settled, None) => {
                let settled = if ability == Ability::Settled { hold(SETTLED)? } else { None };
                let tokens = hold(ABLE)?.map(|able| Tokens { _able: able, settled });
                self.tokens.extend(tokens.map(|tokens| (need.to_owned(), tokens)));
            }
            (Ability::Able, Some(held)) => held.settled = None,
            (Ability::Settled, Some(_)) => {}
        }
        Ok(())
    }

    /// Takes in instances that came or went; returns whether any did, and the changes of owners.
    pub(super) fn follow(&mut self, now: Time) -> (bool, Vec<Handover>) {
        self.has_news = false;
        let mut touched = BTreeSet::new();
        let Ownership { attendances: [settled_now, able_now], settled, able, met, .. } = self;
        for (attendance, tokens, all) in [(settled_now, SETTLED, settled), (able_now, ABLE, able)] {
            while let Some(presence) = attendance() {
                touched.extend(take_in(&presence, tokens, all, met));
            }
        }
        let is_news = !touched.is_empty();
        for need in &touched {
            let able = self.able.get(need);
            let is_known = |mark| able.into_iter().flatten().any(|able| mark_of(able) == Some(mark));
            self.watches.get_mut(need).into_iter().for_each(|watch| watch.forget(is_known));
        }
        let is_due = |(need, watch): (&String, &mut Watch)| {
            watch.is_due(self.ours.contains(need), now).then(|| need.clone())
        };
        touched.extend(self.watches.iter_mut().filter_map(is_due));
        (is_news, touched.into_iter().filter_map(|need| self.choose(need, now)).collect())
    }

    /// Where the values of others are heard, the owner by the tokens gets a need that this instance serves when it is heard, and this
    /// instance takes a need whose owner is not.
    fn choose(&mut self, need: String, now: Time) -> Option<Handover> {
        let able = self.able(&need);
        let first = (*able.first()?).to_owned();
        let (is_first, is_able) = (first == self.instance, able.contains(&&*self.instance));
        let is_ours = self.ours.contains(&need);
        let watch = self.watches.get(&need);
        let is_heard = |other: &&&str| watch.is_none_or(|watch| watch.hears(mark_of(other), now));
        let above = able.iter().take_while(|other| **other != self.instance);
        let heard = above.clone().find(is_heard).map(|other| (*other).to_owned());
        let unserved = self.watches.get_mut(&need).filter(|_| !is_ours);
        let is_unserved = unserved.is_some_and(|watch| watch.is_unserved(is_able, now));
        let handover = match heard {
            Some(to) if is_ours => Handover::Given { need: need.clone(), to },
            None | Some(_) if !is_ours && is_first => Handover::Taken { need: need.clone(), unheard: None },
            None | Some(_) if is_unserved => Handover::Taken { need: need.clone(), unheard: Some(first) },
            None | Some(_) => return None,
        };
        self.watches.get_mut(&need).into_iter().for_each(Watch::change_hands);
        if is_ours {
            self.ours.remove(&need);
        } else {
            self.ours.insert(need);
        }
        Some(handover)
    }
}

/// Adds or removes the holder of a token; returns the need of the token.
fn take_in(
    presence: &Presence,
    tokens: &str,
    all: &mut BTreeMap<String, BTreeSet<String>>,
    met: &mut BTreeSet<u32>,
) -> Option<String> {
    let (Presence::Alive(token) | Presence::Gone(token)) = presence;
    let (instance, need) = token.strip_prefix(tokens)?.strip_prefix('/')?.split_once('/')?;
    let holders = all.entry(need.to_owned()).or_default();
    met.extend(mark_of(instance).filter(|_| met.len() < MET_MAX));
    match presence {
        Presence::Alive(_) => holders.insert(instance.to_owned()),
        Presence::Gone(_) => holders.remove(instance),
    };
    Some(need.to_owned())
}

/// The name of an instance, unique on the network.
pub(super) fn instance(name: &str, bridge: &dyn Bridge) -> String {
    format!("{name}{}", mark(bridge.publisher()))
}

/// The suffix that makes an instance's name unique: a part of its identity on the bus.
fn mark(publisher: PublisherId) -> String {
    format!(".{:08x}", short(publisher))
}

/// The part of an identity that is in an instance's name.
fn short(publisher: PublisherId) -> u32 {
    (publisher.0 & 0xffff_ffff) as u32
}

/// The mark of an instance's name; names come from strangers.
fn mark_of(instance: &str) -> Option<u32> {
    u32::from_str_radix(instance.rsplit_once('.')?.1, 16).ok()
}

/// The part of a token that names the need.
fn key(need: &str) -> &str {
    need.trim_matches('/')
}

/// The rank of an instance for a need, equal on all instances; it spreads the needs over the instances. It depends on the name,
/// so a restarted instance gets the same needs; among equal names, the unique suffix decides.
fn rank<'i>(instance: &'i str, need: &str) -> (u64, &'i str) {
    let name = instance.rsplit_once('.').map_or(instance, |(name, _)| name);
    let hash = hash(name.bytes().chain([0]).chain(need.bytes()));
    // Names that differ only in the last letter have similar hashes without this last mixing.
    let mixed = (hash ^ (hash >> 32)).wrapping_mul(0xd6e8_feb8_6659_fd93);
    (mixed ^ (mixed >> 32), instance)
}

/// FNV-1a: the same on every machine, not for secrets.
pub(super) fn hash(bytes: impl Iterator<Item = u8>) -> u64 {
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

#[cfg(test)]
mod tests;
