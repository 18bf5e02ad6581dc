//! Checks variables and constants, and finds them by name.

use super::problems::Problems;
use super::quantity::{self, Kind};
use crate::expression::is_reserved;
use crate::interval::Interval;
use crate::knowledge::draft::{Bounds, Place, Source, Text, VariableDraft};
use crate::knowledge::index::Index;
use crate::knowledge::properties::SharedNames;
use crate::knowledge::{IdVec, KnowledgeBase, Properties, Shape, Variable, VariableId};
use crate::unit::Unit;
use alloc::collections::BTreeSet;
use alloc::format;
use alloc::vec::Vec;

/// Variables and constants, found by their names.
#[derive(Default)]
pub(super) struct Variables {
    pub(super) list: IdVec<VariableId, Variable>,
    names: Index<VariableId>,
    declared: Declared,
}

/// Where each variable and constant is declared.
pub(super) type Declared = IdVec<VariableId, Place>;

impl Variables {
    /// The variable of a name.
    pub(super) fn find(&self, name: &str) -> Option<VariableId> {
        self.names.find(name, |id| self.list[id].name.as_str())
    }

    /// The variable of a name; an unknown one is reported.
    pub(super) fn look_up(&self, problems: &mut Problems, name: &Text) -> Option<VariableId> {
        let found = self.find(&name.text);
        if found.is_none() {
            problems.unknown(
                name,
                "variable",
                self.list.len(),
                || self.names(),
                "declare it under `variables`",
            );
        }
        found
    }

    /// The variables of a list of names, ascending, each once; unknown names are reported.
    pub(super) fn look_up_all(&self, problems: &mut Problems, names: &[Text]) -> Vec<VariableId> {
        let mut found: Vec<_> = names.iter().filter_map(|name| self.look_up(problems, name)).collect();
        found.sort_unstable();
        found.dedup();
        found
    }

    /// The variables named anywhere in a text, even if it is no valid formula.
    pub(super) fn named_in(&self, text: &str) -> impl Iterator<Item = VariableId> {
        text.split(|c: char| !c.is_alphanumeric() && c != '_').filter_map(|word| self.find(word))
    }

    /// All names, in alphabetical order.
    pub(super) fn names(&self) -> Vec<&str> {
        let mut names: Vec<&str> = self.list.iter().map(|variable| variable.name.as_str()).collect();
        names.sort_unstable();
        names
    }

    /// The variables and constants, and their places.
    pub(super) fn into_parts(self) -> (IdVec<VariableId, Variable>, Declared) {
        (self.list, self.declared)
    }

    fn add(&mut self, place: Place, variable: Variable) {
        self.list.push(variable);
        self.declared.push(place);
    }

    /// Drops and reports repeated names; reports names that formulas could not use.
    fn check_names(&mut self, problems: &mut Problems) {
        self.index();
        let repeated = self.names.repeated(|id| self.list[id].name.as_str());
        for &(first, id) in &repeated {
            collision(problems, self.declared[id], &self.list[first], &self.list[id]);
        }
        if !repeated.is_empty() {
            let keep = |id: VariableId| repeated.binary_search_by_key(&id, |&(_, later)| later).is_err();
            self.list.retain(keep);
            self.declared.retain(keep);
            self.index();
        }
        for (variable, &place) in self.list.iter().zip(&self.declared) {
            if !is_name(&variable.name) {
                let help = "a name has letters, digits and `_`, begins with a letter, and means nothing else";
                problems.error(place, format!("`{}` cannot be a name", variable.name), help);
            }
        }
    }

    fn index(&mut self) {
        self.names = Index::new(self.list.len(), |id| self.list[id].name.as_str());
    }
}

/// Reads variables, then constants.
pub(super) fn build(problems: &mut Problems, source: &mut dyn Source) -> Variables {
    let mut variables = Variables::default();
    let mut names_of_properties = SharedNames::default();
    source.variables(&mut |draft| {
        let properties = quantity::properties(problems, &mut names_of_properties, &draft.properties);
        variables.add(draft.name.place, Variable { properties, ..variable(problems, draft) });
    });
    source.constants(&mut |(name, bounds)| variables.add(name.place, constant(problems, name, bounds)));
    variables.check_names(problems);
    variables
}

/// Warns of variables and constants that no signal, relation, formula or need uses.
pub(super) fn check_used(
    problems: &mut Problems,
    declared: &Declared,
    knowledge: &KnowledgeBase,
    mentioned: &BTreeSet<VariableId>,
) {
    let variables = knowledge.variables();
    let mut used = IdVec::filled(variables.len(), |id| mentioned.contains(&id));
    let related =
        knowledge.relations().iter().flat_map(|relation| relation.inputs.iter().chain(&relation.outputs));
    let carried = knowledge.signals().iter().map(|signal| &signal.variable);
    let needed = knowledge.needs().iter().map(|need| &need.variable);
    for &id in related.chain(carried).chain(needed) {
        used[id] = true;
    }
    for (id, variable) in variables.enumerate() {
        if !used[id] && is_name(&variable.name) {
            problems.warn(declared[id], format!("nothing uses `{}`", variable.name), "");
        }
    }
}

fn variable(problems: &mut Problems, draft: &VariableDraft) -> Variable {
    let unit = draft.unit.as_ref().and_then(|text| quantity::unit(problems, text));
    let shape = draft.shape.as_ref().map_or(Shape::Scalar, |text| shape(problems, text));
    Variable {
        name: draft.name.text.clone(),
        shape,
        range: draft.range.as_ref().and_then(|range| possible(problems, range, unit.as_ref())),
        max_rate: draft.max_rate.as_ref().and_then(|text| max_rate(problems, text, unit.as_ref())),
        wraps: draft.wraps.as_ref().and_then(|text| turn(problems, text, unit.as_ref(), shape)),
        constant: None,
        properties: Properties::new(),
        unit,
    }
}

/// Reads a constant; an invalid value becomes the whole number line, so that formulas can still be checked.
fn constant(problems: &mut Problems, name: &Text, bounds: &Bounds) -> Variable {
    let read = quantity::constant(problems, bounds);
    let (unit, value) = read.map_or((None, Interval::ENTIRE), |(unit, value)| (Some(unit), value));
    Variable {
        name: name.text.clone(),
        unit,
        shape: Shape::Scalar,
        range: None,
        max_rate: None,
        wraps: None,
        constant: Some(value),
        properties: Properties::new(),
    }
}

fn shape(problems: &mut Problems, text: &Text) -> Shape {
    let found = Shape::NAMES.into_iter().find(|(name, _)| *name == text.text);
    if found.is_none() {
        let message = format!("`{}` is no shape", text.text);
        problems.error(text, message, "write `scalar` (one number) or `vector` (a list of them)");
    }
    found.map_or(Shape::Scalar, |(_, shape)| shape)
}

/// Reads the turn after which the values of a variable repeat.
fn turn(problems: &mut Problems, text: &Text, unit: Option<&Unit>, shape: Shape) -> Option<f64> {
    if shape == Shape::Vector {
        problems.error(text, "`wraps` has no meaning for a vector", "leave it away");
        return None;
    }
    let turn = quantity::quantity(problems, text, unit, Kind::Difference)?;
    if turn <= 0.0 {
        problems.error(text, "a turn is above 0", "write what its values wrap at, such as `360 deg`");
        return None;
    }
    Some(turn)
}

pub(super) fn possible(
    problems: &mut Problems,
    (lo, hi): &(Text, Text),
    unit: Option<&Unit>,
) -> Option<Interval> {
    let low = quantity::bound(problems, lo, unit);
    let high = quantity::bound(problems, hi, unit);
    let (low, high) = quantity::ordered(problems, lo, low?, high?)?;
    Some(Interval::new(low, high))
}

/// Reads a rate; a plain number counts in this unit a second.
pub(super) fn max_rate(problems: &mut Problems, text: &Text, unit: Option<&Unit>) -> Option<f64> {
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

fn collision(problems: &mut Problems, at: Place, first: &Variable, second: &Variable) {
    let help = "keep one, or rename one";
    let kind = |variable: &Variable| if variable.constant.is_some() { "constant" } else { "variable" };
    let (one, other, name) = (kind(first), kind(second), &first.name);
    let message = match (first.constant, second.constant) {
        (Some(one), Some(other)) if one != other => format!("constant `{name}` has two values"),
        _ if one == other => format!("{one} `{name}` is given twice"),
        _ => format!("`{name}` is a {one} and a {other}"),
    };
    problems.error(at, message, help);
}

/// Whether a formula can use this name.
fn is_name(text: &str) -> bool {
    let begins = text.starts_with(|first: char| first.is_ascii_alphabetic() || first == '_');
    let goes_on = text.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_');
    begins && goes_on && !is_reserved(text)
}
