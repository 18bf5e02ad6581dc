//! Resolves the names of a formula, expands the model's functions, and checks shapes and units at every node.

use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec::Vec;
use core::f64::consts::PI;
use core::ops::Range;

use super::affine::Weight;
use super::builtin;
use super::formula::{Formula, MAX_LEVELS, MAX_NODES, Shape};
use super::measure::{self, Measure, Misfit, PLAIN};
use super::operation::{Constant, Operation};
use super::parser::MAX_DEPTH;
use super::problem::Problem;
use super::simplify::simplified;
use super::syntax::{Expr, Function, Node};
use super::{Kind, Scope, Symbol};
use crate::interval::Interval;
use crate::time::Span;
use crate::unit::{Dimension, Unit, nearest};

#[derive(Clone)]
pub(super) struct Typed {
    pub(super) formula: Formula,
    pub(super) measure: Measure,
    pub(super) weight: Weight,
}

impl Typed {
    pub(super) fn of(formula: Formula, measure: Measure) -> Typed {
        Typed { formula, measure, weight: Weight::of(measure) }
    }

    pub(super) fn weighing(self, weight: Weight) -> Typed {
        Typed { weight, ..self }
    }
}

/// A checked operand and its place.
#[derive(Clone, Copy)]
pub(super) struct Operand<'o> {
    pub(super) typed: &'o Typed,
    pub(super) at: &'o Expr,
}

/// A function of the model that is being expanded.
pub(super) struct Call {
    pub(super) function: String,
    /// The place of the call in the outermost text; `None` when the body itself is that text.
    pub(super) place: Option<Range<usize>>,
    pub(super) parameters: Vec<(String, Typed)>,
}

/// A parameter of a function that is checked by itself.
pub(super) const PARAMETER: Symbol = Symbol(u32::MAX);

/// The largest number of visited and copied nodes for the expansion of all functions.
const MAX_WORK: usize = 10 * MAX_NODES;

pub(super) struct Checker<'a> {
    pub(super) scope: &'a dyn Scope,
    problems: Vec<Problem>,
    pub(super) calls: Vec<Call>,
    depth: usize,
    work: usize,
    is_exhausted: bool,
}

impl<'a> Checker<'a> {
    pub(super) fn new(scope: &'a dyn Scope) -> Checker<'a> {
        Checker { scope, problems: Vec::new(), calls: Vec::new(), depth: 0, work: 0, is_exhausted: false }
    }

    pub(super) fn finish(self) -> Vec<Problem> {
        let mut problems: Vec<Problem> = Vec::new();
        for problem in self.problems {
            if !problems.contains(&problem) {
                problems.push(problem);
            }
        }
        problems.sort_by_key(|problem| problem.span.start);
        problems
    }

    /// Reports a problem; a problem inside a function of the model at the place of the call.
    pub(super) fn report(&mut self, problem: Problem) {
        let call = self.calls.iter().find_map(|call| Some((call.place.clone()?, &call.function)));
        self.problems.push(match call {
            Some((span, function)) => {
                Problem { span, message: format!("in `{function}`: {}", problem.message), ..problem }
            }
            None => problem,
        });
    }

    pub(super) fn error(
        &mut self,
        span: &Range<usize>,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> Option<Typed> {
        self.report(Problem::error(span.clone(), message).with_help(help));
        None
    }

    pub(super) fn note(&mut self, span: &Range<usize>, misfit: Option<Misfit>) {
        if let Some(misfit) = misfit {
            self.report(misfit.at(span.clone()));
        }
    }

    /// The measure; a misfit is reported and becomes unknown.
    pub(super) fn noted(&mut self, span: &Range<usize>, measure: Result<Measure, Misfit>) -> Measure {
        measure.unwrap_or_else(|misfit| {
            self.note(span, Some(misfit));
            Measure::Unknown
        })
    }

    pub(super) fn common(
        &mut self,
        span: &Range<usize>,
        what: &str,
        left: Measure,
        right: Measure,
    ) -> Measure {
        let (measure, misfit) = measure::common(what, left, right);
        self.note(span, misfit);
        measure
    }

    pub(super) fn expect(&mut self, what: &str, typed: &Typed, wanted: Dimension, expression: &Expr) {
        self.note(&expression.span, measure::expect(what, typed.measure, wanted, expression));
    }

    /// Counts work; `None` and a problem when there is too much of it.
    fn spend(&mut self, span: &Range<usize>, work: usize) -> Option<()> {
        self.work = self.work.saturating_add(work);
        if self.work > MAX_WORK || self.depth > MAX_DEPTH {
            self.exhaust(span);
        }
        (!self.is_exhausted).then_some(())
    }

    fn exhaust(&mut self, span: &Range<usize>) {
        if !self.is_exhausted {
            let message = format!(
                "this formula has more than {MAX_NODES} terms or {MAX_LEVELS} levels, functions written out"
            );
            self.error(span, message, "split it by variables of its own");
        }
        self.is_exhausted = true;
    }

    pub(super) fn made(&mut self, span: &Range<usize>, formula: Formula, measure: Measure) -> Option<Typed> {
        if !formula.is_bounded() {
            self.exhaust(span);
            return None;
        }
        Some(Typed::of(formula, measure))
    }

    /// Resolves and checks a node; `None` when an error prevents checking the nodes around it.
    pub(super) fn resolve(&mut self, expression: &Expr) -> Option<Typed> {
        self.spend(&expression.span, 1)?;
        self.depth += 1;
        let typed = match &expression.node {
            Node::Number(value, unit) => Some(self.number(&expression.span, *value, unit.as_ref())),
            Node::Name(name) => self.name(&expression.span, name),
            Node::Prefix(prefix, of) => self.prefix(&expression.span, *prefix, of),
            Node::Infix(infix, left, right) => self.infix(&expression.span, *infix, left, right),
            Node::Index(of, index) => self.index(&expression.span, of, index),
            Node::Slice(of, from, to) => self.slice(&expression.span, of, from.as_deref(), to.as_deref()),
            Node::Point(..) => self.point_alone(&expression.span),
            Node::Call(name, arguments) => self.call(&expression.span, name, arguments),
        };
        self.depth -= 1;
        typed
    }

    fn number(&mut self, span: &Range<usize>, value: f64, unit: Option<&Unit>) -> Typed {
        let Some(unit) = unit else {
            let measure = if value == 0.0 { Measure::Zero } else { PLAIN };
            return Typed::of(Formula::number(value), measure);
        };
        self.warn_of_shadow(span, unit);
        let bounds = unit.to_si_interval(Interval::point(value));
        let constant = Constant { value: unit.to_si(value), bounds };
        let typed = Typed::of(Formula::constant(constant), Measure::Known(unit.dimension));
        if unit.is_affine() { typed.weighing(Weight::POINT) } else { typed }
    }

    /// Warns of a factor of a unit behind the first one that may be meant as a variable.
    fn warn_of_shadow(&mut self, span: &Range<usize>, unit: &Unit) {
        let text = unit.to_string();
        let names =
            text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_').filter(|name| !name.is_empty());
        for name in names.skip(1).filter(|name| self.scope.symbol(name).is_some()) {
            let message = format!("`{name}` is read as a unit here, and there is a variable of this name");
            let help = format!("write blanks around the operator before `{name}` if the variable is meant");
            self.report(Problem::warning(span.clone(), message).with_help(help));
        }
    }

    fn name(&mut self, span: &Range<usize>, name: &str) -> Option<Typed> {
        if let Some(typed) = self.parameter(name) {
            self.spend(span, typed.formula.size())?;
            return Some(typed);
        }
        let (formula, measure) = match name {
            "pi" => {
                (Formula::constant(Constant { value: PI, bounds: Interval::new(PI, PI.next_up()) }), PLAIN)
            }
            "dt" => (Formula::node(Operation::Elapsed, Vec::new()), Measure::Known(Dimension::TIME)),
            "true" | "false" => {
                (Formula::node(Operation::Truth(name == "true"), Vec::new()), Measure::Unknown)
            }
            _ => return self.variable(span, name),
        };
        Some(Typed::of(formula, measure))
    }

    pub(super) fn parameter(&self, name: &str) -> Option<Typed> {
        let call = self.calls.last()?;
        call.parameters.iter().find(|(parameter, _)| parameter == name).map(|(_, typed)| typed.clone())
    }

    fn variable(&mut self, span: &Range<usize>, name: &str) -> Option<Typed> {
        let Some(symbol) = self.scope.symbol(name) else { return self.unknown_name(span, name) };
        let Kind { shape, unit, constant, .. } = self.scope.kind(symbol);
        let formula = match constant {
            None => Formula::symbol(symbol, shape),
            Some(constant) if constant.is_certain() || constant.is(0.0) => Formula::constant(constant),
            Some(constant) => Formula::node(Operation::Known(symbol, constant), Vec::new()),
        };
        let is_point = unit.as_ref().is_some_and(Unit::is_affine);
        let typed = Typed::of(formula, Measure::of(unit.map(|unit| unit.dimension)));
        Some(if is_point { typed.weighing(Weight::POINT) } else { typed })
    }

    fn unknown_name(&mut self, span: &Range<usize>, name: &str) -> Option<Typed> {
        if let Some((.., usage)) = builtin::FUNCTIONS.iter().find(|(function, ..)| *function == name) {
            return self.error(span, format!("`{name}` is a function"), format!("write `{usage}`"));
        }
        let parameters: Vec<String> = self
            .calls
            .last()
            .iter()
            .flat_map(|call| &call.parameters)
            .map(|(name, _)| name.clone())
            .collect();
        let known = parameters.iter().map(String::as_str).chain(self.scope.names()).chain(builtin::WORDS);
        let near = nearest(name, known).map(ToString::to_string);
        let message = format!("`{name}` is not defined");
        if near.is_none() && Unit::parse(name).is_ok() {
            let help = format!(
                "`{name}` is a unit: write it behind a number and without parentheses, as in `2 m/s/A`"
            );
            return self.error(span, message, help);
        }
        self.report(Problem::error(span.clone(), message).with_nearest(near.as_deref()));
        None
    }

    fn call(&mut self, span: &Range<usize>, name: &str, arguments: &[Expr]) -> Option<Typed> {
        if let Some((_, function, least, most, usage)) =
            builtin::FUNCTIONS.iter().find(|(known, ..)| *known == name)
        {
            if (*least..=*most).contains(&arguments.len()) {
                return self.builtin(span, name, *function, arguments);
            }
            let message = format!("`{name}` with {} arguments", arguments.len());
            return self.error(span, message, format!("write `{usage}`"));
        }
        match self.scope.function(name) {
            Some(function) => self.written_out(span, function, arguments),
            None => self.unknown_function(span, name),
        }
    }

    /// The expansion of a function of the model, with its arguments.
    fn written_out(&mut self, span: &Range<usize>, function: &Function, arguments: &[Expr]) -> Option<Typed> {
        let (name, parameters) = (&function.name, &function.parameters);
        if self.calls.iter().any(|call| call.function == *name) {
            let help = "a function cannot use itself, not by way of others either";
            return self.error(span, format!("the function `{name}` uses itself"), help);
        }
        if parameters.len() != arguments.len() {
            let message = format!("`{name}` with {} arguments", arguments.len());
            return self.error(span, message, format!("write `{name}({})`", parameters.join(", ")));
        }
        let values: Vec<Option<Typed>> = arguments.iter().map(|argument| self.resolve(argument)).collect();
        let values: Option<Vec<Typed>> = values.into_iter().collect();
        let parameters = parameters.iter().cloned().zip(values?).collect();
        self.calls.push(Call { function: name.clone(), place: Some(span.clone()), parameters });
        let typed = self.resolve(&function.body);
        self.calls.pop();
        typed
    }

    /// Checks that an expression is a number or a vector.
    pub(super) fn numeric(&mut self, what: &str, expression: &Expr) -> Option<Typed> {
        self.shaped(what, expression, &[Shape::Scalar, Shape::Vector], "a number")
    }

    /// Checks that an expression is a number.
    pub(super) fn scalar(&mut self, what: &str, expression: &Expr) -> Option<Typed> {
        self.shaped(what, expression, &[Shape::Scalar], "a number")
    }

    /// Checks that an expression is a vector.
    pub(super) fn vector(&mut self, what: &str, expression: &Expr) -> Option<Typed> {
        self.shaped(what, expression, &[Shape::Vector], "a vector")
    }

    /// Checks that an expression is true or false.
    pub(super) fn truth(&mut self, what: &str, expression: &Expr) -> Option<Typed> {
        self.shaped(what, expression, &[Shape::Truth], "true or false")
    }

    fn shaped(&mut self, what: &str, expression: &Expr, wanted: &[Shape], name: &str) -> Option<Typed> {
        let typed = self.resolve(expression)?;
        let shape = typed.formula.shape();
        if wanted.contains(&shape) {
            return Some(typed);
        }
        let help = match shape {
            Shape::Vector => "take one element, such as `v[0]`, or `min`, `max`, `mean`, `norm`, ... of it",
            Shape::Truth => {
                "write `if(condition, then, else)` to make a number of it, `a < b and b < c` for a range"
            }
            Shape::Scalar if wanted == [Shape::Truth] => "compare it with something",
            Shape::Scalar => "only a variable with `shape: vector`, or a part of one, is a vector",
        };
        self.error(&expression.span, format!("{what} takes {name}, not {}", described(shape)), help)
    }

    /// Checks that an expression is a constant number.
    pub(super) fn constant(&mut self, what: &str, expression: &Expr) -> Option<(Constant, Typed)> {
        let typed = self.scalar(what, expression)?;
        if let Some(constant) = simplified(typed.formula.with_loose_constants()).as_constant() {
            return Some((constant, typed));
        }
        self.error(&expression.span, format!("{what} takes a constant"), "variables are not allowed here");
        None
    }

    /// Checks that an expression is a constant span of time, with a unit or in seconds.
    pub(super) fn span(&mut self, what: &str, expression: &Expr) -> Option<Span> {
        let (Constant { value, .. }, Typed { measure, .. }) = self.constant(what, expression)?;
        if measure != PLAIN && measure != Measure::Zero {
            self.note(&expression.span, measure::expect(what, measure, Dimension::TIME, expression));
        }
        if (1e-6..=1e6).contains(&value) {
            return Some(Span::from_seconds(value));
        }
        self.error(
            &expression.span,
            format!("{what} takes a span of a microsecond to a million seconds"),
            "write it with its unit, such as `0.5 s`",
        );
        None
    }
}

pub(super) fn described(shape: Shape) -> &'static str {
    match shape {
        Shape::Scalar => "a number",
        Shape::Vector => "a vector",
        Shape::Truth => "true or false",
    }
}
