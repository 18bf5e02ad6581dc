//! Checks temporal specifications, and makes of each the two relations that know its verdict.

use super::parsed::condition;
use super::problems::Problems;
use super::quantity;
use super::scope::Names;
use crate::expression::{Constant, Formula, answered, implied, once, truth_as_number};
use crate::knowledge::draft::{BodyDraft, RelationDraft, Requirement, SpecificationDraft, Text};
use crate::knowledge::properties::{PRIOR, Properties};
use crate::knowledge::{Relation, VariableId};
use crate::time::Span;
use alloc::format;
use alloc::vec::Vec;

/// The longest time of a specification.
const LONGEST: Span = Span::from_millis(1_000_000_000);

/// The relation that computes the verdict.
pub(super) fn verdict(
    problems: &mut Problems,
    draft: &RelationDraft,
    specification: &SpecificationDraft,
    names: &Names,
) -> Option<Relation> {
    let variable = names.variables.look_up(problems, &draft.name)?;
    let formula = formula(problems, specification, names);
    let inputs: Vec<VariableId> = names.take_used().into_iter().collect();
    let formula = formula?;
    if inputs.is_empty() {
        problems.error(
            &draft.name,
            "this specification is about no variable",
            "name variables in its conditions",
        );
        return None;
    }
    Some(Relation {
        name: draft.name.text.clone(),
        inputs,
        outputs: Vec::from([variable]),
        formulas: Vec::from([truth_as_number(formula)]),
        condition: None,
        text: specification.text(),
        properties: Properties::new(),
    })
}

/// The variable of a specification's verdict, and the relation that requires it, which is never the one that is wrong; `None` for
/// other relations.
pub(super) fn required(draft: &RelationDraft, verdict: &Relation) -> Option<(VariableId, Relation)> {
    let (BodyDraft::Specification(_), [variable]) = (&draft.body, verdict.outputs.as_slice()) else {
        return None;
    };
    let mut properties = Properties::new();
    properties.insert(PRIOR, 0.0);
    let required = Relation {
        name: format!("{} is required", verdict.name),
        inputs: Vec::new(),
        outputs: Vec::from([*variable]),
        formulas: Vec::from([Formula::constant(Constant::exact(1.0))]),
        condition: None,
        text: format!("{} = 1", verdict.name),
        properties,
    };
    Some((*variable, required))
}

/// Whether the specification holds, as a condition.
fn formula(problems: &mut Problems, specification: &SpecificationDraft, names: &Names) -> Option<Formula> {
    let when = specification.when.as_ref().map(|when| condition(problems, when, names));
    match &specification.what {
        Requirement::Always(what, span) => {
            let what = condition(problems, what, names);
            let span = span.as_ref().map(|text| span_of(problems, text));
            match (when, span) {
                (None, None) => what,
                (Some(when), None) => Some(implied(what?, when?)),
                (Some(when), Some(span)) => Some(implied(what?, once(when?, span?))),
                (None, Some(_)) => {
                    let at = specification.texts().last()?;
                    problems.error(
                        at,
                        "`for` has no meaning without `when`",
                        "say since when, or leave `for` away",
                    );
                    None
                }
            }
        }
        Requirement::Eventually(what, span) => {
            let what = condition(problems, what, names);
            let span = span_of(problems, span);
            match when {
                Some(when) => Some(answered(when?, what?, span?)),
                None => Some(once(what?, span?)),
            }
        }
    }
}

fn span_of(problems: &mut Problems, text: &Text) -> Option<Span> {
    let span = quantity::span(problems, text)?;
    if span > Span::ZERO && span <= LONGEST {
        return Some(span);
    }
    problems.error(
        text,
        format!("`{}` is no time to wait for", text.text),
        "write more than 0 s, at most a million seconds",
    );
    None
}
