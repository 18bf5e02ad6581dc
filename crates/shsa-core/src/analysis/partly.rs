//! Faults that comparisons show only in part: beside several inverses, or as long as a derivative sees them change.

use super::comparisons::{Comparison, Comparisons};
use crate::expression::Formula;
use crate::knowledge::{IdVec, KnowledgeBase, Relation, RelationId, SignalId, VariableId};
use crate::residual_selection::{Findings, Isolability};
use crate::substitution::{Step, Way};
use crate::trust::Component;
use alloc::collections::{BTreeMap, BTreeSet};
use alloc::vec::Vec;

/// The reason why a comparison shows a fault only in part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Reservation {
    /// The relation has several solutions, as `z = v^2` has for `v`: a fault is hidden where it leads to another one of these.
    Branches(RelationId),
    /// The relation takes only a derivative: an offset shows for the window in which it comes, and no longer.
    Change(RelationId),
}

/// The faults that comparisons show only in part.
#[derive(Clone, Debug, PartialEq)]
pub struct Partly {
    /// By the comparisons that have one solution.
    unambiguous: Findings,
    /// What a comparison shows without reservation.
    lasting: BTreeSet<Component>,
    /// The reservations of all comparisons that show a fault, ascending.
    met: BTreeMap<Component, Vec<Reservation>>,
}

impl Partly {
    /// Complexity: O(comparisons times components times the size of the formulas of each).
    pub(super) fn new(knowledge: &KnowledgeBase, comparisons: &Comparisons) -> Partly {
        let mut unambiguous = Findings::new(knowledge);
        let mut lasting: BTreeSet<Component> = BTreeSet::new();
        let mut met: BTreeMap<Component, BTreeSet<Reservation>> = BTreeMap::new();
        let branching = IdVec::filled(knowledge.relations().len(), |relation| {
            branching(&knowledge.relations()[relation])
        });
        let reader = Reader { knowledge, branching };
        for (&pair, (one, other)) in comparisons.pairs().iter().zip(comparisons.fault_signature()) {
            let mut doubted = BTreeSet::new();
            let signals = comparisons.shows(pair);
            let relations = comparisons.shows_relations(pair);
            let shown =
                signals.iter().map(Component::Signal).chain(relations.iter().map(Component::Relation));
            for component in shown {
                let found = reader.reservations(ways(comparisons, pair), component);
                if found.iter().any(|it| matches!(it, Reservation::Branches(_))) {
                    doubted.insert(component);
                }
                if found.is_empty() {
                    lasting.insert(component);
                }
                met.entry(component).or_default().extend(found);
            }
            unambiguous.compare_where(one, other, |component| !doubted.contains(&component));
        }
        unambiguous.share(knowledge);
        let met =
            met.into_iter().map(|(component, found)| (component, found.into_iter().collect())).collect();
        Partly { unambiguous, lasting, met }
    }

    /// Whether every comparison that shows a fault of the component does so only in part.
    #[must_use]
    pub fn is_in_part(&self, knowledge: &KnowledgeBase, component: Component) -> bool {
        let component = measured(knowledge, component);
        self.met.contains_key(&component) && !self.lasting.contains(&component)
    }

    /// The reservations of the comparisons that show a fault of the component, ascending.
    #[must_use]
    pub fn reservations(&self, knowledge: &KnowledgeBase, component: Component) -> &[Reservation] {
        self.met.get(&measured(knowledge, component)).map_or(&[], Vec::as_slice)
    }

    /// The findings about a fault of a component by the comparisons that have one solution; `None` for a common cause.
    #[must_use]
    pub fn unambiguous(&self, component: Component) -> Option<&Isolability> {
        match component {
            Component::Signal(signal) => Some(self.unambiguous.signal(signal)),
            Component::Relation(relation) => Some(self.unambiguous.relation(relation)),
            Component::Cause(_) => None,
        }
    }

    /// Whether a fault is isolable from a fault of another component without a comparison that has several solutions.
    #[must_use]
    pub fn is_isolable_from(&self, component: Component, other: Component) -> bool {
        self.unambiguous(component).is_some_and(|found| found.is_isolable_from(other))
    }
}

/// A component, or the signal that represents the same measurement.
fn measured(knowledge: &KnowledgeBase, component: Component) -> Component {
    match component {
        Component::Signal(signal) => Component::Signal(knowledge.witness(signal)),
        other => other,
    }
}

/// The two ways of a comparison.
fn ways(comparisons: &Comparisons, pair: Comparison) -> impl Iterator<Item = &Way> + Clone {
    [pair.one, pair.other].into_iter().filter_map(|at| comparisons.ways().get(at))
}

/// The variables for which a relation has several solutions.
fn branching(relation: &Relation) -> Vec<VariableId> {
    let has_branches = |&output: &VariableId| relation.formula(output).is_some_and(Formula::has_branches);
    relation.outputs.iter().copied().filter(has_branches).collect()
}

/// Reads the formulas between a component and the output of a way.
struct Reader<'a> {
    knowledge: &'a KnowledgeBase,
    /// By relation: the variables for which it has several solutions.
    branching: IdVec<RelationId, Vec<VariableId>>,
}

impl Reader<'_> {
    /// The reservations of a comparison about a component; none where the component reaches the output of one way in full.
    fn reservations<'w>(
        &self,
        ways: impl Iterator<Item = &'w Way> + Clone,
        component: Component,
    ) -> Vec<Reservation> {
        let solved = |step: &Step| self.branches(step.relation).contains(&step.output);
        let solved_in =
            |way: &Way| way.substitution.steps.iter().find(|step| solved(step)).map(|step| step.relation);
        if let Some(relation) = ways.clone().find_map(solved_in) {
            return Vec::from([Reservation::Branches(relation)]);
        }
        let mut all = Vec::new();
        for found in ways.filter_map(|way| self.on_the_way(way, component)) {
            if found.is_empty() {
                return found;
            }
            all.extend(found);
        }
        all
    }

    /// The reservations of the steps between a component and the output of a way; `None` where it does not reach the output.
    fn on_the_way(&self, way: &Way, component: Component) -> Option<Vec<Reservation>> {
        let mut reached: Vec<VariableId> = Vec::new();
        if let Component::Signal(signal) = component {
            let knowledge = self.knowledge;
            let carries =
                |input: &SignalId| knowledge.as_witnesses(knowledge.origins(*input)).contains(signal);
            reached.extend(way.inputs().filter(carries).map(|input| knowledge.signals()[input].variable));
        }
        let mut found = Vec::new();
        for step in &way.substitution.steps {
            if component == Component::Relation(step.relation) {
                reached.push(step.output);
                continue;
            }
            let Some(formula) = self.knowledge.relations()[step.relation].formula(step.output) else {
                continue;
            };
            let read: Vec<VariableId> =
                reached.iter().copied().filter(|input| formula.symbols().contains(&input.symbol())).collect();
            if read.is_empty() {
                continue;
            }
            if read.iter().any(|input| self.branches(step.relation).contains(input)) {
                found.push(Reservation::Branches(step.relation));
            }
            if read.iter().all(|input| formula.only_differentiates(input.symbol())) {
                found.push(Reservation::Change(step.relation));
            }
            reached.push(step.output);
        }
        reached.contains(&way.substitution.sink).then_some(found)
    }

    fn branches(&self, relation: RelationId) -> &[VariableId] {
        &self.branching[relation]
    }
}
