//! Checks which variables relations `learn`: these count as constants, whose values are found while running.

use super::problems::Problems;
use super::scope::Names;
use crate::knowledge::draft::{RelationDraft, Text};
use crate::knowledge::{IdVec, Learned, Relation, RelationId, Shape, Signal, SignalId, Variable, VariableId};
use alloc::format;
use alloc::vec::Vec;

/// A variable that a relation learns, as it is written.
pub(super) struct Learning {
    pub(super) name: Text,
    pub(super) variable: VariableId,
    pub(super) relation: RelationId,
}

impl Learning {
    /// What a relation learns; unknown names are reported.
    pub(super) fn of(
        problems: &mut Problems,
        draft: &RelationDraft,
        relation: RelationId,
        names: &Names,
    ) -> Vec<Learning> {
        let learning = |name: &Text| {
            let variable = names.variables.look_up(problems, name)?;
            Some(Learning { name: name.clone(), variable, relation })
        };
        draft.learn.iter().filter_map(learning).collect()
    }
}

/// Makes the learned variables constants of their range. No relation computes a constant, so the formulas that would are taken
/// out, and those of the relations that learn go to the result.
pub(super) fn build(
    problems: &mut Problems,
    learning: &[Learning],
    variables: &mut IdVec<VariableId, Variable>,
    relations: &mut IdVec<RelationId, Relation>,
    signals: &IdVec<SignalId, Signal>,
) -> Vec<Learned> {
    let mut learned = Vec::new();
    for (at, Learning { name, variable, relation }) in learning.iter().enumerate() {
        let earlier = learning.iter().take(at);
        if earlier.into_iter().any(|it| (it.variable, it.relation) == (*variable, *relation)) {
            problems.error(name, format!("`{}` is given twice", name.text), "keep one");
            continue;
        }
        let formula = relations.find(*relation).and_then(|it| it.formula(*variable)).cloned();
        let obstacle = obstacle(&variables[*variable], *variable, signals);
        let unsolved =
            ("the relation cannot be solved for it", "name a variable that the relation determines");
        match (obstacle, formula) {
            (Some((what, help)), _) => report(problems, name, what, help),
            (None, None) => report(problems, name, unsolved.0, unsolved.1),
            (None, Some(formula)) => {
                learned.push(Learned { variable: *variable, relation: *relation, formula });
            }
        }
    }
    for Learned { variable, .. } in &learned {
        variables[*variable].constant = variables[*variable].range;
        relations.iter_mut().for_each(|relation| forget_output(relation, *variable));
    }
    for Learning { name, relation, .. } in learning {
        if relations.find(*relation).is_some_and(|relation| relation.outputs.is_empty()) {
            report(problems, name, "the relation determines nothing else", "add what it determines to `for`");
        }
    }
    learned
}

fn report(problems: &mut Problems, name: &Text, what: &str, help: &str) {
    problems.error(name, format!("`{}` cannot be learned: {what}", name.text), help);
}

/// Why a variable cannot be learned, and the help.
fn obstacle(
    variable: &Variable,
    id: VariableId,
    signals: &IdVec<SignalId, Signal>,
) -> Option<(&'static str, &'static str)> {
    if variable.constant.is_some() {
        return Some(("it is a constant", "declare it under `variables`, with `range` and `max_rate`"));
    }
    if variable.shape == Shape::Vector || variable.wraps.is_some() {
        return Some(("it is a vector, or wraps", "only numbers on a line are learned"));
    }
    if signals.iter().any(|signal| signal.variable == id) {
        return Some(("a signal carries it", "what is measured needs not be learned: take out one of them"));
    }
    if variable.range.is_none_or(|range| !range.is_bounded()) {
        return Some(("it has no `range`", "give the values that it can have while the plant is sound"));
    }
    variable.max_rate.is_none().then_some((
        "it has no `max_rate`",
        "give how fast it can change, such as `1 mohm/h`: faster changes are faults",
    ))
}

/// Takes the formula of an output out.
fn forget_output(relation: &mut Relation, output: VariableId) {
    if let Some(at) = relation.outputs.iter().position(|it| *it == output) {
        relation.outputs.remove(at);
        if at < relation.formulas.len() {
            relation.formulas.remove(at);
        }
    }
}
