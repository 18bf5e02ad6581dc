//! Updates a graph after changes of numbers and availability, without building it again.

use super::{Carrier, Graph, status};
use crate::knowledge::{ACCURACY, Element, KnowledgeBase, RelationId, Rows, SignalId, VariableId};

impl Graph {
    /// Takes over the properties, and the availability, of the `changed` elements of the knowledge base that the graph was made
    /// from. After a change of its structure or utility, use [`Graph::new`].
    ///
    /// Complexity: O(relations that read the changed elements, each times its outputs and inputs).
    pub fn update(&mut self, knowledge: &KnowledgeBase, changed: &[Element]) {
        let mut is_sound = true;
        let mut has_new_numbers = false;
        for &element in changed {
            let renumbered = match element {
                Element::Variable(variable) => self.update_variable(knowledge, variable),
                Element::Relation(relation) => self.update_relation(knowledge, relation),
                Element::Signal(signal) => self.update_signal(knowledge, signal),
            };
            if renumbered {
                has_new_numbers = true;
                is_sound &= self.is_sound(knowledge, element);
            }
        }
        if has_new_numbers {
            self.monotone = match self.monotone {
                true => is_sound,
                false => self.utility.check(knowledge).is_empty(),
            };
        }
        self.version = knowledge.version();
    }

    /// Whether additional relations can only lower the utility, checked for an element and its readers.
    fn is_sound(&self, knowledge: &KnowledgeBase, element: Element) -> bool {
        let variable = match element {
            Element::Variable(variable) => Some(variable),
            Element::Signal(signal) => self.carried(signal),
            Element::Relation(_) => None,
        };
        let readers = variable.map_or(&[][..], |variable| self.readers.row(variable));
        let has_problem = |element| self.utility.check_element(knowledge, element).is_some();
        // What lacks a property has that of the variable.
        let (carriers, producers) = match element {
            Element::Variable(variable) => (knowledge.carriers(variable), knowledge.producers(variable)),
            _ => (&[][..], &[][..]),
        };
        !has_problem(element)
            && !carriers.iter().any(|&carrier| has_problem(Element::Signal(carrier)))
            && !readers.iter().chain(producers).any(|&relation| has_problem(Element::Relation(relation)))
    }

    /// Updates a variable; returns whether checked numbers have changed.
    fn update_variable(&mut self, knowledge: &KnowledgeBase, id: VariableId) -> bool {
        let Some(variable) = knowledge.variables().find(id) else { return false };
        self.variables[id].own_accuracy = variable.properties.get(ACCURACY).copied();
        let numbers = self.utility.numbers_of_output(&variable.properties);
        self.output_numbers.row_mut(id).iter_mut().zip(numbers).for_each(|(old, new)| *old = new);
        for &signal in knowledge.carriers(id) {
            self.update_signal(knowledge, signal);
        }
        for &relation in knowledge.producers(id) {
            self.update_weights(knowledge, relation);
        }
        self.update_status(knowledge, id);
        true
    }

    fn update_signal(&mut self, knowledge: &KnowledgeBase, id: SignalId) -> bool {
        let Some(signal) = knowledge.signals().find(id) else { return false };
        let accuracy = signal.properties.get(ACCURACY).copied();
        let weight = self.scale().signal(self.utility.of_signal(knowledge, id));
        let mut renumbered = false;
        for carrier in self.carriers.row_mut(signal.variable).iter_mut().filter(|c| c.signal == id) {
            renumbered = carrier.accuracy != accuracy || carrier.weight != weight;
            *carrier = Carrier { signal: id, available: knowledge.is_available(id), accuracy, weight };
        }
        self.update_status(knowledge, signal.variable);
        renumbered
    }

    fn update_relation(&mut self, knowledge: &KnowledgeBase, id: RelationId) -> bool {
        let Some(relation) = knowledge.relations().find(id) else { return false };
        let numbers = self.utility.numbers_of(&relation.properties);
        self.numbers.row_mut(id).iter_mut().zip(numbers).for_each(|(old, new)| *old = new);
        self.update_weights(knowledge, id);
        true
    }

    fn update_status(&mut self, knowledge: &KnowledgeBase, variable: VariableId) {
        let new = status(&self.variables[variable], self.carriers.row(variable), &[]);
        if core::mem::replace(&mut self.variables[variable].status, new) == new {
            return;
        }
        self.provided[variable] = new.provided;
        let mut next = 0;
        while let Some(&reader) = self.readers.row(variable).get(next) {
            self.update_weights(knowledge, reader);
            next += 1;
        }
    }

    fn update_weights(&mut self, knowledge: &KnowledgeBase, relation: RelationId) {
        for &output in &knowledge.relations()[relation].outputs {
            let weight = self.weight(relation, output, |input| self.variables[input].status);
            let producers = self.producers.row_mut(output);
            for producer in producers.iter_mut().filter(|producer| producer.relation == relation) {
                producer.weight = weight;
            }
        }
    }
}

/// The relations that read each variable, by counting. Complexity: O(model).
pub(super) fn readers(knowledge: &KnowledgeBase) -> Rows<VariableId, RelationId> {
    let relations = knowledge.relations().enumerate();
    let read = relations.flat_map(|(id, relation)| relation.inputs.iter().map(move |&input| (input, id)));
    Rows::grouped(knowledge.variables().len(), read)
}
