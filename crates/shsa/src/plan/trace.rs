//! The steps of a search by SH-PGSA, in the order of making and as a tree (thesis, Fig. 1.20).

use crate::show;
use serde_json::{Value, json};
use shsa_core::knowledge::{KnowledgeBase, RelationId, VariableId};
use shsa_core::plan::{Leaves, Step};
use shsa_format::text::counted;

/// The most steps that are kept: a search may take millions.
const MOST: usize = 10_000;

/// The steps of a search.
#[derive(Default)]
pub(super) struct Trace {
    steps: Vec<Step>,
    /// The number of steps beyond the most.
    more: usize,
}

impl Trace {
    pub(super) fn take(&mut self, step: Step) {
        match self.steps.len() < MOST {
            true => self.steps.push(step),
            false => self.more += 1,
        }
    }

    /// The steps below the step that made them go on, each with its number.
    pub(super) fn to_text(&self, knowledge: &KnowledgeBase) -> String {
        let mut below: Vec<Vec<usize>> = vec![Vec::new(); self.steps.len() + 1];
        for (at, step) in self.steps.iter().enumerate() {
            below[step.after.unwrap_or(0)].push(at);
        }
        let mut rows = Vec::new();
        let mut stack: Vec<usize> = below[0].iter().rev().copied().collect();
        while let Some(at) = stack.pop() {
            stack.extend(below[at + 1].iter().rev());
            let step = &self.steps[at];
            let decisions: Vec<String> = step
                .decisions
                .iter()
                .map(|&(variable, relation)| in_words(knowledge, variable, relation))
                .collect();
            rows.push(vec![
                (at + 1).to_string(),
                format!("{}{}", "| ".repeat(step.depth), decisions.join(", ")),
                format!("{:.6}", step.utility),
                leaves(step.leaves).to_owned(),
            ]);
        }
        let table = show::style().table(&["step", "decides", "utility", "leaves"], rows);
        match self.more {
            0 => table,
            more => format!("{table}\n\n{} more are not shown", counted(more, "step")),
        }
    }

    pub(super) fn to_json(&self, knowledge: &KnowledgeBase) -> Value {
        let step = |step: &Step| {
            let decisions = step.decisions.iter().map(|&(variable, relation)| {
                let relation = relation.map(|relation| knowledge.relations()[relation].name.as_str());
                json!({ "variable": knowledge.variables()[variable].name, "relation": relation })
            });
            json!({
                "after": step.after,
                "decisions": decisions.collect::<Vec<_>>(),
                "utility": step.utility,
                "leaves": leaves(step.leaves),
            })
        };
        self.steps.iter().map(step).collect()
    }
}

fn in_words(knowledge: &KnowledgeBase, variable: VariableId, relation: Option<RelationId>) -> String {
    let variable = &knowledge.variables()[variable].name;
    match relation {
        Some(relation) => format!("{variable} by {}", knowledge.relations()[relation].name),
        None => format!("{variable} as provided"),
    }
}

fn leaves(leaves: Leaves) -> &'static str {
    match leaves {
        Leaves::Open => "open",
        Leaves::Complete => "complete",
        Leaves::Cycle => "cycle",
    }
}
