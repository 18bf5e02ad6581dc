//! Tests of formulas, on a small model.

use super::*;
use std::string::{String, ToString};
use std::vec;

mod affine;
mod checking;
mod enclosing;
mod evaluation;
mod offset;
mod oracle;
mod random;
mod solving;
mod tables;
mod temporal;
mod tightness;
mod time;

/// A model for tests: variables with shape, unit, range; functions.
pub(super) struct Model {
    variables: Vec<(&'static str, Kind)>,
    functions: Vec<Function>,
}

impl Model {
    pub(super) fn new() -> Model {
        Model { variables: Vec::new(), functions: Vec::new() }
    }

    pub(super) fn variable(mut self, name: &'static str, unit: &str, range: Option<(f64, f64)>) -> Model {
        let unit = (!unit.is_empty()).then(|| Unit::parse(unit).unwrap());
        let bounds = range.map(|(lo, hi)| Interval::new(lo, hi));
        let range = bounds.map(|range| unit.as_ref().map_or(range, |unit| unit.to_si_interval(range)));
        self.variables.push((name, Kind { shape: Shape::Scalar, unit, range, constant: None }));
        self
    }

    pub(super) fn vector(mut self, name: &'static str, unit: &str) -> Model {
        self = self.variable(name, unit, None);
        self.variables.last_mut().unwrap().1.shape = Shape::Vector;
        self
    }

    pub(super) fn constant(mut self, name: &'static str, quantity: &str) -> Model {
        let checked = check(&parse_expression(quantity).unwrap(), &self);
        self = self.variable(name, "", None);
        let kind = &mut self.variables.last_mut().unwrap().1;
        kind.unit = checked.dimension.map(Unit::si);
        kind.constant = checked.formula.unwrap().as_constant();
        self
    }

    pub(super) fn define(mut self, head: &str, body: &str) -> Model {
        let (name, parameters) = parse_function_head(head).unwrap();
        self.functions.push(Function { name, parameters, body: parse_expression(body).unwrap() });
        self
    }

    pub(super) fn name(&self, symbol: Symbol) -> String {
        self.variables[symbol.0 as usize].0.to_string()
    }

    pub(super) fn text(&self, formula: &Formula) -> String {
        formula.to_text(&|symbol| self.name(symbol))
    }

    /// The checked formula of a text without errors.
    #[track_caller]
    pub(super) fn formula(&self, text: &str) -> Formula {
        let expression = parse_expression(text).unwrap_or_else(|problem| panic!("{text}: {problem}"));
        let checked = check(&expression, self);
        checked.formula.unwrap_or_else(|| panic!("{text}: {:?}", checked.problems))
    }

    /// All problems of a formula, one a line: the marked text, the message, the help.
    pub(super) fn problems(&self, text: &str) -> String {
        let problems = match parse_expression(text) {
            Ok(expression) => check(&expression, self).problems,
            Err(problem) => vec![problem],
        };
        described(text, &problems)
    }

    /// All problems of an equation.
    pub(super) fn equation_problems(&self, text: &str) -> String {
        let problems = match parse_equation(text) {
            Ok(equation) => check_equation(&equation, self).problems,
            Err(problem) => vec![problem],
        };
        described(text, &problems)
    }

    /// The solution of an equation for a variable, or the problem.
    pub(super) fn solved(&self, equation: &str, wanted: &str) -> String {
        let wanted = self.symbol(wanted).unwrap();
        match solve(&parse_equation(equation).unwrap(), wanted, self) {
            Ok(formula) => self.text(&formula),
            Err(problem) => described(equation, &[problem]),
        }
    }
}

pub(super) fn described(text: &str, problems: &[Problem]) -> String {
    let lines = problems.iter().map(|problem| {
        let mark =
            text.get(problem.span.clone()).unwrap_or_else(|| panic!("{text}: no text at {:?}", problem.span));
        let severity = if problem.severity == Severity::Error { "" } else { "warning: " };
        let help = problem.help.as_ref().map(|help| std::format!(" -- {help}")).unwrap_or_default();
        std::format!("{severity}[{mark}] {}{help}", problem.message)
    });
    lines.collect::<Vec<_>>().join("\n")
}

impl Scope for Model {
    fn symbol(&self, name: &str) -> Option<Symbol> {
        let place = self.variables.iter().position(|(known, _)| *known == name)?;
        Some(Symbol(place as u32))
    }

    fn kind(&self, symbol: Symbol) -> Kind {
        self.variables[symbol.0 as usize].1.clone()
    }

    fn function(&self, name: &str) -> Option<&Function> {
        self.functions.iter().find(|function| function.name == name)
    }

    fn names(&self) -> Vec<&str> {
        self.variables.iter().map(|(name, _)| *name).collect()
    }

    fn function_names(&self) -> Vec<&str> {
        self.functions.iter().map(|function| function.name.as_str()).collect()
    }
}

/// The units of a rover's variables.
pub(super) fn rover() -> Model {
    Model::new()
        .variable("dmin", "m", None)
        .variable("speed", "m/s", Some((-3.0, 3.0)))
        .variable("heading", "rad", None)
        .variable("yaw_rate", "rad/s", None)
        .variable("load", "", None)
        .variable("slip", "1", None)
        .variable("s", "m", None)
        .variable("outside", "degC", None)
        .vector("distances", "m")
        .vector("weights", "1")
        .constant("wheel_base", "2.67 m")
        .define("clamp01(x)", "min(max(x, 0), 1)")
        .define("double(x)", "x + x")
        .define("again(x)", "again(x)")
        .define("ping(x)", "pong(x)")
        .define("pong(x)", "ping(x)")
        .define("turned(a)", "sin(a)")
        .define("nearest(v)", "min(v)")
}
