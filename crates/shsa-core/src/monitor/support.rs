//! What a way of knowing rests on: the signals that it reads, their origins, and those that its value is computed from.

use crate::knowledge::{Id, KnowledgeBase, SignalSet, VariableId};
use crate::substitution::Way;
use alloc::vec::Vec;

/// The signals of a way and all their origins: a loss of any of them loses the way. Signals from the same source are replaced by
/// the one that represents the source.
#[must_use]
pub fn rests_on(knowledge: &KnowledgeBase, way: &Way) -> SignalSet {
    let all = way.inputs().fold(SignalSet::new(), |mut all, signal| {
        all.extend(&knowledge.origins(signal));
        all
    });
    knowledge.as_witnesses(all)
}

/// The signals that a way reads, itself or by a fusion, which computes its output from all its inputs. The other signals that it
/// [rests on](rests_on) are declared ancestors: how much of them is in a reading is not known.
pub(super) fn reads(knowledge: &KnowledgeBase, way: &Way) -> SignalSet {
    let all = way.inputs().fold(SignalSet::new(), |mut all, signal| {
        match knowledge.is_computed(signal) {
            true => all.extend(&knowledge.origins(signal)),
            false => _ = all.insert(signal),
        }
        all
    });
    knowledge.as_witnesses(all)
}

/// The signals that the value of a way is computed from, and all their origins, without the signals that only conditions read:
/// these do not change the size of the output. Signals from the same source are replaced by the one that represents the source.
#[must_use]
pub fn sized_by(knowledge: &KnowledgeBase, way: &Way) -> SignalSet {
    let needed = computed_from(knowledge, way);
    let sources = way.substitution.sources.iter().zip(&way.signals);
    let signals = sources.filter(|(variable, _)| needed.contains(variable));
    let all = signals.filter_map(|(_, signal)| *signal).fold(SignalSet::new(), |mut all, signal| {
        all.extend(&knowledge.origins(signal));
        all
    });
    knowledge.as_witnesses(all)
}

/// The variables that the value of a way is computed from, including the way's own variable.
fn computed_from(knowledge: &KnowledgeBase, way: &Way) -> Vec<VariableId> {
    let mut needed = Vec::from([way.substitution.sink]);
    for step in way.substitution.steps.iter().rev() {
        if !needed.contains(&step.output) {
            continue;
        }
        let relation = &knowledge.relations()[step.relation];
        match relation.formula(step.output) {
            Some(formula) => needed
                .extend(formula.symbols().iter().map(|symbol| VariableId::from_index(symbol.0 as usize))),
            None => needed.extend(relation.needs(step.output)),
        }
    }
    needed
}
