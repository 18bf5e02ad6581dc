//! Compares a graph with its successor after a change of structure.

use super::{Carrier, Graph};
use crate::knowledge::{IdVec, Lineage, RelationId, VariableId};

impl Graph {
    /// The variables about which searches read the same in both graphs, up to ids: whether they are provided and by which
    /// signals, and the relations that produce them, with all their inputs and numbers, in the same order. The state of an input
    /// counts for that input.
    ///
    /// A search takes the same decisions where all visited variables last, in the same order. Complexity: O(model).
    pub(in crate::plan) fn lasting(&self, new: &Graph, lineage: &Lineage) -> IdVec<VariableId, bool> {
        if self.utility != new.utility || self.monotone != new.monotone {
            return IdVec::filled(self.variables.len(), |_| false);
        }
        let relations =
            IdVec::filled(self.relations.len(), |relation| self.relation_lasts(new, lineage, relation));
        IdVec::filled(self.variables.len(), |variable| {
            let namesake = lineage.variable(variable);
            namesake.is_some_and(|namesake| {
                self.is_provided_alike(new, lineage, variable, namesake)
                    && self.is_produced_alike(new, lineage, &relations, variable, namesake)
            })
        })
    }

    fn relation_lasts(&self, new: &Graph, lineage: &Lineage, relation: RelationId) -> bool {
        let Some(namesake) = lineage.relation(relation) else { return false };
        let inputs = self.inputs.row(relation).iter().map(|&input| lineage.variable(input));
        self.relations[relation] == new.relations[namesake]
            && inputs.eq(new.inputs.row(namesake).iter().copied().map(Some))
            && alike(self.numbers.row(relation), new.numbers.row(namesake))
    }

    fn is_provided_alike(
        &self,
        new: &Graph,
        lineage: &Lineage,
        variable: VariableId,
        namesake: VariableId,
    ) -> bool {
        let (before, after) = (&self.variables[variable], &new.variables[namesake]);
        let succeeded = |carrier: &Carrier| {
            let signal = lineage.namesake(carrier.signal)?;
            Some(Carrier { signal, ..*carrier })
        };
        let carriers = self.carriers.row(variable).iter().map(succeeded);
        before.constant == after.constant
            && before.own_accuracy == after.own_accuracy
            && carriers.eq(new.carriers.row(namesake).iter().copied().map(Some))
    }

    fn is_produced_alike(
        &self,
        new: &Graph,
        lineage: &Lineage,
        lasting: &IdVec<RelationId, bool>,
        variable: VariableId,
        namesake: VariableId,
    ) -> bool {
        let producers = self.producers.row(variable).iter().map(|producer| producer.relation);
        let succeeded = |relation| lineage.relation(relation).filter(|_| lasting[relation]);
        let after = new.producers.row(namesake).iter().map(|producer| Some(producer.relation));
        producers.map(succeeded).eq(after)
            && alike(self.output_numbers.row(variable), new.output_numbers.row(namesake))
    }
}

/// Whether numbers are the same, those that are missing included.
fn alike(before: &[f64], after: &[f64]) -> bool {
    before.iter().map(|number| number.to_bits()).eq(after.iter().map(|number| number.to_bits()))
}
