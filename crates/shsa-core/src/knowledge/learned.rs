//! Variables that change slowly and are learned while running: constants of their range for all that is planned.

use super::ids::{RelationId, VariableId};
use super::rows::Rows;
use super::{Id, KnowledgeBase, Relation};
use crate::expression::Formula;
use crate::interval::Interval;
use alloc::vec::Vec;

/// A relation that a variable is fitted to. The variable has a bounded range and a largest rate of change.
#[derive(Clone, Debug)]
pub struct Learned {
    /// The learned variable, which is a constant of the knowledge base.
    pub variable: VariableId,
    /// The relation.
    pub relation: RelationId,
    /// The relation solved for the variable.
    pub formula: Formula,
}

impl KnowledgeBase {
    /// The learned variables with the relations that they are fitted to, in file order.
    #[must_use]
    pub fn learned(&self) -> &[Learned] {
        &self.learned
    }

    /// Replaces the learned variables; they must be constants of the knowledge base.
    #[must_use]
    pub fn with_learned(self, learned: Vec<Learned>) -> KnowledgeBase {
        KnowledgeBase { learned, ..self }
    }

    /// Sets the present value of a learned variable, SI.
    pub fn set_constant(&mut self, variable: VariableId, value: Interval) {
        self.variables[variable].constant = Some(value);
    }

    /// The same knowledge base in which a learned variable is none: the relation computes it like any other. O(model).
    #[must_use]
    pub fn with_unknown(&self, learned: &Learned) -> KnowledgeBase {
        let mut knowledge = self.clone();
        knowledge.variables[learned.variable].constant = None;
        knowledge.relations[learned.relation].add_output(learned.variable, learned.formula.clone());
        let outputs = knowledge.relations.enumerate().map(|(id, relation)| (id, relation.outputs.as_slice()));
        let produced = outputs.flat_map(|(id, outputs)| outputs.iter().map(move |&output| (output, id)));
        knowledge.producers = Rows::grouped(knowledge.variables.len(), produced);
        knowledge
    }
}

impl Relation {
    fn add_output(&mut self, output: VariableId, formula: Formula) {
        let at = self.outputs.partition_point(|other| other.index() < output.index());
        self.outputs.insert(at, output);
        self.formulas.insert(at.min(self.formulas.len()), formula);
    }
}
