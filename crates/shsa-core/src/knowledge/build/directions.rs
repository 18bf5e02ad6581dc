//! Solves an equation for its variables: for those that `for` names, or for as many as possible.

use super::problems::Problems;
use super::scope::Names;
use crate::expression::{Equation, Formula, Problem, Severity, check_equation, parse_equation, solve};
use crate::knowledge::draft::{RelationDraft, Text};
use crate::knowledge::{Shape, VariableId};
use alloc::collections::BTreeSet;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;

/// At most this many reasons why an equation cannot be solved are reported.
const MAX_REASONS: usize = 3;
/// An equation is solved for at most this many variables: each gives a formula of the equation's size.
const MAX_DIRECTIONS: usize = 100;

/// The names after `for` and their variables.
pub(super) fn directions<'d>(
    problems: &mut Problems,
    draft: &'d RelationDraft,
    names: &Names,
) -> Option<Vec<(&'d Text, VariableId)>> {
    let wanted = draft.directions.as_ref()?;
    let learned = draft.learn.iter();
    if wanted.is_empty() || wanted.len() > MAX_DIRECTIONS {
        let message =
            format!("relation `{}` is to be solved for {} variables", draft.name.text, wanted.len());
        let help = format!("name 1 to {MAX_DIRECTIONS} variables after `for`, or leave `for` away");
        problems.error(&draft.name, message, help);
        return Some(Vec::new());
    }
    report_constants(problems, wanted, names);
    let mut found: Vec<(&Text, VariableId)> = wanted
        .iter()
        .chain(learned)
        .filter_map(|name| Some((name, names.variables.look_up(problems, name)?)))
        .filter(|(name, _)| !is_constant(names, &name.text))
        .collect();
    found.sort_by_key(|(_, id)| *id);
    found.dedup_by_key(|(_, id)| *id);
    Some(found)
}

/// Whether a condition reads a variable: where the relation does not hold, a result for it may look as if it did.
fn reads(condition: Option<&Formula>, id: VariableId) -> bool {
    condition.is_some_and(|condition| condition.occurrences(id.symbol()) > 0)
}

const PROVES_ITSELF: &str = "its own `when` reads it, so the result would prove its own condition";
const ANOTHER_CONDITION: &str =
    "write the condition about what it is computed from, or about another variable";

/// The formulas for the named variables; an impossible one is an error.
pub(super) fn named(
    problems: &mut Problems,
    wanted: &[(&Text, VariableId)],
    learn: &[Text],
    equation: &Equation,
    condition: Option<&Formula>,
    names: &Names,
) -> (Vec<VariableId>, Vec<Formula>) {
    let mut found = (Vec::new(), Vec::new());
    for &(name, id) in wanted {
        if reads(condition, id) {
            problems.warn(
                name,
                format!("`for` names `{}`, but {PROVES_ITSELF}", name.text),
                ANOTHER_CONDITION,
            );
        }
        match solve(equation, id.symbol(), names) {
            Ok(formula) => {
                found.0.push(id);
                found.1.push(formula);
            }
            Err(problem) => {
                let key = if learn.contains(name) { "learn" } else { "for" };
                let message = format!("`{key}` names `{}`, but {}", name.text, problem.message);
                problems.error(
                    name,
                    message,
                    problem.help.unwrap_or_else(|| "take it out of `for`".to_string()),
                );
            }
        }
    }
    found
}

/// The formulas for all possible variables; none at all is an error.
pub(super) fn every(
    problems: &mut Problems,
    text: &Text,
    equation: &Equation,
    condition: Option<&Formula>,
    used: &BTreeSet<VariableId>,
    names: &Names,
) -> (Vec<VariableId>, Vec<Formula>) {
    let mut found = (Vec::new(), Vec::new());
    let mut unsolved = Vec::new();
    if used.len() > MAX_DIRECTIONS {
        let message = format!("this relation holds {} variables", used.len());
        let help = format!("name those to solve for with `for`, at most {MAX_DIRECTIONS}");
        problems.error(text, message, help);
        return found;
    }
    for &id in used.iter().filter(|&&id| names.variables.list[id].constant.is_none()) {
        if reads(condition, id) {
            unsolved.push((id, Problem::error(0..0, PROVES_ITSELF).with_help(ANOTHER_CONDITION)));
            continue;
        }
        match solve(equation, id.symbol(), names) {
            Ok(formula) => {
                found.0.push(id);
                found.1.push(formula);
            }
            Err(problem) => unsolved.push((id, problem)),
        }
    }
    if found.0.is_empty() {
        let name = |id: VariableId| names.variables.list[id].name.as_str();
        let reasons: Vec<String> = unsolved.iter().map(|(id, problem)| reason(name(*id), problem)).collect();
        let (message, help) = unsolvable(equation, &reasons, names);
        problems.error(text, message, help);
    } else {
        note_unsolved(problems, text, equation, &unsolved, names);
    }
    found
}

/// Notes for which variables an equation is not solved: those with the same reason in one note, at the first of them.
fn note_unsolved(
    problems: &mut Problems,
    text: &Text,
    equation: &Equation,
    unsolved: &[(VariableId, Problem)],
    names: &Names,
) {
    let sides = check_equation(equation, names).sides;
    // A variable that only the condition reads, or only by its past, cannot be solved for.
    let is_in = |id: &VariableId| {
        let count = |side: &Formula| side.occurrences(id.symbol());
        sides.as_ref().is_some_and(|(lhs, rhs)| count(lhs) + count(rhs) > 0)
    };
    let mut by_reason: Vec<(&str, &Problem, Vec<&str>)> = Vec::new();
    // Aggregates of vectors have no inverse by design: no note.
    let is_number = |id: &VariableId| names.variables.list[*id].shape == Shape::Scalar;
    for (id, problem) in unsolved.iter().filter(|(id, _)| is_in(id) && is_number(id)) {
        let (message, name) = (why(problem), names.variables.list[*id].name.as_str());
        match by_reason.iter_mut().find(|(known, ..)| *known == message) {
            Some((.., same)) => same.push(name),
            None => by_reason.push((message, problem, Vec::from([name]))),
        }
    }
    // With an error, the solved equation is longer than the written text.
    let written = parse_equation(&text.text).ok();
    for (why, problem, variables) in by_reason {
        let place = |name: &&str| {
            let written = written.as_ref()?;
            written.lhs.places_of(name).into_iter().chain(written.rhs.places_of(name)).next()
        };
        let span = variables.iter().find_map(place).unwrap_or(0..text.text.len());
        let listed: Vec<String> = variables.iter().map(|name| format!("`{name}`")).collect();
        let message = format!("this relation is not solved for {}: {why}", listed.join(", "));
        let own = problem.help.as_ref().map(|help| format!("{help}; ")).unwrap_or_default();
        let help = format!("{own}where it is meant so, `for` names what it is solved for");
        problems.inside(text, Problem { severity: Severity::Note, span, message, help: Some(help) });
    }
}

fn reason(variable: &str, problem: &Problem) -> String {
    format!("not for `{variable}`: {}", why(problem))
}

/// The reason why an equation cannot be solved, without its introduction.
fn why(problem: &Problem) -> &str {
    let message = problem.message.as_str();
    message.strip_prefix("this cannot be solved for it: ").unwrap_or(message)
}

/// Why an equation can be solved for no variable, and the help.
fn unsolvable(equation: &Equation, reasons: &[String], names: &Names) -> (&'static str, String) {
    let sides = check_equation(equation, names).sides;
    let constants = sides.and_then(|(lhs, rhs)| lhs.as_constant().zip(rhs.as_constant()));
    if constants.is_some_and(|(lhs, rhs)| !lhs.bounds.overlaps(rhs.bounds)) {
        let help = "the two sides have different values: correct one of them";
        return ("the constants of this relation contradict each other", help.to_string());
    }
    if reasons.is_empty() {
        let help = "a relation says how variables determine each other";
        return ("this relation holds no variable", help.to_string());
    }
    let explained = reasons.get(..MAX_REASONS.min(reasons.len())).unwrap_or_default().join("; ");
    ("this relation can be solved for nothing", explained)
}

pub(super) fn report_constants(problems: &mut Problems, outputs: &[Text], names: &Names) {
    for name in outputs.iter().filter(|name| is_constant(names, &name.text)) {
        problems.error(name, format!("`{}` is a constant", name.text), "a constant is never computed");
    }
}

fn is_constant(names: &Names, name: &str) -> bool {
    names.variables.find(name).is_some_and(|id| names.variables.list[id].constant.is_some())
}
