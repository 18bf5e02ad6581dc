//! Looks up the names of a formula, writes out the model's functions, and checks shapes and units at every node.

use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec;
use alloc::vec::Vec;
use core::f64::consts::PI;
use core::ops::Range;

use super::affine::Weight;
use super::builtin;
use super::formula::{Formula, MAX_LEVELS, MAX_NODES, Shape, whole_power};
use super::measure::{self, Measure, Misfit, PLAIN};
use super::operation::{Binary, Comparison, Constant, Operation, Unary};
use super::parser::MAX_DEPTH;
use super::problem::{Problem, Severity};
use super::simplify::simplified;
use super::syntax::{Equation, Expr, Function, Infix, Node, Prefix};
use super::{Kind, Scope, Symbol};
use crate::interval::Interval;
use crate::time::Span;
use crate::unit::{Dimension, Unit, nearest};

/// A formula with all that is to be said about it.
#[derive(Clone, Debug)]
pub struct Checked {
    /// The formula, simplified; `None` when there is an error.
    pub formula: Option<Formula>,
    /// The dimension of its value; `None` when it is not known, or when it fits every unit (a literal 0).
    pub dimension: Option<Dimension>,
    /// Every error and warning, in the order of the text.
    pub problems: Vec<Problem>,
}

/// An equation with all that is to be said about it.
#[derive(Clone, Debug)]
pub struct CheckedEquation {
    /// Both sides, simplified; `None` when there is an error.
    pub sides: Option<(Formula, Formula)>,
    /// The dimension of both sides; `None` when it is not known.
    pub dimension: Option<Dimension>,
    /// Whether both sides are temperatures on a scale with a zero of its own, of which a share has no meaning.
    pub is_affine: bool,
    /// Every error and warning, in the order of the text.
    pub problems: Vec<Problem>,
}

/// Checks a formula.
///
/// Time: linear in the formula with the model's functions written out, which is bounded by [`MAX_NODES`].
#[must_use]
pub fn check(expression: &Expr, scope: &dyn Scope) -> Checked {
    let mut checker = Checker::new(scope);
    let typed = checker.resolve(expression);
    if let Some(typed) = &typed {
        checker.want_proper(typed, expression);
    }
    let problems = checker.finish();
    let dimension = typed.as_ref().and_then(|typed| typed.measure.dimension());
    let formula = typed.filter(|_| !has_error(&problems)).map(|typed| simplified(typed.formula));
    Checked { formula, dimension, problems }
}

/// Checks an equation: both sides, and that they can be equal.
///
/// Time: as [`check`].
#[must_use]
pub fn check_equation(equation: &Equation, scope: &dyn Scope) -> CheckedEquation {
    let mut checker = Checker::new(scope);
    let span = equation.lhs.span.start..equation.rhs.span.end;
    let sides = checker.resolve(&equation.lhs).zip(checker.resolve(&equation.rhs));
    let measure = sides
        .as_ref()
        .and_then(|(lhs, rhs)| checker.equal(&span, (lhs, &equation.lhs), (rhs, &equation.rhs)));
    let is_affine =
        sides.as_ref().is_some_and(|(lhs, rhs)| lhs.weight == Weight::POINT || rhs.weight == Weight::POINT);
    let problems = checker.finish();
    let sides = sides.filter(|_| !has_error(&problems));
    let sides = sides.map(|(lhs, rhs)| (simplified(lhs.formula), simplified(rhs.formula)));
    CheckedEquation { sides, dimension: measure.and_then(Measure::dimension), is_affine, problems }
}

/// Checks a function of the model by itself, with parameters of unknown unit, once as numbers and once as vectors.
///
/// Returns the problems of the better try; those with the arguments' own units show where it is called.
#[must_use]
pub fn check_function(function: &Function, scope: &dyn Scope) -> Vec<Problem> {
    let with = |shape| {
        let mut checker = Checker::new(scope);
        let parameter = Typed::of(Formula::symbol(Symbol(u32::MAX), shape), Measure::Unknown);
        let parameters = function.parameters.iter().map(|name| (name.clone(), parameter.clone())).collect();
        checker.calls.push(Call { function: function.name.clone(), place: None, parameters });
        checker.resolve(&function.body);
        checker.finish()
    };
    let as_numbers = with(Shape::Scalar);
    if !has_error(&as_numbers) {
        return as_numbers;
    }
    let as_vectors = with(Shape::Vector);
    if has_error(&as_vectors) { as_numbers } else { as_vectors }
}

fn has_error(problems: &[Problem]) -> bool {
    problems.iter().any(|problem| problem.severity == Severity::Error)
}

#[derive(Clone)]
pub(super) struct Typed {
    pub(super) formula: Formula,
    pub(super) measure: Measure,
    pub(super) weight: Weight,
}

impl Typed {
    fn of(formula: Formula, measure: Measure) -> Typed {
        Typed { formula, measure, weight: Weight::of(measure) }
    }

    pub(super) fn weighing(self, weight: Weight) -> Typed {
        Typed { weight, ..self }
    }
}

/// A function of the model that is being written out.
struct Call {
    function: String,
    /// Where it is called in the outermost text; `None` when the body itself is that text.
    place: Option<Range<usize>>,
    parameters: Vec<(String, Typed)>,
}

/// What all functions written out may cost in visited and copied nodes.
const MAX_WORK: usize = 10 * MAX_NODES;

pub(super) struct Checker<'a> {
    scope: &'a dyn Scope,
    problems: Vec<Problem>,
    calls: Vec<Call>,
    depth: usize,
    work: usize,
    is_exhausted: bool,
}

impl<'a> Checker<'a> {
    fn new(scope: &'a dyn Scope) -> Checker<'a> {
        Checker { scope, problems: Vec::new(), calls: Vec::new(), depth: 0, work: 0, is_exhausted: false }
    }

    fn finish(self) -> Vec<Problem> {
        let mut problems: Vec<Problem> = Vec::new();
        for problem in self.problems {
            if !problems.contains(&problem) {
                problems.push(problem);
            }
        }
        problems.sort_by_key(|problem| problem.span.start);
        problems
    }

    /// Notes a problem; inside a function of the model at the place where it is called.
    pub(super) fn report(&mut self, problem: Problem) {
        let call = self.calls.iter().find_map(|call| Some((call.place.clone()?, &call.function)));
        self.problems.push(match call {
            Some((span, function)) => {
                Problem { span, message: format!("in `{function}`: {}", problem.message), ..problem }
            }
            None => problem,
        });
    }

    fn error(
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

    /// The measure, or unknown with a note why.
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

    /// Counts work; `None` and a problem when there has been too much of it.
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

    /// Looks up and checks a node; `None` when it has an error that forbids to check what is around it.
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

    /// A factor of a unit behind the first may have been meant as a variable.
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

    fn parameter(&self, name: &str) -> Option<Typed> {
        let call = self.calls.last()?;
        call.parameters.iter().find(|(parameter, _)| parameter == name).map(|(_, typed)| typed.clone())
    }

    fn variable(&mut self, span: &Range<usize>, name: &str) -> Option<Typed> {
        let Some(symbol) = self.scope.symbol(name) else { return self.unknown_name(span, name) };
        let Kind { shape, unit, constant, .. } = self.scope.kind(symbol);
        let formula = constant.map_or_else(|| Formula::symbol(symbol, shape), Formula::constant);
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
        let problem =
            Problem::error(span.clone(), format!("`{name}` is not defined")).with_nearest(near.as_deref());
        self.report(problem);
        None
    }

    fn prefix(&mut self, span: &Range<usize>, prefix: Prefix, of: &Expr) -> Option<Typed> {
        match prefix {
            Prefix::Minus => {
                let of = self.numeric("`-`", of)?;
                let made = self.made(span, Formula::unary(Unary::Neg, of.formula), of.measure)?;
                Some(made.weighing(of.weight.times(-1.0)))
            }
            Prefix::Not => {
                let of = self.truth("`not`", of)?;
                self.made(span, Formula::node(Operation::Not, vec![of.formula]), Measure::Unknown)
            }
        }
    }

    fn infix(&mut self, span: &Range<usize>, infix: Infix, left: &Expr, right: &Expr) -> Option<Typed> {
        let what = format!("`{}`", infix.symbol());
        match infix {
            Infix::And | Infix::Or => {
                let both = self.truth(&what, left).zip(self.truth(&what, right));
                let operation = if infix == Infix::And { Operation::And } else { Operation::Or };
                both.and_then(|(left, right)| {
                    self.made(
                        span,
                        Formula::node(operation, vec![left.formula, right.formula]),
                        Measure::Unknown,
                    )
                })
            }
            Infix::Add | Infix::Subtract | Infix::Multiply | Infix::Divide => {
                let (own, other) = self.both(&what, left, right, Checker::numeric)?;
                let weight = self.combined(infix, (&own, left), (&other, right));
                let made = self.arithmetic(span, infix, own, other)?;
                let weight = weight.filter(|_| made.measure != Measure::Unknown);
                let weight = weight.unwrap_or_else(|| Weight::of(made.measure));
                Some(made.weighing(weight))
            }
            Infix::Power => {
                let (base, exponent) = self.both(&what, left, right, Checker::numeric)?;
                self.power(span, base, exponent, left, right)
            }
            _ => self.comparison(span, infix, left, right),
        }
    }

    /// Both sides checked by `how`, so that the problems of both are found.
    pub(super) fn both(
        &mut self,
        what: &str,
        left: &Expr,
        right: &Expr,
        how: fn(&mut Checker<'a>, &str, &Expr) -> Option<Typed>,
    ) -> Option<(Typed, Typed)> {
        let left = how(self, what, left);
        let right = how(self, what, right);
        left.zip(right)
    }

    fn arithmetic(&mut self, span: &Range<usize>, infix: Infix, left: Typed, right: Typed) -> Option<Typed> {
        let (binary, measure) = match infix {
            Infix::Multiply => (Binary::Mul, left.measure.combine(right.measure, Dimension::times)),
            Infix::Divide => (Binary::Div, left.measure.combine(right.measure, Dimension::over)),
            Infix::Add => (Binary::Add, Ok(self.common(span, "+", left.measure, right.measure))),
            _ => (Binary::Sub, Ok(self.common(span, "-", left.measure, right.measure))),
        };
        let measure = self.noted(span, measure);
        self.made(span, Formula::binary(binary, left.formula, right.formula), measure)
    }

    fn power(
        &mut self,
        span: &Range<usize>,
        base: Typed,
        exponent: Typed,
        left: &Expr,
        right: &Expr,
    ) -> Option<Typed> {
        self.expect("an exponent", &exponent, Dimension::PLAIN, right);
        let constant = simplified(exponent.formula.clone())
            .as_constant()
            .filter(|constant| constant.is_certain() || constant.is(0.0));
        let Some(Constant { value, .. }) = constant else {
            self.expect("the base of a power with a variable exponent", &base, Dimension::PLAIN, left);
            return self.made(span, Formula::binary(Binary::Pow, base.formula, exponent.formula), PLAIN);
        };
        if value == 1.0 {
            return Some(base);
        }
        self.want_difference("`^`", &base, left);
        if libm::round(value) == value && value.abs() <= 1e9 {
            let measure = self.noted(span, base.measure.power(value as i32, 1));
            return self.made(span, whole_power(base.formula, value as i32), measure);
        }
        let measure = match as_ratio(value) {
            Some((over, under)) => base.measure.power(over, under),
            None if base.measure == PLAIN => Ok(PLAIN),
            None => Ok(Measure::Unknown),
        };
        let measure = self.noted(span, measure);
        let formula = if value == 0.5 {
            Formula::unary(Unary::Sqrt, base.formula)
        } else {
            Formula::binary(Binary::Pow, base.formula, exponent.formula)
        };
        self.made(span, formula, measure)
    }

    fn comparison(&mut self, span: &Range<usize>, infix: Infix, left: &Expr, right: &Expr) -> Option<Typed> {
        let what = format!("`{}`", infix.symbol());
        let bare = is_bare(left) || is_bare(right);
        let places = (left, right);
        let (left, right) = self.both(&what, left, right, Checker::scalar)?;
        match bare.then(|| measure::bare_limit(left.measure, right.measure)).flatten() {
            Some(misfit) => self.note(span, Some(misfit)),
            None => {
                self.common(span, infix.symbol(), left.measure, right.measure);
                self.same_zero(span, infix.symbol(), (&left, places.0), (&right, places.1));
            }
        }
        let (left, right) = (left.formula, right.formula);
        let formula = match infix {
            Infix::Less => Formula::compare(Comparison::Less, left, right),
            Infix::AtMost => Formula::compare(Comparison::AtMost, left, right),
            Infix::Greater => Formula::compare(Comparison::Less, right, left),
            Infix::AtLeast => Formula::compare(Comparison::AtMost, right, left),
            Infix::Unequal => {
                Formula::node(Operation::Not, vec![Formula::compare(Comparison::Equal, left, right)])
            }
            _ => Formula::compare(Comparison::Equal, left, right),
        };
        self.made(span, formula, Measure::Unknown)
    }

    fn equal(
        &mut self,
        span: &Range<usize>,
        (lhs, left_at): (&Typed, &Expr),
        (rhs, right_at): (&Typed, &Expr),
    ) -> Option<Measure> {
        let (left, right) = (lhs.formula.shape(), rhs.formula.shape());
        if left != right || left == Shape::Truth {
            let message =
                format!("the left side is {}, the right side {}", described(left), described(right));
            self.error(span, message, "both sides of an equation are numbers, or both are vectors");
            return None;
        }
        let measure = self.common(span, "=", lhs.measure, rhs.measure);
        self.same_zero(span, "=", (lhs, left_at), (rhs, right_at));
        Some(measure)
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

    fn unknown_function(&mut self, span: &Range<usize>, name: &str) -> Option<Typed> {
        if self.scope.symbol(name).is_some()
            || self.parameter(name).is_some()
            || builtin::WORDS.contains(&name)
        {
            return self.error(span, format!("`{name}` is no function"), "a product is written `*`");
        }
        let known =
            builtin::FUNCTIONS.iter().map(|(function, ..)| *function).chain(self.scope.function_names());
        let near = nearest(name, known).map(ToString::to_string);
        let place = span.start..span.start + name.len();
        let problem = Problem::error(place, format!("the function `{name}` is not defined"));
        self.report(problem.with_nearest(near.as_deref()));
        None
    }

    /// A function of the model with its arguments in the places of the parameters.
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

    /// A number or a vector.
    pub(super) fn numeric(&mut self, what: &str, expression: &Expr) -> Option<Typed> {
        self.shaped(what, expression, &[Shape::Scalar, Shape::Vector], "a number")
    }

    /// A number.
    pub(super) fn scalar(&mut self, what: &str, expression: &Expr) -> Option<Typed> {
        self.shaped(what, expression, &[Shape::Scalar], "a number")
    }

    /// A vector.
    pub(super) fn vector(&mut self, what: &str, expression: &Expr) -> Option<Typed> {
        self.shaped(what, expression, &[Shape::Vector], "a vector")
    }

    /// True or false.
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

    /// A number that is known now.
    pub(super) fn constant(&mut self, what: &str, expression: &Expr) -> Option<(Constant, Typed)> {
        let typed = self.scalar(what, expression)?;
        if let Some(constant) = simplified(typed.formula.clone()).as_constant() {
            return Some((constant, typed));
        }
        self.error(&expression.span, format!("{what} takes a constant"), "variables are not allowed here");
        None
    }

    /// A constant span of time: with a unit, or in seconds.
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

/// The number as a quotient with a small divisor, when it is one.
fn as_ratio(value: f64) -> Option<(i32, i32)> {
    let is_whole = |value: f64| (libm::round(value) - value).abs() < 1e-9 && value.abs() < 1000.0;
    (1..=12)
        .find(|under| is_whole(value * f64::from(*under)))
        .map(|under| (libm::round(value * f64::from(under)) as i32, under))
}

fn described(shape: Shape) -> &'static str {
    match shape {
        Shape::Scalar => "a number",
        Shape::Vector => "a vector",
        Shape::Truth => "true or false",
    }
}

/// Whether it is a number written without a unit.
fn is_bare(expression: &Expr) -> bool {
    match &expression.node {
        Node::Number(_, unit) => unit.is_none(),
        Node::Prefix(Prefix::Minus, of) => is_bare(of),
        _ => false,
    }
}
