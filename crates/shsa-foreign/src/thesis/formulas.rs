//! The candidate formulas for the code of a relation.

use shsa_core::knowledge::Text;
use std::collections::BTreeSet;

use super::names::Names;
use super::notes::Notes;
use super::python::{self, Translated, Trouble};
use super::sketch::Direction;

/// The candidates for a relation, the best first; none for structure only.
#[derive(Default)]
pub(super) struct Candidates {
    pub(super) equations: Vec<Candidate>,
    /// The code, for its place.
    pub(super) code: Option<Text>,
    /// Variables that are read as lists.
    pub(super) vectors: BTreeSet<String>,
    /// The outputs and inputs, to which the relation returns when no formula is accepted.
    pub(super) structure: Option<(Vec<Text>, Vec<Text>)>,
}

/// An equation and its condition.
pub(super) struct Candidate {
    pub(super) equation: Text,
    pub(super) condition: Option<Text>,
}

/// The use of a relation that stays structure.
pub(super) const STRUCTURE: &str = "the relation is structure only: it can be planned and analysed, not run";

/// Whether a piece of code assigns to a variable.
pub(super) fn assigns(code: &Text, output: &str) -> bool {
    code.text.lines().any(|line| {
        let target = line.split('=').next().unwrap_or("").trim();
        target == output || target.strip_suffix(".v") == Some(output)
    })
}

/// Translates the code of one direction; code without a translation is reported.
pub(super) fn candidates(
    notes: &mut Notes,
    names: &Names,
    relation: &Text,
    direction: &Direction,
) -> Candidates {
    let Some(code) = direction.code.as_ref().filter(|code| !code.text.trim().is_empty()) else {
        if let Some(constraint) = &direction.constraint {
            let message =
                format!("the constraint of relation `{}` is left out: it has no formula", relation.text);
            notes.warn(constraint, message, STRUCTURE);
        }
        return Candidates::default();
    };
    let mut equations = Vec::new();
    let mut vectors = BTreeSet::new();
    for plain_angles in [false, true] {
        match both(names, direction, code, plain_angles) {
            Ok((formula, condition)) => {
                if !plain_angles {
                    described(notes, direction, code, names, &formula, condition.as_ref());
                    vectors.extend(formula.vectors.iter().cloned());
                }
                let candidate = candidate(names, direction, code, formula, condition);
                if equations.iter().all(|other: &Candidate| !other.says_the_same(&candidate)) {
                    equations.push(candidate);
                }
            }
            Err((text, trouble)) => {
                notes.inside(
                    text,
                    trouble.span,
                    format!("this cannot be taken over: {}", trouble.message),
                    STRUCTURE,
                );
                return Candidates::default();
            }
        }
    }
    notes.rewritten.insert(code.place.from);
    notes.rewritten.extend(direction.constraint.as_ref().map(|constraint| constraint.place.from));
    Candidates { equations, code: Some(code.clone()), vectors, structure: None }
}

impl Candidate {
    fn says_the_same(&self, other: &Candidate) -> bool {
        let condition = |candidate: &Candidate| candidate.condition.as_ref().map(|text| text.text.clone());
        self.equation.text == other.equation.text && condition(self) == condition(other)
    }
}

type Both = (Translated, Option<Translated>);

/// The formula and the condition, or the text that could not be translated.
fn both<'t>(
    names: &Names,
    direction: &'t Direction,
    code: &'t Text,
    plain_angles: bool,
) -> Result<Both, (&'t Text, Trouble)> {
    let ours = |name: &'t Text| (name.text.as_str(), names.find(&name.text).unwrap_or(&name.text));
    let inputs = direction.inputs.iter().filter(|input| input.text != direction.output.text);
    let mut inputs: Vec<(&str, &str)> = inputs.map(ours).collect();
    let own = python::Names { output: Some(&direction.output.text), inputs: inputs.clone(), plain_angles };
    let formula = python::translate(&code.text, &own).map_err(|trouble| (code, trouble))?;
    let Some(constraint) = &direction.constraint else { return Ok((formula, None)) };
    inputs.push(ours(&direction.output));
    let own = python::Names { output: None, inputs, plain_angles };
    let condition = python::translate(&constraint.text, &own).map_err(|trouble| (constraint, trouble))?;
    Ok((formula, Some(condition)))
}

fn candidate(
    names: &Names,
    direction: &Direction,
    code: &Text,
    formula: Translated,
    condition: Option<Translated>,
) -> Candidate {
    let output = names.find(&direction.output.text).unwrap_or(&direction.output.text);
    let equation = Text { text: format!("{output} = {}", formula.formula), place: code.place };
    let place = direction.constraint.as_ref().map_or(code.place, |constraint| constraint.place);
    let condition = condition.map(|condition| Text { text: condition.formula, place });
    Candidate { equation, condition }
}

/// Reports inputs that are not read, and a time that is not taken over.
fn described(
    notes: &mut Notes,
    direction: &Direction,
    code: &Text,
    names: &Names,
    formula: &Translated,
    condition: Option<&Translated>,
) {
    for input in direction.inputs.iter().filter(|input| input.text != direction.output.text) {
        let ours = names.find(&input.text).unwrap_or(&input.text);
        if !formula.used.contains(ours) && condition.is_none_or(|condition| !condition.used.contains(ours)) {
            let message =
                format!("the formula does not read the input `{}`: it is no input any more", input.text);
            notes.warn(input, message, "");
        }
    }
    if let Some(place) = &formula.time {
        let help = "a result is valid where the times of all its inputs overlap";
        notes.inside(code, place.clone(), "this time is not taken over", help);
    }
}
