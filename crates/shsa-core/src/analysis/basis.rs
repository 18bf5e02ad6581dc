//! The relations that an analysis uses, and the ways through these relations.

use super::Options;
use crate::computation::Computation;
use crate::knowledge::{KnowledgeBase, RelationId};
use crate::residual_selection::WatchBudget;
use crate::substitution::{Step, Way};
use alloc::vec::Vec;

/// The relations that an analysis excludes.
#[derive(Clone, Debug, Default)]
pub(super) struct Basis {
    /// The excluded relations, ascending.
    forbidden: Vec<RelationId>,
    watch: WatchBudget,
}

impl Basis {
    /// Relations that go on from a variable's own last value are always excluded: such a way has no new information about its
    /// own variable, and cannot run for another variable. [`Options::only_runnable`] also excludes relations without a formula,
    /// except those from `assumed` on.
    pub(super) fn new(knowledge: &KnowledgeBase, options: Options, assumed: RelationId) -> Basis {
        let remembers = |id: RelationId| {
            let formulas = &knowledge.relations()[id].formulas;
            formulas.iter().any(|formula| !formula.previous_symbols().is_empty())
        };
        let lacks_formula = |id: RelationId| {
            options.only_runnable && id < assumed && knowledge.relations()[id].formulas.is_empty()
        };
        let forbidden = knowledge.relations().ids().filter(|&id| remembers(id) || lacks_formula(id));
        Basis { forbidden: forbidden.collect(), watch: options.watch }
    }

    /// The excluded relations, ascending.
    pub(super) fn forbidden(&self) -> &[RelationId] {
        &self.forbidden
    }

    /// The limits of the monitor.
    pub(super) fn watch(&self) -> WatchBudget {
        self.watch
    }

    /// Whether a way counts: it uses no excluded relation, and either can run or lacks only a formula.
    pub(super) fn admits(&self, knowledge: &KnowledgeBase, way: &Way) -> bool {
        let steps = &way.substitution.steps;
        let forbidden = |step: &Step| self.forbidden.binary_search(&step.relation).is_ok();
        let lacks_formula = |step: &Step| knowledge.relations()[step.relation].formula(step.output).is_none();
        !steps.iter().any(forbidden)
            && (steps.iter().any(lacks_formula) || Computation::can_run(knowledge, way))
    }
}
