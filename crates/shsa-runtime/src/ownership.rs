//! Several instances on one network share the needs: each need is served by one of those that can.
//!
//! Who can serve a need holds a token of that name, which vanishes with its holder; who has done so for the need's probation
//! holds another one. All see the same tokens and choose by the same rule, so nobody has to be asked: of those with both tokens,
//! else of those with the first, the name whose hash with the need is highest. Who has just been started knows not yet who
//! lies: it takes nothing from anybody that serves, and its first token only where nobody else holds one. When a network that
//! was cut is whole again, those who served the same need meanwhile see each other's tokens, and all but one stop.

use crate::error::{Context, RuntimeError};
use shsa_bridge::{Attendance, Bridge, BridgeError, Presence, PublisherId};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

/// What the tokens of those who can serve a need begin with; then come the instance and the need's name on the bus.
const ABLE: &str = "shsa/healer";
/// And of those who have been able to for a while.
const SETTLED: &str = "shsa/settled";

/// Who serves what.
pub(super) struct Ownership {
    /// What we are called, unique on the network.
    instance: String,
    attendances: [Attendance; 2],
    /// Who can serve each need, by the need's name on the bus.
    able: BTreeMap<String, BTreeSet<String>>,
    /// Who has been able to for a while.
    settled: BTreeMap<String, BTreeSet<String>>,
    /// What we hold while we can serve a need.
    tokens: BTreeMap<String, Tokens>,
    /// The needs that we serve.
    ours: BTreeSet<String>,
}

/// The tokens that we hold for a need.
struct Tokens {
    _able: Box<dyn Send>,
    settled: Option<Box<dyn Send>>,
}

/// How far we can serve a need.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ability {
    /// There is no value for it.
    Unable,
    /// There are values, since a moment ago, or they are uncertain.
    Able,
    /// There have been values for a while.
    Settled,
}

/// Somebody else serves a need now.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Handover {
    /// We do.
    Taken { need: String },
    /// This instance does.
    Given { need: String, to: String },
}

impl Ownership {
    /// `None` where the bus does not tell who is there.
    ///
    /// # Errors
    /// When the name cannot be part of a token's.
    pub(super) fn new(name: &str, bridge: &dyn Bridge) -> Result<Option<Ownership>, RuntimeError> {
        let look =
            |tokens: &str| bridge.attendance(&format!("{tokens}/**")).context("looking for other instances");
        // What tells who is settled comes first: nobody is taken for a beginner who is none.
        let (settled, able) = (look(SETTLED)?, look(ABLE)?);
        let instance = instance(name, bridge);
        Ok(settled.zip(able).map(|(settled, able)| Ownership {
            instance,
            attendances: [settled, able],
            able: BTreeMap::new(),
            settled: BTreeMap::new(),
            tokens: BTreeMap::new(),
            ours: BTreeSet::new(),
        }))
    }

    /// Whether a need is ours to serve: it stays so while nobody can.
    pub(super) fn is_ours(&self, need: &str) -> bool {
        self.ours.contains(key(need))
    }

    /// Whether another instance serves a need.
    pub(super) fn is_others(&self, need: &str) -> bool {
        !self.is_ours(need) && self.able.get(key(need)).is_some_and(|able| !able.is_empty())
    }

    /// Whether an instance publishes under this identity.
    pub(super) fn is_instance(&self, publisher: PublisherId) -> bool {
        let mark = mark(publisher);
        self.able.values().flatten().any(|instance| instance.ends_with(&mark))
    }

    /// The instances that can serve a need, the one that does first.
    pub(super) fn able(&self, need: &str) -> Vec<&str> {
        let need = key(need);
        let settled = self.settled.get(need);
        let is_settled = |instance: &str| settled.is_some_and(|settled| settled.contains(instance));
        let mut able: Vec<&str> = self.able.get(need).into_iter().flatten().map(String::as_str).collect();
        able.sort_by_key(|instance| Reverse((is_settled(instance), rank(instance, need))));
        able
    }

    /// Says whether we can serve a need now.
    ///
    /// # Errors
    /// When the need's name cannot be part of a token's.
    pub(super) fn tell(
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

    /// Takes in who has come and gone: whether anybody has, and what that changes.
    pub(super) fn follow(&mut self) -> (bool, Vec<Handover>) {
        let mut touched = BTreeSet::new();
        let Ownership { attendances: [settled_now, able_now], settled, able, .. } = self;
        for (attendance, tokens, all) in [(settled_now, SETTLED, settled), (able_now, ABLE, able)] {
            while let Some(presence) = attendance() {
                touched.extend(take_in(&presence, tokens, all));
            }
        }
        (!touched.is_empty(), touched.into_iter().filter_map(|need| self.choose(need)).collect())
    }

    fn choose(&mut self, need: String) -> Option<Handover> {
        let chosen = self.able(&need).first().map(|first| (*first).to_owned())?;
        let is_ours = chosen == self.instance;
        match (is_ours, self.ours.contains(&need)) {
            (true, false) => {
                self.ours.insert(need.clone());
                Some(Handover::Taken { need })
            }
            (false, true) => {
                self.ours.remove(&need);
                Some(Handover::Given { need, to: chosen })
            }
            _ => None,
        }
    }
}

/// Who holds or has held a token, among those who do; the need that it is about.
fn take_in(
    presence: &Presence,
    tokens: &str,
    all: &mut BTreeMap<String, BTreeSet<String>>,
) -> Option<String> {
    let (Presence::Alive(token) | Presence::Gone(token)) = presence;
    let (instance, need) = token.strip_prefix(tokens)?.strip_prefix('/')?.split_once('/')?;
    let holders = all.entry(need.to_owned()).or_default();
    match presence {
        Presence::Alive(_) => holders.insert(instance.to_owned()),
        Presence::Gone(_) => holders.remove(instance),
    };
    Some(need.to_owned())
}

/// What an instance is called, unique on the network.
pub(super) fn instance(name: &str, bridge: &dyn Bridge) -> String {
    format!("{name}{}", mark(bridge.publisher()))
}

/// What makes an instance's name unique: a part of its identity on the bus.
fn mark(publisher: PublisherId) -> String {
    format!(".{:08x}", publisher.0 & 0xffff_ffff)
}

/// The part of a token's name that stands for a need.
fn key(need: &str) -> &str {
    need.trim_matches('/')
}

/// Spreads the needs over the instances, the same way everywhere: by the names, so that who is started again under its name
/// has the same share; among equal names by what makes them unique.
fn rank<'i>(instance: &'i str, need: &str) -> (u64, &'i str) {
    let name = instance.rsplit_once('.').map_or(instance, |(name, _)| name);
    let hash = hash(name.bytes().chain([0]).chain(need.bytes()));
    // Names that differ in their last letter only differ too little without a last round of mixing.
    let mixed = (hash ^ (hash >> 32)).wrapping_mul(0xd6e8_feb8_6659_fd93);
    (mixed ^ (mixed >> 32), instance)
}

/// FNV-1a, the same on every machine; not for secrets.
pub(super) fn hash(bytes: impl Iterator<Item = u8>) -> u64 {
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

#[cfg(test)]
mod tests;
