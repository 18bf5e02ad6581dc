//! Whether contracts admit a way, found step by step in the order of computation, without composing certificates.
//!
//! A search asks about many ways under the same evidence, and most answers follow from the contracts of the way's own members:
//! the signals first, then each relation from what its inputs give, last the need. What does not follow in that order (demands on
//! consumers, claims of redundancy, long chains of platforms) is left unknown, and [`Assurance::compose`] decides.

use super::Assurance;
use super::level_sets::{Certified, Given, LevelSet};
use crate::assurance::reading::Read;
use crate::interval::Truth;
use crate::knowledge::{
    self, Asked, Condition, Contract, ContractId, EvidenceSource, KnowledgeBase, Measure, NeedId, Party,
    Subject, VariableId, Watched,
};
use crate::statement::Statement;
use crate::substitution::{Step, Way};
use alloc::vec::Vec;

/// How many platforms, or producers of signals that are not in use, may demand something of each other in a row.
const MOST_OTHERS: u32 = 4;

/// The provider of a variable, as far as a way has been gone through.
#[derive(Clone, Copy)]
struct Provider {
    variable: VariableId,
    /// The levels that it gives.
    given: Given,
    statements: Statements,
}

/// The statements of a provider.
#[derive(Clone, Copy)]
enum Statements {
    /// Levels without properties.
    Levels,
    /// Those of a signal's contract.
    Signal(ContractId),
    /// Those of a relation's contract that hold, or may hold: from a place to a place.
    Relation(usize, usize),
}

/// What the members of a way give, as far as they have been gone through.
pub(in crate::assurance) struct Along<'a> {
    assurance: &'a Assurance,
    knowledge: &'a KnowledgeBase,
    way: &'a Way,
    read: Read<'a>,
    /// The providers by their variables, ascending.
    providers: Vec<Provider>,
    /// The guarantees of relations with a contract.
    offers: Vec<(&'a Statement, Truth)>,
}

/// The member whose contract is evaluated.
#[derive(Clone, Copy)]
struct Place {
    /// The variable that a relation computes.
    computed: Option<VariableId>,
    /// How many platforms have demanded something on the way here.
    depth: u32,
}

/// The contract of a member that reads no relation.
const OWN: Place = Place { computed: None, depth: 0 };

impl<'a> Along<'a> {
    /// Begins a way. The contracts of signals alone may be asked of an empty one.
    pub(in crate::assurance) fn new(
        assurance: &'a Assurance,
        knowledge: &'a KnowledgeBase,
        way: &'a Way,
        read: Read<'a>,
    ) -> Along<'a> {
        Along { assurance, knowledge, way, read, providers: Vec::new(), offers: Vec::new() }
    }

    /// Whether the way is admissible for a need; unknown where only [`Assurance::compose`] tells.
    ///
    /// Time: linear in the members of the way, times their guarantees and demands, and a logarithm for each input.
    pub(in crate::assurance) fn admits(mut self, need: NeedId) -> Truth {
        if !self.assurance.sets.fit() {
            return Truth::Unknown;
        }
        self.providers.reserve(self.way.signals.len() + self.way.substitution.steps.len());
        for (&variable, &chosen) in self.way.substitution.sources.iter().zip(&self.way.signals) {
            let Some(chosen) = chosen else { continue };
            let (given, statements) = match self.assurance.sets.signals[chosen] {
                Certified::Plain(levels) => (Given::surely(levels), Statements::Levels),
                Certified::Alone(id) | Certified::Flowing(id) => {
                    (self.own_levels(id), Statements::Signal(id))
                }
            };
            self.provide(Provider { variable, given, statements });
        }
        for &step in &self.way.substitution.steps {
            let provider = self.computed(step);
            self.provide(provider);
        }
        self.need(need)
    }

    fn provide(&mut self, provider: Provider) {
        let place = self.providers.partition_point(|known| known.variable < provider.variable);
        self.providers.insert(place, provider);
    }

    /// The provider of a variable; `None` where it has not been gone through.
    fn provider(&self, variable: VariableId) -> Option<&Provider> {
        let place = self.providers.binary_search_by_key(&variable, |known| known.variable).ok()?;
        self.providers.get(place)
    }

    /// The levels that a contract gives of its own subject: of a signal's variable, or of this program.
    pub(in crate::assurance) fn own_levels(&self, id: ContractId) -> Given {
        let row = &self.knowledge.contracts().rows()[id];
        let mut levels = Given::default();
        for &(at, reached) in &self.assurance.sets.own[id] {
            let holds = row.gives.get(at).map_or(Truth::False, |given| self.holds(id, row, given, OWN));
            levels.add(reached, holds);
        }
        levels
    }

    fn computed(&mut self, step: Step) -> Provider {
        let (knowledge, variable) = (self.knowledge, step.output);
        let id = match self.assurance.sets.relations[step.relation] {
            Certified::Plain(passed) => {
                let given = self.passed_on(step, passed);
                return Provider { variable, given, statements: Statements::Levels };
            }
            Certified::Alone(id) | Certified::Flowing(id) => id,
        };
        let (row, start, mut levels) =
            (&knowledge.contracts().rows()[id], self.offers.len(), Given::default());
        let name = &knowledge.variables()[variable].name;
        for given in row.gives.iter().filter(|given| given.statement.service == *name) {
            let level = given.statement.level;
            let place = Place { computed: Some(variable), depth: 0 };
            let holds = self.holds(id, row, given, place);
            let holds = holds.and(self.computing().gives(self.assurance.sets.bit(level)));
            levels.add(self.assurance.sets.given(level), holds);
            if !holds.is_false() {
                self.offers.push((&given.statement, holds));
            }
        }
        let statements = Statements::Relation(start, self.offers.len());
        Provider { variable, given: levels, statements }
    }

    /// The levels that all inputs of a relation without a contract give.
    fn passed_on(&self, step: Step, passed: LevelSet) -> Given {
        let mut given = Given::surely(passed);
        for input in self.knowledge.relations()[step.relation].needs(step.output) {
            if self.knowledge.variables()[input].constant.is_none() {
                given = given.and(self.provider(input).map_or(Given::UNKNOWN, |known| known.given));
            }
        }
        given.and(self.computing())
    }

    /// The levels at which this program computes: all where it has no contract.
    fn computing(&self) -> Given {
        let Some(healer) = self.assurance.sets.healer else { return Given::surely(LevelSet::ALL) };
        let mut levels = self.own_levels(healer);
        levels.add(self.assurance.sets.bit(None), Truth::True);
        levels
    }

    /// Whether a guarantee of a contract holds.
    fn holds(&self, id: ContractId, row: &Contract, given: &knowledge::Given, place: Place) -> Truth {
        let holds = self.condition(id, row, &given.when, place);
        // A claim of redundancy may be wrong in this way.
        if given.redundant.is_some() { holds.and(Truth::Unknown) } else { holds }
    }

    fn condition(&self, id: ContractId, row: &Contract, condition: &Condition, place: Place) -> Truth {
        let part = |part: &Condition| self.condition(id, row, part, place);
        match condition {
            Condition::All(parts) => parts.iter().map(part).fold(Truth::True, Truth::and),
            Condition::Any(parts) => parts.iter().map(part).fold(Truth::False, Truth::or),
            Condition::AtLeast(count, parts) => {
                let mut parts: Vec<Truth> = parts.iter().map(part).collect();
                parts.sort_unstable_by_key(|&truth| core::cmp::Reverse(truth));
                match (*count as usize).checked_sub(1) {
                    Some(last) => parts.get(last).copied().unwrap_or(Truth::False),
                    None => Truth::True,
                }
            }
            Condition::Asked(at) => row.asks.get(*at).map_or(Truth::False, |it| self.asked(it, place)),
            Condition::Watched(at) => {
                row.evidence.get(*at).map_or(Truth::False, |watched| self.watched(id, watched, place))
            }
        }
    }

    /// Evidence that is not known to be true satisfies nothing.
    fn watched(&self, id: ContractId, watched: &Watched, place: Place) -> Truth {
        let is_elsewhere = place.computed.is_some_and(|output| output != self.way.substitution.sink);
        match watched.source {
            EvidenceSource::Source(Measure::Value | Measure::Width) if is_elsewhere => Truth::False,
            _ if (self.read)(id, watched, self.way).truth.is_true() => Truth::True,
            _ => Truth::False,
        }
    }

    fn asked(&self, asked: &Asked, place: Place) -> Truth {
        let wanted = &asked.statement;
        match asked.of {
            Party::Provider(variable) => self.provided(variable, wanted),
            Party::Contract(id) => self.other(id, |given| given.meets(wanted), place.depth),
            Party::Producer(signal) => match self.knowledge.contracts().of(Subject::Signal(signal)) {
                Some(id) => self.other(id, |given| given.meets(wanted), place.depth),
                None => Truth::Unknown,
            },
            Party::Consumers => Truth::Unknown,
        }
    }

    /// Whether the provider of a variable meets a demand.
    fn provided(&self, variable: VariableId, wanted: &Statement) -> Truth {
        let row = &self.knowledge.variables()[variable];
        if row.constant.is_some() {
            return Truth::True;
        }
        let Some(provider) = self.provider(variable) else { return Truth::Unknown };
        if wanted.properties.is_empty() && wanted.service == row.name {
            return provider.given.gives(self.assurance.sets.bit(wanted.level));
        }
        match provider.statements {
            Statements::Levels => Truth::False,
            Statements::Signal(id) => self.other(id, |given| given.meets(wanted), 0),
            Statements::Relation(from, to) => {
                let offers = self.offers.get(from..to).unwrap_or_default().iter();
                let met = offers.filter(|(given, _)| given.meets(wanted));
                met.fold(Truth::False, |best, (_, holds)| best.or(*holds))
            }
        }
    }

    /// Whether a platform, this program, or the producer of a signal gives something.
    fn other(&self, id: ContractId, gives: impl Fn(&Statement) -> bool, depth: u32) -> Truth {
        if depth >= MOST_OTHERS {
            return Truth::Unknown;
        }
        let row = &self.knowledge.contracts().rows()[id];
        let place = Place { computed: None, depth: depth + 1 };
        let given = row.gives.iter().filter(|given| gives(&given.statement));
        given.map(|given| self.holds(id, row, given, place)).fold(Truth::False, Truth::or)
    }

    /// Whether the need can give something: one of its guarantees, or that all of its demands are met.
    fn need(&self, need: NeedId) -> Truth {
        let source = self.provider(self.way.substitution.sink);
        let integrity = self.assurance.integrity[need].map_or(Truth::True, |level| {
            source.map_or(Truth::Unknown, |it| it.given.gives(self.assurance.sets.bit(Some(level))))
        });
        let contracts = self.knowledge.contracts();
        let Some(id) = contracts.of(Subject::Need(need)) else { return integrity };
        let row = &contracts.rows()[id];
        let own = if row.gives.is_empty() {
            let asked = row.asks.iter().map(|asked| self.asked(asked, OWN));
            let watched = row.evidence.iter().map(|watched| self.watched(id, watched, OWN));
            asked.chain(watched).fold(Truth::True, Truth::and)
        } else {
            let modes = row.gives.iter().map(|given| self.condition(id, row, &given.when, OWN));
            modes.fold(Truth::False, Truth::or)
        };
        own.and(integrity)
    }
}
