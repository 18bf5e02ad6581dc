//! Checks operators: the shapes and units of their operands, and the use of temperatures: where only a difference has a meaning,
//! and where two must have the same zero.

use alloc::format;
use alloc::string::{String, ToString};
use core::ops::Range;

use super::affine::Weight;
use super::check::{Checker, Operand, Typed, described};
use super::formula::{Formula, Shape, whole_power};
use super::measure::{self, Measure, PLAIN};
use super::operation::{Binary, Comparison, Constant, Operation, Reduction, Unary};
use super::problem::Problem;
use super::simplify::simplified;
use super::syntax::{Expr, Infix, Node, Prefix};
use crate::unit::Dimension;
use alloc::vec;

impl Typed {
    /// The value, when it is a constant plain number without an uncertainty: an uncertain multiple has no certain zero.
    fn factor(&self) -> Option<f64> {
        let is_plain = self.measure == PLAIN || self.measure == Measure::Zero;
        let constant = is_plain.then(|| simplified(self.formula.clone()).as_constant()).flatten();
        constant.filter(|constant| constant.is_certain()).map(|constant| constant.value)
    }
}

impl<'a> Checker<'a> {
    pub(super) fn prefix(&mut self, span: &Range<usize>, prefix: Prefix, of: &Expr) -> Option<Typed> {
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

    pub(super) fn infix(
        &mut self,
        span: &Range<usize>,
        infix: Infix,
        left: &Expr,
        right: &Expr,
    ) -> Option<Typed> {
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
                let weight = self.combined(
                    infix,
                    Operand { typed: &own, at: left },
                    Operand { typed: &other, at: right },
                );
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

    /// Checks both sides by `how`, so that the problems of both are found.
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
        let (own, other) = self.both(&what, left, right, Checker::scalar)?;
        match bare.then(|| measure::bare_limit(own.measure, other.measure)).flatten() {
            Some(misfit) => self.note(span, Some(misfit)),
            None => {
                self.common(span, infix.symbol(), own.measure, other.measure);
                let (one, two) = (Operand { typed: &own, at: left }, Operand { typed: &other, at: right });
                self.same_zero(span, infix.symbol(), one, two);
            }
        }
        let (left, right) = (own.formula, other.formula);
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

    pub(super) fn equal(
        &mut self,
        span: &Range<usize>,
        lhs: Operand<'_>,
        rhs: Operand<'_>,
    ) -> Option<Measure> {
        let (left, right) = (lhs.typed.formula.shape(), rhs.typed.formula.shape());
        if left != right || left == Shape::Truth {
            let message =
                format!("the left side is {}, the right side {}", described(left), described(right));
            self.error(span, message, "both sides of an equation are numbers, or both are vectors");
            return None;
        }
        let measure = self.common(span, "=", lhs.typed.measure, rhs.typed.measure);
        self.same_zero(span, "=", lhs, rhs);
        Some(measure)
    }
}

impl Checker<'_> {
    /// The weight of a sum, difference, product or quotient; `None` where its measure determines it.
    pub(super) fn combined(&mut self, infix: Infix, left: Operand<'_>, right: Operand<'_>) -> Option<Weight> {
        let (own, other) = (left.typed.weight, right.typed.weight);
        let plain = |typed: &Typed| typed.measure == PLAIN;
        let is_free = [own, other].iter().all(|&weight| weight == Weight::DIFFERENCE || !weight.is_known());
        match infix {
            Infix::Add => Some(own.plus(other)),
            Infix::Subtract => Some(own.plus(other.times(-1.0))),
            _ => {
                let factor = |of: Operand<'_>| if is_free { None } else { of.typed.factor() };
                if let Some(factor) = factor(right) {
                    return Some(own.times(if infix == Infix::Divide { 1.0 / factor } else { factor }));
                }
                if let Some(factor) = factor(left).filter(|_| infix == Infix::Multiply) {
                    return Some(other.times(factor));
                }
                let what = format!("`{}`", infix.symbol());
                let own = self.want_difference(&what, left.typed, left.at);
                let other = self.want_difference(&what, right.typed, right.at);
                match (plain(left.typed), plain(right.typed)) {
                    (_, true) => Some(own),
                    (true, _) if infix == Infix::Multiply => Some(other),
                    _ => None,
                }
            }
        }
    }

    /// The weight of a reduction of several numbers.
    pub(super) fn reduced(
        &mut self,
        span: &Range<usize>,
        name: &str,
        how: Reduction,
        typed: &[Typed],
        places: &[Expr],
    ) -> Weight {
        let all = || typed.iter().zip(places).map(|(typed, at)| Operand { typed, at });
        let sum = typed.iter().fold(Weight::DIFFERENCE, |sum, one| sum.plus(one.weight));
        match how {
            Reduction::Sum => sum,
            Reduction::Mean => sum.times(1.0 / typed.len().max(1) as f64),
            Reduction::Count => Weight::DIFFERENCE,
            Reduction::Norm => {
                let differences =
                    all().map(|one| self.want_difference(&format!("`{name}`"), one.typed, one.at));
                differences.fold(Weight::DIFFERENCE, Weight::plus)
            }
            Reduction::Min | Reduction::Max | Reduction::Median | Reduction::Either | Reduction::OneOf => {
                let mut pairs = all();
                let Some(mut first) = pairs.next() else { return Weight::UNKNOWN };
                let mut weight = first.typed.weight;
                for one in pairs {
                    weight = self.same_zero(span, name, first, one);
                    // a quantity in K determines the zero of the others less than a temperature does
                    first = if first.typed.weight == weight { first } else { one };
                }
                weight
            }
        }
    }

    /// Reports a temperature where only a difference has a meaning; returns the weight to go on with.
    pub(super) fn want_difference(&mut self, what: &str, typed: &Typed, at: &Expr) -> Weight {
        if typed.weight.may_be(Weight::DIFFERENCE) {
            return typed.weight;
        }
        if !typed.weight.is_proper() {
            return self.improper(typed.weight, at);
        }
        let message = format!("{what} takes a difference of temperatures, not a temperature in degC or degF");
        let help = "subtract `0 degC` for the difference from the zero of the scale, or `0 K` for the absolute temperature; or declare it in K";
        self.report(Problem::error(at.span.clone(), message).with_help(help));
        Weight::UNKNOWN
    }

    /// Reports a value that is neither a temperature nor a difference.
    pub(super) fn want_proper(&mut self, typed: &Typed, at: &Expr) {
        if !typed.weight.is_proper() {
            self.improper(typed.weight, at);
        }
    }

    fn improper(&mut self, weight: Weight, at: &Expr) -> Weight {
        let times = if weight.lo.abs() < weight.hi.abs() { weight.lo } else { weight.hi };
        let message = format!(
            "this is no temperature: the zero of the scale is in it {} times",
            libm::round(times * 1e6) / 1e6
        );
        let literal = temperature_in(at)
            .map(|(value, kelvin)| format!("for a difference write `{kelvin} K` instead of `{value}`"));
        let help = literal.unwrap_or_else(|| {
            "subtract `0 degC` from a temperature for a temperature difference (`t - 0 degC`), or write a constant that is a difference in K; the weights of a mean sum to 1".to_string()
        });
        self.report(Problem::error(at.span.clone(), message).with_help(help));
        Weight::UNKNOWN
    }

    /// The common weight of both sides of `what` (`=`, `<`, `min`, ...).
    pub(super) fn same_zero(
        &mut self,
        span: &Range<usize>,
        what: &str,
        one: Operand<'_>,
        two: Operand<'_>,
    ) -> Weight {
        for (zero, other) in [(one, two.typed), (two, one.typed)] {
            if zero.typed.measure == Measure::Zero {
                self.warn_of_zero(other, zero.at);
                return other.weight;
            }
        }
        for (Operand { typed, at }, other) in [(one, two.typed), (two, one.typed)] {
            let is_fine =
                typed.weight.is_proper() || other.weight.is_known() && typed.weight.may_be(other.weight);
            if !is_fine {
                return self.improper(typed.weight, at);
            }
        }
        let common = one.typed.weight.and(two.typed.weight);
        if common.is_none() {
            let message = format!("`{what}` of a temperature and a difference of temperatures");
            let help = match temperature_in(one.at).or_else(|| temperature_in(two.at)) {
                Some((value, kelvin)) => format!("for a difference write `{kelvin} K` instead of `{value}`"),
                None => "write the difference in K; `t - 0 degC` makes a difference of a temperature, `d + 0 degC` a temperature of a difference".to_string(),
            };
            self.report(Problem::error(span.clone(), message).with_help(help));
        }
        common.unwrap_or(Weight::UNKNOWN)
    }

    /// Warns of a `0` without a unit, which is 0 K, beside a temperature in degC.
    fn warn_of_zero(&mut self, other: &Typed, at: &Expr) {
        if !other.weight.may_be(Weight::DIFFERENCE) {
            let problem = Problem::warning(at.span.clone(), "`0` without a unit is 0 K here");
            self.report(problem.with_help("write `0 degC` or `0 K`"));
        }
    }
}

/// The first number that is written in degC or degF, and its difference in K.
fn temperature_in(expression: &Expr) -> Option<(String, f64)> {
    match &expression.node {
        Node::Number(value, Some(unit)) if unit.offset != 0.0 && *value != 0.0 => {
            Some((format!("{value} {unit}"), unit.to_si_difference(*value)))
        }
        Node::Prefix(_, of) => temperature_in(of),
        Node::Infix(_, left, right) => temperature_in(left).or_else(|| temperature_in(right)),
        _ => None,
    }
}

/// The number as a quotient with a small divisor, if it is one.
fn as_ratio(value: f64) -> Option<(i32, i32)> {
    let is_whole = |value: f64| (libm::round(value) - value).abs() < 1e-9 && value.abs() < 1000.0;
    (1..=12)
        .find(|under| is_whole(value * f64::from(*under)))
        .map(|under| (libm::round(value * f64::from(under)) as i32, under))
}

/// Whether the expression is a number without a unit.
fn is_bare(expression: &Expr) -> bool {
    match &expression.node {
        Node::Number(_, unit) => unit.is_none(),
        Node::Prefix(Prefix::Minus, of) => is_bare(of),
        _ => false,
    }
}
