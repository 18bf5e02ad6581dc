//! Coverage: how often two ways were compared, as a share of how often they could have been.

use super::{Monitor, Residual, WayIndex};
use crate::knowledge::{KnowledgeBase, SignalId, VariableId};
use crate::substitution::Way;

/// Fewer possible comparisons than this prove nothing.
const TOO_FEW: u64 = 20;

/// Fewer than one in this many possible comparisons is rare.
const RARE: u64 = 10;

/// How often the two ways of a pair were compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Coverage {
    /// The slower way.
    pub way: WayIndex,
    /// The faster way.
    pub other: WayIndex,
    /// The number of comparisons made.
    pub made: u64,
    /// The number of possible comparisons: the values of the rarest signal of both ways.
    pub possible: u64,
    /// Whether a relation of one of the ways holds only under a condition.
    pub is_conditional: bool,
}

impl Coverage {
    /// Whether no comparison was made, though there were enough values.
    #[must_use]
    pub fn is_missing(&self) -> bool {
        self.made == 0 && self.possible >= TOO_FEW
    }

    /// Whether less than a tenth of the comparisons was made, though no condition forbade them.
    #[must_use]
    pub fn is_rare(&self) -> bool {
        self.made > 0
            && self.possible >= TOO_FEW
            && self.made.saturating_mul(RARE) < self.possible
            && !self.is_conditional
    }
}

impl Monitor {
    /// The watched ways of knowing a variable. O(log n) for all ways.
    pub fn ways_of(&self, variable: VariableId) -> impl Iterator<Item = WayIndex> + '_ {
        self.consensus.knowing(variable)
    }

    /// The way that is a signal of a variable alone, where it is watched. O(ways of the variable).
    #[must_use]
    pub fn find_direct(&self, variable: VariableId, signal: SignalId) -> Option<WayIndex> {
        let is_it = |index: &WayIndex| {
            self.way(*index).is_some_and(|watched| watched.computation.way().direct() == Some(signal))
        };
        self.consensus.knowing(variable).find(is_it)
    }

    /// The coverage of each pair, in their order. Complexity: O(pairs times the signals of their ways).
    pub fn coverage<'a>(&'a self, knowledge: &'a KnowledgeBase) -> impl Iterator<Item = Coverage> + 'a {
        self.pairs.iter().map(|pair| self.coverage_of(knowledge, pair))
    }

    fn coverage_of(&self, knowledge: &KnowledgeBase, pair: &Residual) -> Coverage {
        let ways = || [pair.way, pair.other].into_iter().filter_map(|way| self.way(way));
        let is_conditional = |way: &Way| {
            let mut steps = way.substitution.steps.iter();
            steps.any(|step| knowledge.relations()[step.relation].condition.is_some())
        };
        Coverage {
            way: pair.way,
            other: pair.other,
            made: pair.made,
            possible: self.chances(pair).saturating_sub(pair.before),
            is_conditional: ways().any(|way| is_conditional(way.computation.way())),
        }
    }

    /// The number of values of the rarest signal of both ways.
    pub(super) fn chances(&self, pair: &Residual) -> u64 {
        let ways = [pair.way, pair.other].into_iter().filter_map(|way| self.way(way));
        let inputs = ways.flat_map(|way| way.computation.way().inputs());
        inputs.map(|signal| self.ports[signal].counts().accepted).min().unwrap_or(0)
    }
}
