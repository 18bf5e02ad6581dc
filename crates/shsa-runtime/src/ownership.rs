//! Several instances on one network share the needs: each need is served by one of those that can.
//!
//! Who can serve a need holds a token of that name, which vanishes with its holder. All see the same tokens and choose by the
//! same rule, so nobody has to be asked: the name whose hash with the need is highest. When a network that was cut is whole
//! again, those who served the same need meanwhile see each other's tokens, and all but one stop.

use crate::error::{Context, RuntimeError};
use shsa_bridge::{Attendance, Bridge, BridgeError, Presence, PublisherId};
use std::collections::{BTreeMap, BTreeSet};

/// What all tokens begin with; then come the instance and the need's name on the bus.
const TOKENS: &str = "shsa/healer";

/// Who serves what.
pub(super) struct Ownership {
    /// What we are called, unique on the network.
    instance: String,
    attendance: Attendance,
    /// Who can serve each need, by the need's name on the bus.
    able: BTreeMap<String, BTreeSet<String>>,
    /// What we hold while we can serve a need.
    tokens: BTreeMap<String, Box<dyn Send>>,
    /// The needs that we serve.
    ours: BTreeSet<String>,
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
        let attendance = bridge.attendance(&format!("{TOKENS}/**")).context("looking for other instances")?;
        let instance = instance(name, bridge);
        Ok(attendance.map(|attendance| Ownership {
            instance,
            attendance,
            able: BTreeMap::new(),
            tokens: BTreeMap::new(),
            ours: BTreeSet::new(),
        }))
    }

    /// Whether a need is ours to serve.
    pub(super) fn is_ours(&self, need: &str) -> bool {
        self.ours.contains(key(need))
    }

    /// Whether an instance publishes under this identity.
    pub(super) fn is_instance(&self, publisher: PublisherId) -> bool {
        let mark = mark(publisher);
        self.able.values().flatten().any(|instance| instance.ends_with(&mark))
    }

    /// The instances that can serve a need, the one that does first.
    pub(super) fn able(&self, need: &str) -> Vec<&str> {
        let able = self.able.get(key(need)).into_iter().flatten();
        let mut able: Vec<&str> = able.map(String::as_str).collect();
        able.sort_by_key(|instance| std::cmp::Reverse(rank(instance, key(need))));
        able
    }

    /// Says whether we can serve a need now.
    ///
    /// # Errors
    /// When the need's name cannot be part of a token's.
    pub(super) fn tell(&mut self, need: &str, is_able: bool, bridge: &dyn Bridge) -> Result<(), BridgeError> {
        let need = key(need);
        if !is_able {
            self.tokens.remove(need);
        } else if !self.tokens.contains_key(need) {
            let token = bridge.attend(&format!("{TOKENS}/{}/{need}", self.instance))?;
            self.tokens.extend(token.map(|token| (need.to_owned(), token)));
        }
        Ok(())
    }

    /// Takes in who has come and gone, and tells what that changes.
    pub(super) fn follow(&mut self) -> Vec<Handover> {
        let mut touched = BTreeSet::new();
        while let Some(presence) = (self.attendance)() {
            touched.extend(self.take_in(&presence));
        }
        touched.into_iter().filter_map(|need| self.choose(need)).collect()
    }

    fn take_in(&mut self, presence: &Presence) -> Option<String> {
        let (Presence::Alive(token) | Presence::Gone(token)) = presence;
        let (instance, need) = token.strip_prefix(TOKENS)?.strip_prefix('/')?.split_once('/')?;
        let able = self.able.entry(need.to_owned()).or_default();
        match presence {
            Presence::Alive(_) => able.insert(instance.to_owned()),
            Presence::Gone(_) => able.remove(instance),
        };
        Some(need.to_owned())
    }

    fn choose(&mut self, need: String) -> Option<Handover> {
        let chosen = self.able(&need).first().map(|first| (*first).to_owned());
        let is_ours = chosen.as_deref() == Some(self.instance.as_str());
        match (is_ours, self.ours.contains(&need)) {
            (true, false) => {
                self.ours.insert(need.clone());
                Some(Handover::Taken { need })
            }
            (false, true) => {
                self.ours.remove(&need);
                chosen.map(|to| Handover::Given { need, to })
            }
            _ => None,
        }
    }
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
mod tests {
    use super::*;
    use shsa_bridge::memory::MemoryBus;
    use shsa_bridge::{Clock, Inbox, Link, Outgoing};
    use std::sync::{Arc, Mutex};

    /// A network that tells who is there.
    #[derive(Clone, Default)]
    struct Network(Arc<Mutex<Vec<Waiting>>>);

    /// What a member has not looked at yet.
    type Waiting = (u128, Vec<Presence>);

    struct Member {
        network: Network,
        id: u128,
        bus: shsa_bridge::memory::MemoryBridge,
    }

    struct Badge(Network, Arc<str>);

    impl Network {
        fn join(&self, id: u128) -> Member {
            Member { network: self.clone(), id, bus: MemoryBus::new(Clock::manual()).join(1) }
        }

        fn tell(&self, presence: &Presence) {
            self.0.lock().unwrap().iter_mut().for_each(|(_, waiting)| waiting.push(presence.clone()));
        }
    }

    impl Drop for Badge {
        fn drop(&mut self) {
            self.0.tell(&Presence::Gone(self.1.clone()));
        }
    }

    impl Bridge for Member {
        fn publisher(&self) -> PublisherId {
            PublisherId(self.id)
        }
        fn inbox(&self) -> &Inbox {
            self.bus.inbox()
        }
        fn subscribe(&mut self, _: &str, _: Option<&str>) -> Result<(), BridgeError> {
            Ok(())
        }
        fn subscribe_all(&mut self) -> Result<(), BridgeError> {
            Ok(())
        }
        fn publish(&mut self, _: Outgoing<'_>) -> Result<(), BridgeError> {
            Ok(())
        }
        fn link(&self) -> Link {
            Link::Up
        }
        fn attend(&self, name: &str) -> Result<Option<Box<dyn Send>>, BridgeError> {
            let name: Arc<str> = name.into();
            self.network.tell(&Presence::Alive(name.clone()));
            Ok(Some(Box::new(Badge(self.network.clone(), name))))
        }
        fn attendance(&self, _: &str) -> Result<Option<Attendance>, BridgeError> {
            let (network, id) = (self.network.clone(), self.id);
            network.0.lock().unwrap().push((id, Vec::new()));
            Ok(Some(Box::new(move || {
                let mut members = network.0.lock().unwrap();
                let (_, waiting) = members.iter_mut().find(|(member, _)| *member == id)?;
                (!waiting.is_empty()).then(|| waiting.remove(0))
            })))
        }
    }

    const NEEDS: [&str; 20] = [
        "/n/1", "/n/2", "/n/3", "/n/4", "/n/5", "/n/6", "/n/7", "/n/8", "/n/9", "/n/10", "/n/11", "/n/12",
        "/n/13", "/n/14", "/n/15", "/n/16", "/n/17", "/n/18", "/n/19", "/n/20",
    ];

    /// Instances that can serve every need.
    fn able(network: &Network, names: &[&str]) -> Vec<(Member, Ownership)> {
        let member = |(id, name): (usize, &&str)| {
            let member = network.join(id as u128);
            let shares = Ownership::new(name, &member).unwrap().unwrap();
            (member, shares)
        };
        let mut members: Vec<_> = names.iter().enumerate().map(member).collect();
        for (member, shares) in &mut members {
            NEEDS.iter().for_each(|need| shares.tell(need, true, member).unwrap());
        }
        members.iter_mut().for_each(|(_, shares)| drop(shares.follow()));
        members
    }

    /// How many serve each need, and how many needs each serves.
    fn served(members: &[(Member, Ownership)]) -> (Vec<usize>, Vec<usize>) {
        let by = |need: &&str| members.iter().filter(|(_, shares)| shares.is_ours(need)).count();
        let of = |(_, shares): &(Member, Ownership)| NEEDS.iter().filter(|need| shares.is_ours(need)).count();
        (NEEDS.iter().map(by).collect(), members.iter().map(of).collect())
    }

    #[test]
    fn each_need_has_one_and_each_instance_has_some() {
        for names in [["a", "b", "c"], ["one", "two", "three"], ["shsa", "shsa", "shsa"]] {
            let members = able(&Network::default(), &names);
            let (by, of) = served(&members);
            assert!(by.iter().all(|count| *count == 1), "{names:?}: {by:?}");
            assert_eq!(of.iter().sum::<usize>(), NEEDS.len());
            assert!(names[0] == names[1] || of.iter().all(|count| *count > 0), "{names:?}: {of:?}");
        }
    }

    #[test]
    fn who_is_gone_is_replaced_and_gets_back_what_it_had() {
        let network = Network::default();
        let mut members = able(&network, &["a", "b", "c"]);
        let need = *NEEDS.iter().find(|need| members[1].1.is_ours(need)).unwrap();
        let (member, mut gone) = members.remove(1);
        gone.tokens.clear();
        let told: Vec<Handover> = members.iter_mut().flat_map(|(_, shares)| shares.follow()).collect();
        assert!(told.contains(&Handover::Taken { need: key(need).into() }), "{told:?}");
        gone.tell(need, true, &member).unwrap();
        drop(gone.follow());
        let told: Vec<Handover> = members.iter_mut().flat_map(|(_, shares)| shares.follow()).collect();
        assert_eq!(told, [Handover::Given { need: key(need).into(), to: gone.instance.clone() }]);
        assert!(gone.is_ours(need));
    }

    #[test]
    fn nobody_serves_before_it_can() {
        let network = Network::default();
        let member = network.join(7);
        let mut shares = Ownership::new("a", &member).unwrap().unwrap();
        assert!(!shares.is_ours("/n/1"));
        shares.tell("/n/1", true, &member).unwrap();
        assert_eq!(shares.follow(), [Handover::Taken { need: "n/1".into() }]);
        assert_eq!(shares.able("/n/1"), ["a.00000007"]);
        shares.tell("/n/1", false, &member).unwrap();
        drop(shares.follow());
        assert!(!shares.is_ours("/n/1"));
    }
}
