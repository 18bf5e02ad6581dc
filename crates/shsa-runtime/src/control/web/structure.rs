//! The content of a model for its drawing as a graph.

use serde_json::{Value, json};
use shsa_core::knowledge::{KnowledgeBase, SignalId, VariableId};

/// Variables, relations, signals and needs of a model, as they refer to each other by name.
pub(super) fn json(knowledge: &KnowledgeBase) -> Value {
    let variable = |id: VariableId| &*knowledge.variables()[id].name;
    let variables = |ids: &[VariableId]| ids.iter().map(|&id| variable(id)).collect::<Vec<_>>();
    let signal = |&id: &SignalId| &*knowledge.signals()[id].name;
    json!({
        "version": knowledge.version(),
        "variables": knowledge.variables().iter().map(|it| json!({
            "name": it.name,
            "unit": it.unit.as_ref().map(ToString::to_string),
            "is_constant": it.constant.is_some(),
        })).collect::<Vec<_>>(),
        "relations": knowledge.relations().iter().map(|it| json!({
            "name": it.name,
            "text": it.text,
            "inputs": variables(&it.inputs),
            "outputs": variables(&it.outputs),
        })).collect::<Vec<_>>(),
        "signals": knowledge.signals().iter().map(|it| json!({
            "name": it.name,
            "variable": variable(it.variable),
            "source": it.source,
            "rate_hz": it.rate_hz,
            "derived_from": it.derived_from.iter().map(signal).collect::<Vec<_>>(),
        })).collect::<Vec<_>>(),
        "needs": knowledge.needs().iter().enumerate().map(|(id, it)| json!({
            "name": knowledge.need_name(shsa_core::knowledge::Id::from_index(id)),
            "variable": variable(it.variable),
            "signal": it.signal,
        })).collect::<Vec<_>>(),
    })
}
