//! Checks variables and constants, and finds them by name.

use super::problems::Problems;
use super::quantity::{self, Kind};
use crate::expression::{Node, is_reserved, parse_expression};
use crate::interval::Interval;
use crate::knowledge::draft::{Bounds, Draft, Text, VariableDraft};
use crate::knowledge::{IdVec, KnowledgeBase, Properties, Shape, Variable, VariableId};
use crate::unit::Unit;
use alloc::collections::{BTreeMap, BTreeSet};
use alloc::format;
use alloc::vec::Vec;

/// Variables and constants with their names.
#[derive(Default)]
pub(super) struct Variables<'d> {
    pub(super) list: IdVec<VariableId, Variable>,
    names: BTreeMap<&'d str, VariableId>,
    /// Where each is declared, in the order of the list.
    declared: Vec<&'d Text>,
}

impl<'d> Variables<'d> {
    /// The variable of a name.
    pub(super) fn find(&self, name: &str) -> Option<VariableId> {
        self.names.get(name).copied()
    }

    /// The variable of a name; an unknown one is reported.
    pub(super) fn look_up(&self, problems: &mut Problems, name: &Text) -> Option<VariableId> {
        let found = self.find(&name.text);
        if found.is_none() {
            problems.unknown(name, "variable", self.names(), "declare it under `variables`");
        }
        found
    }

    /// Those of a list of names, ascending, each once; unknown ones are reported.
    pub(super) fn look_up_all(&self, problems: &mut Problems, names: &[Text]) -> Vec<VariableId> {
        let mut found: Vec<_> = names.iter().filter_map(|name| self.look_up(problems, name)).collect();
        found.sort_unstable();
        found.dedup();
        found
    }

    /// The variables that are named anywhere in a text, whether it is a formula or not.
    pub(super) fn named_in(&self, text: &str) -> impl Iterator<Item = VariableId> {
        text.split(|c: char| !c.is_alphanumeric() && c != '_').filter_map(|word| self.find(word))
    }

    /// All names, in alphabetical order.
    pub(super) fn names(&self) -> impl ExactSizeIterator<Item = &'d str> + '_ {
        self.names.keys().copied()
    }

    fn add(&mut self, problems: &mut Problems, name: &'d Text, variable: Variable) {
        if let Some(&other) = self.names.get(name.text.as_str()) {
            collision(problems, name, &self.list[other], &variable);
            return;
        }
        if !is_name(&name.text) {
            let help = "a name has letters, digits and `_`, begins with a letter, and means nothing else";
            problems.error(name, format!("`{}` cannot be a name", name.text), help);
        }
        let id = self.list.push(variable);
        self.names.insert(&name.text, id);
        self.declared.push(name);
    }
}

/// Reads variables, then constants.
pub(super) fn build<'d>(problems: &mut Problems, draft: &'d Draft) -> Variables<'d> {
    let mut variables = Variables::default();
    for draft in &draft.variables {
        let variable = variable(problems, draft);
        variables.add(problems, &draft.name, variable);
    }
    for (name, bounds) in &draft.constants {
        let variable = constant(problems, name, bounds);
        variables.add(problems, name, variable);
    }
    variables
}

/// Warns of variables and constants that nothing carries, computes, reads or needs.
pub(super) fn check_used(
    problems: &mut Problems,
    variables: &Variables,
    knowledge: &KnowledgeBase,
    mentioned: &BTreeSet<VariableId>,
) {
    let mut used = mentioned.clone();
    used.extend(
        knowledge.relations().iter().flat_map(|relation| relation.inputs.iter().chain(&relation.outputs)),
    );
    used.extend(knowledge.signals().iter().map(|signal| signal.variable));
    used.extend(knowledge.needs().iter().map(|need| need.variable));
    for (id, name) in variables.list.ids().zip(&variables.declared) {
        if !used.contains(&id) && is_name(&name.text) {
            problems.warn(name, format!("nothing uses `{}`", name.text), "");
        }
    }
}

fn variable(problems: &mut Problems, draft: &VariableDraft) -> Variable {
    let unit = draft.unit.as_ref().and_then(|text| quantity::unit(problems, text));
    Variable {
        name: draft.name.text.clone(),
        shape: draft.shape.as_ref().map_or(Shape::Scalar, |text| shape(problems, text)),
        range: draft.range.as_ref().and_then(|range| possible(problems, range, unit.as_ref())),
        max_rate: draft.max_rate.as_ref().and_then(|text| max_rate(problems, text, unit.as_ref())),
        constant: None,
        properties: quantity::properties(problems, &draft.properties),
        unit,
    }
}

/// A constant whose value is wrong is any number, so that what uses it can still be checked.
fn constant(problems: &mut Problems, name: &Text, bounds: &Bounds) -> Variable {
    let read = quantity::constant(problems, bounds);
    let (unit, value) = read.map_or((None, Interval::ENTIRE), |(unit, value)| (Some(unit), value));
    Variable {
        name: name.text.clone(),
        unit,
        shape: Shape::Scalar,
        range: None,
        max_rate: None,
        constant: Some(value),
        properties: Properties::new(),
    }
}

fn shape(problems: &mut Problems, text: &Text) -> Shape {
    match text.text.as_str() {
        "scalar" => Shape::Scalar,
        "vector" => Shape::Vector,
        _ => {
            let message = format!("`{}` is no shape", text.text);
            problems.error(text, message, "write `scalar` (one number) or `vector` (a list of them)");
            Shape::Scalar
        }
    }
}

fn possible(problems: &mut Problems, (lo, hi): &(Text, Text), unit: Option<&Unit>) -> Option<Interval> {
    let low = quantity::bound(problems, lo, unit);
    let high = quantity::bound(problems, hi, unit);
    let (low, high) = quantity::ordered(problems, lo, low?, high?)?;
    Some(Interval::new(low, high))
}

/// A plain number counts in the variable's unit a second.
fn max_rate(problems: &mut Problems, text: &Text, unit: Option<&Unit>) -> Option<f64> {
    let a_second = unit.and_then(|unit| Unit::parse(&format!("{unit}/s")).ok());
    let rate = quantity::quantity(problems, text, a_second.as_ref(), Kind::Difference)?;
    if rate <= 0.0 {
        problems.error(
            text,
            "a largest rate of change is above 0",
            "leave `max_rate` away when it is not known",
        );
        return None;
    }
    Some(rate)
}

fn collision(problems: &mut Problems, name: &Text, first: &Variable, second: &Variable) {
    let help = "keep one, or rename one";
    let kind = |variable: &Variable| if variable.constant.is_some() { "constant" } else { "variable" };
    let (one, other) = (kind(first), kind(second));
    let message = match (first.constant, second.constant) {
        (Some(one), Some(other)) if one != other => format!("constant `{}` has two values", name.text),
        _ if one == other => format!("{one} `{}` is given twice", name.text),
        _ => format!("`{}` is a {one} and a {other}", name.text),
    };
    problems.error(name, message, help);
}

/// Whether a formula can use this name.
fn is_name(text: &str) -> bool {
    let alone =
        matches!(parse_expression(text), Ok(read) if matches!(&read.node, Node::Name(name) if name == text));
    alone && !is_reserved(text)
}
