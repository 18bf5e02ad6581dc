//! Checks the functions of the language: the shapes and units of their arguments and results.

use alloc::format;
use alloc::string::ToString;
use alloc::vec;
use alloc::vec::Vec;
use core::f64::consts::LN_10;
use core::ops::Range;

use super::affine::Weight;
use super::builtin::{self, Builtin};
use super::check::{Checker, Operand, PARAMETER, Typed};
use super::check_time;
use super::formula::{Formula, whole_power};
use super::lacking::may_lack;
use super::measure::{ANGLE, Measure, PLAIN};
use super::operation::{Binary, Constant, Operation, Reduction, Unary};
use super::problem::Problem;
use super::syntax::{Expr, Node, Prefix};
use crate::interval::Interval;
use crate::unit::{Dimension, nearest};

impl<'a> Checker<'a> {
    pub(super) fn builtin(
        &mut self,
        span: &Range<usize>,
        name: &str,
        function: Builtin,
        arguments: &[Expr],
    ) -> Option<Typed> {
        let what = format!("`{name}`");
        match (function, arguments) {
            (Builtin::If, [condition, then, other]) => self.select(span, condition, then, other),
            (Builtin::Table, [of, points @ ..]) => self.table(span, of, points),
            (Builtin::Within, [of, least, greatest]) => self.within(span, of, least, greatest),
            (Builtin::Atan2 | Builtin::Hypot, [left, right]) => {
                self.of_two(span, name, function, left, right)
            }
            (Builtin::Root, [of, degree]) => self.root(span, of, degree),
            (Builtin::Interval, [lo, hi]) => self.between(span, lo, hi),
            (Builtin::Derivative | Builtin::Delay | Builtin::MovingMean, [of, window]) => {
                check_time::over_window(self, span, function, of, window)
            }
            (Builtin::Always | Builtin::Once, [condition, window]) => {
                check_time::lasting(self, span, function, condition, window)
            }
            (Builtin::Answered, [trigger, response, window]) => {
                check_time::answered(self, span, trigger, response, window)
            }
            (Builtin::PlusMinus, [of]) => self.plus_minus(span, of),
            (Builtin::Previous, [of]) => self.previous(span, of),
            (Builtin::Integral, [of]) => {
                let at = of;
                let of = self.scalar(&what, at)?;
                self.want_difference(&what, &of, at);
                let measure = of.measure.combine(Measure::Known(Dimension::TIME), Dimension::times);
                let measure = self.noted(span, measure);
                self.made(span, Formula::node(Operation::Integral, vec![of.formula]), measure)
            }
            (_, arguments) => match reduction(function) {
                Some(reduction) => self.reduce(span, name, reduction, arguments),
                None => arguments.first().and_then(|of| self.of_one(span, name, function, of)),
            },
        }
    }

    /// Functions of one number.
    fn of_one(&mut self, span: &Range<usize>, name: &str, function: Builtin, of: &Expr) -> Option<Typed> {
        let what = format!("`{name}`");
        let typed = self.numeric(&what, of)?;
        let is_of_amounts = matches!(function, Builtin::Sqrt | Builtin::Abs);
        let weight = if is_of_amounts { self.want_difference(&what, &typed, of) } else { typed.weight };
        let (unary, takes, gives) = match function {
            Builtin::Sqrt => {
                let measure = self.noted(span, typed.measure.power(1, 2));
                return self.made(span, Formula::unary(Unary::Sqrt, typed.formula), measure);
            }
            Builtin::Abs => (Unary::Abs, None, typed.measure),
            Builtin::Floor => (Unary::Floor, Some(Dimension::PLAIN), PLAIN),
            Builtin::Exp => (Unary::Exp, Some(Dimension::PLAIN), PLAIN),
            Builtin::Ln | Builtin::Log10 => (Unary::Ln, Some(Dimension::PLAIN), PLAIN),
            Builtin::Sin => (Unary::Sin, Some(Dimension::ANGLE), PLAIN),
            Builtin::Cos => (Unary::Cos, Some(Dimension::ANGLE), PLAIN),
            Builtin::Tan => (Unary::Tan, Some(Dimension::ANGLE), PLAIN),
            Builtin::Asin => (Unary::Asin, Some(Dimension::PLAIN), ANGLE),
            Builtin::Acos => (Unary::Acos, Some(Dimension::PLAIN), ANGLE),
            _ => (Unary::Atan, Some(Dimension::PLAIN), ANGLE),
        };
        if let Some(takes) = takes {
            self.expect(&what, &typed, takes, of);
        }
        let formula = Formula::unary(unary, typed.formula);
        let formula = if function == Builtin::Log10 { over_ln_10(formula) } else { formula };
        let made = self.made(span, formula, gives)?;
        Some(if function == Builtin::Abs { made.weighing(weight) } else { made })
    }

    fn of_two(
        &mut self,
        span: &Range<usize>,
        name: &str,
        function: Builtin,
        left: &Expr,
        right: &Expr,
    ) -> Option<Typed> {
        let (what, places) = (format!("`{name}`"), (left, right));
        let (left, right) = self.both(&what, left, right, Checker::numeric)?;
        let common = self.common(span, name, left.measure, right.measure);
        self.want_difference(&what, &left, places.0);
        self.want_difference(&what, &right, places.1);
        let (binary, measure) =
            if function == Builtin::Atan2 { (Binary::Atan2, ANGLE) } else { (Binary::Hypot, common) };
        self.made(span, Formula::binary(binary, left.formula, right.formula), measure)
    }

    fn root(&mut self, span: &Range<usize>, of: &Expr, degree: &Expr) -> Option<Typed> {
        let typed = self.numeric("`root`", of);
        let (Constant { value, .. }, _) = self.constant("the degree of a root", degree)?;
        let typed = typed?;
        if libm::trunc(value) != value || !(2.0..=1000.0).contains(&value) {
            let problem =
                Problem::error(degree.span.clone(), "the degree of a root is a whole number from 2 to 1000");
            self.report(problem);
            return None;
        }
        self.want_difference("`root`", &typed, of);
        let measure = self.noted(span, typed.measure.power(1, value as i32));
        let unary = if value == 2.0 { Unary::Sqrt } else { Unary::Root(value as i32) };
        self.made(span, Formula::unary(unary, typed.formula), measure)
    }

    fn select(&mut self, span: &Range<usize>, condition: &Expr, then: &Expr, other: &Expr) -> Option<Typed> {
        let condition = self.truth("`if`", condition);
        let (one, two) = self.both("`if`", then, other, Checker::scalar)?;
        let measure = self.common(span, "if", one.measure, two.measure);
        let operands = (Operand { typed: &one, at: then }, Operand { typed: &two, at: other });
        let weight = self.same_zero(span, "if", operands.0, operands.1);
        let arguments = vec![condition?.formula, one.formula, two.formula];
        Some(self.made(span, Formula::node(Operation::Select, arguments), measure)?.weighing(weight))
    }

    /// Checks a reduction of one vector, or of two and more numbers.
    fn reduce(
        &mut self,
        span: &Range<usize>,
        name: &str,
        how: Reduction,
        arguments: &[Expr],
    ) -> Option<Typed> {
        let what = format!("`{name}`");
        if let [vector] = arguments {
            let typed = self.vector(&format!("{what} of one argument"), vector)?;
            let is_of_amounts = matches!(how, Reduction::Sum | Reduction::Norm);
            let weight =
                if is_of_amounts { self.want_difference(&what, &typed, vector) } else { typed.weight };
            let measure = if how == Reduction::Count { PLAIN } else { typed.measure };
            let made =
                self.made(span, Formula::node(Operation::Reduce(how), vec![typed.formula]), measure)?;
            return Some(if how == Reduction::Count { made } else { made.weighing(weight) });
        }
        let typed: Vec<Option<Typed>> = arguments
            .iter()
            .map(|argument| self.scalar(&format!("{what} of several arguments"), argument))
            .collect();
        let typed: Vec<Typed> = typed.into_iter().collect::<Option<_>>()?;
        let measures = typed.iter().map(|typed| typed.measure);
        let common =
            measures.reduce(|left, right| self.common(span, name, left, right)).unwrap_or(Measure::Unknown);
        let weight = self.reduced(span, name, how, &typed, arguments);
        let measure = if how == Reduction::Count { PLAIN } else { common };
        let formulas: Vec<Formula> = typed.into_iter().map(|typed| typed.formula).collect();
        let range = |symbol| if symbol == PARAMETER { None } else { self.scope.kind(symbol).range };
        let may_lack = how.passes_over() && formulas.iter().any(|formula| may_lack(formula, &range));
        let formula = if may_lack { reduced(how, formulas) } else { of_list(how, formulas) };
        Some(self.made(span, formula, measure)?.weighing(weight))
    }

    pub(super) fn index(&mut self, span: &Range<usize>, of: &Expr, index: &Expr) -> Option<Typed> {
        let vector = self.vector("`[..]`", of);
        let place = self.scalar("an index", index);
        let (vector, place) = vector.zip(place)?;
        self.expect("an index", &place, Dimension::PLAIN, index);
        let formula = Formula::node(Operation::Index, vec![vector.formula, place.formula]);
        Some(self.made(span, formula, vector.measure)?.weighing(vector.weight))
    }

    pub(super) fn slice(
        &mut self,
        span: &Range<usize>,
        of: &Expr,
        from: Option<&Expr>,
        to: Option<&Expr>,
    ) -> Option<Typed> {
        let vector = self.vector("`[..]`", of);
        let from = from.map_or(Some(0), |from| self.place(from));
        let to = to.map_or(Some(u32::MAX), |to| self.place(to));
        let (vector, (from, to)) = vector.zip(from.zip(to))?;
        if from >= to {
            let problem = Problem::error(span.clone(), format!("no element lies from {from} to before {to}"));
            self.report(problem.with_help("`v[a..b]` holds the elements from a to before b, counted from 0"));
            return None;
        }
        let formula = Formula::node(Operation::Slice(from, to), vec![vector.formula]);
        Some(self.made(span, formula, vector.measure)?.weighing(vector.weight))
    }

    /// Checks a constant index of a vector.
    fn place(&mut self, expression: &Expr) -> Option<u32> {
        let (Constant { value, .. }, Typed { measure, .. }) =
            self.constant("the end of a slice", expression)?;
        if libm::trunc(value) == value
            && (0.0..1e9).contains(&value)
            && matches!(measure, PLAIN | Measure::Zero)
        {
            return Some(value as u32);
        }
        let problem =
            Problem::error(expression.span.clone(), "the end of a slice is a whole number, not negative");
        self.report(problem);
        None
    }

    fn plus_minus(&mut self, span: &Range<usize>, of: &Expr) -> Option<Typed> {
        let (constant, typed) = self.constant("`plusminus`", of)?;
        self.want_difference("`plusminus`", &typed, of);
        let most = constant.bounds.abs().hi();
        let formula = Formula::constant(Constant { value: 0.0, bounds: Interval::new(-most, most) });
        Some(self.made(span, formula, typed.measure)?.weighing(Weight::DIFFERENCE))
    }

    fn between(&mut self, span: &Range<usize>, lo: &Expr, hi: &Expr) -> Option<Typed> {
        let places = (lo, hi);
        let lo = self.constant("`interval`", lo);
        let ((lo, own), (hi, other)) = lo.zip(self.constant("`interval`", hi))?;
        let (one, two) = (Operand { typed: &own, at: places.0 }, Operand { typed: &other, at: places.1 });
        let measure = self.common(span, "interval", own.measure, other.measure);
        let weight = self.same_zero(span, "interval", one, two);
        let bounds = Interval::new(lo.bounds.lo(), hi.bounds.hi());
        if bounds.is_empty() {
            self.report(Problem::error(span.clone(), "the first bound of this interval is above the second"));
            return None;
        }
        Some(self.made(span, Formula::constant(Constant::between(bounds)), measure)?.weighing(weight))
    }

    fn within(&mut self, span: &Range<usize>, of: &Expr, least: &Expr, greatest: &Expr) -> Option<Typed> {
        let value = self.scalar("`within`", of);
        let lo = self.bound(least, f64::NEG_INFINITY);
        let hi = self.bound(greatest, f64::INFINITY);
        let (value, (lo, hi)) = value.zip(lo.zip(hi))?;
        let mut measure = value.measure;
        let mut weight = value.weight;
        for (bound, at) in [(&lo.1, least), (&hi.1, greatest)] {
            let Some(bound) = bound else { continue };
            measure = self.common(span, "within", measure, bound.measure);
            weight = self.same_zero(
                span,
                "within",
                Operand { typed: &value, at: of },
                Operand { typed: bound, at },
            );
        }
        let bounds = Interval::new(lo.0, hi.0);
        if bounds.is_empty() {
            self.report(Problem::error(span.clone(), "the least value is above the greatest"));
            return None;
        }
        let formula = Formula::node(Operation::Within(Constant::between(bounds)), vec![value.formula]);
        Some(self.made(span, formula, measure)?.weighing(weight))
    }

    /// Checks a constant bound, or `inf` with its sign, which fits every unit.
    fn bound(&mut self, expression: &Expr, outermost: f64) -> Option<(f64, Option<Typed>)> {
        let (is_negative, of) = match &expression.node {
            Node::Prefix(Prefix::Minus, of) => (true, &**of),
            _ => (false, expression),
        };
        if matches!(&of.node, Node::Name(name) if name == "inf") && is_negative == (outermost < 0.0) {
            return Some((outermost, None));
        }
        let (constant, typed) = self.constant("a bound of `within`", expression)?;
        let bound = if outermost < 0.0 { constant.bounds.lo() } else { constant.bounds.hi() };
        Some((bound, Some(typed)))
    }

    fn previous(&mut self, span: &Range<usize>, of: &Expr) -> Option<Typed> {
        let typed = self.numeric("`previous`", of)?;
        let Some(formula) = before(&typed.formula) else {
            let problem = Problem::error(span.clone(), "`previous` of a time operator");
            self.report(
                problem
                    .with_help("`previous(x)` takes variables and what is computed from them at one moment"),
            );
            return None;
        };
        Some(self.made(span, formula, typed.measure)?.weighing(typed.weight))
    }

    pub(super) fn unknown_function(&mut self, span: &Range<usize>, name: &str) -> Option<Typed> {
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
}

/// The reduction that a function is.
fn reduction(function: Builtin) -> Option<Reduction> {
    Some(match function {
        Builtin::Min => Reduction::Min,
        Builtin::Max => Reduction::Max,
        Builtin::Sum => Reduction::Sum,
        Builtin::Mean => Reduction::Mean,
        Builtin::Norm => Reduction::Norm,
        Builtin::Median => Reduction::Median,
        Builtin::Count => Reduction::Count,
        Builtin::Either => Reduction::Either,
        Builtin::OneOf => Reduction::OneOf,
        _ => return None,
    })
}

/// A reduction of listed numbers, of which some may have no value.
fn reduced(how: Reduction, formulas: Vec<Formula>) -> Formula {
    Formula::node(Operation::Reduce(how), vec![Formula::node(Operation::List, formulas)])
}

/// A reduction of listed numbers; plain arithmetic where possible, so that it can be solved.
fn of_list(how: Reduction, formulas: Vec<Formula>) -> Formula {
    let count = formulas.len() as f64;
    let chain = |binary, formulas: Vec<Formula>| {
        let chained = formulas.into_iter().reduce(|left, right| Formula::binary(binary, left, right));
        chained.unwrap_or_else(|| Formula::number(0.0))
    };
    match how {
        Reduction::Min => chain(Binary::Min, formulas),
        Reduction::Max => chain(Binary::Max, formulas),
        Reduction::Sum => chain(Binary::Add, formulas),
        Reduction::Mean => Formula::binary(Binary::Div, chain(Binary::Add, formulas), Formula::number(count)),
        Reduction::Norm => {
            let squares = formulas.into_iter().map(|formula| whole_power(formula, 2)).collect();
            Formula::unary(Unary::Sqrt, chain(Binary::Add, squares))
        }
        Reduction::Median | Reduction::Count | Reduction::Either | Reduction::OneOf => reduced(how, formulas),
    }
}

fn over_ln_10(formula: Formula) -> Formula {
    let constant = Constant { value: LN_10, bounds: Interval::new(LN_10.next_down(), LN_10.next_up()) };
    Formula::binary(Binary::Div, formula, Formula::constant(constant))
}

/// The formula over the previous values of its symbols; `None` when it depends on more than these.
fn before(formula: &Formula) -> Option<Formula> {
    match formula.operation() {
        Operation::Symbol(symbol) => Some(Formula::previous(symbol, formula.shape())),
        operation if operation.is_stateful() => None,
        _ => {
            let arguments: Option<Vec<Formula>> = formula.arguments().iter().map(before).collect();
            Some(formula.with_arguments(arguments?))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expression::{Shape, Symbol};

    #[test]
    fn previous_reaches_the_leaves() {
        let sum =
            Formula::binary(Binary::Add, Formula::symbol(Symbol(1), Shape::Scalar), Formula::number(2.0));
        let found = before(&sum).map(|formula| formula.previous_symbols());
        assert_eq!(found, Some(vec![Symbol(1)]));
        assert_eq!(before(&Formula::node(Operation::Elapsed, vec![])), None);
    }
}
