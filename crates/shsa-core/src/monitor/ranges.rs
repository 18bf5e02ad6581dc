//! The declared ranges of variables as ways of knowing them, beside the ways that may leave them: a computed value outside of its
//! range contradicts it, which is evidence against all that the value is computed from.
//!
//! That a value lies within the range says nothing: nothing is recorded before the first contradiction, and a range has no vote.

use super::{Monitor, Residual, WatchedWay};
use crate::computation::Computation;
use crate::expression::Symbol;
use crate::interval::Interval;
use crate::knowledge::{Id, KnowledgeBase, VariableId};
use crate::substitution::Way;
use alloc::collections::{BTreeMap, BTreeSet};
use alloc::vec::Vec;

/// The ranges that some of the ways may leave, in the order of their variables.
pub(super) fn left_ranges(knowledge: &KnowledgeBase, ways: &[Computation]) -> Vec<Computation> {
    let left = ways.iter().map(Computation::way).filter(|way| may_leave_range(knowledge, way));
    let variables: BTreeSet<VariableId> = left.map(|way| way.substitution.sink).collect();
    let of_range = |variable| Computation::of_range(variable, checked_range(knowledge, variable)?);
    variables.into_iter().filter_map(of_range).collect()
}

/// Whether the values of a way may leave the range of its variable, by the ranges of its inputs. What a signal shows outside of it
/// is told by the signal's own readings.
#[must_use]
pub fn may_leave_range(knowledge: &KnowledgeBase, way: &Way) -> bool {
    let Some(range) = checked_range(knowledge, way.substitution.sink) else { return false };
    if way.inputs().next().is_none() || way.direct().is_some() {
        return false;
    }
    let mut known: BTreeMap<VariableId, Interval> = BTreeMap::new();
    for step in &way.substitution.steps {
        let of = |symbol: Symbol| {
            let variable = VariableId::from_index(symbol.0 as usize);
            let declared = || {
                let described = knowledge.variables().find(variable)?;
                described.constant.or_else(|| checked_range(knowledge, variable))
            };
            known.get(&variable).copied().or_else(declared)
        };
        let formula = knowledge.relations()[step.relation].formula(step.output);
        let value = formula.map_or(Interval::ENTIRE, |formula| formula.bounds(&of));
        known.insert(step.output, value);
    }
    let value = known.get(&way.substitution.sink).copied().unwrap_or(Interval::ENTIRE);
    value.lo() < range.lo() || value.hi() > range.hi()
}

/// The range of a variable, finite at both ends as far as numbers go; `None` for one without a range, or that wraps.
fn checked_range(knowledge: &KnowledgeBase, variable: VariableId) -> Option<Interval> {
    let variable = knowledge.variables().find(variable)?;
    let range = variable.range.filter(|_| variable.wraps.is_none())?;
    Some(Interval::new(range.lo().max(f64::MIN), range.hi().min(f64::MAX)))
}

impl Monitor {
    /// The ways to compare with ranges, each with its range. O(ways times ranges).
    pub(super) fn beside_ranges(&self, knowledge: &KnowledgeBase) -> Vec<(usize, usize)> {
        let ranges = || self.ways.iter().enumerate().filter(|(_, way)| way.is_range);
        let beside = |(at, way): (usize, &WatchedWay)| {
            let (range, _) = ranges().find(|(_, range)| range.variable() == way.variable())?;
            may_leave_range(knowledge, way.computation.way()).then_some((at, range))
        };
        self.ways.iter().enumerate().filter_map(beside).collect()
    }
}

impl WatchedWay {
    /// Whether this is no way of computing the variable, but its declared range.
    #[must_use]
    pub fn is_range(&self) -> bool {
        self.is_range
    }
}

impl Residual {
    /// Whether a value lies in the range that it is compared with, and always has.
    #[inline]
    pub(super) fn is_within_as_ever(&self, value: Interval, range: Interval) -> bool {
        self.disagreement.is_none() && value.overlaps(range)
    }
}
