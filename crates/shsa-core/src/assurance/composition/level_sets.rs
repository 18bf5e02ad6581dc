//! The levels that parts of a model give by themselves, as sets: what can be said of a way without going through its certificates.

use crate::interval::Truth;
use crate::knowledge::{
    Contract, ContractId, EvidenceSource, HEALER, IdVec, KnowledgeBase, NeedId, Party, RelationId, SignalId,
    Subject,
};
use crate::statement::Level;
use alloc::vec::Vec;

/// A set of levels, a bit each: those of the model, ascending, and whether anything is given at all. A set with a level has all
/// lower levels of its scale.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(in crate::assurance) struct LevelSet(u32);

/// The bit for a guarantee without regard to its level.
const ANY: u32 = 1 << MOST_LEVELS;

/// How many levels a set has room for: more than all standard scales have together.
const MOST_LEVELS: usize = 30;

impl LevelSet {
    /// The set that has everything.
    pub(in crate::assurance) const ALL: LevelSet = LevelSet(ANY | (ANY - 1));

    pub(in crate::assurance) fn with(self, other: LevelSet) -> LevelSet {
        LevelSet(self.0 | other.0)
    }

    pub(in crate::assurance) fn and(self, other: LevelSet) -> LevelSet {
        LevelSet(self.0 & other.0)
    }

    pub(in crate::assurance) fn has(self, other: LevelSet) -> bool {
        self.0 & other.0 == other.0
    }
}

/// The levels that are given for sure, and those that may be given.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::assurance) struct Given {
    pub(in crate::assurance) sure: LevelSet,
    pub(in crate::assurance) maybe: LevelSet,
}

impl Given {
    /// The same levels, for sure.
    pub(in crate::assurance) fn surely(levels: LevelSet) -> Given {
        Given { sure: levels, maybe: levels }
    }

    /// Nothing is known.
    pub(in crate::assurance) const UNKNOWN: Given = Given { sure: LevelSet(0), maybe: LevelSet::ALL };

    /// Adds the levels of a guarantee.
    pub(in crate::assurance) fn add(&mut self, levels: LevelSet, holds: Truth) {
        match holds {
            Truth::True => *self = Given { sure: self.sure.with(levels), maybe: self.maybe.with(levels) },
            Truth::Unknown => self.maybe = self.maybe.with(levels),
            Truth::False => {}
        }
    }

    pub(in crate::assurance) fn and(self, other: Given) -> Given {
        Given { sure: self.sure.and(other.sure), maybe: self.maybe.and(other.maybe) }
    }

    /// Whether these levels are given.
    pub(in crate::assurance) fn gives(self, levels: LevelSet) -> Truth {
        match (self.sure.has(levels), self.maybe.has(levels)) {
            (true, _) => Truth::True,
            (false, true) => Truth::Unknown,
            (false, false) => Truth::False,
        }
    }
}

/// How the levels of a signal, or of what a relation computes, follow.
#[derive(Clone, Copy, Debug)]
pub(in crate::assurance) enum Certified {
    /// At most these, without a contract.
    Plain(LevelSet),
    /// By a contract over evidence of its own and platforms.
    Alone(ContractId),
    /// By a contract that depends on the flow.
    Flowing(ContractId),
}

/// What of the contracts does not depend on evidence.
#[derive(Clone, Debug)]
pub(in crate::assurance) struct Levels {
    /// All levels that are demanded or given anywhere, ascending.
    rows: Vec<Level>,
    pub(in crate::assurance) signals: IdVec<SignalId, Certified>,
    pub(in crate::assurance) relations: IdVec<RelationId, Certified>,
    /// The levels that a need demands of its source, where it demands nothing else.
    pub(in crate::assurance) needs: IdVec<NeedId, Option<LevelSet>>,
    /// The contract of this program.
    pub(in crate::assurance) healer: Option<ContractId>,
    /// The guarantees of each contract about its own signal, or about this program, by their places, with the levels that they
    /// reach.
    pub(in crate::assurance) own: IdVec<ContractId, Vec<(usize, LevelSet)>>,
}

impl Levels {
    /// `rows` has all levels of the model, ascending; `integrity` the level that each need demands by its key.
    pub(super) fn new(
        knowledge: &KnowledgeBase,
        rows: &[Level],
        integrity: &IdVec<NeedId, Option<Level>>,
    ) -> Levels {
        let (contracts, rows) = (knowledge.contracts(), rows.to_vec());
        let mut levels = Levels {
            rows,
            signals: IdVec::new(),
            relations: IdVec::new(),
            needs: IdVec::new(),
            healer: contracts.of(Subject::Healer),
            own: IdVec::new(),
        };
        for row in contracts.rows().iter() {
            let about = match row.subject {
                Subject::Signal(id) => {
                    Some(knowledge.variables()[knowledge.signals()[id].variable].name.as_str())
                }
                Subject::Healer => Some(HEALER),
                _ => None,
            };
            let own =
                row.gives.iter().enumerate().filter(|(_, given)| Some(&*given.statement.service) == about);
            let own = own.map(|(at, given)| (at, levels.given(given.statement.level))).collect();
            levels.own.push(own);
        }
        for (id, signal) in knowledge.signals().enumerate() {
            let plain = || levels.given(contracts.integrity(&signal.properties));
            let certified = contracts.of(Subject::Signal(id)).map(|id| of_contract(knowledge, id));
            let certified = certified.unwrap_or_else(|| Certified::Plain(plain()));
            levels.signals.push(certified);
        }
        for (id, relation) in knowledge.relations().enumerate() {
            let plain = || {
                let passed =
                    levels.rows.iter().filter(|&&level| contracts.passes_on(&relation.properties, level));
                let passed = passed.map(|&level| levels.bit(Some(level)));
                passed.fold(LevelSet(ANY), LevelSet::with)
            };
            let certified = contracts.of(Subject::Relation(id)).map(Certified::Flowing);
            let certified = certified.unwrap_or_else(|| Certified::Plain(plain()));
            levels.relations.push(certified);
        }
        for need in knowledge.needs().ids() {
            levels.needs.push(levels.demanded(knowledge, need, integrity[need]));
        }
        levels
    }

    /// The bit of a level; all bits for a level of which there is no row.
    pub(in crate::assurance) fn bit(&self, level: Option<Level>) -> LevelSet {
        let Some(level) = level else { return LevelSet(ANY) };
        let place = self.rows.binary_search(&level).ok().filter(|place| *place < MOST_LEVELS);
        place.map_or(LevelSet::ALL, |place| LevelSet(1 << place))
    }

    /// The levels that a guarantee reaches.
    pub(in crate::assurance) fn given(&self, level: Option<Level>) -> LevelSet {
        let Some(level) = level else { return LevelSet(ANY) };
        let reached = self.rows.iter().filter(|wanted| level.reaches(**wanted));
        reached.map(|&level| self.bit(Some(level))).fold(LevelSet(ANY), LevelSet::with)
    }

    /// Whether sets have room for all levels.
    pub(in crate::assurance) fn fit(&self) -> bool {
        self.rows.len() <= MOST_LEVELS
    }

    /// The levels that a need demands of its source; `None` where it demands something else.
    fn demanded(
        &self,
        knowledge: &KnowledgeBase,
        need: NeedId,
        integrity: Option<Level>,
    ) -> Option<LevelSet> {
        let variable = knowledge.needs()[need].variable;
        let own = integrity.map_or(LevelSet(0), |level| self.bit(Some(level)));
        let Some(contract) = knowledge.contracts().of_need(need) else { return Some(own) };
        let name = &knowledge.variables()[variable].name;
        let is_level = contract.asks.iter().all(|asked| {
            asked.of == Party::Provider(variable)
                && asked.statement.properties.is_empty()
                && asked.statement.service == *name
        });
        let is_all = contract.gives.is_empty() && contract.evidence.is_empty() && is_level;
        let asked = contract.asks.iter().map(|asked| self.bit(asked.statement.level));
        is_all.then(|| asked.fold(own, LevelSet::with))
    }
}

fn of_contract(knowledge: &KnowledgeBase, id: ContractId) -> Certified {
    let row: &Contract = &knowledge.contracts().rows()[id];
    let is_alone = row.evidence.iter().all(|watched| !matches!(watched.source, EvidenceSource::Source(_)))
        && row.asks.iter().all(|asked| matches!(asked.of, Party::Contract(_)));
    if is_alone { Certified::Alone(id) } else { Certified::Flowing(id) }
}
