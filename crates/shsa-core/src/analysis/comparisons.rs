//! The comparisons that the monitor makes, and the faults that each of them detects.

use super::basis::Basis;
use super::budget::Budget;
use crate::knowledge::{IdVec, KnowledgeBase, RelationSet, Shape, SignalSet, VariableId};
use crate::monitor::{SupportedWay, compared};
use crate::plan::Graph;
use crate::residual_selection::{FaultSignature, Witnesses, afford, isolate, witnesses};
use crate::substitution::Way;
use alloc::collections::BTreeMap;
use alloc::vec::Vec;

/// The ways of knowing one variable that are compared.
#[derive(Clone, Debug, Default)]
pub(super) struct Watched {
    pub(super) witnesses: Witnesses,
    /// Whether the budget was spent before the search for ways.
    pub(super) skipped: bool,
}

impl Watched {
    /// The ways of a variable that the monitor would watch, regardless of the total cost of all variables.
    pub(super) fn of(
        knowledge: &KnowledgeBase,
        graph: &Graph,
        basis: &Basis,
        variable: VariableId,
        budget: &mut Budget,
    ) -> Watched {
        if knowledge.variables()[variable].shape == Shape::Vector {
            let mut none = Watched::default();
            none.witnesses.exact = true;
            return none;
        }
        if budget.is_spent() {
            return Watched { skipped: true, ..Watched::default() };
        }
        let admits = |way: &Way| basis.admits(knowledge, way);
        let witnesses = witnesses(knowledge, graph, variable, basis.watch().ways, admits);
        budget.spend(1 + witnesses.expanded);
        Watched { witnesses, skipped: false }
    }
}

/// Two ways of one variable that are compared, as places in [`Comparisons::ways`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Comparison {
    /// The first way.
    pub one: usize,
    /// The second way.
    pub other: usize,
}

/// All comparisons of a knowledge base.
#[derive(Clone, Debug, Default)]
pub struct Comparisons {
    ways: Vec<Way>,
    fault_signature: Vec<FaultSignature>,
    pairs: Vec<Comparison>,
}

impl Comparisons {
    /// Pairs these ways as the monitor does. Complexity: O(p log p) for p pairs of ways of one variable.
    pub(super) fn new(knowledge: &KnowledgeBase, ways: Vec<Way>) -> Comparisons {
        let fault_signature: Vec<FaultSignature> =
            ways.iter().map(|way| FaultSignature::of(knowledge, way)).collect();
        let rests_on = fault_signature.iter().map(FaultSignature::rests_on);
        let supported: Vec<SupportedWay<'_>> =
            ways.iter().zip(rests_on).map(|(way, rests_on)| SupportedWay { way, rests_on }).collect();
        let pairs = compared(knowledge, &supported)
            .into_iter()
            .map(|(one, other)| Comparison { one, other })
            .collect();
        Comparisons { ways, fault_signature, pairs }
    }

    /// The ways that are watched, by variable, best utility first.
    #[must_use]
    pub fn ways(&self) -> &[Way] {
        &self.ways
    }

    /// All comparisons, in the order of the ways.
    #[must_use]
    pub fn pairs(&self) -> &[Comparison] {
        &self.pairs
    }

    /// The signals of a comparison: when its ways disagree, at least one of these is faulty.
    #[must_use]
    pub fn signals(&self, comparison: Comparison) -> SignalSet {
        self.of(comparison).map(|(one, other)| one.signals(other)).unwrap_or_default()
    }

    /// The signals whose faults a comparison [shows](crate::residual_selection::FaultSignature::shows).
    #[must_use]
    pub fn shows(&self, comparison: Comparison) -> SignalSet {
        self.of(comparison).map(|(one, other)| one.shows(other)).unwrap_or_default()
    }

    /// The relations of a comparison: a disagreement means that a signal of it is faulty, or one of these relations does not
    /// hold.
    #[must_use]
    pub fn relations(&self, comparison: Comparison) -> RelationSet {
        self.of(comparison).map(|(one, other)| one.relations(other)).unwrap_or_default()
    }

    /// The relations whose violation a comparison [shows](crate::residual_selection::FaultSignature::shows_relations).
    #[must_use]
    pub fn shows_relations(&self, comparison: Comparison) -> RelationSet {
        self.of(comparison).map(|(one, other)| one.shows_relations(other)).unwrap_or_default()
    }

    /// The fault signatures of both sides of each comparison.
    pub(super) fn fault_signature(&self) -> impl Iterator<Item = (&FaultSignature, &FaultSignature)> {
        self.pairs.iter().filter_map(|&comparison| self.of(comparison))
    }

    fn of(&self, Comparison { one, other }: Comparison) -> Option<(&FaultSignature, &FaultSignature)> {
        Some((self.fault_signature.get(one)?, self.fault_signature.get(other)?))
    }
}

/// Adds the ways that isolate the faults of measured variables, where ways were searched.
pub(super) fn isolated(
    knowledge: &KnowledgeBase,
    graph: &Graph,
    basis: &Basis,
    watched: &mut IdVec<VariableId, Watched>,
    budget: &mut Budget,
) {
    if budget.is_spent() {
        return;
    }
    let is_number = |variable: VariableId| knowledge.variables()[variable].shape == Shape::Scalar;
    let ids: Vec<VariableId> = watched.ids().collect();
    let looked_for =
        ids.into_iter().zip(watched.iter_mut()).filter(|(id, watched)| is_number(*id) && !watched.skipped);
    let mut ways: BTreeMap<VariableId, &mut Witnesses> =
        looked_for.map(|(id, watched)| (id, &mut watched.witnesses)).collect();
    let admits = |way: &Way| basis.admits(knowledge, way);
    budget.spend(isolate(knowledge, graph, &mut ways, basis.watch().ways, admits));
}

/// All ways of the variables, in order, within the cost limit of all.
pub(super) fn gathered(
    knowledge: &KnowledgeBase,
    basis: &Basis,
    watched: &mut IdVec<VariableId, Watched>,
) -> Vec<Way> {
    afford(knowledge, watched.iter_mut().map(|watched| &mut watched.witnesses), basis.watch().cost);
    watched.iter().flat_map(|watched| watched.witnesses.ways.iter().cloned()).collect()
}
