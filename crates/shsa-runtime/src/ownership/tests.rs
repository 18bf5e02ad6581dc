//! Which instance serves which need, on a simulated network.

use super::*;
use shsa_bridge::memory::MemoryBus;
use shsa_bridge::{Clock, Inbox, Link, Outgoing};
use std::sync::{Arc, Mutex};

/// A network that tells which tokens are held.
#[derive(Clone, Default)]
struct Network(Arc<Mutex<Hall>>);

/// The held tokens, and their observers.
#[derive(Default)]
struct Hall {
    held: Vec<Arc<str>>,
    watching: Vec<Waiting>,
}

/// The changes of tokens with this prefix that a member has not read yet.
type Waiting = (u128, String, Vec<Presence>);

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

    fn announce(&self, presence: &Presence) {
        let (Presence::Alive(name) | Presence::Gone(name)) = presence;
        let mut hall = self.0.lock().unwrap();
        match presence {
            Presence::Alive(name) => hall.held.push(name.clone()),
            Presence::Gone(name) => hall.held.retain(|held| held != name),
        }
        let watching = hall.watching.iter_mut().filter(|(_, tokens, _)| name.starts_with(tokens.as_str()));
        watching.for_each(|(_, _, waiting)| waiting.push(presence.clone()));
    }
}

impl Drop for Badge {
    fn drop(&mut self) {
        self.0.announce(&Presence::Gone(self.1.clone()));
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
        self.network.announce(&Presence::Alive(name.clone()));
        Ok(Some(Box::new(Badge(self.network.clone(), name))))
    }
    fn attendance(&self, pattern: &str) -> Result<Option<Attendance>, BridgeError> {
        let (network, id) = (self.network.clone(), self.id);
        let tokens = pattern.trim_end_matches("**").to_owned();
        let mut hall = network.0.lock().unwrap();
        let held = hall.held.iter().filter(|name| name.starts_with(&tokens)).cloned();
        let held = held.map(Presence::Alive).collect();
        hall.watching.push((id, tokens.clone(), held));
        drop(hall);
        Ok(Some(Box::new(move || {
            let mut hall = network.0.lock().unwrap();
            let mine = |(member, watched, _): &&mut Waiting| *member == id && *watched == tokens;
            let (_, _, waiting) = hall.watching.iter_mut().find(mine)?;
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
        NEEDS.iter().for_each(|need| shares.announce(need, Ability::Settled, member).unwrap());
    }
    members.iter_mut().for_each(|(_, shares)| drop(shares.follow()));
    members
}

/// How many instances serve each need, and how many needs each instance serves.
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
    let handovers: Vec<Handover> = members.iter_mut().flat_map(|(_, shares)| shares.follow().1).collect();
    assert!(handovers.contains(&Handover::Taken { need: key(need).into() }), "{handovers:?}");
    gone.announce(need, Ability::Settled, &member).unwrap();
    drop(gone.follow());
    let handovers: Vec<Handover> = members.iter_mut().flat_map(|(_, shares)| shares.follow().1).collect();
    assert_eq!(handovers, [Handover::Given { need: key(need).into(), to: gone.instance.clone() }]);
    assert!(gone.is_ours(need));
}

#[test]
fn nobody_serves_before_it_can() {
    let network = Network::default();
    let member = network.join(7);
    let mut shares = Ownership::new("a", &member).unwrap().unwrap();
    assert!(!shares.is_ours("/n/1"));
    shares.announce("/n/1", Ability::Able, &member).unwrap();
    assert_eq!(shares.follow().1, [Handover::Taken { need: "n/1".into() }]);
    assert_eq!(shares.able("/n/1"), ["a.00000007"]);
    assert!(!shares.is_others("/n/1"));
    // The owner keeps the need while no other instance is able.
    shares.announce("/n/1", Ability::Unable, &member).unwrap();
    drop(shares.follow());
    assert!(shares.is_ours("/n/1") && shares.able("/n/1").is_empty());
    let other = network.join(8);
    let mut others = Ownership::new("b", &other).unwrap().unwrap();
    drop(others.follow());
    assert!(!others.is_ours("/n/1") && !others.is_others("/n/1"));
    others.announce("/n/1", Ability::Able, &other).unwrap();
    drop((others.follow(), shares.follow()));
    assert!(others.is_ours("/n/1") && shares.is_others("/n/1"));
}

/// Two members that can serve a need: the first serves it, the second has the higher rank.
fn newcomer(network: &Network) -> [(Member, Ownership); 2] {
    let join = |name: &str, id: u128| {
        let member = network.join(id);
        let shares = Ownership::new(name, &member).unwrap().unwrap();
        (member, shares)
    };
    let names = ["a", "b"].map(|name| format!("{name}.0000000{}", u8::from(name == "b")));
    let (first, second) =
        if rank(&names[0], "n/1") > rank(&names[1], "n/1") { ("b", "a") } else { ("a", "b") };
    let mut old = join(first, u128::from(first == "b"));
    old.1.announce("/n/1", Ability::Settled, &old.0).unwrap();
    assert_eq!(old.1.follow().1, [Handover::Taken { need: "n/1".into() }]);
    [old, join(second, u128::from(second == "b"))]
}

fn follow(members: &mut [(Member, Ownership)]) {
    members.iter_mut().for_each(|(_, shares)| drop(shares.follow()));
}

#[test]
fn who_has_just_been_started_takes_a_need_when_it_has_proven_itself_or_nobody_else_can() {
    let network = Network::default();
    let mut members = newcomer(&network);
    let is_ours = |members: &[(Member, Ownership); 2]| [0, 1].map(|at: usize| members[at].1.is_ours("/n/1"));
    let announce = |members: &mut [(Member, Ownership); 2], at: usize, ability| {
        let (member, shares) = &mut members[at];
        shares.announce("/n/1", ability, member).unwrap();
        follow(members);
    };
    // The newcomer does not see the other yet: it takes the first token, but is not settled.
    announce(&mut members, 1, Ability::Able);
    assert_eq!((members[1].1.tokens.len(), is_ours(&members)), (1, [true, false]));
    announce(&mut members, 1, Ability::Unable);
    // The newcomer sees the other: it takes no token.
    announce(&mut members, 1, Ability::Able);
    assert_eq!((members[1].1.tokens.len(), is_ours(&members)), (0, [true, false]));
    // The first member becomes unable.
    announce(&mut members, 0, Ability::Unable);
    announce(&mut members, 1, Ability::Able);
    assert_eq!(is_ours(&members), [false, true]);
    // The first member becomes able again, and is settled.
    announce(&mut members, 0, Ability::Settled);
    assert_eq!(is_ours(&members), [true, false]);
    announce(&mut members, 1, Ability::Settled);
    assert_eq!(is_ours(&members), [false, true]);
}
