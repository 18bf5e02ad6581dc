//! The names of what a substitution is made of, and its formula.

use serde_json::{Value, json};
use shsa_core::expression::Formula;
use shsa_core::knowledge::{Id, KnowledgeBase, SignalId, VariableId};
use shsa_core::substitution::{Substitution, Way};

/// The names of a substitution.
#[derive(Clone, Debug, PartialEq)]
pub struct Names {
    /// Its relations.
    pub relations: Vec<String>,
    /// Its variables.
    pub variables: Vec<String>,
    /// The best rated signals of its sources; of equal ones the first in file order.
    pub signals: Vec<String>,
    /// Its formula over its sources, in SI; for relations of structure only, their nesting.
    pub formula: String,
}

impl Names {
    /// The names with the utility, as `shsa plan --json` prints them.
    #[must_use]
    pub fn to_json(&self, utility: f64) -> Value {
        json!({
            "utility": utility,
            "relations": self.relations,
            "variables": self.variables,
            "signals": self.signals,
            "formula": self.formula,
        })
    }

    /// The relations in one text.
    #[must_use]
    pub fn relations_or_own(&self) -> String {
        match self.relations.is_empty() {
            true => "(its own signal)".to_owned(),
            false => self.relations.join(", "),
        }
    }

    /// The names of a substitution; `excluded` signals are not used.
    #[must_use]
    pub fn of(
        knowledge: &KnowledgeBase,
        substitution: &Substitution,
        excluded: &impl Fn(SignalId) -> bool,
    ) -> Names {
        let name = |variable: VariableId| knowledge.variables()[variable].name.clone();
        let mut variables: Vec<VariableId> = substitution.steps.iter().map(|step| step.output).collect();
        variables.extend(&substitution.sources);
        variables.push(substitution.sink);
        variables.sort_unstable();
        variables.dedup();
        let usable = |signal: SignalId| knowledge.is_available(signal) && !excluded(signal);
        let way = Way::choices(knowledge, substitution, usable, 1).into_iter().next();
        let signals = way.iter().flat_map(|way| way.inputs());
        Names {
            relations: substitution
                .relations()
                .into_iter()
                .map(|relation| knowledge.relations()[relation].name.clone())
                .collect(),
            variables: variables.into_iter().map(name).collect(),
            signals: signals.map(|signal| knowledge.signals()[signal].name.clone()).collect(),
            formula: formula(knowledge, substitution),
        }
    }
}

/// The formula of a substitution over its sources, in SI; for relations of structure only, their nesting.
fn formula(knowledge: &KnowledgeBase, substitution: &Substitution) -> String {
    let names = |symbol: shsa_core::expression::Symbol| {
        knowledge.variables()[VariableId::from_index(symbol.0 as usize)].name.clone()
    };
    let written: Option<Vec<(_, &Formula)>> = substitution
        .steps
        .iter()
        .map(|step| Some((step.output.symbol(), knowledge.relations()[step.relation].formula(step.output)?)))
        .collect();
    match written.as_deref() {
        Some([before @ .., (_, last)]) => last.inline(before).to_text(&names),
        _ => nested(knowledge, substitution, substitution.sink, &mut { MOST_NESTED }),
    }
}

/// The most relations that are written into each other: shared variables could double the text each time.
const MOST_NESTED: usize = 200;

/// Writes out relations as long as there is room, then the names of their variables.
fn nested(
    knowledge: &KnowledgeBase,
    substitution: &Substitution,
    variable: VariableId,
    room: &mut usize,
) -> String {
    let step = substitution.steps.iter().find(|step| step.output == variable);
    let (Some(step), Some(left)) = (step, room.checked_sub(1)) else {
        return knowledge.variables()[variable].name.clone();
    };
    *room = left;
    let relation = &knowledge.relations()[step.relation];
    let inputs: Vec<String> =
        relation.needs(variable).map(|input| nested(knowledge, substitution, input, room)).collect();
    format!("{}({})", relation.name, inputs.join(", "))
}
