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
    members.iter_mut().for_each(|(_, shares)| drop(shares.follow(Time(0))));
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
    let handovers: Vec<Handover> =
        members.iter_mut().flat_map(|(_, shares)| shares.follow(Time(0)).1).collect();
    assert!(handovers.contains(&Handover::Taken { need: key(need).into(), unheard: None }), "{handovers:?}");
    gone.announce(need, Ability::Settled, &member).unwrap();
    drop(gone.follow(Time(0)));
    let handovers: Vec<Handover> =
        members.iter_mut().flat_map(|(_, shares)| shares.follow(Time(0)).1).collect();
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
    assert_eq!(shares.follow(Time(0)).1, [Handover::Taken { need: "n/1".into(), unheard: None }]);
    assert_eq!(shares.able("/n/1"), ["a.00000007"]);
    assert!(!shares.is_others("/n/1"));
    // The owner keeps the need while no other instance is able.
    shares.announce("/n/1", Ability::Unable, &member).unwrap();
    drop(shares.follow(Time(0)));
    assert!(shares.is_ours("/n/1") && shares.able("/n/1").is_empty());
    let other = network.join(8);
    let mut others = Ownership::new("b", &other).unwrap().unwrap();
    drop(others.follow(Time(0)));
    assert!(!others.is_ours("/n/1") && !others.is_others("/n/1"));
    others.announce("/n/1", Ability::Able, &other).unwrap();
    drop((others.follow(Time(0)), shares.follow(Time(0))));
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
    assert_eq!(old.1.follow(Time(0)).1, [Handover::Taken { need: "n/1".into(), unheard: None }]);
    [old, join(second, u128::from(second == "b"))]
}

fn follow(members: &mut [(Member, Ownership)]) {
    members.iter_mut().for_each(|(_, shares)| drop(shares.follow(Time(0))));
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

/// A moment of the watch's time.
fn at(milliseconds: i64) -> Time {
    Time(milliseconds * 1_000_000)
}

/// Two members that hear the need; the second one has the higher rank, and holds both tokens.
fn hearing(network: &Network) -> [(Member, Ownership); 2] {
    let mut members = newcomer(network);
    members.iter_mut().for_each(|(_, shares)| shares.listen("/n/1", Some(Span::from_millis(1_000))));
    let (member, shares) = &mut members[1];
    shares.announce("/n/1", Ability::Settled, member).unwrap();
    members
}

#[test]
fn an_owner_goes_on_until_its_successor_is_heard() {
    let network = Network::default();
    let [(_, mut old), (second, mut new)] = hearing(&network);
    assert_eq!(old.follow(at(0)), (true, vec![]), "the claim alone takes no need");
    assert_eq!(new.follow(at(0)).1, [Handover::Taken { need: "n/1".into(), unheard: None }]);
    assert!(!old.hear("/n/1", Some(PublisherId(99)), at(10)), "a stranger");
    assert!(!old.hear("/n/1", None, at(10)), "somebody who does not show itself");
    assert_eq!(old.follow(at(10)), (false, vec![]));
    assert!(old.hear("/n/1", Some(second.publisher()), at(20)));
    let to = new.instance.clone();
    assert_eq!(old.follow(at(20)).1, [Handover::Given { need: "n/1".into(), to }]);
}

#[test]
fn an_owner_that_is_not_heard_is_replaced_after_the_age_and_gets_the_need_back_when_it_is() {
    let network = Network::default();
    let [(_, mut old), (second, new)] = hearing(&network);
    drop(old.follow(at(0)));
    old.hear("/n/1", Some(second.publisher()), at(0));
    drop(old.follow(at(0)));
    assert!(old.is_others("/n/1"));
    old.want("/n/1", at(100));
    assert_eq!(old.due(), Some(at(1_100) + Span(1)));
    assert_eq!(old.follow(at(1_101)).1, [], "its value may be on its way");
    let unheard = Some(new.instance.clone());
    assert_eq!(old.follow(at(1_201)).1, [Handover::Taken { need: "n/1".into(), unheard }]);
    assert_eq!(old.due(), None);
    old.hear("/n/1", Some(second.publisher()), at(5_000));
    assert!(matches!(old.follow(at(5_000)).1[..], [Handover::Given { .. }]));
}

/// Claims without values, by any number of strangers in any order, keep nobody who is able from serving.
#[test]
fn claims_without_values_stop_no_need() {
    let network = Network::default();
    let mut members = hearing(&network);
    members[1].1.tokens.clear();
    let (_, mine) = &mut members[0];
    let stranger = network.join(0xdead_beef);
    let mut held = Vec::new();
    let mut random = 1_u64;
    for now in (0..60_000).step_by(100) {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let (kind, name) = ((random >> 60) % 4, (random >> 33) % 50);
        match kind {
            0 | 1 => {
                let tokens = if kind == 0 { ABLE } else { SETTLED };
                held.push(stranger.attend(&format!("{tokens}/x{name}.{name:08x}/n/1")).unwrap());
            }
            2 => held.clear(),
            _ => assert!(!mine.hear("/n/1", Some(PublisherId(u128::from(name) << 40 | 0xabcd)), at(now))),
        }
        drop(mine.follow(at(now)));
        assert!(mine.is_ours("/n/1"), "{now}");
    }
}

/// An instance that may hang, as a run drives it.
struct Stalling {
    member: Member,
    shares: Ownership,
    hangs: bool,
    /// When it was driven last, and since when it has been there without a break.
    driven: i64,
    since: i64,
}

impl Stalling {
    fn serves(&self) -> bool {
        !self.hangs && self.shares.is_ours("/n/1")
    }

    /// Drives it at this time, with a value of its own, after these have published.
    fn drive(&mut self, publishers: &[PublisherId], now: i64) {
        // It was away: it proves itself again for the probation.
        if now - self.driven > 1_000 {
            self.since = now;
        }
        self.driven = now;
        let ability = if now - self.since < 5_000 { Ability::Able } else { Ability::Settled };
        for other in publishers.iter().filter(|it| **it != self.member.publisher()) {
            assert!(self.shares.hear("/n/1", Some(*other), at(now)));
        }
        if !self.shares.is_ours("/n/1") {
            self.shares.want("/n/1", at(now));
        }
        self.shares.announce("/n/1", ability, &self.member).unwrap();
        drop(self.shares.follow(at(now)));
    }
}

/// Instances that hang and go on at random times, each for 0 to 10 s: nobody publishes beside another for longer than the moment
/// of a change, and one serves if one can, but for the age after a change.
#[test]
fn instances_that_hang_and_go_on_leave_one_that_serves() {
    for seed in 0..60_u64 {
        let names = &["a", "b", "c"][..2 + (seed % 2) as usize];
        let mut members: Vec<Stalling> = able(&Network::default(), names)
            .into_iter()
            .map(|(member, shares)| Stalling { member, shares, hangs: false, driven: 0, since: -5_000 })
            .collect();
        members.iter_mut().for_each(|it| it.shares.listen("/n/1", Some(Span::from_millis(1_000))));
        let mut random = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        let mut draw = |below: u64| {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(99);
            (random >> 33) % below
        };
        let (mut next, mut last, mut beside, mut unserved) = (10_000, 0, 0, 0);
        for now in (0..180_000_i64).step_by(50) {
            if now >= next {
                let which = draw(members.len() as u64) as usize;
                members[which].hangs = !members[which].hangs;
                (last, next) = (now, now + draw(10_000) as i64);
            }
            let serving: Vec<&Stalling> = members.iter().filter(|it| it.serves()).collect();
            let publishers: Vec<PublisherId> = serving.iter().map(|it| it.member.publisher()).collect();
            let is_anybody = members.iter().any(|it| !it.hangs);
            beside = if publishers.len() > 1 { beside + 1 } else { 0 };
            unserved = if publishers.is_empty() && is_anybody { unserved + 50 } else { 0 };
            let because = format!("seed {seed}, {now} ms, changed at {last}: {publishers:?}");
            assert!(beside <= 2, "{because} publish beside each other");
            assert!(unserved <= 1_300, "{because}: nobody has published for {unserved} ms");
            members.iter_mut().filter(|it| !it.hangs).for_each(|it| it.drive(&publishers, now));
        }
    }
}
