//! Coverage: how often two ways were compared, as a share of how often they could have been.

use super::{Monitor, Residual, WayIndex};
use crate::knowledge::{KnowledgeBase, SignalId, VariableId};
use crate::substitution::Way;

/// So few chances to be compared say nothing.
const TOO_FEW: u64 = 20;

/// One comparison in so many that could have been made is rare.
const RARE: u64 = 10;

/// How often two ways were compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Coverage {
    /// The slower way.
    pub way: WayIndex,
    /// The faster one.
    pub other: WayIndex,
    /// How often.
    pub made: u64,
    /// How often they could have been: how many values came of the signal of both that came least often.
    pub possible: u64,
    /// Whether a relation of one of them holds only under a condition.
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
    /// The index of a signal of a variable by itself, when it is watched. O(ways of the variable).
    #[must_use]
    pub fn find_direct(&self, variable: VariableId, signal: SignalId) -> Option<WayIndex> {
        let is_it = |index: &WayIndex| {
            self.way(*index).is_some_and(|watched| watched.computation.way().direct() == Some(signal))
        };
        self.consensus.knowing(variable).find(is_it)
    }

    /// How often each pair was compared, in their order. Complexity: O(pairs times the signals of their ways).
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

    /// How many values came of the signal of both ways that came least often.
    pub(super) fn chances(&self, pair: &Residual) -> u64 {
        let ways = [pair.way, pair.other].into_iter().filter_map(|way| self.way(way));
        let inputs = ways.flat_map(|way| way.computation.way().inputs());
        inputs.map(|signal| self.ports[signal].counts().accepted).min().unwrap_or(0)
    }
}
