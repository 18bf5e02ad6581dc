//! A model with contracts, orders about them, and what must hold of whatever goes out under them.

use shsa_core::assurance::{Assurance, Ground};
use shsa_core::engine::{Input, Order, Publication};
use shsa_core::knowledge::{EvidenceSource, KnowledgeBase, Policy};
use shsa_core::time::{Span, Time};
use std::collections::{BTreeMap, BTreeSet};

/// All policies, evidence of every kind, a platform that may run out of time, sources with and without contracts. SIL 3 is
/// given only by who was checked.
pub(super) const CERTIFIED: &str = "\
shsa: 1
variables: { a: { max_rate: 100 }, b: {}, idle: {} }
relations:
  by_b: { equation: a = b, for: [a] }
signals:
  /a1: { variable: a, rate: 100 Hz, value_error: 0.5, timeout: 100 ms }
  /a2: { variable: a, rate: 80 Hz, value_error: 0.5 }
  /b1: { variable: b, rate: 50 Hz, value_error: 0.5, timeout: 300 ms }
  /idle: { variable: idle, value_error: 0.1 }
needs:
  a:
    - { signal: /stop, max_age: 200 ms, hold: 0 s, probation: 100 ms }
    - { signal: /degrade, max_age: 200 ms, when_unsure: hull, max_width: 20 }
    - { signal: /warn, max_age: 1 s }
    - { signal: /free, max_age: 1 s }
platform:
  board: { evidence: { spare: value of /idle at least 4 no older than 1 s }, gives: { time: { time: at least 5 ms, level: SIL 3, when: spare } } }
contracts:
  /a1:
    evidence: { fresh: age at most 50 ms, sound: verdict healthy, often: rate at least 20 Hz, checked: told }
    gives:
      best: { error: at most 1, level: SIL 3, when: fresh and checked }
      good: { error: at most 1, level: SIL 2, when: fresh and (sound or often) }
  /a2: { evidence: { narrow: width at most 5 }, gives: { near: { error: at most 1, level: SIL 1, when: narrow } } }
  /b1: { evidence: { checked: told }, gives: { near: { error: at most 1, level: SIL 3, when: checked } } }
  by_b:
    evidence: { agrees: agreement at least 50 % }
    asks: { near: { error: at most 1, level: SIL 3 } }
    gives: { near: { error: at most 1, level: SIL 3 } }
  /stop:
    runs_on: board
    asks: { near: { of: a, error: at most 1, level: SIL 2 }, time: { of: platform, time: at least 1 ms, level: SIL 2 } }
  /degrade: { policy: degrade, asks: { near: { of: a, error: at most 1, level: SIL 3 } } }
  /warn: { policy: warn, asks: { near: { of: a, error: at most 1, level: SIL 3 } } }
";

/// The same signals and needs under other contracts: one guarantees more, one demands less, one policy is sterner, a platform is
/// slower, a relation has no word of its own.
pub(super) fn changed() -> String {
    [
        ("level: SIL 1, when: narrow", "level: SIL 2, when: narrow"),
        ("/warn: { policy: warn", "/warn: { policy: stop"),
        ("/degrade: { policy: degrade", "/degrade: { policy: warn"),
        (
            "asks: { near: { of: a, error: at most 1, level: SIL 2 }, time",
            "asks: { near: { of: a, error: at most 1, level: SIL 1 }, time",
        ),
        ("value of /idle at least 4", "value of /idle at least 6"),
        ("    gives: { near: { error: at most 1, level: SIL 3 } }\n", ""),
    ]
    .iter()
    .fold(CERTIFIED.to_owned(), |text, (before, after)| {
        assert!(text.contains(before), "{before}");
        text.replace(before, after)
    })
}

/// The rank of SIL 3, which nobody gives who was not checked.
const CHECKED: u32 = 2;

/// An order about contracts, the nth of its kind; `None` where the model has none.
pub(super) fn order(knowledge: &KnowledgeBase, kind: u8, about: usize, how: u8) -> Option<Order> {
    let rows = knowledge.contracts().rows();
    let attested: Vec<String> = rows
        .iter()
        .flat_map(|row| row.evidence.iter().map(move |it| (row, it)))
        .filter(|(_, it)| it.source == EvidenceSource::Attested)
        .map(|(row, it)| format!("{}/{}", row.name, it.name))
        .collect();
    let evidence = attested.get(about.checked_rem(attested.len())?)?.clone();
    let needs = knowledge.needs();
    let need = needs.iter().nth(about % needs.len().max(1))?.signal.clone();
    Some(match kind {
        0 => Order::Override {
            need,
            lasts: Span::from_millis(i64::from(how) * 50),
            because: "fuzzing".to_owned(),
        },
        kind => Order::Attest { evidence, holds: kind == 1 },
    })
}

/// What was ordered about contracts, as a reader of the orders knows it.
#[derive(Default)]
pub(super) struct Known {
    /// The latest time of all inputs: an order with an older time counts from then.
    now: Option<Time>,
    /// By the name of the need: until when.
    overridden: BTreeMap<String, Time>,
    checked: BTreeSet<String>,
    /// Whether the input denies that anything is checked. The inputs before it are settled with it, by the evidence before it.
    is_denial: bool,
}

impl Known {
    pub(super) fn receive(&mut self, input: &Input) {
        let now = self.now.map_or(input.time(), |now| now.max(input.time()));
        self.now = Some(now);
        self.is_denial = false;
        let Input::Order { order, .. } = input else { return };
        match order {
            Order::Override { need, lasts, .. } => {
                let until = self.overridden.entry(need.clone()).or_insert(Time::MIN);
                *until = (*until).max(now + *lasts);
            }
            Order::Attest { evidence, holds: true } => _ = self.checked.insert(evidence.clone()),
            Order::Attest { evidence, holds: false } => {
                self.is_denial = self.checked.remove(evidence) && self.checked.is_empty();
            }
            _ => {}
        }
    }

    /// Nothing goes out under a contract but on a ground that its policy and the orders allow, and at no level that nobody
    /// gives.
    pub(super) fn check(&self, knowledge: &KnowledgeBase, publication: &Publication) {
        let need = publication.need;
        let (ground, level) = (publication.admitted.ground, publication.admitted.level);
        if !Assurance::new(knowledge).is_some_and(|assurance| assurance.demands(need)) {
            assert_eq!((ground, level), (Ground::Undemanded, None), "{publication:?}");
            return;
        }
        let policy = Assurance::policy(knowledge, need);
        let until = self.overridden.get(&knowledge.needs()[need].signal);
        let is_allowed = match ground {
            Ground::Undemanded => false,
            Ground::Met | Ground::Lapsing => true,
            Ground::Degraded => policy == Policy::Degrade && level.is_some(),
            Ground::Warned => policy == Policy::Warn,
            Ground::Overridden => until.is_some_and(|until| publication.time < *until),
        };
        assert!(is_allowed, "{publication:?} under {policy:?}, overridden until {until:?}");
        let is_checked = !self.checked.is_empty() || self.is_denial;
        assert!(
            is_checked || level.is_none_or(|level| level.rank < CHECKED),
            "nobody gives it: {publication:?}"
        );
    }
}
