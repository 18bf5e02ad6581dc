//! Contracts: what those who take part guarantee, on which conditions, what they demand of others, and what they observe.
//!
//! A contract is the conditional safety certificate of a signal's producer, of a relation, of who needs a variable, of a
//! platform, or of this program itself (Schneider and Trapp 2013, doi:10.1145/2491465.2491467). Who meets whose demands
//! depends on the flow of information: see [`assurance`](crate::assurance).

use super::ids::{IdVec, NeedId, RelationId, SignalId, VariableId, id};
use super::properties::{INTEGRITY, Properties};
use crate::interval::Interval;
use crate::statement::{Level, Scales, Statement};
use crate::time::Span;
use alloc::collections::BTreeMap;
use alloc::string::String;
use alloc::vec::Vec;

id! {
    /// A contract of a model: platforms first, then in file order.
    pub ContractId
}

/// The type of service that platforms give, and that is asked of them.
pub const PLATFORM: &str = "platform";
/// The type of service that who uses a variable gives: how it uses it, and what it does then.
pub const CONSUMER: &str = "consumer";
/// The type of service of this program, which computes relations; the name of its contract.
pub const HEALER: &str = "shsa";

/// The scale that the property `integrity` and the key of needs stand for.
pub const INTEGRITY_SCALE: &str = "asil";

/// Who has a contract.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Subject {
    /// The producer of a signal.
    Signal(SignalId),
    /// A relation, where it is part of a substitute.
    Relation(RelationId),
    /// Who needs a variable.
    Need(NeedId),
    /// Something that others run on.
    Platform,
    /// This program.
    Healer,
}

/// What one of those who take part guarantees, demands and observes.
#[derive(Clone, Debug, PartialEq)]
pub struct Contract {
    /// Of the subject, as the model names it.
    pub name: String,
    /// Whose it is.
    pub subject: Subject,
    /// What it runs on.
    pub runs_on: Option<ContractId>,
    /// The best first.
    pub gives: Vec<Given>,
    /// Of others.
    pub asks: Vec<Asked>,
    /// At run time.
    pub evidence: Vec<Watched>,
    /// What is done while it can give nothing; of a need.
    pub policy: Policy,
}

/// A guarantee.
#[derive(Clone, Debug, PartialEq)]
pub struct Given {
    /// Unique in its contract.
    pub name: String,
    /// What is guaranteed.
    pub statement: Statement,
    /// When it holds.
    pub when: Condition,
    /// Two of what it asks (by their places) whose redundancy is claimed to raise the level.
    pub redundant: Option<[usize; 2]>,
}

/// A demand.
#[derive(Clone, Debug, PartialEq)]
pub struct Asked {
    /// Unique in its contract, among demands and evidence.
    pub name: String,
    /// What is demanded.
    pub statement: Statement,
    /// Of whom.
    pub of: Party,
}

/// Who is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Party {
    /// Who provides a variable in the flow of now: a signal or a relation.
    Provider(VariableId),
    /// The producer of a signal, in the flow or not.
    Producer(SignalId),
    /// A platform, or this program.
    Contract(ContractId),
    /// Everybody who uses what is given.
    Consumers,
}

/// When a guarantee holds; leaves by their places in the contract. Without negation, so that what holds only grows with what
/// is assumed to hold.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Condition {
    /// All of them; of none it holds.
    All(Vec<Condition>),
    /// One of them; of none it does not hold.
    Any(Vec<Condition>),
    /// So many of them.
    AtLeast(u32, Vec<Condition>),
    /// A demand is met.
    Asked(usize),
    /// Evidence is true.
    Watched(usize),
}

impl Condition {
    /// Tells every leaf, as often as it occurs.
    pub fn leaves(&self, tell: &mut dyn FnMut(&Condition)) {
        match self {
            Condition::All(parts) | Condition::Any(parts) | Condition::AtLeast(_, parts) => {
                parts.iter().for_each(|part| part.leaves(tell));
            }
            leaf => tell(leaf),
        }
    }
}

/// A piece of evidence: what is observed, and where it must lie.
#[derive(Clone, Debug, PartialEq)]
pub struct Watched {
    /// Unique in its contract, among demands and evidence.
    pub name: String,
    /// What is observed.
    pub source: EvidenceSource,
    /// Where it must lie, SI; `None` where it is simply so or not.
    pub within: Option<Interval>,
    /// For how long an observation counts; `None` is until the next one.
    pub max_age: Option<Span>,
}

/// Where evidence comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum EvidenceSource {
    /// From a signal.
    Signal(SignalId, Measure),
    /// From what serves the need: the values of the substitution in use.
    Source(Measure),
    /// Somebody says so: a manual check.
    Told,
}

/// What can be measured of a signal, or of what serves a need.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Measure {
    /// Observations a second.
    Rate,
    /// How old the newest value is, in seconds.
    Age,
    /// How wide the newest value is, SI.
    Width,
    /// The share of comparisons in which it agreed with the others.
    Agreement,
    /// The share of time in which it gave a value.
    Availability,
    /// The newest value, SI.
    Value,
    /// Whether it is healthy: a truth, not a number.
    Verdict,
}

impl Measure {
    /// Every measure with the word for it in models.
    pub const NAMES: [(&'static str, Measure); 7] = [
        ("rate", Measure::Rate),
        ("age", Measure::Age),
        ("width", Measure::Width),
        ("agreement", Measure::Agreement),
        ("availability", Measure::Availability),
        ("value", Measure::Value),
        ("verdict", Measure::Verdict),
    ];

    /// The word for it in models.
    #[must_use]
    pub fn name(self) -> &'static str {
        Measure::NAMES.iter().find(|(_, measure)| *measure == self).map_or("", |(name, _)| name)
    }
}

/// What is done with a need that nothing admissible serves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Policy {
    /// Nothing goes out: at once where a contract refuses, after the need's `max_age` where it is not known yet.
    #[default]
    Stop,
    /// The next lower guarantee is given, as long as there is one.
    Degrade,
    /// It goes out all the same, and is told.
    Warn,
}

impl Policy {
    /// Every policy with the word for it in models.
    pub const NAMES: [(&'static str, Policy); 3] =
        [("stop", Policy::Stop), ("degrade", Policy::Degrade), ("warn", Policy::Warn)];
}

/// All contracts of a model.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Contracts {
    rows: IdVec<ContractId, Contract>,
    /// Of whom there is one; platforms and this program are found by name.
    of: BTreeMap<Subject, ContractId>,
    scales: Scales,
}

impl Contracts {
    /// Of checked rows; of two with one subject the first is its contract.
    #[must_use]
    pub fn new(rows: IdVec<ContractId, Contract>) -> Contracts {
        let mut of = BTreeMap::new();
        for (id, row) in rows.enumerate().filter(|(_, row)| row.subject != Subject::Platform) {
            of.entry(row.subject).or_insert(id);
        }
        Contracts { rows, of, scales: Scales::standard() }
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// All of them.
    #[must_use]
    pub fn rows(&self) -> &IdVec<ContractId, Contract> {
        &self.rows
    }

    /// The scales of all levels.
    #[must_use]
    pub fn scales(&self) -> &Scales {
        &self.scales
    }

    /// The contract of somebody who is no platform. O(log contracts).
    #[must_use]
    pub fn of(&self, subject: Subject) -> Option<ContractId> {
        self.of.get(&subject).copied()
    }

    /// The highest level that a signal without a contract gives: its property `integrity` on the scale of ISO 26262, `A` to
    /// `D` as 1 to 4; none without it.
    #[must_use]
    pub fn integrity(&self, signal: &Properties) -> Option<Level> {
        let scale = self.scales.named(INTEGRITY_SCALE)?;
        let most = self.scales.get(scale)?.levels.len() as u32 - 1;
        let rank = signal.get(INTEGRITY).map(|level| (*level as u32).min(most)).filter(|rank| *rank > 0);
        rank.map(|rank| Level { scale, rank })
    }

    /// Whether a relation without a contract passes a level on that all of its inputs give: not above its own `integrity`.
    #[must_use]
    pub fn passes_on(&self, relation: &Properties, level: Level) -> bool {
        let own = relation.get(INTEGRITY);
        own.is_none_or(|own| {
            self.scales.rank_on(INTEGRITY_SCALE, level).is_none_or(|rank| f64::from(rank) <= *own)
        })
    }

    /// The contract of who needs a variable. O(log contracts).
    #[must_use]
    pub fn of_need(&self, need: NeedId) -> Option<&Contract> {
        self.of(Subject::Need(need)).map(|id| &self.rows[id])
    }
}
