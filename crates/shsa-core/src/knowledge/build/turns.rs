//! Notes relations that compute a variable without `wraps` from a variable with `wraps`.

use super::problems::Problems;
use super::scope::{Names, variable};
use crate::expression::{Binary, Formula, Operation, Unary};
use crate::knowledge::draft::Text;
use crate::knowledge::{Relation, Variable, VariableId};
use alloc::collections::BTreeSet;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::f64::consts::TAU;

/// Notes each output that does not wrap but contains whole turns of its inputs.
pub(super) fn note(problems: &mut Problems, text: &Text, relation: &Relation, names: &Names) {
    for (&output, formula) in relation.outputs.iter().zip(&relation.formulas) {
        let described = &names.variables.list[output];
        if described.wraps.is_some() {
            continue;
        }
        let mut found = BTreeSet::new();
        taken_over(formula, names, &mut found);
        let turns: BTreeSet<String> = found.iter().map(|&id| turn(&names.variables.list[id])).collect();
        let wrapping: Vec<String> =
            found.iter().map(|&id| format!("`{}`", names.variables.list[id].name)).collect();
        let (Some(turn), false) = (turns.first(), wrapping.is_empty()) else { continue };
        let (name, wrapping) = (&described.name, wrapping.join(" and "));
        let (message, help) = match found.len() {
            1 => (
                format!(
                    "`{name}` does not wrap, and is computed from {wrapping}, which does: it steps by whole turns"
                ),
                format!("declare `wraps: {turn}` for `{name}` too, or use `sin` and `cos` of {wrapping}"),
            ),
            _ => (
                format!(
                    "`{name}` does not wrap, and is computed from {wrapping}, which do: their difference is taken the shorter way round"
                ),
                format!(
                    "declare `wraps: {turn}` for `{name}` too; without it, it is right within half a turn to either side of 0"
                ),
            ),
        };
        problems.note(text, message, help);
    }
}

/// The formulas of outputs; those of angles that wrap at a whole turn without the cut of `atan2`.
pub(super) fn around(outputs: &[VariableId], formulas: Vec<Formula>, names: &Names) -> Vec<Formula> {
    let is_angle = |output: &VariableId| {
        names.variables.list[*output].wraps.is_some_and(|turn| (turn / TAU - 1.0).abs() < 1e-6)
    };
    let formulas = outputs.iter().zip(formulas);
    formulas.map(|(output, formula)| if is_angle(output) { formula.around() } else { formula }).collect()
}

fn turn(variable: &Variable) -> String {
    let turn = variable.wraps.unwrap_or(0.0);
    match &variable.unit {
        Some(unit) => format!("{} {unit}", libm::round(turn / unit.scale * 1e6) / 1e6),
        None => turn.to_string(),
    }
}

/// The wrapping variables whose whole turns show in a formula's value.
fn taken_over(formula: &Formula, names: &Names, found: &mut BTreeSet<VariableId>) {
    match formula.operation() {
        Operation::Symbol(symbol) => {
            let id = variable(symbol);
            if names.variables.list.find(id).is_some_and(|variable| variable.wraps.is_some()) {
                found.insert(id);
            }
        }
        // A comparison is reported where its value is used; a rate of change has no turns.
        Operation::Compare(_) | Operation::Derivative(_) => {}
        Operation::Unary(Unary::Sin | Unary::Cos | Unary::Tan)
            if formula.arguments().iter().all(|of| is_periodic(of, names)) => {}
        _ => formula.arguments().iter().for_each(|argument| taken_over(argument, names, found)),
    }
}

/// Whether sine and cosine of a formula stay the same after a turn of any of its variables.
fn is_periodic(formula: &Formula, names: &Names) -> bool {
    match formula.operation() {
        Operation::Symbol(symbol) => {
            let wraps = names.variables.list.find(variable(symbol)).and_then(|variable| variable.wraps);
            wraps.is_none_or(|turn| {
                let turns = turn / TAU;
                (turns - libm::round(turns)).abs() < 1e-6
            })
        }
        Operation::Binary(Binary::Add | Binary::Sub) | Operation::Unary(Unary::Neg) => {
            formula.arguments().iter().all(|argument| is_periodic(argument, names))
        }
        _ => {
            let mut found = BTreeSet::new();
            taken_over(formula, names, &mut found);
            found.is_empty()
        }
    }
}
