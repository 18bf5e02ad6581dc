//! Contracts: guarantees, their conditions, demands of others, and evidence.
//!
//! A contract is the conditional safety certificate of a signal's producer, of a relation, of the consumer of a variable, of a
//! platform, or of this program itself (Schneider and Trapp 2013, doi:10.1145/2491465.2491467). Which guarantees meet which
//! demands depends on the flow of information: see [`assurance`](crate::assurance).

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

/// The type of service that platforms give, and that others demand of them.
pub const PLATFORM: &str = "platform";
/// The type of service of a variable's consumer: how it uses the variable, and how it reacts.
pub const CONSUMER: &str = "consumer";
/// The type of service of this program, which computes relations; also the name of its contract.
pub const HEALER: &str = "shsa";

/// The scale of the property `integrity` and of the key of needs.
pub const INTEGRITY_SCALE: &str = "asil";

/// The subject of a contract.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Subject {
    /// The producer of a signal.
    Signal(SignalId),
    /// A relation, where it is part of a substitute.
    Relation(RelationId),
    /// The consumer of a variable.
    Need(NeedId),
    /// A platform that services run on.
    Platform,
    /// This program.
    Healer,
}

/// The guarantees, demands and evidence of one subject.
#[derive(Clone, Debug, PartialEq)]
pub struct Contract {
    /// The subject's name in the model.
    pub name: String,
    /// The subject.
    pub subject: Subject,
    /// The platform that the subject runs on.
    pub runs_on: Option<ContractId>,
    /// Guarantees, the best first.
    pub gives: Vec<Given>,
    /// Demands of others.
    pub asks: Vec<Asked>,
    /// Evidence at run time.
    pub evidence: Vec<Watched>,
    /// What happens to a need while no guarantee holds.
    pub policy: Policy,
}

/// A guarantee.
#[derive(Clone, Debug, PartialEq)]
pub struct Given {
    /// Unique in its contract.
    pub name: String,
    /// The guaranteed statement.
    pub statement: Statement,
    /// When the guarantee holds.
    pub when: Condition,
    /// Two demands (by their places) whose redundancy is claimed to raise the level.
    pub redundant: Option<[usize; 2]>,
}

/// A demand.
#[derive(Clone, Debug, PartialEq)]
pub struct Asked {
    /// Unique in its contract, among demands and evidence.
    pub name: String,
    /// The demanded statement.
    pub statement: Statement,
    /// The party that the demand asks.
    pub of: Party,
}

/// The party that a demand asks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Party {
    /// The present provider of a variable: a signal or a relation.
    Provider(VariableId),
    /// The producer of a signal, whether in use or not.
    Producer(SignalId),
    /// A platform, or this program.
    Contract(ContractId),
    /// All consumers of the given variable.
    Consumers,
}

/// When a guarantee holds; leaves are places in the contract. There is no negation: more assumptions never make a condition fail.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Condition {
    /// Conjunction; true without parts.
    All(Vec<Condition>),
    /// Disjunction; false without parts.
    Any(Vec<Condition>),
    /// At least this many parts hold.
    AtLeast(u32, Vec<Condition>),
    /// A demand is met.
    Asked(usize),
    /// Evidence is true.
    Watched(usize),
}

impl Condition {
    /// Visits every leaf, as often as it occurs.
    pub fn leaves(&self, visit: &mut dyn FnMut(&Condition)) {
        match self {
            Condition::All(parts) | Condition::Any(parts) | Condition::AtLeast(_, parts) => {
                parts.iter().for_each(|part| part.leaves(visit));
            }
            leaf => visit(leaf),
        }
    }
}

/// A piece of evidence: a measured quantity, and where it must lie.
#[derive(Clone, Debug, PartialEq)]
pub struct Watched {
    /// Unique in its contract, among demands and evidence.
    pub name: String,
    /// The source of the quantity.
    pub source: EvidenceSource,
    /// Where the quantity must lie, SI; `None` for evidence that is true or false.
    pub within: Option<Interval>,
    /// For how long an observation counts; `None`: until the next one.
    pub max_age: Option<Span>,
}

/// The source of evidence.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum EvidenceSource {
    /// From a signal.
    Signal(SignalId, Measure),
    /// From the source that serves the need: the values of the substitution in use.
    Source(Measure),
    /// The verdict of a temporal specification.
    Specification(VariableId),
    /// From an operator: a manual check.
    Attested,
}

/// A quantity of a signal, or of the source of a need.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Measure {
    /// Observations a second.
    Rate,
    /// The age of the newest value, in seconds.
    Age,
    /// The width of the newest value, SI.
    Width,
    /// The share of comparisons with agreement.
    Agreement,
    /// The share of time with a value.
    Availability,
    /// The newest value, SI.
    Value,
    /// Whether it is healthy: true or false, not a number.
    Verdict,
}

impl Measure {
    /// Every measure and its name in models.
    pub const NAMES: [(&'static str, Measure); 7] = [
        ("rate", Measure::Rate),
        ("age", Measure::Age),
        ("width", Measure::Width),
        ("agreement", Measure::Agreement),
        ("availability", Measure::Availability),
        ("value", Measure::Value),
        ("verdict", Measure::Verdict),
    ];

    /// The measure's name in models.
    #[must_use]
    pub fn name(self) -> &'static str {
        Measure::NAMES.iter().find(|(_, measure)| *measure == self).map_or("", |(name, _)| name)
    }
}

/// What happens to a need without an admissible source.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Policy {
    /// Nothing is published: at once where a contract refuses, after the need's `max_age` where evidence is unknown.
    #[default]
    Stop,
    /// The next lower guarantee is given, while there is one.
    Degrade,
    /// Values are published all the same, with a warning.
    Warn,
}

impl Policy {
    /// Every policy and its name in models.
    pub const NAMES: [(&'static str, Policy); 3] =
        [("stop", Policy::Stop), ("degrade", Policy::Degrade), ("warn", Policy::Warn)];
}

/// All contracts of a model.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Contracts {
    rows: IdVec<ContractId, Contract>,
    /// The contract of each subject; platforms and this program are found by name.
    of: BTreeMap<Subject, ContractId>,
    scales: Scales,
}

impl Contracts {
    /// The contracts of checked rows; of two with one subject the first counts.
    #[must_use]
    pub fn new(rows: IdVec<ContractId, Contract>) -> Contracts {
        let mut of = BTreeMap::new();
        for (id, row) in rows.enumerate().filter(|(_, row)| row.subject != Subject::Platform) {
            of.entry(row.subject).or_insert(id);
        }
        Contracts { rows, of, scales: Scales::standard() }
    }

    /// Whether there is no contract.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// All contracts.
    #[must_use]
    pub fn rows(&self) -> &IdVec<ContractId, Contract> {
        &self.rows
    }

    /// The scales of all levels.
    #[must_use]
    pub fn scales(&self) -> &Scales {
        &self.scales
    }

    /// The contract of a subject other than a platform. O(log contracts).
    #[must_use]
    pub fn of(&self, subject: Subject) -> Option<ContractId> {
        self.of.get(&subject).copied()
    }

    /// The highest level that a signal without a contract gives: its property `integrity` on the scale of ISO 26262, `A` to `D`
    /// as 1 to 4; none without the property.
    #[must_use]
    pub fn integrity(&self, signal: &Properties) -> Option<Level> {
        let scale = self.scales.named(INTEGRITY_SCALE)?;
        let most = self.scales.get(scale)?.levels.len() as u32 - 1;
        let rank = signal.get(INTEGRITY).map(|level| (*level as u32).min(most)).filter(|rank| *rank > 0);
        rank.map(|rank| Level { scale, rank })
    }

    /// Whether a relation without a contract passes on a level that all of its inputs give: not above its own `integrity`.
    #[must_use]
    pub fn passes_on(&self, relation: &Properties, level: Level) -> bool {
        let own = relation.get(INTEGRITY);
        own.is_none_or(|own| {
            self.scales.rank_on(INTEGRITY_SCALE, level).is_none_or(|rank| f64::from(rank) <= *own)
        })
    }

    /// The contract of the consumer of a need. O(log contracts).
    #[must_use]
    pub fn of_need(&self, need: NeedId) -> Option<&Contract> {
        self.of(Subject::Need(need)).map(|id| &self.rows[id])
    }
}
