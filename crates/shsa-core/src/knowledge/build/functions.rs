//! Checks the model's functions.

use super::problems::Problems;
use super::scope::Names;
use super::variables::Variables;
use crate::expression::{Function, Scope, check_function, parse_expression, parse_function_head};
use crate::knowledge::draft::{Source, Text};
use alloc::collections::BTreeMap;
use alloc::format;
use alloc::string::String;

/// Reads functions by name; an invalid function is left out.
pub(super) fn build(
    problems: &mut Problems,
    source: &mut dyn Source,
    variables: &Variables,
) -> BTreeMap<String, Function> {
    let mut functions = BTreeMap::new();
    source.functions(&mut |(head, body)| {
        let Some(function) = function(problems, head, body) else { return };
        let name = function.name.clone();
        let message = if variables.find(&name).is_some() {
            format!("`{name}` is a variable and a function")
        } else if functions.insert(name.clone(), function).is_some() {
            format!("function `{name}` is given twice")
        } else {
            return;
        };
        problems.error(head, message, "keep one, or rename one");
    });
    functions
}

/// Checks the bodies, now that all functions are known.
pub(super) fn check(problems: &mut Problems, source: &mut dyn Source, names: &Names) {
    source.functions(&mut |(head, body)| {
        let known = parse_function_head(&head.text).ok().and_then(|(name, _)| names.function(&name));
        for problem in known.map(|function| check_function(function, names)).unwrap_or_default() {
            problems.inside(body, problem);
        }
    });
    // What a function uses is used by the relations that call it, and not by the relation that is read next.
    names.take_used();
}

fn function(problems: &mut Problems, head: &Text, body: &Text) -> Option<Function> {
    let read = parse_function_head(&head.text).map_err(|problem| problems.inside(head, problem)).ok();
    let body = parse_expression(&body.text).map_err(|problem| problems.inside(body, problem)).ok();
    let (name, parameters) = read?;
    Some(Function { name, parameters, body: body? })
}
