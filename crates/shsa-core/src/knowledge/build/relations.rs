//! Checks relations, and solves equations for as many of their variables as possible.

use super::directions::{directions, every, named, report_constants};
use super::learning::Learning;
use super::parsed::{condition, reported};
use super::problems::Problems;
use super::quantity;
use super::scope::Names;
use super::{specifications, turns, vague};
use crate::expression::{CheckedEquation, Equation, Node, check_equation, parse_equation};
use crate::knowledge::draft::{BodyDraft, Bounds, Place, RelationDraft, Source, Text};
use crate::knowledge::index::Index;
use crate::knowledge::properties::SharedNames;
use crate::knowledge::{IdVec, Relation, RelationId, Specification, ValueError, VariableId};
use crate::unit::{Dimension, Unit};
use alloc::collections::BTreeSet;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::mem;

/// The relations of a model.
pub(super) struct Built {
    pub(super) relations: IdVec<RelationId, Relation>,
    /// The variables of relations that are invalid and left out.
    pub(super) undecided: BTreeSet<VariableId>,
    pub(super) learning: Vec<Learning>,
    pub(super) specifications: Vec<Specification>,
    /// Where relations with formulas are declared; empty when some relations were given twice.
    pub(super) places: Vec<(RelationId, Place)>,
}

/// Reads relations.
pub(super) fn build(problems: &mut Problems, source: &mut dyn Source, names: &Names) -> Built {
    let mut relations = IdVec::new();
    let mut specifications = Vec::new();
    let mut names_of_properties = SharedNames::default();
    let mut declared: IdVec<RelationId, Place> = IdVec::new();
    let mut undecided = BTreeSet::new();
    let mut learning = Vec::new();
    source.relations(&mut |draft| {
        problems.printable(&draft.name);
        let relation = match &draft.body {
            BodyDraft::Equation(text) => equation(problems, draft, text, names),
            BodyDraft::Structure { outputs, inputs } => structure(problems, draft, outputs, inputs, names),
            BodyDraft::Specification(specification) => {
                specifications::verdict(problems, draft, specification, names)
            }
        };
        let properties = quantity::properties(problems, &mut names_of_properties, &draft.properties);
        if let Some(relation) = relation {
            let relation = Relation { properties, ..relation };
            let required = specifications::required(draft, &relation);
            let relation = relations.push(relation);
            learning.extend(Learning::of(problems, draft, relation, names));
            declared.push(draft.name.place);
            if let Some((variable, required)) = required {
                let required = relations.push(required);
                specifications.push(Specification { variable, verdict: relation, required });
                declared.push(draft.name.place);
            }
        } else {
            undecided.extend(named_by(draft, names));
        }
    });
    drop_repeated(problems, &mut relations, &declared);
    if relations.len() < declared.len() {
        specifications.clear();
    }
    let places = vague::places(&relations, &declared);
    Built { relations, undecided, learning, specifications, places }
}

/// Drops and reports the relations that have the name of an earlier one.
fn drop_repeated(
    problems: &mut Problems,
    relations: &mut IdVec<RelationId, Relation>,
    declared: &IdVec<RelationId, Place>,
) {
    let name = |id: RelationId| relations[id].name.as_str();
    let repeated = Index::new(relations.len(), name).repeated(name);
    for &(_, id) in &repeated {
        problems.error(declared[id], format!("relation `{}` is given twice", name(id)), "keep one");
    }
    if !repeated.is_empty() {
        relations.retain(|id| repeated.binary_search_by_key(&id, |&(_, later)| later).is_err());
    }
}

fn named_by(draft: &RelationDraft, names: &Names) -> Vec<VariableId> {
    let texts: Vec<&Text> = match &draft.body {
        BodyDraft::Equation(text) => Vec::from([text]),
        BodyDraft::Structure { outputs, inputs } => outputs.iter().chain(inputs).collect(),
        BodyDraft::Specification(specification) => specification.texts().chain([&draft.name]).collect(),
    };
    texts.into_iter().flat_map(|text| names.variables.named_in(&text.text)).collect()
}

fn structure(
    problems: &mut Problems,
    draft: &RelationDraft,
    outputs: &[Text],
    inputs: &[Text],
    names: &Names,
) -> Option<Relation> {
    let equations_only = [("for", draft.directions.is_some()), ("when", draft.condition.is_some())];
    let equations_only = equations_only.into_iter().chain([("error", draft.error.is_some())]);
    for (key, _) in equations_only.filter(|(_, given)| *given) {
        let message =
            format!("`{key}` has no meaning in relation `{}`, which has no equation", draft.name.text);
        problems.error(&draft.name, message, "give an `equation`, or leave it away");
    }
    let found = names.variables.look_up_all(problems, outputs);
    let inputs = names.variables.look_up_all(problems, inputs);
    let constant = found.iter().any(|&id| names.variables.list[id].constant.is_some());
    if constant {
        report_constants(problems, outputs, names);
    }
    if found.is_empty() || constant {
        return None;
    }
    if let [output] = found.as_slice()
        && inputs.as_slice() == [*output]
    {
        let message = format!("relation `{}` reads only what it produces", draft.name.text);
        problems.error(&draft.name, message, "name other inputs");
        return None;
    }
    Some(Relation { inputs, outputs: found, ..unsolved(draft, "") })
}

fn equation(problems: &mut Problems, draft: &RelationDraft, text: &Text, names: &Names) -> Option<Relation> {
    let parsed = reported(problems, text, parse_equation(&text.text));
    let equation = parsed.and_then(|parsed| checked(problems, draft, text, parsed, names));
    let mut inputs = names.take_used();
    let wanted = directions(problems, draft, names);
    let condition = draft.condition.as_ref().and_then(|text| condition(problems, text, names));
    inputs.extend(names.take_used());
    let equation = equation?;
    let directions = wanted.as_ref().map_or(inputs.len(), Vec::len);
    if !names.may_solve(directions, inputs.len()) {
        let help = "name the variables to solve for with `for`, or split the equations";
        problems.error(text, "the equations of this model hold too many variables", help);
        return None;
    }
    let (outputs, formulas) = match wanted {
        Some(wanted) => named(problems, &wanted, &draft.learn, &equation, condition.as_ref(), names),
        None => every(problems, text, &equation, condition.as_ref(), &inputs, names),
    };
    names.take_used();
    let formulas = turns::around(&outputs, formulas, names);
    let inputs = inputs.into_iter().collect();
    let solved = Relation { inputs, outputs, formulas, condition, ..unsolved(draft, &text.text) };
    turns::note(problems, text, &solved, names);
    (!solved.outputs.is_empty()).then_some(solved)
}

/// The relation before it is solved.
fn unsolved(draft: &RelationDraft, text: &str) -> Relation {
    Relation {
        name: draft.name.text.clone(),
        inputs: Vec::new(),
        outputs: Vec::new(),
        formulas: Vec::new(),
        condition: None,
        text: text.to_string(),
        properties: crate::knowledge::Properties::new(),
    }
}

/// The equation including the relation's own error; `None` when there is a problem.
fn checked(
    problems: &mut Problems,
    draft: &RelationDraft,
    text: &Text,
    parsed: Equation,
    names: &Names,
) -> Option<Equation> {
    let mut checked = check_equation(&parsed, names);
    for problem in mem::take(&mut checked.problems) {
        problems.inside(text, problem);
    }
    let Some(bounds) = &draft.error else { return checked.sides.and(Some(parsed)) };
    let error = error(problems, bounds, &parsed, checked.dimension, names);
    checked.sides.as_ref()?;
    let error = error?;
    if let (Bounds::One(at), true) = (bounds, checked.is_affine && error.relative > 0.0) {
        let message = "a share of a temperature counts from absolute zero: 2 % of 20 degC are 5.9 K";
        problems.warn(at, message, "write the error in K, such as `0.5 K`");
    }
    parse_equation(&loosened(&text.text, &parsed, error, &checked)?).ok()
}

/// The error in SI; a plain number counts in the unit of the left side when that is a variable.
fn error(
    problems: &mut Problems,
    bounds: &Bounds,
    parsed: &Equation,
    dimension: Option<Dimension>,
    names: &Names,
) -> Option<ValueError> {
    let of_variable = match &parsed.lhs.node {
        Node::Name(name) => names.variables.find(name).and_then(|id| names.variables.list[id].unit.clone()),
        _ => None,
    };
    let unit = of_variable.or_else(|| dimension.map(Unit::si));
    quantity::value_error(problems, bounds, unit.as_ref())
}

/// The equation's text including the error.
fn loosened(text: &str, parsed: &Equation, error: ValueError, checked: &CheckedEquation) -> Option<String> {
    let between = parsed.lhs.span.end..parsed.rhs.span.start;
    let at = between.start + text.get(between)?.find('=')?;
    let (lhs, rhs) = (text.get(..at)?, text.get(at + 1..)?);
    let unit = checked.dimension.filter(|&dimension| dimension != Dimension::PLAIN);
    let unit = unit.map(|unit| format!(" {unit}")).unwrap_or_default();
    let (lo, hi) = (error.lo, error.hi);
    let (less, more) = (1.0 - error.relative, 1.0 + error.relative);
    let share = match (error.relative > 0.0, checked.is_affine) {
        (false, _) => format!("({rhs})"),
        (true, false) => format!("({rhs}) * interval({less}, {more})"),
        // The share is one of the absolute temperature; `0 K` makes that of a point, and a point of it again.
        (true, true) => format!("(({rhs}) - 0 K) * interval({less}, {more}) + 0 K"),
    };
    Some(format!("{lhs} = {share} + interval({lo}{unit}, {hi}{unit})"))
}
